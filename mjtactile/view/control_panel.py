"""The page's controls: pause, step, drag, actuators, record and replay. They only write to `Controls`."""

from __future__ import annotations

import mujoco
import numpy as np
import viser

from mjtactile.view.controls import Controls
from mjtactile.view.frame import Frame
from mjtactile.view.perturbation import movable_bodies

_NOBODY = "none"
_SPEEDS = {"1/16": 1 / 16, "1/8": 1 / 8, "1/4": 1 / 4, "1/2": 1 / 2, "1": 1.0, "2": 2.0, "4": 4.0}
#: Size of the handle by which a body is dragged, over the model's extent [-].
_HANDLE = 0.15


class ControlPanel:
    """Buttons and sliders in the page of a model; they write requests to `controls`."""

    def __init__(self, server: viser.ViserServer, model: mujoco.MjModel, controls: Controls) -> None:
        self._server, self._controls = server, controls
        self._bodies = movable_bodies(model)
        self._status = server.gui.add_markdown("")
        self._add_playback()
        self._handle = self._add_handle(float(model.stat.extent))
        self._add_arrow_lengths()
        self._add_actuators(model)

    def follow(self, frame: Frame, status: str) -> None:
        """Update texts, buttons and the dragging handle."""
        controls = self._controls
        self._status.content = f"{frame.time:.3f} s, {status}"
        for button, label in (
            (self._pause, "Go on" if controls.paused else "Pause"),
            (self._record, "Stop recording" if controls.recording else "Record"),
            (self._replay, "Stop replaying" if controls.replaying else "Replay"),
        ):
            if button.label != label:
                button.label = label
        if controls.body is not None and controls.dragged_to is None:
            self._handle.position = frame.xpos[controls.body]

    def _add_playback(self) -> None:
        gui, controls = self._server.gui, self._controls
        self._pause, step = gui.add_button("Pause"), gui.add_button("Step")
        self._record, self._replay = gui.add_button("Record"), gui.add_button("Replay")
        speed = gui.add_dropdown("Speed", tuple(_SPEEDS), initial_value="1")

        @self._pause.on_click
        def _(_: object) -> None:
            controls.paused, controls.steps = not controls.paused, 0

        @step.on_click
        def _(_: object) -> None:
            if controls.paused:
                controls.steps += 1
            controls.paused = True

        @self._record.on_click
        def _(_: object) -> None:
            controls.recording = not controls.recording

        @self._replay.on_click
        def _(_: object) -> None:
            controls.replaying = not controls.replaying

        @speed.on_update
        def _(_: object) -> None:
            controls.speed = _SPEEDS[speed.value]

    def _add_handle(self, extent: float) -> viser.TransformControlsHandle:
        """The handle by which a body is dragged."""
        gui, controls = self._server.gui, self._controls
        handle = self._server.scene.add_transform_controls(
            "/drag", scale=_HANDLE * extent, disable_rotations=True, depth_test=False, visible=False
        )
        body = gui.add_dropdown("Drag", (_NOBODY, *self._bodies), initial_value=_NOBODY)

        @body.on_update
        def _(_: object) -> None:
            controls.dragged_to = None
            controls.body = self._bodies.get(body.value)
            handle.visible = controls.body is not None

        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            # async, so that calls keep their order: viser runs other functions in threads, in any order.
            ends = event.phase == "end"
            controls.dragged_to = None if ends else np.array(event.target.position, dtype=float)

        return handle

    def _add_arrow_lengths(self) -> None:
        gui, controls = self._server.gui, self._controls
        force = gui.add_slider("Arrows, mm/N", min=1.0, max=100.0, step=1.0, initial_value=1e3 * controls.force_length)
        torsion = gui.add_slider(
            "Torsion, mm/(N mm)", min=1.0, max=100.0, step=1.0, initial_value=controls.torsion_length
        )

        @force.on_update
        def _(_: object) -> None:
            controls.force_length = force.value * 1e-3

        @torsion.on_update
        def _(_: object) -> None:
            controls.torsion_length = torsion.value

    def _add_actuators(self, model: mujoco.MjModel) -> None:
        """A slider for every actuator that has a range."""
        limited = [number for number in range(model.nu) if model.actuator_ctrllimited[number]]
        if not limited:
            return
        with self._server.gui.add_folder("Actuators"):
            for number in limited:
                self._add_actuator(model, number)

    def _add_actuator(self, model: mujoco.MjModel, number: int) -> None:
        low, high = (float(end) for end in model.actuator_ctrlrange[number])
        name = model.actuator(number).name or f"actuator {number}"
        slider = self._server.gui.add_slider(
            name, min=low, max=high, step=(high - low) / 500, initial_value=min(max(0.0, low), high)
        )

        @slider.on_update
        def _(_: object) -> None:
            self._controls.controls[number] = slider.value
