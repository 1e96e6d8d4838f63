"""One job with everything said about it, written by hand so that the prompts' texts do not depend on a simulator."""

from __future__ import annotations

from aidsr.core.artifacts import (
    ActuatorGroup,
    BodySummary,
    Brief,
    Concept,
    Critique,
    CritiqueIssue,
    EnvironmentSummary,
    Fault,
    GeomSummary,
    MountSummary,
    Placement,
    Robot,
    Scene,
    SiteSummary,
    ValidationReport,
    Vec3,
)

RUBBER = ((0.9, 0.005, 0.0001), 1)
"""Friction and priority of what the environment is made of."""


def shape(name: str, kind: str, size_m: tuple[float, ...], position_m: Vec3, grip=RUBBER, **more) -> GeomSummary:
    friction, priority = grip
    return GeomSummary(
        name=name, shape=kind, size_m=size_m, position_m=position_m, friction=friction, priority=priority, **more
    )


SUMMARY = EnvironmentSummary(
    gravity_m_s2=(0, 0, -9.81),
    timestep_s=0.002,
    mounts=(
        MountSummary(
            name="mount",
            position_m=(0, 0, 0.5),
            z_axis=(0, -0.0, -1),
            x_axis=(1, 0, 0),
            moved_by=(),
        ),
        MountSummary(
            name="mount_carriage",
            position_m=(0.1, 0, 0.5),
            z_axis=(0, 0, -1),
            x_axis=(1, 0, 0),
            moved_by=("carriage_z",),
        ),
    ),
    bodies=(
        BodySummary(
            name="world",
            parent="",
            position_m=(0, 0, 0),
            mass_kg=0,
            joints=(),
            geoms=(
                shape("floor", "plane", (1, 1, 0.1), (0, 0, 0)),
                shape("goal_line", "box", (0.01, 0.3, 0.001), (0.5, 0, 0), solid=False),
                shape("", "sphere", (0.01,), (0.5, 0.3, 0), solid=False),
            ),
        ),
        BodySummary(
            name="housing",
            parent="world",
            position_m=(0.08, 0.06, 0.24),
            mass_kg=0.2,
            joints=(),
            geoms=(shape("", "box", (0.03, 0.03, 0.01), (0.08, 0.06, 0.23)),),
        ),
        BodySummary(
            name="button",
            parent="housing",
            position_m=(0.08, 0.06, 0.2523333),
            mass_kg=0.0301,
            joints=("button_slide: slide along 0 0 1, -0.008 to 0 m, spring 60 N/m",),
            geoms=(shape("button_cap", "cylinder", (0.02, 0.004), (0.08, 0.06, 0.25), ((0.9, 0.003, 0.0003), 0)),),
        ),
    ),
    sites=(
        SiteSummary(name="mount", body="world", position_m=(0, 0, 0.5)),
        SiteSummary(name="button_top", body="button", position_m=(0.08, 0.06, 0.256)),
    ),
    sensors=("button_travel", "button_position"),
    actuators=("lift",),
)

BRIEF = Brief(
    objective="Press the round button, 20 mm in radius, at least 5 mm in and hold it there for 0.2 s.",
    task="reaching/button_pushing",
    environment="<mujoco/>",
    summary=SUMMARY,
    base="fixed",
    needs_contact=True,
    judging={"Success": "Pressed at least 5 mm. Held for 0.2 s.", "Penalty": "More than 20 N on the button."},
)

CONCEPT = Concept(
    name="Hanging arm",
    interpretation="The button lies 0.25 m below the mount and 0.1 m beside it.",
    morphology="One limb, 0.3 m long.",
    actuation="Three tendons at 120 degrees.",
    functional_part="tip",
    family="arm",
    parameters={"length_m": 0.3, "segments": 10},
    rationale="Simple.",
)

ROBOT = Robot(
    mjcf=(
        '<mujoco model="arm">\n  <worldbody>\n    <body name="base">\n      <site name="tip"/>\n    </body>\n'
        '  </worldbody>\n  <actuator>\n    <general name="pull_a"/>\n    <general name="pull_b"/>\n  </actuator>\n'
        "</mujoco>\n"
    ),
    functional_part="tip",
    actuator_groups=(ActuatorGroup(name="bend", actuators=("pull_a", "pull_b")),),
    notes="L 0.3, N 10.",
)

PLACEMENT = Placement(mount="mount", base="fixed", intended_contacts=("button",), reason="It hangs above the button.")
SCENE = Scene(mjcf="<mujoco/>", placement=PLACEMENT, notes=("The robot's floor was removed.",))

REPORT = ValidationReport(
    stable=False,
    faults=(
        Fault(
            code="numerical_instability",
            layer="simulate",
            severity="error",
            names=("link_3",),
            measured=312.0,
            limit=200.0,
            unit="rad/s",
            message="Joint bend_3 turned at 312 rad/s.",
            cure="Raise joint damping to 0.03 s times the stiffness.",
        ),
    ),
)

CRITIQUE = Critique(
    passed=False,
    summary="It cannot touch.",
    issues=(
        CritiqueIssue(
            blame="coder",
            component="tip",
            problem="The tip has no geom.",
            suggestion="Add a sphere of radius 8 mm.",
        ),
        CritiqueIssue(blame="coder", component="pull_c", problem="The third tendon is missing."),
    ),
)
