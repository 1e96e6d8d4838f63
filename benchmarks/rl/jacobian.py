"""Compare dense and sparse constraint Jacobians: time of a physics step and final positions, for built-in bodies.

    python benchmarks/rl/jacobian.py --seeds 100 101 102

In each round both forms run one after the other, each on one thread, with the same random controls. Processor time is
measured, because other work on the machine affects it little. Results go to jacobian.md beside this file.
"""

from __future__ import annotations

import argparse
import copy
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch

from aidsr.core.artifacts import Concept
from aidsr.core.errors import MjcfError
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.sim.jacobian import choose_jacobian
from aidsr.tasks import BENCHMARK_VERSION, load_task, task_names
from aidsr.teams import rules as builtin

SIMULATIONS, CONTROL_STEPS, ROUNDS = 8, 12, 5
_FORMS = {"dense": mujoco.mjtJacobian.mjJAC_DENSE, "sparse": mujoco.mjtJacobian.mjJAC_SPARSE}


@dataclass(frozen=True)
class Row:
    """Measurements of one body in one task."""

    task: str
    family: str
    dof: int
    longest_tree: int
    """Degrees of freedom of the largest kinematic tree."""
    dense_us: float
    """Processor time of a physics step with the dense form [us], median of the rounds."""
    sparse_us: float
    ratio: float
    """Dense time divided by sparse time, median of the ratios within a round."""
    differs: float
    """Largest difference of a coordinate of `qpos` after all control steps."""
    chosen: str
    """Form that `choose_jacobian` chooses."""


def bodies(seeds: Sequence[int]) -> Iterator[tuple[str, Concept, TaskScene]]:
    """Yield task, concept and scene of built-in bodies for each task, one per family and number of dofs."""
    seen = set()
    for name in task_names():
        task = load_task(name)
        brief = task.brief()
        for seed in seeds:
            team = builtin.team(seed)
            for concept in team.designer.propose(brief, 3):
                robot = team.coder.write(brief, concept)
                try:
                    placement = team.integrator.place(brief, concept, robot)
                    scene = assemble(robot, brief.environment, placement, task.sensors)
                except MjcfError:  # the design loop would repair it
                    continue
                found = TaskScene.of(scene.mjcf, task, groups=robot.actuator_groups)
                if (name, concept.family, found.model.nv) not in seen:
                    seen.add((name, concept.family, found.model.nv))
                    yield name, concept, found


def measure(name: str, concept: Concept, scene: TaskScene) -> Row:
    """Measure a scene with both forms."""
    times: dict[str, list[float]] = {form: [] for form in _FORMS}
    ends = {}
    for _ in range(ROUNDS):
        for form, jacobian in _FORMS.items():
            spent, ends[form] = _play(scene, jacobian)
            times[form].append(spent)
    chosen = copy.copy(scene.model)
    choose_jacobian(chosen)
    return Row(
        name,
        concept.family,
        scene.model.nv,
        max(scene.model.tree_dofnum, default=0),
        statistics.median(times["dense"]),
        statistics.median(times["sparse"]),
        statistics.median(dense / sparse for dense, sparse in zip(*times.values(), strict=True)),
        float(np.abs(ends["dense"] - ends["sparse"]).max()),
        "sparse" if chosen.opt.jacobian == mujoco.mjtJacobian.mjJAC_SPARSE else "dense",
    )


def _play(scene: TaskScene, jacobian: mujoco.mjtJacobian) -> tuple[float, np.ndarray]:
    """Return the processor time of a physics step [us], and `qpos` of all simulations at the end."""
    model = copy.copy(scene.model)
    model.opt.jacobian = jacobian
    batch = Batch(model, nsim=SIMULATIONS, nthread=1)
    substeps = round(scene.task.control_dt_s / model.opt.timestep)
    rng, ctrl, actions = np.random.default_rng(0), batch.bind("ctrl"), scene.actions
    began = time.process_time()
    for _ in range(CONTROL_STEPS):
        ctrl[:, list(actions.actuators)] = actions.ctrl(rng.uniform(-1.0, 1.0, (SIMULATIONS, actions.size)))
        batch.rollout(substeps)
    spent = time.process_time() - began
    return 1e6 * spent / (CONTROL_STEPS * SIMULATIONS * substeps), batch.bind("qpos").copy()


def page(rows: Sequence[Row], seeds: Sequence[int]) -> str:
    """Return the measurements as Markdown."""
    taken = [row for row in rows if row.chosen == "sparse"]
    others = [row for row in rows if row.chosen == "dense"]
    lines = [
        "# Sparse or dense\n",
        f"Made by `python benchmarks/rl/jacobian.py --seeds {' '.join(map(str, seeds))}`, MuJoCo {version('mujoco')}, "
        f"version {BENCHMARK_VERSION} of the benchmark. {len(rows)} bodies of the built-in team, {ROUNDS} rounds of "
        f"{SIMULATIONS} simulations over {CONTROL_STEPS} control steps with random controls; medians. The limit in "
        "`aidsr.sim.jacobian` was chosen with bodies like these in view: the team makes each family in a few sizes.\n",
        _share("Where sparse is chosen", [row.ratio for row in taken], "faster"),
        _share("Where it is not, sparse had been", [1 / row.ratio for row in others], "slower"),
        f"The two forms end apart by at most {max((row.differs for row in rows), default=0.0):.0e} in any coordinate "
        "(m or rad), which is rounding and what contacts make of it.\n",
        "| task | family | dof | of the largest tree | dense | sparse | dense : sparse | differs | chosen |",
        "|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {row.task} | {row.family} | {row.dof} | {row.longest_tree} | {row.dense_us:.1f} us "
            f"| {row.sparse_us:.1f} us | {row.ratio:.2f} | {row.differs:.0e} | {row.chosen} |"
            for row in rows
        ),
    ]
    return "\n".join(lines) + "\n"


def _share(where: str, ratios: Sequence[float], word: str) -> str:
    if not ratios:
        return f"{where}: no body.\n"
    return (
        f"{where}: {len(ratios)} bodies, {statistics.median(ratios):.2f} x {word} in the median "
        f"({min(ratios):.2f} to {max(ratios):.2f}).\n"
    )


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[100, 101, 102])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".md"))
    asked = parser.parse_args()
    rows = [measure(*body) for body in bodies(asked.seeds)]
    asked.out.write_text(page(rows, asked.seeds), encoding="utf-8")


if __name__ == "__main__":
    main()
