"""The page: the scene with wrench arrows and contact outlines, heat maps and forces beside it, and its controls."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import viser
from mjviser import ViserMujocoScene

from mjtactile._types import Array
from mjtactile.sensor import TactileSensor
from mjtactile.view.arrows import force_arrow, torsion_arrow
from mjtactile.view.control_panel import ControlPanel
from mjtactile.view.controls import Controls
from mjtactile.view.frame import Frame, ShownPad
from mjtactile.view.heat_map import Scale, heat_map, heat_map_html
from mjtactile.view.tiles import Tiles

#: Number of frames in the plot of forces.
_HISTORY = 300
#: Width of the panel with a pad's tiles [pixels].
_PANEL_WIDTH = 430
_FORCE_COLOUR, _TORSION_COLOUR, _OUTLINE_COLOUR = (220, 50, 40), (60, 90, 220), (255, 170, 0)
#: Colours of the pads' lines in the plot.
_LINES = ("#d62728", "#1f77b4", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#17becf", "#7f7f7f")
#: Distance of the camera over the model's extent [-], its field of view [rad], and the direction to it.
_DISTANCE, _VIEW, _DIRECTION = 1.3, 0.8, np.array([0.45, -0.8, 0.4])
#: Height of the outline above the pad's surface, so that it is visible [m].
_LIFT = 2e-4


class Page:
    """The page of a model and its pads. Everything runs in the simulation's thread, except callbacks of controls."""

    def __init__(
        self, server: viser.ViserServer, model: mujoco.MjModel, pads: Mapping[str, TactileSensor], controls: Controls
    ) -> None:
        self._server, self._controls, self._pads = server, controls, pads
        server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        _place_camera(server, model)
        # The scene's own control: it changes the size of arrows.
        self._scene = ViserMujocoScene(server, copy.copy(model), num_envs=1)
        self._scene.camera_tracking_enabled = False
        # Without a graphics card, shadows take a browser longer than all the rest.
        server.scene.configure_default_lights(cast_shadow=False)
        server.gui.main_panel.dock_right()
        self._marks = {name: PadMarks(server, number, sensor) for number, (name, sensor) in enumerate(pads.items())}
        self._tiles = {name: Tiles.of(sensor.pad) for name, sensor in pads.items()}
        self._maps = self._heat_maps()
        self._history: deque[tuple[float, ...]] = deque(maxlen=_HISTORY)
        self._plot = self._force_plot()
        self._panel = ControlPanel(server, model, controls)
        self._scale = Scale()

    def show(self, frame: Frame, status: str) -> None:
        """Update the page."""
        with self._server.atomic():
            self._scene.update_from_arrays(
                frame.xpos[None], frame.xmat[None], frame.mocap_pos[None], frame.mocap_quat[None]
            )
            peak = self._scale.follow([pad.readings for pad in frame.pads.values()])
            for name, pad in frame.pads.items():
                self._marks[name].show(pad, self._controls)
            self._maps.content = "".join(self._map_of(name, pad, peak) for name, pad in frame.pads.items())
            self._note_forces(frame)
            self._panel.follow(frame, status)

    def _map_of(self, name: str, pad: ShownPad, peak: float) -> str:
        tiles = self._tiles[name]
        picture = heat_map(tiles.laid_out(pad.readings), peak)
        return heat_map_html(name, _label(name, pad, peak), picture, pad.outline, tiles)

    def _heat_maps(self) -> viser.GuiHtmlHandle:
        gui = self._server.gui
        panel = gui.add_panel()
        with panel.add_tab("Pads"):
            maps = gui.add_html("")
            depths = sorted({", ".join(tiles.depths) for tiles in self._tiles.values()})
            gui.add_markdown(f"Tiles: von Mises stress at {' or '.join(depths)} depth.")
        panel.dock_left()
        panel.set_width(_PANEL_WIDTH)
        return maps

    def _force_plot(self) -> viser.GuiUplotHandle:
        nothing = tuple(np.zeros(1) for _ in range(len(self._pads) + 1))
        series: list[Any] = [{"label": "time, s"}]
        series += [
            {"label": name, "stroke": _LINES[number % len(_LINES)], "width": 2}
            for number, name in enumerate(self._pads)
        ]
        with self._server.gui.add_folder("Force on each pad, N"):
            return self._server.gui.add_uplot(
                nothing, tuple(series), scales={"x": {"time": False, "auto": True}}, aspect=1.8
            )

    def _note_forces(self, frame: Frame) -> None:
        if self._history and frame.time < self._history[-1][0]:
            self._history.clear()
        if not self._history or frame.time > self._history[-1][0]:
            sizes = (float(np.linalg.norm(pad.wrench[:3])) for pad in frame.pads.values())
            self._history.append((frame.time, *sizes))
        self._plot.data = tuple(np.array(self._history).T.copy())


class PadMarks:
    """Arrows and outline of the pad of that number in the scene, in a frame that moves with the pad."""

    def __init__(self, server: viser.ViserServer, number: int, sensor: TactileSensor) -> None:
        self._pad = sensor.pad
        scene, root, size = server.scene, f"/pads/{number}", min(sensor.pad.size)
        self._frame = scene.add_frame(root, show_axes=False)
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        thick: dict[str, Any] = {"shaft_radius": 0.05 * size, "head_radius": 0.12 * size, "head_length": 0.25 * size}
        self._force = scene.add_arrows(f"{root}/force", nothing, _FORCE_COLOUR, visible=False, **thick)
        self._torsion = scene.add_arrows(f"{root}/torsion", nothing, _TORSION_COLOUR, visible=False, **thick)
        self._outline = scene.add_line_segments(
            f"{root}/outline", nothing, _OUTLINE_COLOUR, thickness=0.02 * size, visible=False
        )

    def show(self, pad: ShownPad, controls: Controls) -> None:
        """Update arrows and outline."""
        self._frame.position, self._frame.wxyz = pad.position, pad.quat
        _show_lines(self._force, _one(force_arrow(pad.wrench, controls.force_length, self._pad)))
        _show_lines(self._torsion, _one(torsion_arrow(pad.wrench, controls.torsion_length, self._pad)))
        height = self._pad.surface.height(pad.outline[..., 0], pad.outline[..., 1]) + _LIFT
        _show_lines(self._outline, np.concatenate([pad.outline, height[..., None]], axis=-1))


def _one(arrow: Array | None) -> Array:
    return np.empty((0, 2, 3)) if arrow is None else arrow[None]


def _show_lines(handle: Any, points: Array) -> None:
    """Replace the line segments of a handle by others (n, 2, 3) [m]; hide it if there are none."""
    if len(points):
        handle.points = points.astype(np.float32)
    if handle.visible != bool(len(points)):
        handle.visible = bool(len(points))


def _label(name: str, pad: ShownPad, peak: float) -> str:
    force = float(np.linalg.norm(pad.wrench[:3]))
    return f"{name}: {force:.2f} N, up to {pad.readings.max() / 1e3:.1f} kPa (brightest: {peak / 1e3:.1f} kPa)"


def _place_camera(server: viser.ViserServer, model: mujoco.MjModel) -> None:
    camera, centre = server.initial_camera, np.array(model.stat.center)
    camera.look_at = centre
    camera.position = centre + _DISTANCE * float(model.stat.extent) * _DIRECTION / np.linalg.norm(_DIRECTION)
    camera.fov = _VIEW
    camera.near = float(model.stat.extent) * 0.01
