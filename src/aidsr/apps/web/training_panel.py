"""Train a design, follow its learning curve, and judge whether its motion is plausible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from nicegui import ui

from aidsr.apps.web.curve import curve_svg
from aidsr.apps.web.live import as_action, live
from aidsr.apps.web.recorded_episodes import Stage
from aidsr.apps.web.site import Site
from aidsr.apps.web.study_runs import left_to_study
from aidsr.apps.web.training_form import continues, training_form
from aidsr.apps.web.verdict_panel import draw_judged, read_judged
from aidsr.apps.web.widgets import badge, box, button, fact, long_text, notice, stop_button, text
from aidsr.core.artifacts import Evaluation
from aidsr.core.formatting import format_duration, format_share, format_time_left
from aidsr.core.progress_lines import INTERRUPTED
from aidsr.learn.rl.recipe import is_hopeless
from aidsr.runs import DesignFolder, Run
from aidsr.runs.trainings import CurveRow, Inspection, Training, read_curve, trainings_of, without_tests

_DOING = {
    "learning": "Training a policy.",
    "evaluating": "Evaluating the policy.",
    "judged": "Rendering videos, or repeating the evaluation.",
}


@dataclass(frozen=True)
class _Learning:
    """Progress of a training."""

    steps: int
    seed: int
    curve: tuple[CurveRow, ...]
    test: CurveRow | None
    """Test of the final policy on new development episodes, which is no point of the learning curve."""
    state: str
    """State of a training without a verdict: running, evaluating, stopped, or not evaluated."""
    verdict: Evaluation | None
    is_hopeless: bool
    """Whether it is learning and unlikely to succeed any more."""
    begins_with_script: bool = False


@dataclass(frozen=True)
class _State:
    approved: bool
    doing: str
    """Current work of a process on the design, in words; empty where no process is at work."""
    stoppable: bool
    """Whether that process was started by the web app."""
    output_tail: str
    stopped: str = ""
    """Where the last training was stopped, in words; empty if it was not, or no training was started here."""
    continues: bool = False
    """Whether the last command of the web app continues that training."""
    is_stopping: bool = False


def training_panel(site: Site, run: Run, design: DesignFolder, stage: Stage) -> None:
    """Show the trainings of an approved design, and a form that starts one.

    Args:
        site: The site.
        run: The run of the design.
        design: The design.
        stage: View that plays recorded episodes.
    """
    with box("stack wide"):
        live(lambda: _state(site, run, design), lambda state: _draw(site, run, design, state))
        live(lambda: tuple(reversed(trainings_of(design))), partial(_draw_trainings, site, run, design, stage))


def _state(site: Site, run: Run, design: DesignFolder) -> _State:
    name, trainings = site.training_name(run, design.number), trainings_of(design)
    alive = site.processes.is_alive(name)
    at_work = [training for training in trainings if training.at_work]
    doing = _DOING[at_work[-1].stage] if at_work else ""
    if alive and not at_work:  # between two of its steps, or on a system without file locks
        learning = not trainings or any(training.stage == "learning" for training in trainings)
        doing = _DOING["learning" if learning else "evaluating"]
    if (told := site.processes.progress(name) if alive else None) and doing != _DOING["learning"]:
        doing = f"{doing} {told.doing[0].upper()}{told.doing[1:]}."
    output_tail = "" if alive or _has_new_verdict(site, name, trainings) else site.processes.output_tail(name)
    command = site.processes.command(name)
    stopped = "" if doing else _stopped(command, trainings)
    if stopped and INTERRUPTED in output_tail:
        output_tail = ""  # that it was stopped is said already
    is_stopping = site.processes.is_stopping(name)
    own = bool(stopped) and _taken_up(site, name, trainings[-1]) and continues(command, trainings[-1])
    return _State(design.final_scene.path.exists(), doing, alive, output_tail, stopped, own, is_stopping)


def _stopped(command: Sequence[str], trainings: Sequence[Training]) -> str:
    """Return where the last training was stopped, if a training was started here before; else an empty text."""
    if not command or not trainings or trainings[-1].evaluation.path.exists():
        return ""
    last = trainings[-1]
    if last.result.path.exists():
        return f"Training {last.number} was stopped before its evaluation had ended."
    learned, _ = without_tests(last, read_curve(last))
    steps = int((last.config.read() or {}).get("steps", 0))
    where = f"at {_steps_in_words(learned[-1].steps, steps)} steps" if learned else "before its first steps"
    return f"Training {last.number} was stopped {where}. Its progress is kept."


def _has_new_verdict(site: Site, name: str, trainings: tuple[Training, ...]) -> bool:
    """Whether the last process wrote a verdict; if not, it failed or had nothing to train, and its output says so."""
    verdict = trainings[-1].evaluation.path if trainings else None
    return verdict is not None and verdict.exists() and verdict.stat().st_mtime >= site.processes.started_s(name)


def _learning(site: Site, run: Run, design: DesignFolder, training: Training) -> _Learning:
    config, verdict = training.config.read() or {}, training.evaluation.read()
    working = _is_running(site, site.training_name(run, design.number), training)
    if training.stage == "learning":
        state = "running" if working else "stopped"
    else:
        state = "evaluating" if working else "not evaluated"
    steps, (curve, test) = int(config.get("steps", 0)), without_tests(training, read_curve(training))
    recipe, has_succeeded = config.get("recipe"), any(row.success_share for row in curve)
    algorithm = str(recipe.get("algorithm")) if isinstance(recipe, dict) else ""
    done = curve[-1].steps if curve else 0
    hopeless = state == "running" and is_hopeless(algorithm, has_succeeded=has_succeeded, steps=done, budget=steps)
    script = bool(recipe.get("script")) if isinstance(recipe, dict) else False
    return _Learning(steps, int(config.get("seed", 0)), curve, test, state, verdict, hopeless, script)


def _is_running(site: Site, name: str, training: Training) -> bool:
    """Whether a process works on this training of a design: one started elsewhere, or the design's own process."""
    if training.at_work:
        return True
    return site.processes.is_alive(name) and (_taken_up(site, name, training) or training.result.path.exists())


