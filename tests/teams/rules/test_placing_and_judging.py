"""The Integrator puts robots where their job is; the Judge passes what is right and blames who made it wrong."""

import mujoco
import pytest
from jobs import DESERT, LAMP, MARBLE, brief, concept, free_brief
from lxml import etree

from aidsr.core.artifacts import Critique, CritiqueIssue, Fault, Placement, Scene, ValidationReport
from aidsr.sim.assembly import assemble
from aidsr.tasks import load_task, task_names
from aidsr.teams import rules as builtin

RULES = builtin.team(1)
STABLE = ValidationReport(stable=True)


def placed(task: str, family: str, variant: str) -> tuple:
    idea = concept(task, family, variant)
    robot = RULES.coder.write(brief(task), idea)
    return idea, robot, RULES.integrator.place(brief(task), idea, robot)


def scene(task: str, robot, placement: Placement) -> Scene:
    return assemble(robot, brief(task).environment, placement, load_task(task).sensors)


def report(code: str, *names: str) -> ValidationReport:
    fault = Fault(code=code, layer="simulate", severity="error", names=names, message="seen")
    return ValidationReport(stable=False, faults=(fault,))


def critique(component: str, blame: str = "integrator") -> Critique:
    return Critique(passed=False, issues=(CritiqueIssue(blame=blame, component=component, problem="seen"),))


# --- placing ---------------------------------------------------------------------------------------------------------


def test_an_arm_hangs_from_its_mount_and_may_touch_the_button() -> None:
    _, _, placement = placed("button_pushing", "arm", "two sections")
    assert (placement.mount, placement.base, placement.position_m) == ("mount", "fixed", (0.0, 0.0, 0.0))
    assert placement.intended_contacts == ("button_cap",)


def test_a_base_that_the_environment_moves_is_fixed_to_its_mount() -> None:
    _, _, placement = placed("simple_grasping", "gripper", "four fingers")
    assert (placement.base, placement.intended_contacts) == ("fixed", ("object",))
    assert "which the environment moves" in placement.reason


