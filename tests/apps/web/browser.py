"""The page in a real browser: the server as a process of its own, and Chromium where there is one."""

import asyncio
import io
import os
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, expect, sync_playwright
from playwright.sync_api import TimeoutError as PlaywrightTimeout
from serving import interrupt, started

IMAGES = Path(__file__).parents[3] / "docs" / "images" / "web"
PATIENCE_MS = 300_000
"""How long to wait for anything; nothing here is a measurement."""
_MISSED_MS = 20_000


def chromium() -> str:
    """Return the system's Chromium; without one, skip, or fail where CI promised one."""
    found = next(
        (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), ""
    )
    if not found:
        missing = "no Chromium on this machine; install the package chromium"
        (pytest.fail if os.environ.get("AIDSR_BROWSER_TESTS") == "required" else pytest.skip)(missing)
    return found


def open_tab(page: Page, name: str) -> None:
    """Click a tab until it is open: while a page loads its parts move, and a click may miss."""
    tab = page.get_by_role("tab", name=name)
    for _ in range(PATIENCE_MS // _MISSED_MS):
        tab.click()
        try:
            expect(tab).to_have_attribute("aria-selected", "true", timeout=_MISSED_MS)
        except AssertionError:
            continue
        return
    pytest.fail(f'the tab "{name}" did not open')


def choose(page: Page, field: str, option: str) -> None:
    """Choose an option of a field; a menu opened while the page was busy may close before or during the click."""
    wanted = page.get_by_role("option", name=option)
    for _ in range(10):
        page.get_by_label(field, exact=True).click()
        try:
            wanted.click(timeout=10_000)
        except PlaywrightTimeout:
            continue
        return
    pytest.fail(f"{field} has no option {option}")


@contextmanager
def browsing(*, webgl: bool = False, **options: object) -> Iterator[BrowserContext]:
    """Open a browser without a window; WebGL drawn by the processor would slow everything down, so only where asked."""
    expect.set_options(timeout=PATIENCE_MS)
    with _playwright_at_work():
        browser = _browser(webgl=webgl)
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})  # type: ignore[arg-type]
        try:
            context.set_default_timeout(PATIENCE_MS)
            context.set_default_navigation_timeout(PATIENCE_MS)
            yield context
        finally:
            context.close()


@dataclass
class _Playwright:
    """Playwright of this process with the browsers that it has opened: to start one takes seconds of processor time."""

    api: Playwright
    loop: asyncio.AbstractEventLoop
    browsers: dict[bool, Browser] = field(default_factory=dict)


_shared: list[_Playwright] = []
"""One, once it was wanted."""


@contextmanager
def _playwright_at_work() -> Iterator[None]:
    """Let Playwright's loop, which waits from test to test, count as running only here: others run loops of theirs."""
    if _shared:
        asyncio._set_running_loop(_shared[0].loop)
    else:
        api = sync_playwright().start()
        _shared.append(_Playwright(api, asyncio.get_running_loop()))
    try:
        yield
    finally:
        asyncio._set_running_loop(None)


def _browser(*, webgl: bool) -> Browser:
    """Return the browser for pages with WebGL or for those without."""
    open_ones = _shared[0].browsers
    if webgl not in open_ones or not open_ones[webgl].is_connected():
        drawing = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] if webgl else ["--disable-3d-apis"]
        arguments = ["--no-sandbox", *drawing]
        open_ones[webgl] = _shared[0].api.chromium.launch(executable_path=chromium(), args=arguments)
    return open_ones[webgl]


def close_browsers() -> None:
    """Close what `browsing` opened, at the end of all tests."""
    if not _shared:
        return
    with _playwright_at_work():
        for browser in _shared[0].browsers.values():
            browser.close()
        _shared.pop().api.stop()


@dataclass
class Server:
    """`aidsr web` over a folder of runs."""

    runs: Path
    port: int
    process: ForkServerProcess
    token: str = ""

    @classmethod
    @contextmanager
    def over(cls, runs: Path, token: str = "") -> Iterator["Server"]:
        """Start it, with a token where one is given, wait until it answers, and end it in the end."""
        port = free_port()
        server = cls(runs, port, _started(runs, port, token), token)
        try:
            yield server
        finally:
            interrupt(server.process)

    def restart(self) -> None:
        """End it and start it again at the same address."""
        interrupt(self.process)
        self.process = _started(self.runs, self.port, self.token)

    def address(self, path: str = "/") -> str:
        """Return the address of a page."""
        return f"http://127.0.0.1:{self.port}{path}"


def _started(runs: Path, port: int, token: str) -> ForkServerProcess:
    words = ["web", "--runs", str(runs), "--port", str(port), "--no-browser"]
    process = started(words, {**os.environ, "AIDSR_WEB_TOKEN": token})
    end = time.monotonic() + PATIENCE_MS / 1000
    while True:
        try:
            with urlopen(f"http://127.0.0.1:{port}/assets/icon.svg") as answer:
                assert answer.status == 200
                return process
        except HTTPError as error:
            if token and error.code == 401:
                return process
            raise
        except OSError:
            assert process.is_alive(), "the server ended"
            assert time.monotonic() < end, "the server never answered"
            time.sleep(0.1)


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def shoot(page: Page, name: str, *, whole: bool = False) -> None:
    """Take a picture for the docs, where pictures are wanted (AIDSR_SCREENSHOTS=1)."""
    if os.environ.get("AIDSR_SCREENSHOTS"):
        if page.locator(".v3d").count():
            page.locator(".v3d-square").first.wait_for(state="attached")  # the model is there
        page.mouse.move(0, 0)
        page.evaluate("scrollTo(0, 0)")
        page.wait_for_timeout(2500)
        taken = Image.open(io.BytesIO(page.screenshot(full_page=whole))).convert("RGB")
        small = taken.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
        small.save(IMAGES / f"{name}.png", optimize=True)  # a third of the size; small red marks stay red
