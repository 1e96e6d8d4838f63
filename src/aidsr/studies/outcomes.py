"""Raw results of a study: one row for each attempted design, from which all aggregated results are computed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from statistics import fmean
from typing import Any

from pydantic import ConfigDict

from aidsr.core.artifacts import Artifact, Evaluation, ValidationReport
from aidsr.core.calls import Count, Usage
from aidsr.runs import DesignFolder, read_status
from aidsr.runs.files import JsonFile
from aidsr.runs.trainings import Training
from aidsr.studies.jobs import VERIFIED, exhausted_limits
from aidsr.studies.planned import planned_seeds, read_probe, training_folder_of, unplanned_probe
from aidsr.studies.study import Cell, Study


class DesignRow(Artifact):
    """Results of one design of a study, successful or not."""

    model_config = ConfigDict(allow_inf_nan=False)

    arm: str
    task: str
    run: Count
    design: Count
    family: str = ""
    outcome: str = "failed"
    """Outcome as in outcome.json; "failed" if the run ended without this design, "unfinished" before it has ended."""
    complete: bool = False
    """Whether all its results exist: it has an outcome and, if that is "approved", its scene is verified and all
    its policies are evaluated."""
    verified: bool = False
    """Whether its final scene was validated separately."""
    stable: bool = False
    """Whether it was approved and its final scene passes the validator in a separate validation."""
    seeds: Count = 0
    """Number of policies in the plan; those that are not evaluated count as failed. `read_submission` fills it in
    where an earlier version did not write it and the plan has at most one policy per design."""
    evaluations: tuple[Evaluation, ...] = ()
    """Evaluation of each policy that was evaluated."""
    steps: Count = 0
    """Control steps of all its trainings together."""
    resumed: Count = 0
    """Number of policies whose training was interrupted and resumed, which changes their result."""
    motions: Count = 0
    """Number of successful policies that are an open-loop motion of the probe, which learning did not beat."""
    training_s: float = 0.0
    """Wall time of all its trainings together."""
    probe_progress: float | None = None
    usage: Usage = Usage()
    latency_s: float = 0.0
    iterations: Count = 0

    @property
    def valid(self) -> bool:
        """Whether most of the planned policies are valid."""
        return self._most(each.valid for each in self.evaluations)

    @property
    def successful(self) -> bool:
        """Whether most of the planned policies are successful."""
        return self._most(each.successful for each in self.evaluations)

    @property
    def won_by_mean_action(self) -> int:
        """Number of successful policies that are not needed, since their constant mean action wins often enough."""
        return sum(
            bool(each.successful and each.mean_action and each.mean_action.suffices) for each in self.evaluations
        )

    def wins(self, share: float) -> bool:
        """Return whether most of the planned policies are valid with at least this success rate (0 to 1)."""
        return self._most(each.valid and each.success_share >= share for each in self.evaluations)

    @property
    def policies(self) -> tuple[tuple[float, ...], ...]:
        """Success (1) or failure (0) in every held-out episode, for each planned policy.

        All episodes of an invalid policy are 0; a policy that is not evaluated has no episodes.
        """
        judged = tuple(
            tuple(float(evaluation.valid and episode.ended == "succeeded") for episode in evaluation.episodes)
            for evaluation in self.evaluations
        )
        return (*judged, *[()] * (self.seeds - len(judged)))

    @property
    def episodes_share(self) -> float:
        """Success rate in held-out episodes, mean over the planned policies."""
        return fmean(fmean(policy or (0.0,)) for policy in self.policies or ((),))

    def _most(self, verdicts: Iterable[bool]) -> bool:
        return 2 * sum(verdicts) > len(self.policies)

    @cached_property
    def key(self) -> tuple[int, int]:
        """Key that pairs it with the same design of another arm: number of the run and of the design."""
        return self.run, self.design


class Repair(Artifact):
    """A fault that one iteration had and the next did not."""

    code: str
    """Code of the fault."""
    changed: str
    """What the next iteration changed: "concept", "robot" or "placement"."""


def read_outcomes(study: Study) -> tuple[DesignRow, ...]:
    """Return a row for every design of the plan, in the plan's order."""
    return tuple(row for cell in study.cells for row in _rows_of(study, cell))


