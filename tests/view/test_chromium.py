"""The page in a real browser."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import pytest
from chromium import lacking, opened, stepping
from PIL import Image
from pressed_boxes import boxes_on_pads, pad_with_free_taxels

pytest.importorskip("mjviser", reason="the live view is not installed: pip install 'mjtactile[view]'")
pytest.importorskip("playwright", reason="Playwright is not installed: pip install playwright")

from mjtactile.view.viewer import Viewer

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(lacking() is not None, reason=lacking() or ""),
]

_PATIENCE = 60_000
_PICTURE = 'document.querySelector(\'[data-pad="pad0"] image\').getAttribute("href")'


def tiles(page: Page) -> np.ndarray:
    """The heat map of pad0 as the page has it, RGB."""
    address = page.evaluate(_PICTURE)
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(address.split(",")[1]))))


def text(page: Page) -> str:
    return page.evaluate("document.querySelector('[data-pad=\"pad0\"]').textContent")


def test_a_page_shows_presses_and_its_buttons_work(tmp_path: Path):
    model = boxes_on_pads(2)
    data, push = mujoco.MjData(model), [0.0]
    body = model.body("box0").id

    def act() -> None:
        data.xfrc_applied[body, 2] = -push[0]

    with Viewer(model, data, port=0) as viewer, stepping(viewer, act), opened(viewer.url) as page:
        assert page.evaluate("[...document.querySelectorAll('[data-pad]')].map(one => one.dataset.pad)") == [
            "pad0",
            "pad1",
        ]
        page.wait_for_function("document.querySelector('[data-pad=\"pad0\"]').textContent.includes('0.49 N')")
        rest = tiles(page)
        assert rest.shape == (13, 4 * 13 + 3, 3)
        push[0] = 3.0
        page.wait_for_function(
            "document.querySelector('[data-pad=\"pad0\"]').textContent.includes('3.49 N')", timeout=_PATIENCE
        )
        assert "3.49 N" in text(page)
        assert not np.array_equal(tiles(page), rest)
        page.screenshot(path=tmp_path / "page.png")
        colours = Image.open(tmp_path / "page.png").convert("RGB").getcolors(1 << 20)
        assert colours is not None
        assert len(colours) > 200  # more than an empty page has

        page.get_by_role("button", name="Pause").click()
        page.wait_for_selector("text=paused", timeout=_PATIENCE)
        stands = data.time
        page.wait_for_timeout(300)
        assert data.time == stands
        page.get_by_role("button", name="Step", exact=True).click()
        page.wait_for_timeout(2_000)
        assert data.time == pytest.approx(stands + model.opt.timestep)
        page.get_by_role("button", name="Go on").click()
        page.wait_for_selector("text=running", timeout=_PATIENCE)
    assert data.time > stands + model.opt.timestep


def test_a_page_shows_presses_on_free_taxels():
    model = boxes_on_pads(1, pad_with_free_taxels())
    data, push = mujoco.MjData(model), [0.0]
    body = model.body("box0").id

    def act() -> None:
        data.xfrc_applied[body, 2] = -push[0]

    with Viewer(model, data, port=0) as viewer, stepping(viewer, act), opened(viewer.url) as page:
        page.wait_for_function(
            "document.querySelector('[data-pad=\"pad0\"]').textContent.includes('0.49 N')", timeout=_PATIENCE
        )
        rest = tiles(page)
        push[0] = 3.0
        page.wait_for_function(
            "document.querySelector('[data-pad=\"pad0\"]').textContent.includes('3.49 N')", timeout=_PATIENCE
        )
        pressed = tiles(page)
    grey = (pressed == rest).all(axis=2)
    assert rest.shape == pressed.shape
    assert 0.5 < grey.mean() < 1.0  # what changed is discs, six of them: most of the picture has no taxel
