"""Rendering of an environment to images and to a window, which are created at the first use."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt


class Drawing:
    """Renders one environment's simulation.

    Args:
        camera: name of the model's camera.
        width, height: size of pictures [pixels].
    """

    def __init__(self, camera: str, width: int, height: int) -> None:
        self._camera, self._width, self._height = camera, width, height
        self._forget()

    def picture(self, model: mujoco.MjModel, data: mujoco.MjData) -> npt.NDArray[np.uint8]:
        """An RGB image of a state, shape (height, width, 3), top row first.

        Args:
            model: compiled model.
            data: its state.

        Raises:
            RenderError: OpenGL does not work.
        """
        if self._scene is None:
            self._open(model)
        self._context.make_current()
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED
        view.fixedcamid = model.camera(self._camera).id
        option, kinds = mujoco.MjvOption(), mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, option, mujoco.MjvPerturb(), view, kinds, self._scene)
        area = mujoco.MjrRect(0, 0, self._width, self._height)
        picture = np.empty((self._height, self._width, 3), dtype=np.uint8)
        mujoco.mjr_render(area, self._scene, self._buffers)
        mujoco.mjr_readPixels(picture, None, area, self._buffers)
        return np.ascontiguousarray(picture[::-1])

    def show(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Show a state in the window, which is opened at the first call.

        Args:
            model: compiled model.
            data: its state.
        """
        if self._window is None:
            from mujoco import viewer

            self._window = viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
            self._window.cam.type = mujoco.mjtCamera.mjCAMERA_FIXED
            self._window.cam.fixedcamid = model.camera(self._camera).id
        if self._window.is_running():
            self._window.sync()

    def close(self) -> None:
        """Close the window and free the renderer; further calls have no effect."""
        if self._buffers is not None:
            self._buffers.free()
            self._context.free()
        if self._window is not None:
            self._window.close()
        self._forget()

    def _forget(self) -> None:
        self._context: Any = None
        self._buffers: Any = None
        self._scene: Any = None
        self._window: Any = None

    def _open(self, model: mujoco.MjModel) -> None:
        from mjtactile.sim.render import context_class, working_backend

        self._context = context_class(working_backend())(self._width, self._height)
        self._context.make_current()
        self._buffers = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_resizeOffscreen(self._width, self._height, self._buffers)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._buffers)
        self._scene = mujoco.MjvScene(model, maxgeom=2000)
