"""A viewer for any loop that steps a model: call `sync()` after each step."""

from __future__ import annotations

import io
import time
from collections.abc import Mapping
from contextlib import redirect_stdout

import mujoco

from mjtactile.errors import ViewError
from mjtactile.sensor import TactileSensor
from mjtactile.units import finite_number
from mjtactile.view.controls import Controls
from mjtactile.view.frame import Frame, checked_pads, take_frame
from mjtactile.view.perturbation import Perturbation
from mjtactile.view.recording import MOST_FRAMES, Recording
from mjtactile.view.server import LOOPBACK, PORT, open_server

#: Time between updates of the page while the simulation is paused [s].
_HELD = 0.02


class Viewer:
    """Shows a simulation and its pads in a browser.

    It needs no display: the page is served at `url`. Without a connected browser or a recording, `sync` returns
    immediately. With a browser, `sync` updates the page at `rate` and executes the page's controls: pausing and
    replaying block the loop in `sync`, dragging a body writes `data.xfrc_applied` for the next step, and sliders write
    `data.ctrl`. A paused loop continues when the last browser disconnects.

    Args:
        model: compiled model.
        data: the simulation's MjData.
        pads: sensors to show by name; by default every sensor of the plugin in the model.
        host: address to listen on.
        port: first port to try; 0 for any free port.
        anyone: whether other machines may open the page and control the simulation; without it, only an address of this
            machine alone is taken as `host`.
        rate: updates of the page per second of real time, and frames of recordings per second of simulated time [Hz].

    Attributes:
        controls: requests of the page's users; programs may set them as well.
        recording: the last recording.

    Raises:
        ViewError: the model has no pads, data or pads belong to another model, the rate is not a positive number, this
            machine cannot listen on the address, or other machines could reach it.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        pads: Mapping[str, TactileSensor] | None = None,
        host: str = LOOPBACK,
        port: int = PORT,
        anyone: bool = False,
        rate: float = 30.0,
    ) -> None:
        self.model, self.data = model, data
        self.controls, self.recording = Controls(), Recording()
        if not finite_number(rate) > 0.0:
            raise ViewError(f"rate = {rate!r}; expected a positive number of updates per second, such as 30.")
        self._pads = checked_pads(model, data, pads)
        self._period = 1.0 / rate
        self._perturbation = Perturbation(model)
        self._server = open_server(host, port, anyone=anyone)
        from mjtactile.view.page import Page  # it imports viser, which open_server looks for

        self._page = Page(self._server, self.model, self._pads, self.controls)
        self._watchers = 0
        self._recorded = self._replayed = False
        self._next_frame, self._next_recorded = 0.0, -float("inf")
        self._replay_start = 0.0
        self._server.on_client_connect(self._count_watchers)
        self._server.on_client_disconnect(self._count_watchers)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def url(self) -> str:
        """Address of the page."""
        host = self._server.get_host()
        name = f"[{host}]" if ":" in host else host
        return f"http://{'localhost' if host in ('0.0.0.0', '::') else name}:{self._server.get_port()}"

    def sync(self) -> None:
        """Show the current state and execute the requests of the page's users; call it after each step."""
        if self._watchers or self.controls.recording:
            self._sync()

    def record(self) -> None:
        """Begin a new recording, with or without a connected browser."""
        self.controls.recording = True

    def stop_recording(self) -> Recording:
        """End the recording and return it."""
        self.controls.recording = self._recorded = False
        return self.recording

    def replay(self, recording: Recording | None = None) -> None:
        """Show a recording in the page; the next `sync` replays it and returns at its end.

        Args:
            recording: a recording of this model; by default the last one.

        Raises:
            ViewError: nothing was recorded, or the recording is of another model.
        """
        shown = self.recording if recording is None else recording
        if not isinstance(shown, Recording):
            raise ViewError(f"recording = {shown!r}; expected a Recording: Recording.load(path) reads one from a file.")
        first = shown.at(0.0)
        if len(first.xpos) != self.model.nbody or list(first.pads) != list(self._pads):
            raise ViewError(
                f"the recording has {len(first.xpos)} bodies and pads {list(first.pads)}, the model {self.model.nbody} "
                f"and {list(self._pads)}. Open the model that was recorded."
            )
        self.recording, self.controls.replaying = shown, True

    def close(self) -> None:
        """Stop serving the page; further calls have no effect."""
        self._perturbation.release(self.data)
        self._watchers = 0
        with redirect_stdout(io.StringIO()):  # suppresses viser's own output
            self._server.stop()

    def _count_watchers(self, _: object) -> None:
        """Called by the server's threads."""
        self._watchers = len(self._server.get_clients())
        self._next_frame = 0.0
        if not self._watchers:
            self.controls.let_go()

    def _sync(self) -> None:
        self._write_controls()
        frame = self._record()
        now = time.perf_counter()
        if self._watchers and (now >= self._next_frame or self.controls.holds):
            self._next_frame = now + self._period
            self._page.show(frame or take_frame(self.data, self._pads), self._status())
        while self._watchers and self.controls.holds:
            time.sleep(_HELD)
            self._hold()
        if self.controls.steps:
            self.controls.steps -= 1

    def _write_controls(self) -> None:
        """Apply the values of the page's sliders and the dragging handle to the simulation."""
        controls, data = self.controls, self.data
        while controls.controls:
            actuator, value = controls.controls.popitem()
            data.ctrl[actuator] = value
        target, body = controls.dragged_to, controls.body
        if target is None or body is None:
            self._perturbation.release(data)
            return
        if not self._perturbation.pulls:
            self._perturbation.grab(data, body)
        self._perturbation.drag(target)
        self._perturbation.apply(data)

    def _record(self) -> Frame | None:
        """Record a frame if it is due, and return it."""
        controls, now = self.controls, float(self.data.time)
        if not controls.recording:
            self._recorded = False
            return None
        if not self._recorded:
            self.recording, self._recorded, self._next_recorded = Recording(), True, now
        if self.recording.full:
            controls.recording = False
            return None
        if now < self._next_recorded - self._period:  # the simulation was reset
            self._next_recorded = now
        # A tolerance of half a step keeps frames evenly spaced if the step divides their period.
        if now < self._next_recorded - 0.5 * float(self.model.opt.timestep):
            return None
        self._next_recorded += self._period
        frame = take_frame(self.data, self._pads)
        self.recording.append(frame)
        return frame

    def _hold(self) -> None:
        """Update the page while the simulation is paused: continue a replay, or show the current state."""
        now = time.perf_counter()
        if now < self._next_frame:
            return
        self._next_frame = now + self._period
        if not self.controls.replaying:
            self._replayed = False
            self._write_controls()
            self._page.show(take_frame(self.data, self._pads), self._status())
            return
        if not self.recording.frames:
            self.controls.replaying = False
            return
        if not self._replayed:
            self._replayed, self._replay_start = True, now
        after = (now - self._replay_start) * self.controls.speed
        self._page.show(self.recording.at(after), "replay")
        if after > self.recording.duration:
            self.controls.replaying = self._replayed = False

    def _status(self) -> str:
        controls = self.controls
        said = ["paused" if controls.paused else "running"]
        if controls.recording:
            said.append(f"recording, {len(self.recording.frames)} frames")
        elif self.recording.full:
            said.append(f"recorded {MOST_FRAMES} frames, no more are kept")
        elif self.recording.frames:
            said.append(f"recorded {self.recording.duration:.2f} s")
        return ", ".join(said)
