"""The probe finds what an open loop can do, says so, and what it says can be played again."""

import io
from dataclasses import replace

import numpy as np
import pytest

from aidsr import probe
from aidsr.core.artifacts import ActuatorGroup, EpisodeResult
from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import ProbeReport
from aidsr.learn.openloop.fitness import fitness_of
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.probe_scene import _Player, _refined, _Search, budget_for, probe_scene
from aidsr.learn.openloop.recorded_motion import run_record_motion
from aidsr.tasks import goal_task, load_task, parse_goal
from scenes import QuickPushing, small_learning, small_scene

QUICK = {"candidates": 64, "variations": 2, "threads": 1}


class FarPushing(QuickPushing):
    """Bends farther than the arm can."""

    def is_success(self, readings, state):
        return np.abs(readings["tip_position"][:, 0]) > 1.0


class SidedPushing(QuickPushing):
    """Bends to one side in some variations and to the other in others; the wrong one loses."""

    def sample_variation(self, rng):
        drawn = super().sample_variation(rng)
        return replace(drawn, parameters={**drawn.parameters, "side": (float(rng.choice((-1.0, 1.0))),)})

    def is_success(self, readings, state):
        return self._sideways_m(readings) > 0.05

    def is_failure(self, readings, state):
        return self._sideways_m(readings) < -0.02

    def _sideways_m(self, readings):
        return readings["tip_position"][:, 0] * readings.parameters["side"][:, 0]


@pytest.fixture(scope="module")
def report() -> ProbeReport:
    return probe(small_scene(), QuickPushing(), **QUICK)


def test_a_body_that_can_do_it_succeeds_without_learning(report):
    assert (report.success_share, report.same_motion_share) == (1.0, 1.0)
    assert report.reached == "held success"
    assert report.task == "reaching/button_pushing"
    assert {one.episode.ended for one in report.variations} == {"succeeded"}


def test_a_motion_of_a_probe_is_recorded_as_it_went(report):
    probed = report.variations[1]
    content = run_record_motion(small_scene(), QuickPushing(), probed)
    with np.load(io.BytesIO(content), allow_pickle=False) as stored:
        assert (int(stored["variation"]), str(stored["ended"])) == (probed.episode.variation, "succeeded")
        rows = len(stored["qpos"])
        assert (rows - 1) * float(stored["frame_s"]) == pytest.approx(probed.episode.time_s)
        assert stored["holds"][-1]
        assert not stored["holds"][0]
        assert len(stored["tension_n"]) == len(stored["progress"]) == rows
    renamed = tuple(group.model_copy(update={"group": f"other {group.group}"}) for group in probed.motion.groups)
    other = probed.model_copy(update={"motion": probed.motion.model_copy(update={"groups": renamed})})
    with pytest.raises(UserError, match="belong to another robot"):
        run_record_motion(small_scene(), QuickPushing(), other)


def test_a_body_that_cannot_says_how_far_it_came():
    report = probe(small_scene(), FarPushing(), **QUICK)
    assert (report.success_share, report.same_motion_share) == (0.0, 0.0)
    assert "at the button" in report.reached
    assert report.best.episode.ended == "out_of_time"
    assert report.progress == np.mean([one.episode.best_progress for one in report.variations])


def test_what_needs_another_motion_in_each_variation_is_solved_by_no_single_one():
    task = SidedPushing()
    sides = [task.variation("development", index).parameters["side"][0] for index in range(3)]
    assert len(set(sides)) == 2
    report = probe(small_scene(), task, **{**QUICK, "variations": 3})
    assert report.success_share == 1.0
    assert report.same_motion_share == pytest.approx(2 / 3)


