"""The tools as a designer calls them: by name, with plain arguments, in a workspace."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.scenes import small_arm
from tests.tools.test_statics import limb

from aidsr.core.artifacts import Brief, Keep, ValidationReport
from aidsr.core.errors import AidsrError, UserError
from aidsr.sim.environment_summary import summarize_environment
from aidsr.tasks import load_task
from aidsr.tools import OWNER_TOOLS, TOOLS, Job, Workspace, building, tools_table
from aidsr.validation import validate

ENVIRONMENT = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody><geom name="floor" type="plane" size="5 5 0.1"/><site name="mount" pos="0 0 0.1"/></worldbody>
</mujoco>"""
CART = """
<mujoco><worldbody><body name="base"><geom type="sphere" size="0.01" mass="0.1" pos="0 0 0.2"/>
  <body name="cart"><joint name="along" type="slide" axis="1 0 0"/><geom type="sphere" size="0.05" mass="1"/></body>
</body></worldbody>
<actuator><velocity name="drive" joint="along" kv="1000" ctrlrange="-0.5 0.5"/></actuator></mujoco>"""


def travelling(folder: Path, distance_m: float = 9.0) -> Workspace:
    """A workspace whose job is to travel along x."""
    goal = folder / "goal.toml"
    goal.write_text(f'kind = "travel"\ndistance_m = {distance_m}\ntime_limit_s = 4\nhold_s = 0.2\n')
    summary = summarize_environment(ENVIRONMENT)
    brief = Brief(objective="Travel.", environment=ENVIRONMENT, summary=summary, base="any")
    return Workspace(folder / "work", Job(brief, goal=goal))


def call(work: Workspace, tool: str, /, **arguments: object) -> str:
    return TOOLS[tool].call(work, arguments).text


def with_cart(folder: Path, distance_m: float = 9.0) -> Workspace:
    work = travelling(folder, distance_m)
    call(work, "validate", mjcf=CART, functional_part="cart")
    call(work, "assemble", robot="robot_1", placement={"mount": "mount", "base": "fixed"})
    return work


def test_every_tool_says_what_it_does_and_describes_its_arguments() -> None:
    for tool in (*TOOLS.values(), *OWNER_TOOLS.values()):
        assert tool.description.endswith(".")
        for schema in (tool.schema, *tool.schema.get("$defs", {}).values()):
            for name, field in schema["properties"].items():
                assert field.get("description"), f"{tool.name}: {name}"
            assert schema["additionalProperties"] is False


def test_what_valid_means_is_told_with_the_tools_that_say_it() -> None:
    for word in ("plausible", "slack cables", "locked soft body", "other actuators"):
        assert word in TOOLS["train"].description
    assert "valid, which means what it means for train" in OWNER_TOOLS["evaluate"].description


def test_what_is_measured_has_its_unit_and_no_prefix_of_another_tool() -> None:
    for tool in (*TOOLS.values(), *OWNER_TOOLS.values()):
        for schema in (tool.schema, *tool.schema.get("$defs", {}).values()):
            for name, field in schema["properties"].items():
                if name in ("seconds", "azimuth_deg", "elevation_deg", "force_n"):
                    unit = {"seconds": "s", "force_n": "N"}.get(name, "deg")
                    assert re.search(rf"\b(in|by) {unit}\b", field["description"]), f"{tool.name}: {name}"
                if name != "what":
                    assert not re.match(r"(play|load|gaits|probe)\b.*: ", field["description"]), f"{tool.name}: {name}"


def test_the_docs_have_the_table_of_tools() -> None:
    page = Path(__file__).parents[2] / "docs" / "tools.md"
    for name, tools in (("TOOLS", TOOLS), ("OWNER_TOOLS", OWNER_TOOLS)):
        assert tools_table(tools) in page.read_text(), (
            f"paste the output of: python -c 'import aidsr.tools as t; print(t.tools_table(t.{name}))'"
        )


