"""Small fingers, written out: a base, links in a row with a hinge before each, and two cables that pull either way."""

from collections.abc import Sequence

PITCH_M, SKIN_M, CABLE_M = 0.02, 0.008, 0.0095
BASE = '<geom name="foot" type="cylinder" size="0.015 0.01" pos="0 0 -0.01" mass="0.02"/>'


def finger(
    names: Sequence[str] = ("link_1", "link_2", "link_3", "link_4"),
    *,
    base: str = BASE,
    base_name: str = "base",
    stiffness: float = 0.3,
    pull_n: float = 10.0,
    unguided: Sequence[str] = (),
    cable_m: float = CABLE_M,
) -> str:
    """Return the MJCF of a finger with links of these names; cables pass those of `unguided` without a guide."""
    links, ends = "", ""
    wraps = {side: f'<site site="{side}_base"/>' for side in ("flex", "extend")}
    for number, name in enumerate(names):
        long = PITCH_M if number < len(names) - 1 else PITCH_M / 2
        links += (
            f'<body name="{name}" pos="0 0 {PITCH_M if number else PITCH_M / 2}">'
            f'<joint name="bend {name}" axis="0 1 0" range="-0.5 0.5" stiffness="{stiffness}" '
            f'damping="{0.03 * stiffness}" armature="1e-5"/>'
            f'<geom name="skin {name}" type="capsule" fromto="0 0 0 0 0 {long}" size="{SKIN_M}" mass="0.005"/>'
        )
        for side, x in (("flex", cable_m), ("extend", -cable_m)):
            for end, z in (("in", PITCH_M / 4), ("out", 3 * PITCH_M / 4)):
                if z < long:
                    links += f'<site name="{side}_{end} {name}" pos="{x} 0 {z}"/>'
                    wraps[side] += f'<site site="{side}_{end} {name}"/>' if name not in unguided else ""
        ends += "</body>"
    return f"""<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <worldbody><body name="{base_name}">{base}
    <geom name="stub" type="capsule" fromto="0 0 0 0 0 {PITCH_M / 2}" size="{SKIN_M}" mass="0.002"/>
    <site name="flex_base" pos="{cable_m} 0 {PITCH_M / 4}"/><site name="extend_base" pos="-{cable_m} 0 {PITCH_M / 4}"/>
    {links}{ends}</body></worldbody>
  <contact><exclude body1="{base_name}" body2="{names[0]}"/></contact>
  <tendon>{"".join(f'<spatial name="{side}">{path}</spatial>' for side, path in wraps.items())}</tendon>
  <actuator>{"".join(_motor(side, pull_n) for side in wraps)}</actuator>
</mujoco>"""


def hand() -> str:
    """Return the MJCF of a finger whose last link carries a palm with two thumbs, each of one link without a cable."""
    palm = '<geom name="palm" type="box" size="0.035 0.015 0.006" pos="0 0 0.022" mass="0.01"/>'
    for name, x in (("left", -0.02), ("right", 0.02)):
        palm += (
            f'<geom name="stub {name}" type="capsule" fromto="{x} 0 0.022 {x} 0 0.045" size="0.006" mass="0.002"/>'
            f'<body name="{name}" pos="{x} 0 0.045"><joint name="bend {name}" axis="0 1 0" range="-0.5 0.5" '
            'stiffness="0.1" damping="0.003" armature="1e-5"/>'
            f'<geom name="skin {name}" type="capsule" fromto="0 0 0 0 0 0.02" size="0.006" mass="0.002"/></body>'
        )
    return finger().replace("</body>", f"{palm}</body>", 1)


def _motor(side: str, pull_n: float) -> str:
    force = f'gainprm="-{pull_n}" ctrlrange="0 1" forcerange="-{pull_n} 0"'
    return f'<general name="pull_{side}" tendon="{side}" {force}/>'
