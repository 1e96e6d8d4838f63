"""Lit parts of a compile_for_display model are red, the rest of the robot fades."""

from __future__ import annotations

import mujoco
import pytest

from aidsr.mjcf.compile import parse_mjcf
from aidsr.render.highlight import highlight
from aidsr.render.stage import compile_for_display

ROBOT = """
<mujoco>
  <worldbody>
    <body name="base">
      <geom name="base" size="0.02"/><site name="a"/>
      <body name="tip" pos="0 0 0.1">
        <joint name="bend" axis="0 1 0"/><geom name="skin" size="0.01"/><site name="b"/>
      </body>
    </body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><motor name="m" tendon="t"/><motor name="servo" joint="bend"/></actuator>
</mujoco>"""


def lit(*names: str) -> tuple[set[str], bool, float]:
    """Geoms in red, whether the tendon is, and the opacity of the base."""
    model = compile_for_display(parse_mjcf(ROBOT))
    highlight(model, names)
    red = {geom for geom in ("base", "skin") if _is_red(model.geom_rgba[model.geom(geom).id])}
    return red, _is_red(model.tendon_rgba[0]), float(model.geom_rgba[model.geom("base").id, 3])


def _is_red(rgba: object) -> bool:
    return list(rgba)[:3] == pytest.approx([0.89, 0.20, 0.11])  # type: ignore[call-overload]


@pytest.mark.parametrize("name", ["tip", "skin", "bend", "joint of tip", "geom of tip", "servo", "b"])
def test_a_part_is_lit_by_its_name(name: str) -> None:
    assert lit(name) == ({"skin"}, False, 1.0)


@pytest.mark.parametrize("name", ["t", "m"])
def test_a_tendon_is_seen_through_what_is_around_it(name: str) -> None:
    red, tendon, opacity = lit(name)
    assert (red, tendon) == (set(), True)
    assert opacity < 0.5


def test_where_nothing_bears_a_name_nothing_changes() -> None:
    plain, other = compile_for_display(parse_mjcf(ROBOT)), compile_for_display(parse_mjcf(ROBOT))
    highlight(other, ["nothing", "world"])
    assert (plain.geom_rgba == other.geom_rgba).all()
    assert mujoco.mj_sizeModel(plain) == mujoco.mj_sizeModel(other)
