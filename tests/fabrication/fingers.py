"""A small finger of two cables, written so that a test can change one thing about it; and a hand of them."""

from collections.abc import Sequence

BASE = '<geom name="foot" type="cylinder" size="0.015 0.01" pos="0 0 -0.01" mass="0.02"/>'
WINCH = (
    '<general name="{name}" tendon="{tendon}" ctrlrange="0 1" gainprm="-10" forcerange="-10 0" '
    'dyntype="filterexact" dynprm="0.05"/>'
)


def finger(
    names: Sequence[str] = ("link_1", "link_2", "link_3"),
    *,
    base: str = BASE,
    base_name: str = "base",
    compiler: str = 'angle="radian"',
    joint: str = 'range="-0.5 0.5"',
    stiffness: float = 0.3,
    cable_m: float = 0.0095,
    unguided: Sequence[str] = (),
    extend: str = "",
    actuators: str | None = None,
    sensors: str = '<tendonpos tendon="flex"/><tendonpos tendon="extend"/>',
    extra: str = "",
) -> str:
    """Return its MJCF.

    Args:
        names: Of its links, 20 mm each but for the last, each on a hinge: bend_1, bend_2 …
        base: Geoms of the base, beside a stub of the limb.
        base_name: Of the base.
        compiler: Attributes of `<compiler>`.
        joint: Attributes of each hinge.
        stiffness: Of each hinge [N m/rad].
        cable_m: How far from the middle the cables run [m]; the links are 8 mm thick from there.
        unguided: Links that the cables pass without a guide.
        extend: Attributes of the tendon that stretches the finger.
        actuators: What drives it; a winch of 10 N on each tendon when not given.
        sensors: What it measures.
        extra: Further elements.
    """
    bodies, cables = "", {"flex": '<site site="flex_0"/>', "extend": '<site site="extend_0"/>'}
    for number, name in enumerate(names, start=1):
        last = number == len(names)
        bodies += f'<body name="{name}" pos="0 0 {0.01 if number == 1 else 0.02}">'
        bodies += f'<joint name="bend_{number}" axis="0 1 0" stiffness="{stiffness}" damping="0.01" {joint}/>'
        shape = f'type="capsule" fromto="0 0 0 0 0 {0.01 if last else 0.02}" size="0.008" mass="0.005" solref="0.004 1"'
        bodies += f'<geom name="skin_{number}" {shape}/>'
        for cable, side in (("flex", cable_m), ("extend", -cable_m)):
            for end, height in (("in", 0.005), ("out", 0.015))[: 1 if last else 2]:
                bodies += f'<site name="{cable}_{number}_{end}" pos="{side} 0 {height}"/>'
                cables[cable] += f'<site site="{cable}_{number}_{end}"/>' if name not in unguided else ""
    winches = "".join(WINCH.format(name=f"pull_{cable}", tendon=cable) for cable in cables)
    return f"""<mujoco model="finger"><compiler {compiler}/><option integrator="implicitfast"/><worldbody>
<body name="{base_name}">{base}<geom name="stub" type="capsule" fromto="0 0 0 0 0 0.01" size="0.008" mass="0.002"/>
<site name="flex_0" pos="{cable_m} 0 0.005"/><site name="extend_0" pos="-{cable_m} 0 0.005"/>
{bodies}{"</body>" * (len(names) + 1)}</worldbody>
<contact><exclude body1="{base_name}" body2="{names[0]}"/></contact>
<tendon><spatial name="flex">{cables["flex"]}</spatial>
<spatial name="extend" {extend}>{cables["extend"]}</spatial></tendon>
<actuator>{winches if actuators is None else actuators}</actuator><sensor>{sensors}</sensor>{extra}</mujoco>"""


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