def _taken_up(site: Site, name: str, training: Training) -> bool:
    """Whether the process of that name, or a later one, has begun or resumed a training."""
    events = training.path / "events.jsonl"
    return events.exists() and events.stat().st_mtime >= site.processes.started_s(name)


def _draw(site: Site, run: Run, design: DesignFolder, state: _State) -> None:
    if not state.approved:
        text("A design can be trained once it is approved.", "soft")
        return
    name = site.training_name(run, design.number)
    with box("stack wide"):
        if state.doing:
            with box("notice", role="status"), box("row apart"):
                text(state.doing)
                if state.stoppable:
                    act = as_action(lambda: site.processes.stop(name))
                    stop_button(act, is_stopping=state.is_stopping, hint="The training progress is kept")
                else:
                    text(
                        "Started by another process (a study or a terminal); stop it there.",
                        "small soft",
                    )
        elif not left_to_study(site, run, "Its policies are trained by the plan of the study."):
            if state.stopped:
                with box("notice wait", role="status"), box("row apart"):
                    text(state.stopped)
                    if state.continues:
                        again = as_action(lambda: site.processes.start(name, site.processes.command(name)))
                        hint = "With the settings it was started with"
                        button("Continue training", again, "primary", "play_arrow", hint)
                    else:
                        text("It was not started here last; the command that started it continues it.", "small soft")
            training_form(site, run, design, name, is_first=not state.continues)
            if state.output_tail:
                text("Output of the last training:", "label")
                long_text(state.output_tail, "last output", "last")


def _draw_trainings(site: Site, run: Run, design: DesignFolder, stage: Stage, trainings: tuple[Training, ...]) -> None:
    """Show trainings; each part is redrawn separately, so that no click is lost while a curve grows."""
    with box("stack wide"):
        for training in trainings:
            with box("sheet stack", "article"):
                live(partial(_learning, site, run, design, training), partial(_draw_learning, training))
                live(partial(read_judged, run, training), partial(draw_judged, site, training, stage))
                live(partial(_read_inspection, training), partial(_inspection, training))


def _draw_learning(training: Training, shown: _Learning) -> None:
    with box("stack"):
        with box("row apart"):
            text(f"Training {training.number}", tag="h2")
            if shown.verdict:
                badge("successful" if shown.verdict.successful else "valid" if shown.verdict.valid else "not valid")
            else:
                badge(shown.state)
        last = shown.curve[-1] if shown.curve else None
        success, progress = (last.success_share, last.progress) if last else (None, None)
        with box("facts"):
            if shown.verdict:
                won = sum(episode.ended == "succeeded" for episode in shown.verdict.episodes)
                fact("held-out success", f"{won} of {len(shown.verdict.episodes)}")
            fact("steps", _steps_in_words(last.steps if last else 0, shown.steps))
            fact("training success", "–" if success is None else format_share(success))
            fact("progress", "–" if progress is None else f"{progress:.2f}")
            fact("speed", f"{last.steps_per_s:.0f} steps/s" if last else "–")
            fact("training time", format_duration(last.wall_s) if last else "–")
            if shown.state == "running" and last:
                left = format_time_left(shown.steps - last.steps, last.steps_per_s)
                fact("time", left if last.steps < shown.steps else "testing the policy")
            fact("seed", str(shown.seed))
            if shown.begins_with_script:
                fact("starts from", "a motion script")
        if shown.is_hopeless:
            text("No episode has succeeded so far. Such trainings rarely succeed later; check the robot.", "wait")
        ui.html(curve_svg(shown.curve, shown.steps), sanitize=False).classes("full")
        with box("row small"):
            text("━ success", "accent")
            text("━ progress", "wait")
        if shown.test is not None and shown.test.success_share is not None:
            text(
                "Test of the kept policy after learning, in new development episodes without noise: "
                f"{format_share(shown.test.success_share)} succeeded, progress {shown.test.progress or 0.0:.2f}.",
                "small",
                "p",
            )


def _steps_in_words(done: int, asked: int) -> str:
    """Return the steps made and requested, in words; the last round is completed, so it may be more than requested."""
    return f"{done:,} of {asked:,}" if done <= asked else f"{done:,} (requested: {asked:,})"


def _read_inspection(training: Training) -> tuple[bool, Inspection | None]:
    return training.evaluation.path.exists(), training.inspection.read()


def _inspection(training: Training, read: tuple[bool, Inspection | None]) -> None:
    judged, inspected = read
    if not judged:
        return
    words = {"text": inspected.text if inspected else ""}

    def inspect(*, plausible: bool) -> None:
        training.inspect(Inspection(plausible=plausible, text=str(words["text"] or "").strip()))

    with box("stack tight"):
        text("Your inspection: is the motion plausible for a continuum robot?", "label")
        if inspected:
            verdict = "confirmed" if inspected.plausible else "rejected"
            notice(f"You {verdict} the motion. {inspected.text}".strip(), "good" if inspected.plausible else "bad")
        with box("row"):
            field = ui.input("Reason (optional)").props("outlined dense").classes("grow").bind_value(words, "text")
            field.props["maxlength"] = 1000
            button("Plausible", as_action(lambda: inspect(plausible=True)), "quiet", "check")
            button("Not plausible", as_action(lambda: inspect(plausible=False)), "quiet", "close")
