"""Time one validation, beside a plain Python loop over `mj_step` that runs the same tests and records the same things.

python -m benchmarks.validator.speed
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from benchmarks.validator.corpus.physique import Physique
from benchmarks.validator.corpus.writers.hinges import HingeArms
from mujoco.batch import Batch

from aidsr.sim.compiling import load_mjcf
from aidsr.sim.structure import read_structure
from aidsr.validation import protocol, validate
from aidsr.validation.examination import examine_text
from aidsr.validation.standing import stand

__all__ = ["main"]

_HERE = Path(__file__).parent
_TARGETS = {"validation_s": 0.5, "times_faster": 8.0, "physics_share": 0.85}


@dataclass(frozen=True)
class Round:
    """One run of each, one after the other, so that other work on the machine hits all of them alike.

    Attributes:
        validation_s: `validate` in a warm worker.
        inside_s: The same function in this process.
        physics_s: Of that, inside MuJoCo's native rollout.
        plain_s: The plain loop.
        bare_s: The plain loop without recording: what its steps alone take.
    """

    validation_s: float
    inside_s: float
    physics_s: float
    plain_s: float
    bare_s: float

    @property
    def times_faster(self) -> float:
        """How many times as long the plain loop takes as the validation in a warm worker."""
        return self.plain_s / self.validation_s

    @property
    def physics_share(self) -> float:
        """Share of a validation that is spent stepping."""
        return self.physics_s / self.inside_s


def speed_arm() -> str:
    """Return the robot that is timed: 12 segments, universal joints, 4 tendons, 0.3 m."""
    limb = Physique(length_m=0.3, segments=12, mass_kg=0.1, radius_m=0.02, sag=0.8, damping_ratio=0.3, bend_rad=1.6)
    return HingeArms(limb).document()


def plain_loop(simulations: Sequence[tuple[mujoco.MjModel, Any, Any, int]], *, record: bool = True) -> int:
    """Run the same simulations one after the other; return the number of steps.

    Every step it keeps sensors, state and contacts, as a validator written without batches has to.
    """
    steps = 0
    for model, state, ctrl, frame_steps in simulations:
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        kept: list[tuple[Any, ...]] = []
        for command in ctrl:
            data.ctrl[:] = command
            for _ in range(frame_steps):
                mujoco.mj_step(model, data)
                steps += 1
                if record:
                    kept.append(_look(data))
    return steps


def _look(data: mujoco.MjData) -> tuple[Any, ...]:
    contacts = [(contact.geom1, contact.geom2, contact.dist) for contact in data.contact]
    return (
        data.time,
        data.qpos.copy(),
        data.qvel.copy(),
        data.sensordata.copy(),
        data.xipos.copy(),
        data.site_xpos.copy(),
        data.ten_length.copy(),
        data.actuator_force.copy(),
        contacts,
    )


def battery_of(mjcf: str) -> list[tuple[mujoco.MjModel, Any, Any, int]]:
    """Return the simulations that a validation runs, by looking over its shoulder."""
    kept: list[tuple[mujoco.MjModel, Any, Any, int]] = []
    simulate = protocol.simulate

    def listening(simulations: Any, *, frame_steps: int, **other: Any) -> Any:
        kept.extend((each.model, each.state, each.ctrl, frame_steps) for each in simulations)
        return simulate(simulations, frame_steps=frame_steps, **other)

    loaded = load_mjcf(mjcf)
    model = stand(loaded, "auto", None).model
    protocol.simulate = listening
    try:
        protocol.gather_evidence(model, read_structure(model))
    finally:
        protocol.simulate = simulate
    return kept


@contextmanager
def timed_physics() -> Iterator[list[float]]:
    """Collect how long each native rollout takes."""
    spent: list[float] = []
    rollout = Batch.rollout

    def timed(self: Batch, *arguments: Any, **named: Any) -> Any:
        begin = time.perf_counter()
        try:
            return rollout(self, *arguments, **named)
        finally:
            spent.append(time.perf_counter() - begin)

    Batch.rollout = timed
    try:
        yield spent
    finally:
        Batch.rollout = rollout


def run_round(mjcf: str, simulations: Sequence[tuple[mujoco.MjModel, Any, Any, int]]) -> Round:
    """Time everything once."""
    validation_s = _seconds(lambda: validate(mjcf))
    with timed_physics() as spent:
        inside_s = _seconds(lambda: examine_text(mjcf))
    plain_s = _seconds(lambda: plain_loop(simulations))
    bare_s = _seconds(lambda: plain_loop(simulations, record=False))
    return Round(validation_s, inside_s, sum(spent), plain_s, bare_s)


def _seconds(work: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def main(arguments: Sequence[str] | None = None) -> None:
    """Time some rounds and write `speed.md`."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--out", type=Path, default=_HERE)
    options = parser.parse_args(arguments)
    mujoco.set_mju_user_warning(lambda _message: None)
    mjcf = speed_arm()
    report = validate(mjcf)
    simulations = battery_of(mjcf)
    examine_text(mjcf)
    rounds = [run_round(mjcf, simulations) for _ in range(options.rounds)]
    steps = sum(len(ctrl) * frame_steps for _, _, ctrl, frame_steps in simulations)
    faults = ", ".join(sorted({fault.code for fault in report.errors})) or "none"
    text = _markdown(rounds, steps, len(simulations), faults, options.rounds)
    options.out.joinpath("speed.md").write_text(text, "utf-8")


def _markdown(rounds: Sequence[Round], steps: int, count: int, faults: str, asked: int) -> str:
    def median(name: str) -> float:
        return statistics.median(getattr(each, name) for each in rounds)

    def spread(name: str) -> str:
        values = sorted(getattr(each, name) for each in rounds)
        return f"{values[0]:.3g} to {values[-1]:.3g}"

    rows = {
        "validation_s": ("one validation in a warm worker, two threads [s]", "at most 0.5"),
        "plain_s": ("plain Python loop over `mj_step`, same tests, recording each step [s]", ""),
        "bare_s": ("the same loop without recording [s]", ""),
        "times_faster": ("plain loop / validation", "at least 8"),
        "inside_s": ("one validation in this process [s]", ""),
        "physics_share": ("share of it inside MuJoCo's native rollout", "at least 0.85"),
    }
    table = "\n".join(
        f"| {words} | {median(name):.3g} | {spread(name)} | {target} |" for name, (words, target) in rows.items()
    )
    return f"""# How fast a validation is

An arm of 12 segments with universal joints (24 degrees of freedom) and 4 tendons; {count} simulations, {steps:,} steps
in all; errors found: {faults}. Made by `make bench-validator`: {asked} rounds, in each of which everything is timed
once, one after the other. MuJoCo {mujoco.__version__}, Python {platform.python_version()}, NumPy {np.__version__},
{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the end.

| | median | range | target |
|---|---|---|---|
{table}
"""


if __name__ == "__main__":
    main()
