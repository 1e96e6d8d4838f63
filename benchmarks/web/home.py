"""Measure the time until the home page of many runs can be used, in Chromium on this machine.

Makes one run of three designs with the built-in rules, copies it, starts `aidsr web`, and opens the page three times.
At the first visit the server reads all runs. The program prints the time until the first byte, and from there until the
page can be used: the table shows runs, the page is connected to the server, and the browser answers a timer within
50 ms. Then it prints how much is loaded at the first visit, and at a second visit with the browser's cache.

    python -m benchmarks.web.home --runs 200
"""

from __future__ import annotations

import argparse
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from playwright.sync_api import sync_playwright

import aidsr


def main() -> None:
    """Measure, and print the results."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--runs", type=int, default=200)
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
            address = f"http://127.0.0.1:{port}/"
            opened = open_pages(address, 3, "table.runs tbody tr td a")
            for said, (waited, usable) in zip(("first", "again", "again"), opened, strict=True):
                sys.stdout.write(
                    f"{count} runs of 3 designs, {said}: first byte after {waited:.2f} s, usable {usable:.2f} s later\n"
                )
            for said, (whole, pictures, framework) in zip(("first", "again"), _weigh(address), strict=True):
                sys.stdout.write(
                    f"loaded, {said}: {whole / 1000:.0f} kB, of which {pictures / 1000:.0f} kB pictures, "
                    f"{framework / 1000:.0f} kB of NiceGUI\n"
                )
        finally:
            server.terminate()
            server.wait()


_USABLE = """
let before = 0;
const timer = setInterval(() => {
  const now = performance.now(), prompt = now - before < 50;
  before = now;
  if (!prompt || !window.socket?.connected || !document.querySelector(WANTED)) return;
  clearInterval(timer);
  const { responseStart } = performance.getEntriesByType("navigation")[0];
  window.opened = [responseStart / 1000, (now - responseStart) / 1000];
}, 10);
"""


def open_pages(
    address: str, visits: int, wanted: str, before: Callable[[int], None] = lambda _visit: None
) -> list[tuple[float, float]]:
    """Return for each visit the time until the first byte, and from there until the page can be used [s].

    Args:
        address: Address of the page.
        visits: Number of visits, one after the other in one browser.
        wanted: CSS selector of an element that must be on the page.
        before: Called before each visit, with the visit's index.
    """
    browser_path = next(path for name in ("chromium", "google-chrome") if (path := shutil.which(name)))
    found = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page()
        page.set_default_timeout(300_000)
        page.add_init_script(_USABLE.replace("WANTED", repr(wanted)))
        for visit in range(visits):
            before(visit)
            page.goto(address, wait_until="commit")
            waited, usable = page.wait_for_function("window.opened").json_value()
            found.append((waited, usable))
        browser.close()
    return found


_LOADED = """() => {
  const all = [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")];
  const sum = (some) => some.reduce((bytes, one) => bytes + one.transferSize, 0);
  return [
    sum(all),
    sum(all.filter((one) => one.initiatorType === "img")),
    sum(all.filter((one) => one.name.includes("/_nicegui/"))),
  ];
}"""


def _weigh(address: str) -> list[tuple[int, int, int]]:
    """Return the bytes that a first and a second visit load: all, those of pictures, and those of NiceGUI's files."""
    browser_path = next(path for name in ("chromium", "google-chrome") if (path := shutil.which(name)))
    found = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        for _visit in range(2):
            page.goto(address, wait_until="networkidle")
            page.wait_for_timeout(3000)  # time for the visible pictures to load
            whole, pictures, framework = page.evaluate(_LOADED)
            found.append((whole, pictures, framework))
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
    """Return a free port."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


if __name__ == "__main__":
    main()
