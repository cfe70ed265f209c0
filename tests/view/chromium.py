"""A real browser without a window, driven by Playwright: Debian's Chromium, or another that CHROMIUM names.

python tests/view/chromium.py docs/images/view.png    # the picture of docs/view.md
"""

from __future__ import annotations

import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import mujoco

from mjtactile.view.viewer import Viewer

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: A page draws with WebGL, here without a graphics card.
_SWITCHES = ("--no-sandbox", "--enable-unsafe-swiftshader")


def chromium() -> str | None:
    """Where Chromium is, if it is anywhere."""
    names = (os.environ.get("CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if name and (found := shutil.which(name))), None)


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

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(_SWITCHES))
        page = browser.new_page(viewport={"width": width, "height": height})
        page.goto(url)
        page.wait_for_selector("[data-pad]", timeout=120_000)
        yield page
        browser.close()


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