def test_a_robot_is_kept_edited_and_fixed_under_new_names(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    first = call(work, "validate", mjcf=small_arm(), functional_part="tip", mount="fixed")
    assert first.startswith("robot_1: stable\nlength 238 mm, moving mass 0.04 kg, 2 actuators")
    edited = call(work, "edit", robot="robot_1", patch="<set sel=\"//joint[@name='bend1']\" stiffness='0.4'/>")
    assert edited.startswith("robot_2: stable; changed from robot_1\n")
    assert 'stiffness="0.4"' in call(work, "read", name="robot_2", lines=100)
    assert work.robot("robot_2").functional_part == "tip"
    assert call(work, "fix", robot="robot_1") == "nothing of robot_1 can be fixed by code: it has no fault"
    call(work, "edit", robot="robot_1", patch="<set sel=\"//joint\" damping='0.00001'/>")
    assert "; fixed from robot_3" in call(work, "fix", robot="robot_3")


def test_a_fix_leaves_alone_what_the_job_keeps(tmp_path: Path) -> None:
    robot = small_arm(damping=0.00001).replace("<worldbody>", '<option integrator="implicitfast"/><worldbody>')
    brief = load_task("button_pushing").brief()
    free, kept = (
        Workspace(tmp_path / name, job=Job(brief.model_copy(update={"starting_robot": robot, "keep": keep})))
        for name, keep in (("free", ()), ("kept", (Keep(name="bend1"),)))
    )
    for work in (free, kept):
        call(work, "validate", mjcf=robot, functional_part="tip")
    assert "damp_hinges" not in call(free, "fix", robot="robot_1")
    assert 'Left out damp_hinges, which would change a part to keep: Of "bend1"' in call(kept, "fix", robot="robot_1")


def test_a_robot_is_tested_and_measured_as_it_was_validated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tests: list[dict[str, object]] = []

    def recorded(mjcf: str, **settings: object) -> ValidationReport:
        tests.append(settings)
        return validate(mjcf, **settings)

    monkeypatch.setattr(building, "validate_mjcf", recorded)
    work = Workspace(tmp_path)
    settings = {"mount": "free", "realizable": True, "task": "simple_grasping"}
    call(work, "validate", mjcf=small_arm(), functional_part="tip", **settings)
    call(work, "edit", robot="robot_1", patch="<set sel=\"//joint\" damping='0.00001'/>")
    assert "; fixed from robot_2" in call(work, "fix", robot="robot_2")
    assert len(tests) == 4
    assert all(each == tests[0] for each in tests)
    assert tests[0].items() >= {"mount": "free", "realizable": True, "needs_contact": True}.items()
    assert [work.subject(f"robot_{number}").mount for number in (1, 2, 3)] == ["free"] * 3


def test_a_free_robot_alone_stands_on_a_plane_when_it_is_measured(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    rolling = small_arm().replace('<body name="base">', '<body name="base" pos="0 0 0.1"><freejoint/>')
    call(work, "validate", mjcf=rolling, functional_part="tip")
    how = {"part": "base", "direction": [0, 0, 1], "force_n": 1}
    lifted = call(work, "measure", what="load", subject="robot_1", how=how)
    assert float(re.search(r"gives ([\d.]+) mm", lifted)[1]) > 10
    with pytest.raises(UserError, match="diverged during the measurement; use a smaller force"):
        call(work, "measure", what="load", subject="robot_1", how=how | {"force_n": 5})


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ({"functional_part": "tipp"}, 'functional_part names "tipp", but no body or site of the MJCF has that name'),
        (
            {"actuator_groups": [{"name": "both", "actuators": ["pull_left", "pull_rigth"]}]},
            'actuator_groups names "pull_rigth", but no actuator of the MJCF has that name; it has pull_left',
        ),
    ],
)
def test_a_name_that_the_robot_has_not_is_refused_and_keeps_nothing(
    tmp_path: Path, names: dict[str, object], said: str
) -> None:
    work = Workspace(tmp_path)
    with pytest.raises(UserError, match=re.escape(said)):
        call(work, "validate", mjcf=small_arm(), **names)
    call(work, "validate", mjcf=small_arm(), functional_part="tip")
    with pytest.raises(UserError, match=re.escape(said)):
        call(work, "edit", robot="robot_1", **names)
    assert not (tmp_path / "robot_2").exists()


def test_names_that_mujoco_generates_may_be_given(tmp_path: Path) -> None:
    copies = small_arm().replace("</worldbody>", '<replicate count="2"><body name="pad"/></replicate></worldbody>')
    work = Workspace(tmp_path)
    call(work, "validate", mjcf=copies, functional_part="pad1")
    assert work.robot("robot_1").functional_part == "pad1"


