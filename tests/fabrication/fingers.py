"""A small finger of two cables, written so that a test can change one thing about it."""

WINCH = (
    '<general name="{name}" tendon="{tendon}" ctrlrange="0 1" gainprm="-10" forcerange="-10 0" '
    'dyntype="filterexact" dynprm="0.05"/>'
)


def finger(
    *,
    links: int = 3,
    compiler: str = 'angle="radian"',
    joint: str = 'range="-0.5 0.5"',
    stiffness: float = 0.3,
    base: str = '<geom name="base_shell" type="cylinder" size="0.015 0.01" pos="0 0 -0.01" mass="0.02"/>',
    extend: str = "",
    actuators: str | None = None,
    sensors: str = '<tendonpos tendon="flex"/><tendonpos tendon="extend"/>',
    extra: str = "",
) -> str:
    """Return its MJCF.

    Args:
        links: Links of 20 mm, each on a hinge.
        compiler: Attributes of `<compiler>`.
        joint: Attributes of each hinge.
        stiffness: Of each hinge [N m/rad].
        base: Geoms of the base, beside a stub of the limb.
        extend: Attributes of the tendon that stretches the finger.
        actuators: What drives it; a winch of 10 N on each tendon when not given.
        sensors: What it measures.
        extra: Further elements.
    """
    bodies, cables = "", {"flex": '<site site="flex_0"/>', "extend": '<site site="extend_0"/>'}
    for number in range(1, links + 1):
        last = number == links
        bodies += f'<body name="link_{number}" pos="0 0 {0.01 if number == 1 else 0.02}">'
        bodies += f'<joint name="bend_{number}" axis="0 1 0" stiffness="{stiffness}" damping="0.01" {joint}/>'
        shape = f'type="capsule" fromto="0 0 0 0 0 {0.01 if last else 0.02}" size="0.008" mass="0.005" solref="0.004 1"'
        bodies += f'<geom name="skin_{number}" {shape}/>'
        for cable, side in (("flex", 0.0095), ("extend", -0.0095)):
            for end, height in (("in", 0.005), ("out", 0.015))[: 1 if last else 2]:
                bodies += f'<site name="{cable}_{number}_{end}" pos="{side} 0 {height}"/>'
                cables[cable] += f'<site site="{cable}_{number}_{end}"/>'
    winches = "".join(WINCH.format(name=f"pull_{cable}", tendon=cable) for cable in cables)
    return f"""<mujoco model="finger"><compiler {compiler}/><option integrator="implicitfast"/><worldbody>
<body name="base">{base}<geom name="stub" type="capsule" fromto="0 0 0 0 0 0.01" size="0.008" mass="0.002"/>
<site name="flex_0" pos="0.0095 0 0.005"/><site name="extend_0" pos="-0.0095 0 0.005"/>
{bodies}{"</body>" * (links + 1)}</worldbody>
<contact><exclude body1="base" body2="link_1"/></contact>
<tendon><spatial name="flex">{cables["flex"]}</spatial>
<spatial name="extend" {extend}>{cables["extend"]}</spatial></tendon>
<actuator>{winches if actuators is None else actuators}</actuator><sensor>{sensors}</sensor>{extra}</mujoco>"""
