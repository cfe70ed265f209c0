"""A real browser without a window, driven by Playwright: Debian's Chromium, another that CHROMIUM names, or Qt's.

python tests/view/chromium.py docs/images/view.png    # the picture of docs/view.md
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.error import URLError
from urllib.request import urlopen

import mujoco
import pytest

from mjtactile.view.viewer import Viewer

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

#: A page draws with WebGL, here without a graphics card.
_SWITCHES = ("--no-sandbox", "--enable-unsafe-swiftshader")
#: Python of the environment that has Qt's Chromium: `make build/chromium/installed`.
_QT = Path(__file__).parents[2] / "build/chromium/bin/python"
#: Longest that Qt's Chromium may take to start [s].
_START = 60.0


def chromium() -> str | None:
    """Where Chromium is, if it is anywhere."""
    names = (os.environ.get("CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if name and (found := shutil.which(name))), None)


def lacking() -> str | None:
    """Why there is no browser, and how to get one; None where there is."""
    if chromium() is not None:
        return None
    how = "apt-get install chromium, or set CHROMIUM"
    if not _QT.exists():
        return f"there is no Chromium: make build/chromium/installed, {how}"
    tried = subprocess.run(
        [_QT, "-c", "import PyQt6.QtWebEngineWidgets"], capture_output=True, text=True, check=False, env={}
    )
    return f"Qt's Chromium lacks a library ({tried.stderr.splitlines()[-1]}): {how}" if tried.returncode else None


@contextmanager
def stepping(viewer: Viewer, act: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Step a viewer's simulation in another thread; `act` before each step."""
    ends = threading.Event()

    def loop() -> None:
        while not ends.is_set():
            act()
            mujoco.mj_step(viewer.model, viewer.data)
            viewer.sync()
            ends.wait(1e-3)

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        yield
    finally:
        ends.set()
        viewer.controls.let_go()
        thread.join()


@contextmanager
def opened(url: str, width: int = 1280, height: int = 800) -> Iterator[Page]:
    """A page, once its heat maps are there."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, _empty_page(playwright, width, height) as page:
        page.goto(url)
        page.wait_for_selector("[data-pad]", timeout=120_000)
        yield page


@contextmanager
def _empty_page(playwright: Playwright, width: int, height: int) -> Iterator[Page]:
    found = chromium()
    if found is not None:
        browser = playwright.chromium.launch(executable_path=found, args=list(_SWITCHES))
        yield browser.new_page(viewport={"width": width, "height": height})
        browser.close()
        return
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    window = [_QT, Path(__file__).with_name("qt_chromium.py"), str(port), str(width), str(height)]
    with subprocess.Popen(window, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            browser = _connected(playwright, f"http://127.0.0.1:{port}", process)
            page = browser.contexts[0].pages[0]
            if not page.evaluate("!!document.createElement('canvas').getContext('webgl2')"):
                pytest.skip("Qt's Chromium finds no OpenGL to draw with: apt-get install libgl1-mesa-dri")
            yield page
            browser.close()
        finally:
            process.terminate()


def _connected(playwright: Playwright, address: str, process: subprocess.Popen[bytes]) -> Browser:
    """The browser that a process is to show at an address."""
    begun = time.monotonic()
    while process.poll() is None and time.monotonic() - begun < _START:
        try:
            urlopen(f"{address}/json/version", timeout=1.0).close()
        except (URLError, TimeoutError):
            time.sleep(0.1)
            continue
        return playwright.chromium.connect_over_cdp(address, no_defaults=True)  # Qt has no contexts to set up
    raise RuntimeError(f"Qt's Chromium did not start: {_QT} {Path(__file__).with_name('qt_chromium.py')} says why")


def main(path: str) -> None:
    """The picture of a grasp."""
    from mjtactile.view.demonstrations import demonstration

    demo, model = demonstration("grasp")
    data = mujoco.MjData(model)
    with (
        Viewer(model, data, port=0) as viewer,
        stepping(viewer, lambda: demo.control(model, data)),
        opened(viewer.url) as page,
    ):
        page.wait_for_timeout(10_000)
        while not 2.2 < data.time % demo.times[-1] < 3.0:
            page.wait_for_timeout(20)
        viewer.controls.paused = True
        page.get_by_role("button", name="×").or_(page.locator(".mantine-Notification-closeButton")).first.click()
        page.wait_for_timeout(4_000)
        page.screenshot(path=path)


if __name__ == "__main__":
    main(*sys.argv[1:])