def test_groups_and_the_functional_part_change_without_a_patch(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    call(work, "validate", mjcf=small_arm(), functional_part="tip", mount="fixed")
    groups = [{"name": "both", "actuators": ["pull_left", "pull_right"]}]
    assert call(work, "edit", robot="robot_1", actuator_groups=groups).startswith("robot_2: stable; changed from")
    before, after = work.robot("robot_1"), work.robot("robot_2")
    assert after.mjcf == before.mjcf
    assert [group.name for group in after.actuator_groups] == ["both"]
    call(work, "edit", robot="robot_2", functional_part="base")
    assert work.robot("robot_3").functional_part == "base"


def test_a_scene_is_played_and_its_file_can_be_read(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    played = call(work, "play", scene="scene_1", script="drive: 0.4", seconds=1.0)
    assert "mean velocity" in played
    file = re.search(r"read (file_\d+\.csv)", played)
    assert file is not None
    shown = call(work, "read", name=file[1], lines=3)
    assert shown.splitlines()[1].startswith("time [s],progress,x [m]")
    assert shown.startswith(f"{file[1]}, lines 1 to 3 of 27:")


def test_a_number_of_a_robot_is_swept(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    call(work, "validate", mjcf=limb(), functional_part="tip")
    table = call(
        work,
        "sweep",
        subject="robot_1",
        select="//body/joint",
        attribute="stiffness",
        values=["0.1", "0.2", "x"],
        what="bends",
    )
    found, head, soft, stiff, broken = table.splitlines()
    assert re.fullmatch(r"stiffness of //body/joint, largest bend: 0.1: 28\.\d deg; 0.2: 14\.\d deg", found)
    assert head.startswith("stiffness of //body/joint | largest bend deg | ")
    assert float(soft.split(" | ")[1]) == pytest.approx(28.6, abs=0.2)
    assert float(stiff.split(" | ")[1]) == pytest.approx(14.3, abs=0.2)
    assert broken.startswith("x | failed: ")
    assert {path.name for path in tmp_path.iterdir()} == {"robot_1"}, "the robot stays as it is"


def test_a_sweep_in_which_every_value_fails_is_an_error(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    call(work, "validate", mjcf=limb(), functional_part="tip")
    swept = {"subject": "robot_1", "select": "//body/joint", "attribute": "stiffness", "what": "bends"}
    with pytest.raises(UserError, match=r"every value of stiffness of //body/joint failed\n.*\nx \| failed: "):
        call(work, "sweep", **swept, values=["x", "y"])


def test_a_number_is_swept_in_a_scene_under_a_script(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    swept = {"subject": "scene_1", "select": "//velocity", "attribute": "ctrlrange", "values": ["-0.5 0.5", "-0.1 0.1"]}
    table = call(work, "sweep", **swept, what="play", how={"script": "drive: 1", "seconds": 1.0})
    column = table.splitlines()[1].split(" | ").index("mean velocity x mm/s")
    fast, slow = (float(row.split(" | ")[column]) for row in table.splitlines()[2:])
    assert fast == pytest.approx(5 * slow, rel=0.01)
    assert fast == pytest.approx(500 * 1.0 / 1.1, rel=0.01), "of the centre of mass: 1 kg moves and 0.1 kg stays"


def test_a_robot_that_was_not_stood_stays_where_it_is_when_it_is_swept(tmp_path: Path) -> None:
    work = travelling(tmp_path)
    call(work, "validate", mjcf=small_arm(), functional_part="tip", mount="free")
    placement = {"mount": "mount", "base": "free", "position_m": [0, 0, 0.4]}
    for stand in (True, False):
        call(work, "assemble", robot="robot_1", placement=placement, stand=stand)
    how = {"script": "*: -1", "seconds": 0.1, "distances": [["base", "floor"]]}
    swept = {"what": "play", "how": how, "select": "//body/joint", "attribute": "stiffness", "values": ["0.3"]}
    on_the_ground, above = (
        float(call(work, "sweep", subject=name, **swept).splitlines()[-1].split(" | ")[-2])
        for name in ("scene_1", "scene_2")
    )
    assert on_the_ground < 1
    assert above > 400
    record = tmp_path / "work" / "scene_2" / "scene.json"
    record.write_text(re.sub(r',\s*"stand": false', "", record.read_text()))
    assert work.record("scene_2").stand, "records of before did not tell"


def test_names_are_swept_with_the_prefix_that_results_give_them_or_without(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    swept = {"subject": "scene_1", "attribute": "ctrlrange", "values": ["-0.1 0.1"], "what": "play"}
    bare, prefixed = (
        call(work, "sweep", **swept, select=f"//velocity[@name='{name}']", how={"script": "drive: 1", "seconds": 0.4})
        for name in ("drive", "robot/drive")
    )
    assert "failed" not in prefixed
    assert prefixed.splitlines()[2] == bare.splitlines()[2]


def test_the_most_variations_are_told_before_one_asks_for_more(tmp_path: Path) -> None:
    assert "at most 8" in TOOLS["play"].schema["properties"]["variations"]["description"]
    with pytest.raises(UserError, match="variations has 9 entries, at most 8 fit"):
        call(with_cart(tmp_path), "play", scene="scene_1", script="drive: 1", variations=list(range(9)))


def test_a_number_in_a_script_is_swept(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    how = {"script": "drive: {x}", "seconds": 1.0, "distances": [["cart", "floor"]]}
    table = call(work, "sweep", subject="scene_1", values=["1", "-0.5"], what="play", how=how)
    head, *rows = (line.split(" | ") for line in table.splitlines()[1:])
    assert head[0] == "{x} of the script"
    assert head[-3:] == ["least cart to floor mm", "at the end mm", "came to"]
    assert rows[0][-1].startswith("begun, not yet "), "the phase of the goal"
    fast, back = (float(row[head.index("mean velocity x mm/s")]) for row in rows)
    assert back == pytest.approx(-fast / 2, rel=0.01)


def test_several_variations_are_a_row_each_in_play_and_sweep(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    told = call(work, "play", scene="scene_1", script="drive: 1", seconds=0.4, variations=[0, 3])
    won, warning, head, *rows = told.splitlines()
    assert won == "won 0 of 2"
    assert warning.startswith("scene_1 is not stable")
    assert head.startswith("variation | best progress | ")
    assert [row.split(" | ")[0] for row in rows] == ["0", "3"]
    how = {"script": "drive: {x}", "seconds": 0.4, "variations": [0, 3]}
    swept = call(work, "sweep", subject="scene_1", values=["1", "0.5"], what="play", how=how).splitlines()
    assert [row.split(" | ")[0] for row in swept[2:]] == [
        "1, variation 0",
        "1, variation 3",
        "0.5, variation 0",
        "0.5, variation 3",
    ]


def test_play_tells_what_a_stage_asks_for_against_its_limit(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    call(work, "validate", mjcf=small_arm(), functional_part="tip", task="simple_grasping")
    call(work, "assemble", robot="robot_1", placement={"mount": "mount", "base": "fixed"}, task="simple_grasping")
    asked = (
        r"when progress was best: functional part to object [\d.]+ mm \(at most 50\), contacts face each other "
        r"\(1: from opposite sides\) 0 \(at least 1\), raised by -?[\d.]+(e-\d+)? mm \(at least 100\)"
    )
    played = {"scene": "scene_1", "script": "*: 0", "seconds": 0.2}
    assert re.search(rf"^{asked}$", call(work, "play", **played), re.MULTILINE)
    rows = call(work, "play", **played, variations=[0, 1]).splitlines()
    assert sum(bool(re.search(asked, row)) for row in rows) == 2


def test_a_scene_that_is_not_stable_says_so_wherever_it_is_looked_at(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    assert work.record("scene_1").stable is False
    warning = "scene_1 is not stable, as assemble said"
    assert call(work, "play", scene="scene_1", script="drive: 0", seconds=0.2).splitlines()[1].startswith(warning)
    assert call(work, "look", subject="scene_1").startswith(warning)
    record = tmp_path / "work" / "scene_1" / "scene.json"
    record.write_text(record.read_text().replace('"stable": false', '"stable": true'))
    assert warning not in call(work, "play", scene="scene_1", script="drive: 0", seconds=0.2)


def test_a_probe_tells_seeds_and_the_script_that_got_farthest(tmp_path: Path) -> None:
    work = with_cart(tmp_path, 0.4)
    found = TOOLS["probe"].call(work, {"scene": "scene_1", "seeds": [0, 3], "max_steps": 20_000})
    told = found.text
    (strip,) = found.pictures
    assert strip.startswith(b"\x89PNG")
    assert "seed 0: progress 1.00" in told
    assert "seed 3: progress 1.00" in told
    assert (found.figures["success"], found.figures["episodes"]) == (1.0, 1.0)
    script = re.search(r"as a script:\n(drive: .*)\n", told)
    assert script is not None
    assert "Ended: success, held" in call(work, "play", scene="scene_1", script=script[1])


def test_a_property_is_measured(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    assert "heading drift, median" in call(
        work, "measure", what="gaits", subject="scene_1", how={"gaits": 2, "seconds": 0.5}
    )
    assert "cart to floor: 50.0 mm as drawn" in call(
        work, "measure", what="clearances", subject="scene_1", how={"distances": [["cart", "floor"]]}
    )
    call(work, "validate", mjcf=limb(), functional_part="tip")
    assert "stiffness" in call(work, "measure", what="load", subject="robot_2")


def test_a_picture_is_drawn(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    for arguments in ({"subject": "robot_1"}, {"subject": "scene_1", "script": "drive: 1", "seconds": 0.5}):
        (png,) = TOOLS["look"].call(work, arguments).pictures
        assert png.startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("tool", "arguments", "message"),
    [
        ("play", {"scene": "scene_1"}, "script is missing"),
        ("play", {"scene": "scene_1", "script": "drive: 1", "speed": 2}, 'there is no argument "speed"'),
        ("play", {"scene": "scene_9", "script": "drive: 1"}, 'no scene "scene_9"; scenes: scene_1'),
        ("probe", {"scene": "robot_1"}, "nothing measures success here"),
        ("sweep", {"subject": "scene_1", "values": ["1"], "what": "gaits"}, "nothing to vary"),
        (
            "sweep",
            {"subject": "scene_1", "select": "//velocity", "attribute": "kv", "values": ["1"], "what": "play"},
            "play needs a script",
        ),
        (
            "assemble",
            {"robot": "robot_1", "placement": {"mount": "mount", "base": "fixed"}, "task": "tunnel"},
            'not for "tunnel"',
        ),
        ("edit", {"robot": "robot_1", "patch": "<set sel='//tendon' width='1'/>"}, "selects no element"),
        ("edit", {"robot": "robot_1"}, "nothing would change: give a patch"),
        ("read", {"name": "file_3.csv"}, 'no file "file_3.csv"; files: none yet'),
        ("read", {"name": "file_1/../../goal.toml"}, "no file"),
    ],
)
def test_what_cannot_be_done_is_said(tmp_path: Path, tool: str, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(AidsrError, match=re.escape(message)):
        call(with_cart(tmp_path), tool, **arguments)


def test_results_that_are_long_become_files(tmp_path: Path) -> None:
    from aidsr.tools.tool import MOST_LINES, shortened

    work = Workspace(tmp_path)
    long = "\n".join(f"line {number}" for number in range(200))
    short = shortened(long, work)
    assert len(short.splitlines()) == MOST_LINES
    assert short.endswith("more lines: read file_1.txt")
    assert call(work, "read", name="file_1.txt", first_line=150, lines=1).endswith("line 149")


def test_no_file_is_overwritten_after_another_was_removed(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    assert [work.add_file(text, "txt") for text in "abc"] == ["file_1.txt", "file_2.txt", "file_3.txt"]
    (tmp_path / "file_1.txt").unlink()
    assert work.add_file("d", "txt") == "file_4.txt"
    assert work.file("file_3.txt") == "c"


def test_files_of_others_in_the_folder_are_not_listed(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    (work.folder / "robot_backup").mkdir()
    (work.folder / "task_notes.md").touch()
    assert work.own_tasks() == []
    with pytest.raises(UserError, match=r'no robot "robot_9"; robots: robot_1$'):
        work.robot("robot_9")


def test_a_damaged_scene_is_said(tmp_path: Path) -> None:
    work = with_cart(tmp_path)
    (work.folder / "scene_1" / "scene.json").unlink()
    with pytest.raises(UserError, match="missing or damaged; assemble the scene again"):
        work.record("scene_1")


@pytest.mark.slow
def test_a_short_training_is_told(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="needs the extra rl")
    work = with_cart(tmp_path, 0.4)
    told = call(work, "train", scene="scene_1", steps=4000)
    taken = re.search(r"minutes and ([\d,]+) control steps", told)
    assert taken is not None
    assert told.startswith(f"after {taken[1]} steps: success in ")
    assert " of 20 development variations" in told
    assert re.search(r"^20 episodes ended: .*\d+ by (success|the time limit of 4 s)", told, re.M)
    assert re.search(
        r"^trained for \d+\.\d minutes and [\d,]+ control steps, until (its policy|all steps) .*; ", told, re.M
    )
    assert "learning curve (steps: success, " in told
    shown = told.partition("one episode that it ")[2]
    again = re.match(r"(?:won|lost), played again .*\n[\d.]+ s of development variation (\d+), best progress ", shown)
    assert again
    same = call(work, "play", scene="scene_1", script="*: 1", variation=int(again[1]))
    assert f"development variation {again[1]}, " in same
    assert "\ncentre of mass: from " in shown
    begun = call(work, "train", scene="scene_1", steps=4000, script="*: t=0 1, t=3 1")
    assert "until its policy succeeded nearly always; 20 episodes" in begun
    with pytest.raises(UserError, match='no group "wheel"'):
        call(work, "train", scene="scene_1", steps=4000, script="wheel: 1")
    score = OWNER_TOOLS["evaluate"].call(work, {"scene": "scene_1", "episodes": 20}).text
    assert " of 20 held-out variations" in score
