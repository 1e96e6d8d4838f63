"""Measure how much slower the page of a run opens while one of its designs is trained, in Chromium on this machine.

Makes a run with the built-in rules, starts `aidsr web` and, as the app does, a training of a design on all processors.
It opens the page of the run alternately with the training running and stopped, so that other work on the machine
affects both. It prints the time from the first byte until the page can be used, as `benchmarks.web.home` does.

    python -m benchmarks.web.training --visits 8
"""

from __future__ import annotations

import argparse
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.web.home import free_port, open_pages, wait_for

import aidsr
from aidsr.apps.web.site import Site
from aidsr.runs import read_status


def main() -> None:
    """Measure, and print the results."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--visits", type=int, default=8)
    visits: int = arguments.parse_args().visits
    with tempfile.TemporaryDirectory() as folder:
        made = aidsr.design(task="button_pushing", seed=1, runs=Path(folder))
        site, port = Site.at(Path(folder)), free_port()
        number = next(
            one.number for one in read_status(made).designs if one.outcome and one.outcome.outcome == "approved"
        )
        name = site.training_name(made, number)
        words = [sys.executable, "-m", "aidsr", "web", "--runs", folder, "--port", str(port), "--no-browser"]
        server = subprocess.Popen(words)
        site.processes.start(name, ["train", str(made.design(number).path), "--steps", "100000000"])
        trained = site.processes.pid(name)
        try:
            wait_for(port)
            while not list(made.design(number).path.glob("training/*/curve.csv")):
                time.sleep(0.2)
            _compare(f"http://127.0.0.1:{port}/run/{made.name}", trained, visits)
        finally:
            os.killpg(trained, signal.SIGKILL)
            server.terminate()
            server.wait()


def _compare(address: str, training: int, visits: int) -> None:
    times: dict[signal.Signals, list[float]] = {signal.SIGSTOP: [], signal.SIGCONT: []}

    def turn(visit: int) -> None:
        os.killpg(training, (signal.SIGSTOP, signal.SIGCONT)[visit % 2])
        time.sleep(1.0)

    opened = open_pages(address, 2 * visits + 2, "article.sheet h2", turn)[2:]  # the first two fill the browser's cache
    for visit, (_, usable) in enumerate(opened):
        times[(signal.SIGSTOP, signal.SIGCONT)[visit % 2]].append(usable)
    halted, at_work = (statistics.median(times[each]) for each in (signal.SIGSTOP, signal.SIGCONT))
    sys.stdout.write(
        f"page of a run, median of {visits}: {halted:.2f} s with the training halted, {at_work:.2f} s with it at work: "
        f"{at_work / halted:.2f} times\n"
    )


if __name__ == "__main__":
    main()
