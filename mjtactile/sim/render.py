"""Off-screen rendering of a scene with EGL or, if that fails, OSMesa (software)."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile.errors import RenderError
from mjtactile.sim.mujoco_library import element_id

#: Backends tried in this order if MUJOCO_GL is not set.
BACKENDS = ("egl", "osmesa")
#: A driver that has not created a context after this time [s] counts as not working.
PROBE_TIMEOUT = 30.0

_MAXIMUM_GEOMS = 10_000
#: OpenGL contexts of renderers that are gone, each with its buffers, until they are freed.
_left: list[tuple[Any, mujoco.MjrContext]] = []
_PROBE = """
import sys, mujoco
from mjtactile.sim.render import context_class
context = context_class(sys.argv[1])(8, 8)
context.make_current()
mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), mujoco.mjtFontScale.mjFONTSCALE_100)
"""


def render_scene(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    width: int = 640,
    height: int = 480,
    *,
    camera: str | mujoco.MjvCamera | None = None,
    mark: Callable[[Any], None] | None = None,
) -> npt.NDArray[np.uint8]:
    """Render the state in `data` as RGB, shape (height, width, 3), top row first.

    Args:
        model: compiled model.
        data: its state after `mj_forward` or `mj_step`.
        width: width of the image [pixels].
        height: height of the image [pixels].
        camera: name of a camera of the model, or an `MjvCamera`; a view of the whole scene if None.
        mark: function that may change the `mujoco.MjvScene` before rendering.

    Raises:
        RenderError: OpenGL does not work (the message names the packages to install), the model has no such camera, or
            the size is not positive.
    """
    if width < 1 or height < 1:
        raise RenderError(f"picture size {width} x {height}; expected at least 1 x 1 pixels.")
    view = _view(model, camera)
    renderer = Renderer(model, width, height)
    try:
        return renderer.picture(model, data, view, mark)
    finally:
        renderer.free()


class Renderer:
    """Draws states of one model, off-screen, of a width and a height [pixels], in an OpenGL context of its own.

    OpenGL allows a context in one thread at a time: draw all pictures in the thread that made the renderer.

    Raises:
        RenderError: OpenGL does not work; the message names the packages to install.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        free_left()
        self._size = width, height
        self._context = context_class(working_backend())(width, height)
        buffers = None
        try:
            self._context.make_current()
            self._scene = mujoco.MjvScene(model, maxgeom=_MAXIMUM_GEOMS)
            self._buffers = buffers = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_resizeOffscreen(width, height, buffers)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, buffers)
        except BaseException:
            if buffers is not None:
                buffers.free()
            self._context.free()
            raise
        # Garbage may be collected while another context draws, so what it leaves is freed by `free_left`.
        self._leave = weakref.finalize(self, _left.append, (self._context, self._buffers))
        self._leave.atexit = False

    def picture(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        camera: str | mujoco.MjvCamera,
        mark: Callable[[Any], None] | None = None,
    ) -> npt.NDArray[np.uint8]:
        """Draw a state; arguments, result and errors are those of `render_scene`.

        Raises:
            RenderError: the context is in use by another thread, or the renderer was freed.
        """
        if not self._leave.alive:
            raise RenderError("the renderer was freed: it draws no more pictures. Make another one.")
        try:
            self._context.make_current()
        except Exception as error:  # every backend has errors of its own
            raise RenderError(
                f"OpenGL cannot draw in this thread ({type(error).__name__}): a renderer works in one thread at a "
                "time. Draw all pictures in the thread that drew the first one, or make a renderer or environment for "
                "each thread."
            ) from error
        option, kinds = mujoco.MjvOption(), mujoco.mjtCatBit.mjCAT_ALL
        view = _view(model, camera)
        mujoco.mjv_updateScene(model, data, option, mujoco.MjvPerturb(), view, kinds, self._scene)
        if mark is not None:
            mark(self._scene)
        width, height = self._size
        area = mujoco.MjrRect(0, 0, width, height)
        picture = np.empty((height, width, 3), dtype=np.uint8)
        mujoco.mjr_render(area, self._scene, self._buffers)
        mujoco.mjr_readPixels(picture, None, area, self._buffers)
        return np.ascontiguousarray(picture[::-1])

    def free(self) -> None:
        """Free buffers and context; further calls have no effect."""
        self._leave()
        free_left()


def free_left() -> None:
    """Free what renderers have left, except contexts that another thread still uses."""
    used = []
    while True:
        try:
            context, buffers = _left.pop()
        except IndexError:  # all are freed, perhaps by another thread
            break
        try:
            # Buffers are freed by numbers that every context has, so in another one they would be those of others.
            context.make_current()
        except Exception:  # every backend has errors of its own
            used.append((context, buffers))
            continue
        buffers.free()
        context.free()
    _left.extend(used)


@cache
def working_backend(requested: str | None = None) -> str:
    """The OpenGL backend to use: `requested`, else MUJOCO_GL if it is set, else the first of `BACKENDS` that works.

    Each is tried in a process of its own, because a broken driver may abort, hang, or break the other backend.

    Raises:
        RenderError: none works.
    """
    wanted = (requested if requested is not None else os.environ.get("MUJOCO_GL", "")).lower()
    failures = {}
    for backend in (wanted,) if wanted else BACKENDS:
        failures[backend] = _probe(backend)
        if not failures[backend]:
            return backend
    asked = f" MUJOCO_GL={wanted} asks for this one alone; unset it to let others be tried." if wanted else ""
    raise RenderError(
        f"no working OpenGL for drawing without a screen ({'; '.join(f'{b}: {why}' for b, why in failures.items())})."
        f"{asked} On Debian: apt install libegl1 libegl-mesa0 libgl1-mesa-dri (egl), or libosmesa6 (osmesa)."
    )


def _probe(backend: str) -> str:
    """The reason why a backend does not work; empty if it works."""
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    command = [sys.executable, "-c", _PROBE, backend]
    try:
        tried = subprocess.run(command, capture_output=True, text=True, timeout=PROBE_TIMEOUT, env=environment)
    except subprocess.TimeoutExpired:
        return f"no answer within {PROBE_TIMEOUT:g} s"
    if tried.returncode == 0:
        return ""
    lines = tried.stderr.strip().splitlines()
    return lines[-1] if lines else f"stopped with status {tried.returncode}"


def context_class(backend: str) -> Any:
    """MuJoCo's context class of a backend; chosen here because `import mujoco` reads MUJOCO_GL only once.

    Raises:
        RenderError: there is no such backend.
    """
    if backend not in (*BACKENDS, "glfw"):
        raise RenderError(f"MUJOCO_GL={backend} cannot draw. Use egl or osmesa.")
    return importlib.import_module(f"mujoco.{backend}").GLContext


def _view(model: mujoco.MjModel, camera: str | mujoco.MjvCamera | None) -> Any:
    if isinstance(camera, mujoco.MjvCamera):
        return camera
    view = mujoco.MjvCamera()
    if camera is None:
        mujoco.mjv_defaultFreeCamera(model, view)
        return view
    view.type = mujoco.mjtCamera.mjCAMERA_FIXED
    view.fixedcamid = element_id(model, mujoco.mjtObj.mjOBJ_CAMERA, camera, "camera", RenderError)
    if view.fixedcamid < 0:
        names = [model.camera(i).name for i in range(model.ncam)]
        raise RenderError(f"camera '{camera}' does not exist in the model. Available: {names}.")
    return view
