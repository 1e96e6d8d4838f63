"""Time one validation, and a plain Python loop over `mj_step` that runs the same tests and records the same data.

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

from aidsr.mjcf.compile import load_mjcf
from aidsr.sim.structure import read_structure
from aidsr.validation import protocol, validate
from aidsr.validation.engine import examine_text
from aidsr.validation.mount import mount_model

_HERE = Path(__file__).parent
_TARGETS = {
    "one validation in a warm worker, two threads [s]": "at most 0.5",
    "plain loop / validation": "at least 8",
    "processor time of one validation / of the plain loop": "at most 2",
    "processor time of one validation / of its steps alone": "at most 2",
    "share of a validation inside MuJoCo's native rollout": "at least 0.85",
}


@dataclass(frozen=True)
class Spent:
    """Wall time and processor time."""

    wall_s: float
    cpu_s: float


@dataclass(frozen=True)
class Round:
    """One run of each variant, one after the other, so that other work on the machine affects all of them equally.

    Processor time covers all threads of this process, but not the time that other processes take.

    Attributes:
        validation_s: Wall time of `validate` in a warm worker.
        inside: Time of the same function in this process.
        physics: Part of `inside` that is spent in MuJoCo's native rollout.
        plain: Time of the plain loop.
        bare: Time of the plain loop without recording, i.e. of its steps alone.
    """

    validation_s: float
    inside: Spent
    physics: Spent
    plain: Spent
    bare: Spent

    @property
    def rows(self) -> dict[str, float]:
        """Figures of the table by name."""
        return {
            "one validation in a warm worker, two threads [s]": self.validation_s,
            "plain Python loop over `mj_step`, same tests, recording each step [s]": self.plain.wall_s,
            "the same loop without recording [s]": self.bare.wall_s,
            "plain loop / validation": self.plain.wall_s / self.validation_s,
            "share of a validation inside MuJoCo's native rollout": self.physics.wall_s / self.inside.wall_s,
            "processor time of one validation [s]": self.inside.cpu_s,
            "processor time of the plain loop [s]": self.plain.cpu_s,
            "processor time of its steps alone [s]": self.bare.cpu_s,
            "processor time of one validation / of the plain loop": self.inside.cpu_s / self.plain.cpu_s,
            "processor time of one validation / of its steps alone": self.inside.cpu_s / self.bare.cpu_s,
            "share of processor time inside MuJoCo's native rollout": self.physics.cpu_s / self.inside.cpu_s,
        }


def speed_arm() -> str:
    """Return the MJCF of the robot that is timed: 12 segments, universal joints, 4 tendons, 0.3 m."""
    limb = Physique(length_m=0.3, segments=12, mass_kg=0.1, radius_m=0.02, sag=0.8, damping_ratio=0.3, bend_rad=1.6)
    return HingeArms(limb).document()


def plain_loop(simulations: Sequence[tuple[mujoco.MjModel, Any, Any, int]], *, record: bool = True) -> int:
    """Run the same simulations one after the other; return the number of steps.

    With `record`, sensors, state and contacts of every step are kept, as a validator without batches must do.
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
    """Return the simulations that a validation runs, recorded from its calls of `protocol.simulate`."""
    kept: list[tuple[mujoco.MjModel, Any, Any, int]] = []
    simulate = protocol.simulate

    def listening(simulations: Any, *, frame_steps: int, **other: Any) -> Any:
        kept.extend((each.model, each.state, each.ctrl, frame_steps) for each in simulations)
        return simulate(simulations, frame_steps=frame_steps, **other)

    loaded = load_mjcf(mjcf)
    model = mount_model(loaded, "auto", None).model
    protocol.simulate = listening
    try:
        protocol.gather_evidence(model, read_structure(model))
    finally:
        protocol.simulate = simulate
    return kept


@contextmanager
def timed_physics() -> Iterator[list[Spent]]:
    """Collect the time of each native rollout."""
    spent: list[Spent] = []
    rollout = Batch.rollout

    def timed(self: Batch, *arguments: Any, **named: Any) -> Any:
        begin = _clocks()
        try:
            return rollout(self, *arguments, **named)
        finally:
            spent.append(_since(begin))

    Batch.rollout = timed
    try:
        yield spent
    finally:
        Batch.rollout = rollout


def run_round(mjcf: str, simulations: Sequence[tuple[mujoco.MjModel, Any, Any, int]]) -> Round:
    """Time every variant once."""
    validation = _timed(lambda: validate(mjcf))
    with timed_physics() as spent:
        inside = _timed(lambda: examine_text(mjcf))
    physics = Spent(sum(each.wall_s for each in spent), sum(each.cpu_s for each in spent))
    plain = _timed(lambda: plain_loop(simulations))
    bare = _timed(lambda: plain_loop(simulations, record=False))
    return Round(validation.wall_s, inside, physics, plain, bare)


def _timed(work: Callable[[], Any]) -> Spent:
    begin = _clocks()
    work()
    return _since(begin)


def _clocks() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()


def _since(begin: tuple[float, float]) -> Spent:
    now = _clocks()
    return Spent(now[0] - begin[0], now[1] - begin[1])


def main(arguments: Sequence[str] | None = None) -> None:
    """Time some rounds and write `speed.md`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
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
    def row(name: str) -> str:
        values = sorted(each.rows[name] for each in rounds)
        middle = statistics.median(values)
        return f"| {name} | {middle:.3g} | {values[0]:.3g} to {values[-1]:.3g} | {_TARGETS.get(name, '')} |"

    table = "\n".join(row(name) for name in rounds[0].rows)
    return f"""# How fast a validation is

An arm of 12 segments with universal joints (24 degrees of freedom) and 4 tendons; {count} simulations, {steps:,} steps
in all; errors found: {faults}. Made by `python -m benchmarks.validator.speed --rounds {asked}`: in each round
everything is timed once, one after the other. MuJoCo {mujoco.__version__}, Python {platform.python_version()},
NumPy {np.__version__}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the end. Processor times hold on a
busy machine too, times on the clock only on a free one.

| | median | range | target |
|---|---|---|---|
{table}
"""


if __name__ == "__main__":
    main()