def test_a_motion_is_worth_its_progress_and_success_half_after_a_failure_and_nothing_after_a_divergence():
    yes, no, zeros = np.array([True]), np.array([False]), np.zeros(1)

    def worth(succeeded=no, failed=no, diverged=no):
        return fitness_of(
            EpisodeOutcomes(succeeded, failed, diverged, np.array([0.2]), np.array([0.6]), *[zeros] * 6)
        ).tolist()

    assert worth() == pytest.approx([0.4])
    assert worth(succeeded=yes) == pytest.approx([1.4])
    assert worth(failed=yes) == pytest.approx([0.2])
    assert worth(diverged=yes) == [-1.0], "less than any other"


def test_the_same_seed_gives_the_same_report_whatever_the_threads(report):
    again = probe(small_scene(), QuickPushing(), **{**QUICK, "threads": 2})
    assert again.model_copy(update={"wall_s": 0.0}) == report.model_copy(update={"wall_s": 0.0})
    other = probe(small_scene(), QuickPushing(), **QUICK, seed=1)
    assert other.variations != report.variations


def test_a_motion_that_was_read_back_plays_as_it_was_told(report):
    read = ProbeReport.model_validate_json(report.model_dump_json())
    assert read == report
    scene = small_learning()
    variations = [scene.task.variation("development", one.episode.variation) for one in read.variations]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    course = rollout(
        episodes, OpenLoopPolicy(Motions.of([one.motion for one in read.variations]), scene.task.control_dt_s)
    )
    for row, one in enumerate(read.variations):
        assert course.result(row, one.episode.variation) == one.episode


def test_what_is_solved_is_searched_no_further(report):
    more = probe(small_scene(), QuickPushing(), **{**QUICK, "candidates": 6400})
    assert (report.ended_by, more.played_steps) == ("solved", report.played_steps)
    assert report.played_steps * small_learning().model.opt.timestep == pytest.approx(report.simulated_s)


@pytest.mark.parametrize(
    ("candidates", "max_steps", "motions"), [(640, 30_000, range(16, 60)), (640, 1, range(4, 5)), (16, 1, range(4, 5))]
)
def test_physics_steps_bound_the_search_and_what_it_found_is_still_played(candidates, max_steps, motions):
    report = probe(small_scene(), FarPushing(), **{**QUICK, "candidates": candidates}, max_steps=max_steps)
    assert report.ended_by == "budget"
    assert report.why_ended == f"its {max_steps:,} physics steps are used up; with more it may get farther"
    assert report.motions in motions
    assert report.played_steps <= max(max_steps, 2 * 4 * 500 + 4 * 500)
    assert [one.episode.time_s for one in report.variations] == [1.0, 1.0]


def test_more_candidates_never_come_less_far():
    few = probe(small_scene(), FarPushing(), candidates=16, variations=1, threads=1)
    many = probe(small_scene(), FarPushing(), candidates=96, variations=1, threads=1)
    assert many.progress >= few.progress
    assert many.simulated_s > few.simulated_s


def test_only_whole_generations_are_tried_and_told():
    report = probe(small_scene(), FarPushing(), candidates=40, variations=1, threads=1)
    assert (report.ended_by, report.motions) == ("candidates", 32)
    assert report.why_ended == "all 32 motions for each variation were tried"


def test_what_only_unrounded_motions_solved_is_not_called_solved(report):
    assert report.why_ended == "every variation is solved"
    short = EpisodeResult(variation=0, ended="out_of_time", progress=0.9, best_progress=0.9, reward=0.0, time_s=1.0)
    first, second = report.variations
    missed = report.model_copy(update={"variations": (first.model_copy(update={"episode": short}), second)})
    assert "solved in the search; rounded as reported, motions solve " in missed.why_ended


def test_groups_of_the_design_move_together():
    group = ActuatorGroup(name="both", actuators=("pull_left", "pull_right"))
    report = probe(small_scene(), FarPushing(), groups=[group], candidates=16, variations=1, threads=1)
    assert [one.group for one in report.best.motion.groups] == ["both"]


def test_every_generation_is_told():
    told = []
    report = probe(small_scene(), FarPushing(), **QUICK, listen=told.append)
    assert [point.motions for point in told] == [16, 32, 48, 64]
    assert [point.progress for point in told] == sorted(point.progress for point in told)
    assert {(point.candidates, point.variations) for point in told} == {(64, len(report.variations))}
    assert told[-1].solved == 0