@pytest.mark.parametrize(("family", "variant"), [("crawler", "four legs"), ("worm", "wave"), ("ring", "five sectors")])
def test_a_free_body_stands_just_above_the_ground(family: str, variant: str) -> None:
    _, robot, placement = placed("flat_ground", family, variant)
    root = etree.fromstring(robot.mjcf).find("worldbody/body")
    assert placement.base == "free"
    assert placement.position_m[2] == pytest.approx(float(root.get("pos").split()[2]) + 0.0005, abs=2e-5)
    assert placement.intended_contacts == ("world",)
    whole = scene("flat_ground", robot, placement)
    model = mujoco.MjModel.from_xml_string(whole.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert abs(data.subtree_com[0][0]) < 0.02


def test_a_hook_looks_down_whichever_way_the_mount_is_turned() -> None:
    _, _, placement = placed("drawer_opening", "arm", "hook")
    assert placement.rotation_deg == (0.0, 0.0, 0.0)
    assert set(placement.intended_contacts) == {"drawer_1_handle", "drawer_2_handle", "drawer_3_handle"}
    turned = LAMP.replace('euler="0 90 0"', 'euler="0 90 90"')
    asked = free_brief("Open it by its handle.", turned.replace('name="switch" type', 'name="handle" type'))
    idea = RULES.designer.propose(asked, 1)[0]
    placement = RULES.integrator.place(asked, idea, RULES.coder.write(asked, idea))
    model = asked.summary.mounts[0]
    assert abs(model.x_axis[2]) < 0.01
    assert abs(placement.rotation_deg[2]) == pytest.approx(90)


def test_an_arm_leans_away_from_what_stands_straight_in_front_of_it() -> None:
    ahead = LAMP.replace('pos="0.2 0.08 0.5"', 'pos="0.2 0 0.48"')
    asked = free_brief("Touch the switch.", ahead)
    idea = RULES.designer.propose(asked, 1)[0]
    robot = RULES.coder.write(asked, idea)
    placement = RULES.integrator.place(asked, idea, robot)
    lean = placement.rotation_deg[1]
    assert 25 <= lean <= 60
    further = RULES.integrator.adjust(asked, idea, robot, placement, report("initial_penetration", "switch"))
    assert further.rotation_deg[1] == pytest.approx(lean + 12)


@pytest.mark.parametrize("turned_deg", [0, 90, 200])
def test_a_sweep_curls_ahead_in_a_level_plane_whichever_way_the_mount_is_turned(turned_deg: int) -> None:
    wall = LAMP.replace('euler="0 90 0"', f'euler="0 90 {turned_deg}"')
    asked = free_brief("Brush it with 0.2 to 0.4 N.", wall)
    idea = RULES.designer.propose(asked, 1)[0]
    robot = RULES.coder.write(asked, idea)
    placement = RULES.integrator.place(asked, idea, robot)
    model = mujoco.MjModel.from_xml_string(assemble(robot, wall, placement, ()).mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = [data.xaxis[j] for j in range(model.njnt) if "bend" in model.joint(j).name]
    assert all(abs(axis[2]) > 0.999 for axis in axes)
    before = data.site("robot/functional_part").xpos.copy()
    data.ctrl[:] = [model.actuator_ctrlrange[i, 1] * ("uncurl" not in model.actuator(i).name) for i in range(model.nu)]
    for _ in range(300):
        mujoco.mj_step(model, data)
    assert data.site("robot/functional_part").xpos[0] > before[0] + 0.02


def test_a_sweep_presses_with_the_force_the_objective_names() -> None:
    light, firm = (
        RULES.designer.propose(free_brief(f"Brush it with {force} N.", LAMP), 1)[0].parameters["tension_n"]
        for force in ("0.2 to 0.4", "0.4 to 0.8")
    )
    assert firm == pytest.approx(2.0 * light, rel=0.2)
    heavy = RULES.designer.propose(free_brief("Brush it with 100 to 500 N.", LAMP), 1)[0].parameters["tension_n"]
    assert heavy == pytest.approx(60.0)  # what a winch gives


def test_a_sweep_that_overlaps_moves_back_and_does_not_lean() -> None:
    idea, robot, placement = placed("force_controlled_brushing", "tentacle", "sweep")
    overlap = report("initial_penetration", "wall", "robot/tip_pad")
    back = RULES.integrator.adjust(brief("force_controlled_brushing"), idea, robot, placement, overlap)
    assert back.position_m[2] < placement.position_m[2]
    assert back.rotation_deg == placement.rotation_deg


def test_a_fixed_gripper_is_put_over_its_object() -> None:
    asked = free_brief("Pick the marble up.", MARBLE)
    idea = next(c for c in RULES.designer.propose(asked, 3) if c.family == "gripper")
    placement = RULES.integrator.place(asked, idea, RULES.coder.write(asked, idea))
    assert placement.position_m[0] == pytest.approx(0.02)


def test_a_world_without_mounts_takes_free_robots_at_its_origin() -> None:
    asked = free_brief("Crawl away.", DESERT)
    idea = RULES.designer.propose(asked, 1)[0]
    placement = RULES.integrator.place(asked, idea, RULES.coder.write(asked, idea))
    assert (placement.mount, placement.base) == ("world", "free")


def test_a_mount_that_hangs_is_not_for_a_free_robot() -> None:
    raised = MARBLE.replace('type="plane"', 'type="plane" pos="0 0 -0.1"')
    asked = free_brief("Roll to the marble.", raised)
    idea = RULES.designer.propose(asked, 1)[0]
    robot = RULES.coder.write(asked, idea)
    placement = RULES.integrator.place(asked, idea, robot)
    on_ground = RULES.integrator.place(free_brief("Crawl away.", DESERT), idea, robot)
    assert (placement.mount, placement.base) == ("world", "free")
    assert placement.position_m[2] == pytest.approx(on_ground.position_m[2] - 0.1)
    back = RULES.integrator.adjust(asked, idea, robot, placement, report("initial_penetration", "marble", "robot/tail"))
    assert back.position_m[0] <= placement.position_m[0] - 0.1


def test_overlaps_move_the_robot_back_or_up() -> None:
    idea, robot, placement = placed("simple_grasping", "gripper", "four fingers")
    back = RULES.integrator.adjust(
        brief("simple_grasping"), idea, robot, placement, report("initial_penetration", "object", "robot/fingertip1")
    )
    assert back.position_m[2] < placement.position_m[2]
    idea, robot, placement = placed("flat_ground", "worm", "wave")
    up = RULES.integrator.adjust(
        brief("flat_ground"), idea, robot, placement, report("initial_penetration", "ground", "robot/foot0")
    )
    assert up.position_m[2] > placement.position_m[2]


def test_a_fallen_robot_is_fixed_and_what_placing_cannot_cure_is_said() -> None:
    idea, robot, placement = placed("button_pushing", "arm", "two sections")
    loose = placement.model_copy(update={"base": "free"})
    held = RULES.integrator.adjust(brief("button_pushing"), idea, robot, loose, report("free_fall", "robot/base"))
    assert held.base == "fixed"
    other = RULES.integrator.adjust(brief("button_pushing"), idea, robot, placement, report("too_stiff"))
    assert "No placement cures too_stiff" in other.reason


@pytest.mark.parametrize(
    ("component", "wrong", "attribute"),
    [
        ("base", {"base": "free"}, "base"),
        ("mount", {"mount": "world"}, "mount"),
        ("intended_contacts", {"intended_contacts": ()}, "intended_contacts"),
    ],
)
def test_what_the_judge_blames_on_placing_is_put_right(component: str, wrong: dict, attribute: str) -> None:
    idea, robot, placement = placed("drawer_opening", "arm", "hook")
    bad = placement.model_copy(update=wrong)
    good = RULES.integrator.adjust(brief("drawer_opening"), idea, robot, bad, critique(component))
    assert getattr(good, attribute) == getattr(placement, attribute)


# --- judging ---------------------------------------------------------------------------------------------------------


def judged(task: str, idea, robot, whole: Scene, found: ValidationReport = STABLE) -> Critique:
    return RULES.judge.judge(brief(task), idea, robot, whole, found)


def issues(answer: Critique) -> set[tuple[str, str]]:
    return {(issue.blame, issue.component) for issue in answer.issues}


@pytest.mark.parametrize(
    ("task", "family", "variant"),
    [
        ("button_pushing", "tentacle", "space"),
        ("simple_grasping", "tentacle", "wrap"),
        ("flat_ground", "ring", "four sectors"),
        ("drawer_opening", "gripper", "pincer"),
    ],
)
def test_right_scenes_pass(task: str, family: str, variant: str) -> None:
    idea, robot, placement = placed(task, family, variant)
    assert judged(task, idea, robot, scene(task, robot, placement)).passed


def test_a_pass_names_the_warnings_of_the_validator() -> None:
    task = "button_pushing"
    idea, robot, placement = placed(task, "arm", "two sections")
    known = {"layer": "simulate", "severity": "warning", "message": "seen"}
    warnings = tuple(Fault(code=code, **known) for code in ("cable_shared", "only_opens", "cable_shared"))
    whole = scene(task, robot, placement)
    answer = judged(task, idea, robot, whole, ValidationReport(stable=True, faults=warnings))
    assert answer.summary.endswith("base and contact. 3 warnings of the validator: cable_shared, only_opens.")
    assert "warning" not in judged(task, idea, robot, whole).summary


def test_a_short_arm_is_the_designers_fault_and_its_wish_is_understood() -> None:
    idea, _, placement = placed("button_pushing", "arm", "two sections")
    idea = idea.model_copy(update={"parameters": {**idea.parameters, "length_m": 0.2}})
    robot = RULES.coder.write(brief("button_pushing"), idea)
    answer = judged("button_pushing", idea, robot, scene("button_pushing", robot, placement))
    assert issues(answer) == {("designer", "reach")}
    words = " ".join(f"{issue.problem}: {issue.suggestion}" for issue in answer.issues)
    longer = RULES.designer.revise(brief("button_pushing"), idea, robot, words)
    assert longer.parameters["length_m"] == pytest.approx(0.25)


def test_a_free_base_where_the_task_holds_it_is_the_integrators_fault() -> None:
    idea, robot, placement = placed("button_pushing", "arm", "two sections")
    loose = placement.model_copy(update={"base": "free", "intended_contacts": ()})
    answer = judged("button_pushing", idea, robot, scene("button_pushing", robot, loose))
    assert issues(answer) == {("integrator", "base"), ("integrator", "intended_contacts")}


def test_a_robot_off_its_moving_mount_is_the_integrators_fault() -> None:
    idea, robot, placement = placed("drawer_opening", "arm", "hook")
    away = placement.model_copy(update={"mount": "world"})
    answer = judged("drawer_opening", idea, robot, scene("drawer_opening", robot, away))
    assert ("integrator", "mount") in issues(answer)


def test_missing_parts_are_the_coders_fault() -> None:
    idea, robot, placement = placed("button_pushing", "arm", "two sections")
    root = etree.fromstring(robot.mjcf)
    root.remove(root.find("sensor"))
    for geom in root.iter("geom"):
        geom.attrib.update({"contype": "0", "conaffinity": "0"})
    bare = robot.model_copy(update={"mjcf": etree.tostring(root, encoding="unicode")})
    grouped = idea.model_copy(
        update={"actuator_groups": concept("simple_grasping", "gripper", "pincer").actuator_groups}
    )
    answer = judged("button_pushing", grouped, bare, scene("button_pushing", bare, placement))
    assert {("coder", "contact_disabled"), ("coder", "actuator_groups")} <= issues(answer)


def test_sensors_of_the_robot_need_no_names() -> None:
    idea, robot, placement = placed("button_pushing", "arm", "two sections")
    root = etree.fromstring(robot.mjcf)
    for sensor in root.find("sensor"):
        sensor.attrib.pop("name", None)
    unnamed = robot.model_copy(update={"mjcf": etree.tostring(root, encoding="unicode")})
    assert judged("button_pushing", idea, unnamed, scene("button_pushing", unnamed, placement)).passed
    root.remove(root.find("sensor"))
    without = robot.model_copy(update={"mjcf": etree.tostring(root, encoding="unicode")})
    whole = scene("button_pushing", without, placement)
    assert "<sensor>" in whole.mjcf, "those of the task, which are not the robot's"
    assert ("coder", "no_sensors") in issues(judged("button_pushing", idea, without, whole))


def test_an_unstable_scene_never_passes() -> None:
    idea, robot, placement = placed("button_pushing", "arm", "two sections")
    answer = judged("button_pushing", idea, robot, scene("button_pushing", robot, placement), report("chatter"))
    assert issues(answer) == {("coder", "chatter")}


def test_a_grasp_far_beside_its_object_is_the_integrators_fault() -> None:
    asked = free_brief("Pick the marble up.", MARBLE)
    idea = next(c for c in RULES.designer.propose(asked, 3) if c.family == "gripper")
    robot = RULES.coder.write(asked, idea)
    right = RULES.integrator.place(asked, idea, robot)
    wrong = right.model_copy(update={"position_m": (0.1, 0.0, 0.0)})
    answer = RULES.judge.judge(asked, idea, robot, assemble(robot, asked.environment, wrong), STABLE)
    assert issues(answer) == {("integrator", "offset")}
    assert RULES.integrator.adjust(asked, idea, robot, wrong, answer).position_m == right.position_m


SHELF = """<mujoco model="shelf"><worldbody><geom name="floor" type="plane" size="1 1 0.1"/>
<body name="shelf" pos="0.25 0 0.3"><geom name="board" type="box" size="0.1 0.15 0.01"/></body>
<body name="cup" pos="0.22 0.02 0.35"><freejoint/><geom name="cup" type="cylinder" size="0.025 0.03" mass="0.08"/>
</body><site name="mount" pos="0 0 0.7"{turned}/></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("turned", "passes"), [("", False), (' zaxis="0.53 0.05 -0.85"', True), (' zaxis="1 0 0"', True)]
)
def test_a_robot_that_points_away_from_its_target_does_not_pass(turned: str, passes: bool) -> None:
    """An arm that is long enough does not reach what is behind its mount; the environment has to be changed."""
    asked = free_brief("Reach the cup on the shelf and push it 5 cm away.", SHELF.format(turned=turned))
    idea = next(c for c in RULES.designer.propose(asked, 3) if c.family == "arm")
    robot = RULES.coder.write(asked, idea)
    whole = assemble(robot, asked.environment, RULES.integrator.place(asked, idea, robot))
    answer = RULES.judge.judge(asked, idea, robot, whole, STABLE)
    assert ("direction" in {issue.component for issue in answer.issues}) is not passes
    if not passes:
        [issue] = (issue for issue in answer.issues if issue.component == "direction")
        assert issue.problem.startswith("the robot points away from cup, which is 414 mm away, behind mount")
        assert 'zaxis="0.53 0.05 -0.85"' in issue.suggestion


@pytest.mark.parametrize("task", [name for name in task_names() if load_task(name).base == "fixed"])
def test_no_benchmark_target_is_behind_its_robot(task: str) -> None:
    asked = brief(task)
    for idea in RULES.designer.propose(asked, 8):
        robot = RULES.coder.write(asked, idea)
        whole = scene(task, robot, RULES.integrator.place(asked, idea, robot))
        assert "direction" not in {component for _, component in issues(judged(task, idea, robot, whole))}
