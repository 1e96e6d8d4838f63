"""The same physics, computed in another way."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from tests.scenes import small_arm

from aidsr.sim.numerics import at_half_the_time_step, with_other_integrators


@pytest.mark.parametrize(
    ("own", "others"),
    [
        ("implicitfast", ["discrete", "Euler"]),
        ("Euler", ["discrete", "implicitfast"]),
        ("discrete", ["implicitfast", "Euler"]),
        ("RK4", ["discrete", "implicitfast"]),
    ],
)
def test_the_integrator_is_another_one_and_nothing_else_changes(own: str, others: list[str]) -> None:
    model = mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="0.004" integrator="{own}"/></mujoco>')
    before = model.opt.integrator
    finer, found = at_half_the_time_step(model), with_other_integrators(model)
    assert list(found) == others
    for name, changed in found.items():
        assert changed.opt.integrator == getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")
        assert changed.opt.timestep == 0.004
    assert (finer.opt.integrator, finer.opt.timestep) == (before, 0.002)
    assert (model.opt.integrator, model.opt.timestep) == (before, 0.004), "the model itself stays as it is"


def _tip_m(integrator: int, step_s: float) -> np.ndarray:
    model = mujoco.MjModel.from_xml_string(small_arm())
    model.opt.integrator, model.opt.timestep = integrator, step_s
    data = mujoco.MjData(model)
    data.actuator("pull_left").ctrl = 8.0
    mujoco.mj_step(model, data, nstep=round(3.0 / step_s))
    return np.array(data.site("tip").xpos)


def test_joint_limits_give_way_with_the_step_under_discrete_and_under_no_other_integrator() -> None:
    """docs/physics.md, stability."""
    kinds = mujoco.mjtIntegrator
    true = _tip_m(int(kinds.mjINT_IMPLICITFAST), 0.0005)
    steps_s = (0.002, 0.0005, 0.0001)
    for kind in (kinds.mjINT_IMPLICITFAST, kinds.mjINT_IMPLICIT, kinds.mjINT_EULER):
        for step_s in steps_s:
            assert _tip_m(int(kind), step_s) == pytest.approx(true, abs=1e-5)
    discrete = int(kinds.mjINT_DISCRETE)
    off_mm = [1000 * float(np.linalg.norm(_tip_m(discrete, step_s) - true)) for step_s in steps_s]
    assert off_mm == pytest.approx([5.2, 1.9, 0.4], abs=0.1)
