"""How long the home page of many runs takes until it can be used, in Chromium on this machine.

Makes one run of three designs with the built-in rules, copies it, starts `aidsr web`, and opens the page three times.
The first time the server reads all runs.

    python -m benchmarks.web.home --runs 20
"""

from __future__ import annotations

import argparse
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from playwright.sync_api import sync_playwright

import aidsr


def main() -> None:
    """Measure and print."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--runs", type=int, default=20)
    count: int = arguments.parse_args().runs
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder)
        made = aidsr.design(task="button_pushing", seed=1, runs=runs).path
        for number in range(1, count):
            shutil.copytree(made, runs / f"{made.name}_{number:02d}")
        port = free_port()
        words = [sys.executable, "-m", "aidsr", "web", "--runs", folder, "--port", str(port), "--no-browser"]
        server = subprocess.Popen(words)
        try:
            wait_for(port)
            for said, seconds in zip(("first", "again", "again"), _opened(port, count), strict=True):
                sys.stdout.write(f"{count} runs of 3 designs, {said}: usable after {seconds:.2f} s\n")
        finally:
            server.terminate()
            server.wait()


def _opened(port: int, count: int) -> list[float]:
    """Return how long each of three visits took until all rows stood there and the search field took text [s]."""
    browser_path = next(path for name in ("chromium", "google-chrome") if (path := shutil.which(name)))
    found = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page()
        for _ in range(3):
            begun = time.perf_counter()
            page.goto(f"http://127.0.0.1:{port}/", wait_until="commit")
            page.locator("tbody tr").nth(count - 1).wait_for()
            field = page.get_by_label("Search runs")
            field.fill("button")
            field.fill("")
            found.append(time.perf_counter() - begun)
        browser.close()
    return found


def wait_for(port: int) -> None:
    """Wait until the server answers."""
    while True:
        try:
            with urlopen(f"http://127.0.0.1:{port}/assets/icon.svg"):
                return
        except URLError:
            time.sleep(0.05)


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


if __name__ == "__main__":
    main()
