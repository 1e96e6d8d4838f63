"""Floors are chosen on development variations and counted on held-out ones, and the page follows from them."""

import numpy as np
import pytest
from benchmarks.tasks import floors, study

from aidsr.learn.episodes.scene import TaskScene
from aidsr.tasks import load_task
from scenes import small_scene


@pytest.fixture(scope="module")
def scene():
    return TaskScene.of(small_scene(), "button_pushing")


def fact(**changes):
    about = {
        "task": "locomotion/gap",
        "level": "standard",
        "body": "seed 0",
        "concept": "arm",
        "version": 7,
        "commit": "abc",
    }
    kind = {"kind": "floor", "policy": "idle", "chosen": "", "wins": 0, "episodes": 40}
    return {**about, **kind, **changes}


def test_the_page_is_made_of_the_facts():
    assert study.TABLE.read_text(encoding="utf-8") == study.table(study.facts())


def test_what_was_measured_before_a_task_changed_says_so():
    old, same = fact(task="manipulation/drawer_opening", version=4), fact(task="locomotion/gap", version=4)
    page = study.table([old, same])
    assert "| manipulation/drawer_opening " in page
    assert page.count("before the task changed") == 1


def test_two_groups_have_the_whole_grid_of_constants_and_many_a_fixed_sample(scene, monkeypatch):
    assert len({one.words for one in floors.constants(scene)}) == 9
    monkeypatch.setattr(floors, "CONSTANTS", 5)
    sample = [one.words for one in floors.constants(scene)]
    assert len(set(sample)) == 5
    assert sample == [one.words for one in floors.constants(scene)]


def test_rules_pull_every_set_of_few_groups(scene):
    pulled = {one.words.rpartition(" strength")[0] for one in floors.rules(scene)}
    assert pulled == {"pull_left", "pull_right", "pull_left pull_right"}
    last = {tuple(group.last for group in one.motion.groups) for one in floors.rules(scene)}
    assert max(map(max, last)) == 1.0
    assert min(map(min, last)) == -1.0


def test_a_random_action_is_held_and_depends_on_the_episode_alone():
    task = load_task("button_pushing")
    policy, alone = (floors.RandomPolicy(task, 2, 0.12, numbers) for numbers in ([0, 1], [1]))
    actions = np.array([policy.act(np.zeros((2, 1))) for _ in range(6)])
    assert (actions[0] == actions[2]).all()
    assert (actions[2] != actions[3]).all()
    assert (actions[0, 1] == alone.act(np.zeros((1, 1)))[0]).all()


def test_the_best_is_chosen_without_a_look_at_held_out_variations(scene, monkeypatch):
    played = []

    def play_motions(scene, motions, split, indices, threads, most_s=np.inf):
        played.append((split, len(motions), sorted(set(indices)), most_s))
        won = np.array([motion.groups[0].first for motion in motions]) == 1.0
        return floors.EpisodeOutcomes(*[won] * 11)

    monkeypatch.setattr(floors, "play_motions", play_motions)
    (found,) = floors.measure(scene, ["constant"], 10, 1)
    assert [one[:3] for one in played] == [
        ("development", 18, [0, 1]),
        ("development", 16, [2, 3, 4, 5]),
        ("held_out", 10, list(range(10))),
    ]
    assert played[-1][3] == np.inf
    assert (found.chosen, found.tried, found.development_wins, found.outcomes.success.sum()) == ("+1 -1", 9, 4, 10)


def test_an_episode_ends_early_only_where_nothing_moves_any_more(scene):
    (idle,) = floors.idle(scene)
    outcomes = floors.play_motions(scene, [idle.motion] * 2, "held_out", [0, 1], 1)
    assert (outcomes.time_s < scene.task.time_limit_s - 1.0).all()
    swinging = floors.rules(TaskScene.of(small_scene(), "button_pushing"))[0].motion.model_copy(
        update={"groups": tuple(g.model_copy(update={"amplitude": 1.0}) for g in idle.motion.groups)}
    )
    outcomes = floors.play_motions(scene, [swinging], "held_out", [0], 1)
    assert outcomes.time_s[0] == pytest.approx(scene.task.time_limit_s)


@pytest.mark.parametrize(("policy", "wins", "marked"), [("idle", 2, False), ("idle", 3, True), ("rule", 40, False)])
def test_what_wins_undesigned_is_marked(policy, wins, marked):
    page = study.table([fact(policy=policy, wins=wins), fact(body="seed 1", policy=policy)])
    (row,) = [line for line in page.splitlines() if line.startswith("| locomotion/gap | standard | 2 |")]
    assert f"({wins}/80)" in row
    assert ("**" in row) is marked


def test_a_design_that_was_not_approved_is_no_body():
    page = study.table([fact(), fact(body="seed 1", kind="body", policy=None)])
    assert "| locomotion/gap | standard | 1 of 2 |" in page


def test_the_latest_line_holds(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "FACTS", tmp_path / "results.jsonl")
    for wins in (1, 2):
        study.append(fact(wins=wins))
    study.append(fact(body="seed 1"))
    study.compact()
    assert [one["wins"] for one in study.facts()] == [2, 0]
    assert len((tmp_path / "results.jsonl").read_text().splitlines()) == 2


def test_facts_of_a_task_depend_on_its_sources_and_level():
    digests = {study.digest(load_task(name, level)) for name in ("gap", "tunnel") for level in ("standard", "hard")}
    assert len(digests) >= 3
