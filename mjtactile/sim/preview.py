"""A picture of a pad's position and orientation on its body, before any simulation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._files import check_figure, save_figure
from mjtactile._installed import require
from mjtactile.errors import SceneError, of_type, shortened
from mjtactile.sim.mujoco_library import check_data, element_id, is_pad_sensor, pad_sensor_names
from mjtactile.sim.pad_geom import pad_pieces
from mjtactile.sim.render import render_scene
from mjtactile.sim.wrench import PadFrame, geom_frame
from mjtactile.units import is_whole

_PAD_COLOUR = (1.0, 0.6, 0.1, 1.0)
#: Colours of the arrows along the pad's x, y and z axes.
_AXIS_COLOURS = ((0.9, 0.1, 0.1, 1.0), (0.1, 0.7, 0.1, 1.0), (0.15, 0.3, 1.0, 1.0))
#: Distances of the camera for the close-up and the wide view, in diagonals of the pad [-].
_DISTANCES = (3.5, 18.0)
#: Inclination of the camera's line of sight to the pad's normal [-]; an oblique view shows the pad's thickness.
_LEAN = 0.8
_AMBIENT = 0.5  # intensity of ambient light [-]
_SIDE = 480  # of each picture [pixels]
#: Groups of geoms that MuJoCo draws unless it is told otherwise.
_DRAWN = (0, 1, 2)
_BOX, _MESH = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_MESH)


def preview_pad(
    model: mujoco.MjModel,
    pad: str,
    path: str | Path | None = None,
    *,
    data: mujoco.MjData | None = None,
    groups: Sequence[int] = (0, 1, 2),
) -> npt.NDArray[np.uint8]:
    """Draw a pad's position and orientation: a close-up on the left, a view with its surroundings on the right.

    The pad is orange. Arrows from the middle of its sensing surface are its axes: x red, y green, z blue. z must point
    out of the finger. A geom that hides the orange face lies in front of the pad: it takes contacts that the pad does
    not feel.

    Args:
        model: compiled model.
        pad: name of the pad's sensor, or of its geom.
        path: image file to write, such as .png; None to write none.
        data: state of the model, after `mj_forward` or `mj_step`; if None, its first keyframe or, without one, `qpos0`.
        groups: groups of the geoms that are drawn besides the pad, among 0, 1 and 2. Many models have collision geoms
            in one group and visual geoms in another.

    Returns:
        RGB, shape (height, width, 3), top row first.

    Raises:
        SceneError: the model has no such pad, `data` belongs to another model, or a group is not drawn.
        RenderError: OpenGL does not work.
        OutputError: the file cannot be written.
    """
    of_type(mujoco.MjModel, "model", model, SceneError, "MjSpec.compile() makes one")
    geom = _pad_geom(model, pad)
    if np.ndim(groups) != 1 or not all(is_whole(one) and one in _DRAWN for one in groups):
        raise SceneError(f"groups = {shortened(groups)}; expected groups of geoms among {_DRAWN}, which MuJoCo draws.")
    if path is not None:
        check_figure(Path(path))
    if data is None:
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
    check_data(model, data, "the model")
    frame, pieces = geom_frame(model, data, geom), pad_pieces(model, geom)
    hidden = set(np.flatnonzero(~np.isin(model.geom_group, groups)).tolist()) - set(pieces)
    diagonal = 2.0 * float(model.geom_rbound[geom])
    if model.geom_type[geom] == _BOX:
        diagonal = float(np.linalg.norm(2 * model.geom_size[geom, :2]))
    pictures = [
        render_scene(
            model,
            data,
            _SIDE,
            _SIDE,
            camera=_camera(frame, distance * diagonal),
            mark=partial(_mark, pieces=pieces, hidden=hidden, frame=frame, length=0.2 * distance * diagonal),
        )
        for distance in _DISTANCES
    ]
    picture = np.concatenate(pictures, axis=1)
    if path is not None:
        save_figure(Path(path), _as_figure(picture), dpi=100)
    return picture


def _pad_geom(model: mujoco.MjModel, pad: str) -> int:
    """Id of the pad's geom of that name, or of the pad's sensor of that name."""
    sensor = element_id(model, mujoco.mjtObj.mjOBJ_SENSOR, pad, "pad")
    is_sensor = is_pad_sensor(model, sensor)
    geom = int(model.sensor_objid[sensor]) if is_sensor else mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, pad)
    if geom < 0 or model.geom_type[geom] not in (_BOX, _MESH):
        raise SceneError(f"the model has no pad '{pad}'. Available: {', '.join(pad_sensor_names(model)) or 'none'}.")
    return geom


def _camera(frame: PadFrame, distance: float) -> mujoco.MjvCamera:
    """A camera that looks at the middle of the sensing surface obliquely, from a distance [m]."""
    x, y, normal = frame.rotation.T
    aside = normal + _LEAN * (0.6 * x - y)
    along = -aside / np.linalg.norm(aside)
    view = mujoco.MjvCamera()
    view.lookat[:] = frame.position
    view.distance = distance
    view.azimuth = float(np.degrees(np.arctan2(along[1], along[0])))
    view.elevation = float(np.degrees(np.arcsin(along[2])))
    return view


def _mark(scene: Any, pieces: list[int], hidden: set[int], frame: PadFrame, length: float) -> None:
    """Colour the pad in a scene, add its axes as arrows, and add light."""
    if scene.nlight:
        scene.lights[0].ambient[:] = np.maximum(scene.lights[0].ambient, _AMBIENT)
    for shown in scene.geoms[: scene.ngeom]:
        if shown.objtype == mujoco.mjtObj.mjOBJ_GEOM and shown.objid in pieces:
            shown.rgba[:] = _PAD_COLOUR
        elif shown.objtype == mujoco.mjtObj.mjOBJ_GEOM and shown.objid in hidden:
            shown.rgba[3] = 0.0
    for axis, colour in zip(frame.rotation.T, _AXIS_COLOURS, strict=True):
        if scene.ngeom >= scene.maxgeom:
            return
        arrow = scene.geoms[scene.ngeom]
        nothing = np.zeros(3)
        mujoco.mjv_initGeom(
            arrow, mujoco.mjtGeom.mjGEOM_ARROW, nothing, nothing, np.zeros(9), np.array(colour, dtype=np.float32)
        )
        end = frame.position + length * axis
        mujoco.mjv_connector(arrow, mujoco.mjtGeom.mjGEOM_ARROW, 0.05 * length, frame.position, end)
        scene.ngeom += 1


def _as_figure(picture: npt.NDArray[np.uint8]) -> Any:
    require("figures")
    from matplotlib.figure import Figure

    height, width = picture.shape[:2]
    figure = Figure(figsize=(width / 100, height / 100))
    figure.figimage(picture)
    return figure
