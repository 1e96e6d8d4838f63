"""Scope rules for contacts: margins, ghost shapes, running surfaces, contact exclusions, and a part in the air."""

from __future__ import annotations

from aidsr.sim.scope_contact import COVER_SHARE, GHOST_SHARE, MARGIN_SHARE
from aidsr.sim.structure import OFF_SHARE
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.scope_check import find_out_of_scope_faults, inside

CONTACT_MARGIN = Rule(
    code="contact_margin",
    stage=Stage.SCOPE,
    finds="A shape of the robot pushes what is still away from it.",
    why="With a wide margin it works from afar, like a field of force, and not by its body.",
    limit=f"margin of a geom / L: at most {MARGIN_SHARE:g}",
    check=find_out_of_scope_faults,
    unit="of the robot's length",
    cure="Leave margin out.",
    example=Example((('<geom name="g6"/>', '<geom name="g6" margin="0.02"/>'),)),
)

GHOST_SHAPE = Rule(
    code="ghost_shape",
    stage=Stage.SCOPE,
    finds="A large part of a limb passes through what is around it.",
    why="An arm of which only the tip collides reaches through walls. Discs or a skin that collide stand for the "
    "backbone between them.",
    limit=f"length of a limb that collides with nothing, more than {COVER_SHARE:g} L from a shape that does / length "
    f"of the limb: at most {GHOST_SHARE:g}. A rigid part has the length of its longest shape",
    check=find_out_of_scope_faults,
    unit="of the length of the limb",
    cure="Leave contype, conaffinity and gap at their defaults.",
    explained_by=("contact_disabled",),
    example=Example(
        (('pos="0 0 0.0125" mass="0.01"/>', 'pos="0 0 0.0125" mass="0.01" contype="0" conaffinity="0"/>'),)
    ),
)

MOVING_SURFACE = Rule(
    code="moving_surface",
    stage=Stage.SCOPE,
    finds="A shape of the robot has a surface that runs, as a conveyor belt does.",
    why="It drives the robot over the ground, or moves what it touches, without an actuator and without a body that "
    "moves.",
    limit="shapes of the robot with surfacevel: 0",
    check=find_out_of_scope_faults,
    unit="shapes",
    cure="Leave surfacevel out.",
    example=Example((('<geom name="g6"/>', '<geom name="g6" surfacevel="0 0 0.1 0 0 0"/>'),)),
)

CONTACT_EXCLUDED = Rule(
    code="contact_excluded",
    stage=Stage.SCOPE,
    finds="A contact exclusion or pair is between the robot and its surroundings.",
    why="The environment decides how it is touched. Between parts of the robot exclusions are allowed, and where a "
    "limb begins on its mount.",
    limit="bodies of the robot with exclusions or pairs towards others: 0",
    check=find_out_of_scope_faults,
    unit="bodies",
    cure="Leave the exclusion or the pair out.",
    example=Example(
        (("  <tendon>", '  <contact>\n    <exclude body1="world" body2="s6"/>\n  </contact>\n  <tendon>'),)
    ),
)

PART_IN_THE_AIR = Rule(
    code="part_in_the_air",
    stage=Stage.SCOPE,
    finds="The functional part of the robot in a scene is a point in the air.",
    why="Such a point passes through walls, and swings far for a small bend, so the robot would reach goals that its "
    "body does not reach. A point between fingers is none.",
    limit="distance of the functional part from the bounding box of the geoms that collide, in the reference pose / L: "
    f"at most {OFF_SHARE:g}; in a scene it is the site `robot/functional_part`, a robot alone does not name it",
    check=find_out_of_scope_faults,
    unit="of the robot's length",
    cure="Let the functional part be a body, a geom or a site on the robot, such as its tip, or a site between its "
    "fingers.",
    example=Example((inside("s6", '<site name="robot/functional_part" pos="0 0 0.4"/>'),)),
)
