"""Measure when a live 3-D view appears, and the processor time of the server and of the simulating process.

Makes a design with the built-in rules, starts `aidsr web`, opens the page of the design in Chromium, where the view
runs live, and counts frames on its WebSocket. Other work on the machine has little effect on processor times.

    python -m benchmarks.web.view --seconds 30
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.web.home import free_port, wait_for
from playwright.sync_api import Page, sync_playwright

import aidsr


def main() -> None:
    """Measure, and print the results."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--seconds", type=float, default=30.0)
    seconds: float = arguments.parse_args().seconds
    with tempfile.TemporaryDirectory() as folder:
        made = aidsr.design(task="button_pushing", seed=1, concepts=1, runs=Path(folder)).path
        port = free_port()
        words = [sys.executable, "-m", "aidsr", "web", "--runs", folder, "--port", str(port), "--no-browser"]
        server = subprocess.Popen(words)
        try:
            wait_for(port)
            _watch(server.pid, f"http://127.0.0.1:{port}/run/{made.name}/1", seconds)
        finally:
            server.terminate()
            server.wait()


def _watch(server: int, address: str, seconds: float) -> None:
    browser_path = next(path for name in ("chromium", "google-chrome") if (path := shutil.which(name)))
    with sync_playwright() as playwright:
        drawn = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=browser_path, args=drawn)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(300_000)
        frames = _count_frames(page)
        begun = time.perf_counter()
        page.goto(address)
        page.get_by_text("squares of").wait_for()
        page.evaluate("() => new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
        sys.stdout.write(f"first picture after {time.perf_counter() - begun:.1f} s\n")
        page.wait_for_timeout(10_000)  # meanwhile the page lists the validator's tests
        players = _children(server)
        before, first = _spent_s(server, players), len(frames)
        begun = time.perf_counter()
        page.wait_for_timeout(1000 * seconds)
        lasted = time.perf_counter() - begun
        after, last = _spent_s(server, players), len(frames)
        browser.close()
    rate = (last - first) / lasted
    for who, used in zip(
        ("server", "simulating process"), (b - a for a, b in zip(before, after, strict=True)), strict=True
    ):
        sys.stdout.write(f"{who}: {100 * used / lasted:.1f} % of a core at {rate:.1f} frames/s\n")


def _count_frames(page: Page) -> list[int]:
    frames: list[int] = []

    def heard(message: bytes | str) -> None:
        if isinstance(message, bytes) and message[:1] == b"\x01":
            frames.append(len(message))

    page.on("websocket", lambda socket: socket.on("framereceived", heard) if "/view3d/" in socket.url else None)
    return frames


def _children(pid: int) -> list[int]:
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True).stdout.split()
    return [each for child in map(int, found) for each in (child, *_children(child))]


def _spent_s(server: int, players: list[int]) -> tuple[float, float]:
    """Return the processor time of the server alone, and of the processes it started [s]."""
    return _cpu_s(server), sum(map(_cpu_s, players))


def _cpu_s(pid: int) -> float:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except FileNotFoundError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / 100  # user and system, in ticks of 10 ms


if __name__ == "__main__":
    main()
