"""The verdict on a trained policy: checks, held-out and perturbed episodes, videos and recorded motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from nicegui import ui

from aidsr.apps.web.addresses import file_address
from aidsr.apps.web.live import as_action, show_error, working
from aidsr.apps.web.recorded_episodes import Stage, record, replay_name, variation_of
from aidsr.apps.web.site import Site
from aidsr.apps.web.view3d import Episode
from aidsr.apps.web.widgets import box, button, fact, text
from aidsr.core.artifacts import EpisodeResult, Evaluation, PerturbedEpisodes
from aidsr.core.ends import evaluation_in_words
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_check, format_share
from aidsr.runs import Run
from aidsr.runs.trainings import Training

Play = Callable[[int, ui.button], None]
"""Function that plays a held-out variation; the pressed button shows a loading state while it takes seconds."""


@dataclass(frozen=True)
class Judged:
    """Result of an evaluated training."""

    verdict: Evaluation | None
    films: tuple[str, ...]
    """Addresses of the videos."""
    motions: tuple[Path, ...]
    resumed: bool
    """Whether it was killed while learning and then resumed."""


def read_judged(run: Run, training: Training) -> Judged:
    """Return the result of an evaluated training; without a verdict where it is not evaluated."""
    films = tuple(file_address(run.name, film.path.relative_to(run.path).as_posix()) for film in training.films)
    motions = tuple(motion.path for motion in training.motions)
    return Judged(training.evaluation.read(), films, motions, resumed=training.resumed > 0)


def draw_judged(site: Site, training: Training, stage: Stage, shown: Judged) -> None:
    """Show the result of an evaluated training.

    Args:
        site: The site.
        training: The training.
        stage: View that plays recorded episodes.
        shown: Its result.
    """
    if shown.verdict is None:
        return
    can_replay = training.policy.exists()
    play = partial(_play, site, training, stage) if can_replay else None
    with box("stack"):
        _verdict(shown.verdict, play)
        if shown.resumed:
            text("This training was interrupted and resumed: an uninterrupted one would give another policy.", "wait")
        _films(shown.films)
        _motions(training, shown.motions, stage, play)


def _play(site: Site, training: Training, stage: Stage, variation: int, pressed: ui.button) -> None:
    """Record a held-out episode, then play it in the view."""

    def then(episode: Episode) -> None:
        try:
            stage.play(episode)
        except UserError as error:
            show_error(error)

    working(pressed, partial(record, site, training, variation), then)


def _verdict(verdict: Evaluation, play: Play | None) -> None:
    episodes = verdict.episodes
    with box("facts"):
        fact("mean best progress", f"{sum(one.best_progress for one in episodes) / len(episodes):.2f}")
        fact("valid", "yes" if verdict.valid else "no")
        fact("successful", "yes" if verdict.successful else "no")
    for line in evaluation_in_words(verdict):
        text(line, "small", "p")
    text("Plausibility checks", "label")
    with box("stack"):
        for check in verdict.checks:
            with box("check"):
                held = "" if check.measured is None and check.passed else "yes" if check.passed else "no"
                text({"": "not measured", "yes": "passed", "no": "failed"}[held], f"badge {held}")
                with box("stack tight grow"):
                    text(check.message, "small", "p")
                    measured = f": {format_check(check)}" if check.measured is not None else ""
                    text(check.name.replace("_", " ") + measured, "small soft numbers")
    if verdict.perturbed:
        text("Perturbed scenes", "label")
        _perturbed(verdict.perturbed)
    with ui.expansion(f"All {len(episodes)} held-out episodes").props("dense dense-toggle").classes("full"):
        _episodes(episodes, play)


def _episodes(episodes: tuple[EpisodeResult, ...], play: Play | None) -> None:
    with box("scroll", tabindex="0", role="region", aria_label="held-out episodes"), box("list plain", "table"):
        with box(tag="thead"), box(tag="tr"):
            for title in ("variation", "result", "final progress", "best progress", "reward", "time"):
                text(title, "" if title in ("variation", "result") else "num", "th")
            if play is not None:
                text("replay", "unseen", "th")
        with box(tag="tbody"):
            for one in episodes:
                with box(tag="tr"):
                    text(str(one.variation), "", "td")
                    text(one.ended.replace("_", " "), "good" if one.ended == "succeeded" else "", "td")
                    for number in (one.progress, one.best_progress, one.reward):
                        text(f"{number:.2f}", "num", "td")
                    text(f"{one.time_s:.2f} s", "num", "td")
                    if play is not None:
                        with box(tag="td"):
                            _replay_button("", one.variation, play, f"Replay episode {one.variation}")


def _replay_button(title: str, variation: int, play: Play, hint: str = "") -> None:
    pressed = button(title, lambda: play(variation, pressed), "bare" if hint else "quiet", "play_arrow", hint)


def _perturbed(perturbed: tuple[PerturbedEpisodes, ...]) -> None:
    with box("scroll", tabindex="0", role="region", aria_label="perturbed episodes"), box("list plain", "table"):
        with box(tag="thead"), box(tag="tr"):
            for title in ("perturbation", "successes", "95 % interval", "successes kept"):
                text(title, "" if title == "perturbation" else "num", "th")
        with box(tag="tbody"):
            for one in perturbed:
                low, high = one.success_interval
                kept = "–" if one.kept_share is None else format_share(one.kept_share)
                with box(tag="tr"):
                    text(one.summary, "", "td")
                    text(f"{len(one.succeeded)} of {one.episodes}", "num", "td")
                    text(f"{format_share(low)} to {format_share(high)}", "num", "td")
                    text(kept, "num", "td")


def _films(addresses: tuple[str, ...]) -> None:
    if not addresses:
        text("There is no video: rendering requires OpenGL on the machine that trains.", "small soft")
        return
    with box("columns"):
        for address in addresses:
            with box("stack tight", "figure"):
                name = f"video of the {PurePosixPath(address).stem} held-out episode"
                film = {"src": address, "controls": "", "muted": "", "autoplay": "", "preload": "auto"}
                with box("film", "video", aria_label=name, **film):
                    pass
                with box("small soft"):
                    text(f"the {PurePosixPath(address).stem} held-out episode")
                    text("", "pace")


def _motions(training: Training, motions: tuple[Path, ...], stage: Stage, play: Play | None) -> None:
    if not motions:
        return
    with box("row"):
        text("In the 3-D view:", "small soft")
        for motion in motions:
            variation = variation_of(motion)
            if play is not None and variation is not None:
                _replay_button(f"Replay {motion.stem}", variation, play)
            else:
                name = replay_name(training.number, motion)
                button(f"Replay {motion.stem}", as_action(partial(stage.replay, name)), "quiet", "play_arrow")