def test_numbers_out_of_range_are_one_sentence():
    with pytest.raises(UserError, match="use at least 16, 1 and 1"):
        probe(small_scene(), QuickPushing(), candidates=5)


def test_a_scene_of_another_task_is_refused():
    with pytest.raises(UserError, match="ground, lane missing"):
        probe(small_scene(), "flat_ground")


def test_stages_are_told_in_words():
    task = QuickPushing()
    assert task.stage_reached(0.2) == "begun, not yet at the button"
    assert task.stage_reached(0.55) == "at the button, not yet pressed"
    assert task.stage_reached(1.0) == "pressed, but success was not held"
    assert task.stage_reached(0.8, met=True) == "pressed, but success was not held"
    assert task.stage_reached(1.0, success=True) == "held success"
    assert replace(task).stages == task.stages


def test_with_a_goal_motions_are_tried_as_they_are_reported():
    scene = small_scene()
    task = goal_task(parse_goal('kind = "reach"\ntarget = "button"'), scene)
    player = _Player(TaskScene.of(scene, task), 2.0, 1)
    rows = player.space.sample("pull", 8, np.random.default_rng(0)) * 3.0
    tried = player.motions_of(rows)
    assert np.abs(np.stack([tried.first, tried.last])).max() <= 1.0
    for index in range(8):
        told = Motions.of([tried.motion(index, ["left", "right"])])
        for time_s in (0.0, 0.31, 1.7):
            assert told.at(time_s)[0] == pytest.approx(tried.at(time_s)[index], abs=0.0)


class LongPushing(FarPushing):
    """As hard, for as long as a robot travels."""

    time_limit_s = 60.0


class LongSidedPushing(SidedPushing):
    """Won at once, on one side or the other; otherwise it takes long."""

    time_limit_s = 60.0


@pytest.mark.parametrize(("task", "variations", "motions"), [(LongPushing(), 4, 32), (FarPushing(), 25, 16)])
def test_however_long_and_many_the_episodes_each_variation_is_searched(task, variations, motions):
    report = probe_scene(small_learning(task), candidates=motions, variations=variations, threads=1)
    assert (report.ended_by, report.motions) == ("candidates", motions)
    assert report.played_steps <= report.max_steps
    assert [one.episode.time_s for one in report.variations] == [task.time_limit_s] * variations


def test_in_long_episodes_motions_that_succeed_are_played_in_the_other_variations_too():
    report = probe_scene(small_learning(LongSidedPushing()), candidates=64, variations=3, threads=1)
    assert report.success_share == 1.0
    assert report.same_motion_share == pytest.approx(2 / 3)


def test_the_default_budget_grows_only_with_long_and_many_episodes():
    short, long = load_task("surface_adapting"), load_task("stairs")
    assert (short.time_limit_s, long.time_limit_s) == (15.0, 60.0)
    assert [budget_for(short, variations) for variations in (1, 2, 4, 8)] == [(128, 300_000)] * 3 + [(128, 600_000)]
    assert [budget_for(long, variations) for variations in (1, 2, 4)] == [(128, steps * 300_000) for steps in (1, 2, 4)]


def test_a_generation_of_four_motions_that_tries_those_of_two_other_variations_leaves_no_empty_part():
    scene = small_scene()
    task = goal_task(parse_goal('kind = "reach"\ntarget = "button"'), scene)
    player, rng = _Player(TaskScene.of(scene, task), 2.0, 1), np.random.default_rng(0)
    searches = [_Search(index, task.variation("development", index)) for index in range(3)]
    for search in searches:
        for kind in ("hold", "pull"):
            search.add(kind, player.space.sample(kind, 4, rng), rng.random(4), solved=False)
    tried = _refined(player.space, searches[0], searches, 4, rng)
    assert [len(player.motions_of(rows).first) for _, _, rows in tried] == [1, 1, 2]
