"""Drawing without a screen: a picture where OpenGL works, a helpful error where it does not."""

import gc
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mjtactile.sim import render
from mjtactile.sim.press_scene import press_scene
from mjtactile.sim.render import Renderer, RenderError, render_scene, working_backend


@pytest.fixture(scope="module")
def scene():
    model = press_scene("star")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def drawing():
    try:
        return working_backend()
    except RenderError as error:
        pytest.skip(str(error))


@pytest.fixture
def broken(monkeypatch):
    working_backend.cache_clear()
    monkeypatch.setattr(render, "_probe", lambda backend: f"no {backend} here")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    yield monkeypatch
    working_backend.cache_clear()


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("camera", [None, "oblique"])
def test_a_picture_shows_the_star_on_the_pad(scene, camera):
    picture = render_scene(*scene, width=160, height=120, camera=camera)
    assert picture.shape == (120, 160, 3)
    assert picture.dtype == np.uint8
    red, blue = picture[..., 0].astype(int), picture[..., 2].astype(int)
    punch, pad = red - blue > 40, (blue - red > 5) & (blue > 60)
    assert punch.sum() > 300
    assert pad.sum() > 600
    rows = [np.mean(np.nonzero(mask)[0]) for mask in (punch, pad)]
    assert rows[0] < rows[1]  # the punch stands above the pad: the first row is the top one


@pytest.mark.usefixtures("drawing")
def test_pictures_larger_than_the_models_buffer_work_and_repeat(scene):
    model, _ = scene
    first = render_scene(*scene, width=model.vis.global_.offwidth + 10, height=50)
    np.testing.assert_array_equal(first, render_scene(*scene, width=model.vis.global_.offwidth + 10, height=50))


#: A texture is among the buffers that have equal numbers in every OpenGL context.
TEXTURED = """<mujoco><asset><texture name="t" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 1 0" width="64"
  height="64"/><material name="m" texture="t"/></asset><worldbody><light pos="0 0 1"/>
  <geom type="plane" size="1 1 .1" material="m"/><camera name="view" pos="0 0 2"/></worldbody></mujoco>"""


@pytest.fixture
def textured():
    model = mujoco.MjModel.from_xml_string(TEXTURED)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data, "view"


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("end", ["freed", "freed twice", "dropped"])
def test_the_end_of_a_renderer_leaves_pictures_of_others_as_they_are(textured, end):
    mine, other = (Renderer(textured[0], 64, 64) for _ in range(2))
    before = mine.picture(*textured)
    other.picture(*textured)  # its context is the current one, as the one of a user's own mujoco.Renderer would be
    mine.picture(*textured)
    if end == "dropped":
        del other
        gc.collect()
    else:
        for _ in range(1 + (end == "freed twice")):
            other.free()
    np.testing.assert_array_equal(mine.picture(*textured), before)
    another = Renderer(textured[0], 64, 64)
    np.testing.assert_array_equal(another.picture(*textured), before)
    np.testing.assert_array_equal(mine.picture(*textured), before)
    assert not render._left
    another.free()
    mine.free()


@pytest.mark.usefixtures("drawing")
def test_a_renderer_refuses_other_threads_while_its_own_uses_it(textured):
    renderer = Renderer(textured[0], 64, 64)
    before = renderer.picture(*textured)
    with ThreadPoolExecutor(1) as thread:
        if working_backend() == "egl":  # software in OSMesa draws anywhere
            with pytest.raises(RenderError, match=r"cannot draw in this thread \(.*thread that drew the first one"):
                thread.submit(lambda: renderer.picture(*textured)).result()
            thread.submit(renderer.free).result()  # left until its own thread frees it
            assert len(render._left) == 1
    renderer.free()
    assert not render._left
    np.testing.assert_array_equal(render_scene(*textured[:2], width=64, height=64, camera="view"), before)


@pytest.mark.usefixtures("drawing")
def test_a_renderer_that_was_freed_says_so(textured):
    renderer = Renderer(textured[0], 64, 64)
    renderer.free()
    with pytest.raises(RenderError, match="the renderer was freed"):
        renderer.picture(*textured)


@pytest.mark.parametrize("fails", ["MjvScene", "MjrContext", "mjr_resizeOffscreen"])
def test_a_renderer_that_cannot_be_made_leaves_no_context(textured, monkeypatch, fails):
    calls = []
    one = SimpleNamespace(
        make_current=lambda: None,
        free=lambda: calls.append("context"),
    )
    buffers = SimpleNamespace(free=lambda: calls.append("buffers"))
    monkeypatch.setattr(render, "working_backend", lambda: "egl")
    monkeypatch.setattr(render, "context_class", lambda _: lambda *_: one)
    for name in ("MjrContext", "mjr_resizeOffscreen"):
        monkeypatch.setattr(mujoco, name, lambda *_: buffers)

    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(mujoco, fails, fail)
    with pytest.raises(KeyboardInterrupt):
        Renderer(textured[0], 64, 64)
    assert calls == (["buffers"] if fails == "mjr_resizeOffscreen" else []) + ["context"]


def test_without_opengl_the_error_names_the_packages(scene, broken):
    with pytest.raises(RenderError, match=r"egl: no egl here; osmesa: no osmesa here.*libegl1.*libosmesa6"):
        render_scene(*scene)


def test_a_requested_backend_is_the_only_one_tried(scene, broken):
    broken.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(RenderError, match=r"\(osmesa: no osmesa here\). MUJOCO_GL=osmesa asks for this one alone"):
        render_scene(*scene)


def test_a_backend_that_does_not_exist_fails_in_its_probe():
    with pytest.raises(RenderError, match=r"nonsense: .*cannot draw. Use egl or osmesa"):
        working_backend("nonsense")


def test_a_driver_that_hangs_is_given_up(monkeypatch):
    working_backend.cache_clear()
    monkeypatch.setattr(render, "PROBE_TIMEOUT", 0.01)
    with pytest.raises(RenderError, match=r"no answer within 0.01 s"):
        working_backend("egl")
    working_backend.cache_clear()


def test_wrong_requests_are_refused(scene):
    with pytest.raises(RenderError, match="0 x 5; expected at least 1 x 1"):
        render_scene(*scene, width=0, height=5)
    with pytest.raises(RenderError, match=r"camera 'nowhere' does not exist.*\['oblique'\]"):
        render_scene(*scene, camera="nowhere")


def test_importing_starts_no_opengl():
    code = "import sys, mjtactile.sim.render; assert not any(name.startswith('OpenGL') for name in sys.modules)"
    environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": ":".join(filter(None, sys.path))}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
