"""What came out of a study, one raw row for each design that was attempted. Every figure is computed from these."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from statistics import fmean

from pydantic import ConfigDict

from aidsr.core.artifacts import Artifact, Evaluation, ValidationReport
from aidsr.core.calls import Count, Usage
from aidsr.runs import DesignFolder, read_status
from aidsr.runs.files import JsonFile
from aidsr.studies.jobs import VERIFIED, exhausted_limits, training_folder_of
from aidsr.studies.study import Cell, Study


class DesignRow(Artifact):
    """One design of a study, whether it got anywhere or not."""

    model_config = ConfigDict(allow_inf_nan=False)

    arm: str
    task: str
    run: Count
    design: Count
    family: str = ""
    outcome: str = "failed"
    """As in outcome.json; "failed" where its run ended without it, "unfinished" where it is not done yet."""
    complete: bool = False
    """Whether nothing of it is missing: it has an outcome and, where that is "approved", its scene is
    verified and every policy judged."""
    verified: bool = False
    """Whether its final scene was validated separately."""
    stable: bool = False
    """Whether it was approved and its final scene passes the validator when it is validated separately."""
    seeds: Count = 0
    """Policies that the plan asks for; those that are not judged count as failed. `read_submission` fills it in
    where an earlier version left it out and one policy or none was asked for."""
    evaluations: tuple[Evaluation, ...] = ()
    """One for each policy that was judged."""
    steps: Count = 0
    """Control steps of all its trainings."""
    resumed: Count = 0
    """Policies whose training was killed while learning and resumed: not those of undisturbed trainings."""
    training_s: float = 0.0
    probe_progress: float | None = None
    usage: Usage = Usage()
    latency_s: float = 0.0
    iterations: Count = 0

    @property
    def valid(self) -> bool:
        """Whether most of the policies that the plan asks for are valid."""
        return self._most(each.valid for each in self.evaluations)

    @property
    def successful(self) -> bool:
        """Whether most of the policies that the plan asks for are successful."""
        return self._most(each.successful for each in self.evaluations)

    def wins(self, share: float) -> bool:
        """Return whether most of the policies that the plan asks for are valid and win this share of their episodes."""
        return self._most(each.valid and each.success_share >= share for each in self.evaluations)

    @property
    def policies(self) -> tuple[tuple[float, ...], ...]:
        """For each policy that the plan asks for, 1 or 0 for every held-out episode.

        All are 0 where it is not valid, and there is none where it is not judged.
        """
        judged = tuple(
            tuple(float(evaluation.valid and episode.ended == "succeeded") for episode in evaluation.episodes)
            for evaluation in self.evaluations
        )
        return (*judged, *[()] * (self.seeds - len(judged)))

    @property
    def episodes_share(self) -> float:
        """Share of held-out episodes won, mean over the policies that the plan asks for."""
        return fmean(fmean(policy or (0.0,)) for policy in self.policies or ((),))

    def _most(self, verdicts: Iterable[bool]) -> bool:
        return 2 * sum(verdicts) > len(self.policies)

    @cached_property
    def key(self) -> tuple[int, int]:
        """What pairs it with the same design of another arm."""
        return self.run, self.design


class Repair(Artifact):
    """A fault that was there in one iteration and gone in the next."""

    code: str
    changed: str
    """What had changed in between: concept, robot or placement."""


def read_outcomes(study: Study) -> tuple[DesignRow, ...]:
    """Return a row for every design the plan asks for, in its order."""
    return tuple(row for cell in study.cells for row in _rows_of(study, cell))


def paid_usd(study: Study, rows: Sequence[DesignRow]) -> float | None:
    """Return what a study has paid so far [USD], None where a price is unknown.

    An arm that continues the designs of another arm counts their calls as its own; they were paid once.
    """
    costs = {(row.arm, row.task, row.key): row.usage.cost_usd for row in rows}
    if None in costs.values():
        return None
    paid = 0.0
    for (arm, task, key), cost in costs.items():
        paid += (cost or 0.0) - ((costs.get((study.arm(arm).after, task, key)) or 0.0) if cost else 0.0)
    return paid


def _rows_of(study: Study, cell: Cell) -> Iterator[DesignRow]:
    expected, run = study.arm(cell.arm).config.concepts, study.run(cell)
    status = read_status(run) if run else None
    states = {design.number: design for design in status.designs} if status else {}
    for number in range(1, expected + 1):
        named = {"arm": cell.arm, "task": cell.task, "run": cell.number, "design": number, "seeds": study.plan.seeds}
        state = states.get(number)
        if run is None or status is None or state is None:
            missed = status is not None and status.state == "finished"
            yield DesignRow(**named, outcome="failed" if missed else "unfinished", complete=missed)
            continue
        folder = run.design(number)
        outcome = state.outcome.outcome if state.outcome else "unfinished"
        if outcome == "out_of_budget" and exhausted_limits(run):  # the study's limit, so it can resume
            outcome = "unfinished"
        verified = JsonFile(folder.path / VERIFIED, ValidationReport).read()
        evaluations = tuple(_evaluations(folder, study.plan.seeds))
        yield DesignRow(
            **named,
            family=state.family,
            outcome=outcome,
            complete=bool(verified and len(evaluations) == study.plan.seeds)
            if outcome == "approved"
            else outcome != "unfinished",
            verified=verified is not None,
            stable=bool(verified and verified.stable),
            evaluations=evaluations,
            steps=sum(int(result["steps"]) for result in _results(folder, study.plan.seeds)),
            resumed=sum(bool(result.get("resumed")) for result in _results(folder, study.plan.seeds)),
            training_s=sum(float(result["wall_s"]) for result in _results(folder, study.plan.seeds)),
            probe_progress=_probed(folder),
            usage=state.usage,
            latency_s=state.latency_s,
            iterations=state.iteration,
        )


def read_repairs(study: Study) -> tuple[Counter[str], list[Repair]]:
    """Return how often each fault stopped an iteration, and which were cured by the next.

    An iteration that was not validated cured nothing, nor did one whose robot alone was what is wrong with a scene.
    """
    seen, cured = Counter[str](), list[Repair]()
    for design, copied in _designs(study):
        before, of_scene = set[str](), False
        for iteration in design.iterations:
            scene = iteration.scene_report.read()
            report = scene or iteration.robot_report.read()
            if report is None:
                continue
            now = {fault.code for fault in report.errors}
            if iteration.number > copied:
                changed = _changed(iteration.concept.path.exists(), iteration.robot.xml.path.exists())
                gone = before - now if scene or not of_scene else ()
                cured += [Repair(code=code, changed=changed) for code in sorted(gone)]
                seen.update(now)
            before, of_scene = now, scene is not None
    return seen, cured


def count_repairs(study: Study) -> Counter[str]:
    """Return how often code put each kind of thing right in a robot, before anyone looked at it."""
    found = Counter[str]()
    for design, copied in _designs(study):
        for iteration in design.iterations[copied:]:
            repairs = iteration.repairs.read()
            found.update(repairs.counts if repairs else {})
    return found


def _designs(study: Study) -> Iterator[tuple[DesignFolder, int]]:
    """Yield every design, and how many of its iterations it took over from the arm that it continues."""
    for cell in study.cells:
        run, before = study.run(cell), study.before(cell)
        origin = study.run(before) if before else None
        for design in run.designs if run else ():
            yield design, len(origin.design(design.number).iterations) if origin else 0


def _changed(concept: bool, robot: bool) -> str:
    if concept:
        return "concept"
    return "robot" if robot else "placement"


def _evaluations(design: DesignFolder, seeds: int) -> Iterator[Evaluation]:
    for seed in range(seeds):
        found = JsonFile(training_folder_of(design, seed) / "evaluation.json", Evaluation).read()
        if found is not None:
            yield found


def _results(design: DesignFolder, seeds: int) -> Sequence[dict[str, float]]:
    files = (
        JsonFile(training_folder_of(design, seed) / "training.json", dict[str, object]).read() for seed in range(seeds)
    )
    return [found for found in files if found is not None]  # type: ignore[misc]


def _probed(design: DesignFolder) -> float | None:
    found = JsonFile(design.path / "probe.json", dict[str, object]).read()
    return float(found["progress"]) if found else None  # type: ignore[arg-type]