def paid_usd(study: Study, rows: Sequence[DesignRow]) -> float | None:
    """Return the cost of a study so far [USD], or None where a price is unknown.

    The rows of an arm that continues another arm's designs include the cost of that arm's calls; it is counted once.
    """
    costs = {(row.arm, row.task, row.key): row.usage.cost_usd for row in rows}
    if None in costs.values():
        return None
    paid = 0.0
    for (arm, task, key), cost in costs.items():
        paid += (cost or 0.0) - ((costs.get((study.arm(arm).after, task, key)) or 0.0) if cost else 0.0)
    return paid


def evaluated_by(rows: Iterable[DesignRow]) -> Counter[str]:
    """Return the number of policies that each version of the software evaluated: its commit and packages, in words."""
    return Counter(
        ", ".join(
            [f"commit {each.commit}" if each.commit else "an unknown commit"]
            + [f"{package} {version}" for package, version in each.versions.items()]
        )
        for row in rows
        for each in row.evaluations
    )


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
        if outcome == "out_of_budget" and exhausted_limits(run):  # stopped by the study's limit, so it can resume
            outcome = "unfinished"
        verified = JsonFile(folder.path / VERIFIED, ValidationReport).read()
        planned = planned_seeds(study, cell, folder)
        judged, results = dict(_evaluations(folder, planned)), _results(folder, planned)
        yield DesignRow(
            **named,
            family=state.family,
            outcome=outcome,
            complete=bool(verified and len(judged) == study.plan.seeds)
            if outcome == "approved"
            else outcome != "unfinished",
            verified=verified is not None,
            stable=bool(verified and verified.stable),
            evaluations=tuple(judged.values()),
            steps=sum(int(result["steps"]) for result in results),
            resumed=sum(bool(result.get("resumed")) for result in results),
            motions=sum(
                each.successful and Training(training_folder_of(folder, seed)).plays_the_motion
                for seed, each in judged.items()
            ),
            training_s=sum(float(result["wall_s"]) for result in results),
            probe_progress=_probed(study, cell, folder),
            usage=state.usage,
            latency_s=state.latency_s,
            iterations=state.iteration,
        )


def read_repairs(study: Study) -> tuple[Counter[str], list[Repair]]:
    """Return how often each fault occurred in an iteration, and the faults that were gone in the next iteration.

    Iterations without a report, or copied from another arm, are not counted. After an iteration with a report on the
    scene, one with a report on the robot alone does not count as repairing faults, as its scene was not validated. Nor
    does one whose document does not load: nothing else was validated there.
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
            if any(fault.layer == "load" for fault in report.errors):
                if iteration.number > copied:
                    seen.update(now)
                before |= now
                continue
            if iteration.number > copied:
                changed = _changed(iteration.concept.path.exists(), iteration.robot.xml.path.exists())
                gone = before - now if scene or not of_scene else ()
                cured += [Repair(code=code, changed=changed) for code in sorted(gone)]
                seen.update(now)
            before, of_scene = now, scene is not None
    return seen, cured


def count_repairs(study: Study) -> Counter[str]:
    """Return how often each kind of automatic fix was applied to a robot before it was validated."""
    found = Counter[str]()
    for design, copied in _designs(study):
        for iteration in design.iterations[copied:]:
            repairs = iteration.repairs.read()
            found.update(repairs.counts if repairs else {})
    return found


def _designs(study: Study) -> Iterator[tuple[DesignFolder, int]]:
    """Yield every design, and the number of its iterations that were copied from the arm that it continues."""
    for cell in study.cells:
        run, continued = study.run(cell), study.continued_cell(cell)
        origin = study.run(continued) if continued else None
        for design in run.designs if run else ():
            yield design, len(origin.design(design.number).iterations) if origin else 0


def _changed(concept: bool, robot: bool) -> str:
    if concept:
        return "concept"
    return "robot" if robot else "placement"


def _evaluations(design: DesignFolder, seeds: Iterable[int]) -> Iterator[tuple[int, Evaluation]]:
    """Yield the seed and the evaluation of each policy that was evaluated."""
    for seed in seeds:
        found = Training(training_folder_of(design, seed)).evaluation.read()
        if found is not None:
            yield seed, found


def _results(design: DesignFolder, seeds: Iterable[int]) -> Sequence[dict[str, Any]]:
    files = (Training(training_folder_of(design, seed)).result.read() for seed in seeds)
    return [found for found in files if found is not None]


def _probed(study: Study, cell: Cell, design: DesignFolder) -> float | None:
    found = read_probe(design)
    return float(found["progress"]) if found and not unplanned_probe(study, cell, design) else None
