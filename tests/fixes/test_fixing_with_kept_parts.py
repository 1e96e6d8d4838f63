"""Automatic fixes leave alone the parts that a person wants to keep, and say so."""

from aidsr.core.artifacts import Fault, Keep
from aidsr.fixes import fix

ROBOT = """<mujoco>
  <!-- an arm -->
  <option integrator="implicitfast"/>
  <worldbody>
    <body name="palm">
      <body name="finger_a"><joint name="bend_a" range="40 -40"/><geom name="skin_a" size="0.01"/></body>
      <body name="finger_b"><joint name="bend_b" stiffness="1" damping="0"/><geom name="skin_b" size="0.01"/></body>
    </body>
  </worldbody>
</mujoco>"""
GROWTH = Fault(code="energy_growth", layer="simulate", severity="error", message="", cure="")


def test_a_safe_fix_of_a_kept_part_is_left_out() -> None:
    misspelt = ROBOT.replace('stiffness="1"', 'stifness="1"')
    fixed = fix(misspelt, keep=[Keep(name="finger_a")])
    assert fixed.mjcf == misspelt.replace("stifness", "stiffness")
    assert fixed.counts == {"misspelt_attributes": 1}
    left = fixed.notes[-1]
    assert left.startswith('Left out inverted_ranges, which would change a part to keep: Of "finger_a"')
    assert "range was 40 -40 and is -40 40" in left


def test_what_may_change_of_a_kept_part_is_fixed() -> None:
    fixed = fix(ROBOT, keep=[Keep(name="finger_a", but=("range",))])
    assert fixed.counts == {"inverted_ranges": 1}


def test_a_part_that_the_robot_does_not_have_hinders_no_fix() -> None:
    assert fix(ROBOT, keep=[Keep(name="thumb")]) == fix(ROBOT)


def test_a_document_of_which_nothing_may_change_stays_as_it_is() -> None:
    fixed = fix(ROBOT, keep=[Keep(name="palm")])
    assert (fixed.mjcf, fixed.total, len(fixed.notes)) == (ROBOT, 0, 1)


def test_a_fault_is_cured_by_the_next_fix_that_leaves_the_part_alone() -> None:
    free, kept = fix(ROBOT, [GROWTH]), fix(ROBOT, [GROWTH], keep=[Keep(name="finger_b")])
    assert 'name="bend_b" stiffness="1" damping="0.01"' in free.mjcf
    assert 'name="bend_b" stiffness="1" damping="0"' in kept.mjcf
    assert any("Left out damp_hinges" in note for note in kept.notes)


def test_a_fault_that_only_a_change_of_a_kept_part_cures_is_unfixed() -> None:
    narrow = Fault(code="joint_range_too_small", layer="simulate", severity="error", message="", cure="",
                   names=("bend_a",))  # fmt: skip
    text = ROBOT.replace('range="40 -40"', 'range="-1 1"')
    assert fix(text, [narrow]).total
    fixed = fix(text, [narrow], keep=[Keep(name="bend_a")])
    assert (fixed.mjcf, fixed.unfixed) == (text, ("joint_range_too_small",))
    assert "bend_a" in fixed.notes[0]
