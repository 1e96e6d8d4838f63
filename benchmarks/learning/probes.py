"""Probe every scene of the suite: for how many variations an open-loop motion wins, and how many one motion wins.

    python -m benchmarks.learning.probes

Rows go to probes.jsonl. The same command continues with the scenes that are missing.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.learning.suite import suite
from benchmarks.rows import append_row, read_rows

from aidsr.core.artifacts import Artifact
from aidsr.core.provenance import commit
from aidsr.learn.openloop.probe_scene import probe_scene
from aidsr.tasks import BENCHMARK_VERSION, is_current

PROBES = Path(__file__).with_name("probes.jsonl")
VARIATIONS = 4


class Probe(Artifact):
    """Result of the probe for one scene."""

    scene: str
    some_motion: int
    """Number of the four variations for which some motion wins."""
    one_motion: int
    """Largest number of the four variations that one and the same motion wins."""
    progress: float
    steps: int
    """Physics steps of all simulations of the probe together."""
    benchmark_version: int
    commit: str


def main() -> None:
    """Probe the scenes that are missing."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    for scene in suite():
        if scene.name in probes_of(PROBES):
            continue
        report = probe_scene(scene.scene(), variations=VARIATIONS, threads=1)
        probe = Probe(
            scene=scene.name,
            some_motion=round(report.success_share * VARIATIONS),
            one_motion=round(report.same_motion_share * VARIATIONS),
            progress=round(report.progress, 4),
            steps=report.played_steps,
            benchmark_version=BENCHMARK_VERSION,
            commit=commit(),
        )
        append_row(PROBES, probe)
        sys.stdout.write(f"{probe.scene}: some motion {probe.some_motion}, one motion {probe.one_motion} of 4\n")
        sys.stdout.flush()


def probes_of(path: Path) -> dict[str, Probe]:
    """Return the recorded probes that hold for the present version of the benchmark, by scene."""
    tasks = {scene.name: scene.task for scene in suite()}
    known = [probe for probe in read_rows(path, Probe) if probe.scene in tasks]
    return {probe.scene: probe for probe in known if is_current(tasks[probe.scene], probe.benchmark_version)}


if __name__ == "__main__":
    main()
