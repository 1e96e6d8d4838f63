"""Rules for faults of the document, which `aidsr.mjcf` finds while it reads and compiles it.

The messages of these faults are in `aidsr.mjcf`, because they quote the document and MuJoCo's errors.
"""

from __future__ import annotations

from aidsr.validation.rule import Example, Rule, Stage


def _rule(code: str, finds: str, why: str, limit: str, cure: str, *changes: tuple[str, str]) -> Rule:
    example = Example(changes)
    return Rule(code=code, stage=Stage.DOCUMENT, finds=finds, why=why, limit=limit, cure=cure, example=example)


XML_SYNTAX = _rule(
    "xml_syntax",
    "The text is not XML.",
    "An element that is not closed, a quote too few or a second document: nothing after it can be trusted.",
    "well-formed XML with the root <mujoco>",
    "Close what is open; leave out what stands around the document.",
    ("</mujoco>", ""),
)
FORBIDDEN = _rule(
    "forbidden",
    "The document reaches outside itself: for a file, a network address or a library.",
    "MJCF comes from language models and strangers, and is not let near the machine. See [Safety](safety.md).",
    "no <include>, <attach>, <model>, <extension> or <plugin>, and no attribute that names a file",
    "Put the content itself into the document, and build shapes from primitive geoms.",
    ("<worldbody>", '<include file="scene.xml"/>\n  <worldbody>'),
)
UNKNOWN_ELEMENT = _rule(
    "unknown_element",
    "An element is not MJCF, or not where it stands.",
    "MuJoCo stops at the first of them; here all are reported at once, with the nearest right name.",
    "the elements of MJCF, as the installed MuJoCo knows them",
    "Use the element that the fault names, or move it to where it belongs.",
    ('<joint name="j3"/>', '<hinge name="j3"/>'),
)
UNKNOWN_ATTRIBUTE = _rule(
    "unknown_attribute",
    "An attribute is not one of its element.",
    "MuJoCo stops at the first of them; here all are reported at once, with the nearest right name.",
    "the attributes of MJCF, as the installed MuJoCo knows them",
    "Use the attribute that the fault names.",
    ("stiffness=", "stifness="),
)
BAD_VALUE = _rule(
    "bad_value",
    "The value of an attribute cannot be read, or is out of bounds.",
    "A word where a number is due, too many numbers, a number that is not finite, or more parts than are looked at.",
    "what MuJoCo reads, finite, and within the [bounds](safety.md) of what is looked at",
    "Write what the fault asks for.",
    ('mass="0.01"', 'mass="light"'),
)
WRONG_FOR_TYPE = _rule(
    "wrong_for_type",
    "An attribute does not fit the type of its element, or another attribute.",
    "MuJoCo refuses a sphere with two ends, a place given twice, or an orientation given twice.",
    "attributes that fit the type, also those from a default class",
    "Keep one of the two.",
    ('<geom name="g3"/>', '<geom name="g3" type="sphere" fromto="0 0 0 0 0 0.02"/>'),
)
DUPLICATE_NAME = _rule(
    "duplicate_name",
    "A name stands for two things of one kind.",
    "Whoever refers to it could mean either.",
    "a name for each thing, once for each kind",
    "Give each a name of its own.",
    ('<joint name="j3"/>', '<joint name="j2"/>'),
)
UNDEFINED_REFERENCE = _rule(
    "undefined_reference",
    "A name is used that nothing bears.",
    "An actuator without its tendon, a tendon without its site or an element without its default class cannot be "
    "built.",
    "names that exist, of the kind that is meant",
    "Use the name that the fault proposes, or add what is missing.",
    ('tendon="back" gear', 'tendon="rear" gear'),
)
JOINT_RANGE_INVALID = _rule(
    "joint_range_invalid",
    "A limited joint has a range in the wrong order.",
    "MuJoCo refuses it where the limit is asked for; without `limited` it drops it, see `range_inverted_ignored`.",
    "the smaller number first; the range of a ball joint begins with 0",
    "Write the smaller number first; the range of a ball joint begins with 0.",
    ('<joint name="j3"/>', '<joint name="j3" limited="true" range="45 -45"/>'),
)
CTRLRANGE_INVALID = _rule(
    "ctrlrange_invalid",
    "A limited actuator has a control range in the wrong order.",
    "MuJoCo refuses it where the limit is asked for; without `ctrllimited` it drops it, see `ctrlrange_missing`.",
    "the smaller number first",
    "Write the smaller number first.",
    ('tendon="front" gear="-1" ctrlrange="0 20"', 'tendon="front" gear="-1" ctrllimited="true" ctrlrange="20 0"'),
)
TENDON_PATH_INVALID = _rule(
    "tendon_path_invalid",
    "The path of a spatial tendon cannot be followed.",
    "It has to begin and end with a site, have a site on both sides of a geom, and no site twice in a row.",
    "a path that MuJoCo can follow",
    "Begin and end with a site, put a site on both sides of a geom, name no site twice in a row.",
    ('<site site="front3"/>', '<site site="front2"/>'),
)
ZERO_MASS = _rule(
    "zero_mass",
    "A body that moves has no mass or inertia.",
    "Any force would accelerate it without bound.",
    "mass and inertia of every moving body: above MuJoCo's smallest number",
    "Give the body a geom with mass, or an <inertial>.",
    ('<geom name="g6"/>', '<geom name="g6" mass="0"/>'),
)
INVALID_JOINT_PLACEMENT = _rule(
    "invalid_joint_placement",
    "A joint stands where it cannot.",
    "A free joint inside the robot, a joint of the world, or more than six degrees of freedom in one body.",
    "up to six degrees of freedom in a body, a free joint only in a child of the world",
    "Leave the joint out, or put it into a body of its own.",
    ('<joint name="j3"/>', '<freejoint name="j3"/>'),
)
KEYFRAME_SIZE = _rule(
    "keyframe_size",
    "A keyframe has another number of values than the model.",
    "It was written for another robot, and would be read past its end.",
    "as many numbers as the model has coordinates, speeds, activations and commands",
    "Count the joints, or leave the keyframe out.",
    ("  <actuator>", '  <keyframe>\n    <key qpos="0 0 0 0 0 0 0"/>\n  </keyframe>\n  <actuator>'),
)
MISSING_ASSET = _rule(
    "missing_asset",
    "A mesh, height field or texture is used that the document does not define.",
    "Files cannot be loaded, so an asset exists only where its numbers stand in the document.",
    "assets that the document defines",
    "Define it under <asset>, or use a primitive geom.",
    ('<geom name="g3"/>', '<geom name="g3" type="mesh" mesh="shell"/>'),
)
LOAD_ERROR = _rule(
    "load_error",
    "The model cannot be built or tested for another reason.",
    "What MuJoCo says beyond these faults; numbers that overflow; a worker that ran past its limits or died; a "
    "time step "
    "too small to test.",
    "a model that compiles, in numbers that are finite, and tests that end",
    "Use metres and kilograms, and a time step of 0.001 to 0.002 s.",
    ('timestep="0.002"', 'timestep="0.0000001"'),
)
