"""Rendering of an environment to images and to a window, which are created at the first use."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt


class Drawing:
    """Renders one environment's simulation by a camera of its model, in pictures of a width and a height [pixels]."""

    def __init__(self, camera: str, width: int, height: int) -> None:
        self._camera, self._width, self._height = camera, width, height
        self._renderer: Any = None
        self._window: Any = None

    def picture(self, model: mujoco.MjModel, data: mujoco.MjData) -> npt.NDArray[np.uint8]:
        """An RGB image of a state, shape (height, width, 3), top row first.

        Raises:
            RenderError: OpenGL does not work.
        """
        if self._renderer is None:
            from mjtactile.sim.render import Renderer

            self._renderer = Renderer(model, self._width, self._height)
        return self._renderer.picture(model, data, self._camera)

    def show(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Show a state in the window, which is opened at the first call."""
        if self._window is None:
            from mujoco import viewer

            self._window = viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
            self._window.cam.type = mujoco.mjtCamera.mjCAMERA_FIXED
            self._window.cam.fixedcamid = model.camera(self._camera).id
        if self._window.is_running():
            self._window.sync()

    def close(self) -> None:
        """Close the window and free the renderer; further calls have no effect."""
        if self._renderer is not None:
            self._renderer.free()
        if self._window is not None:
            self._window.close()
        self._renderer = self._window = None
