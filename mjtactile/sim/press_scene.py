"""Press scenes: a pad, an indenter on slide joints over it, and a force that pushes until the contact is steady.

Lengths are metres, forces newtons, in the pad frame: z out of the pad, pressing is -z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import shapely
import trimesh
from shapely import Polygon

from mjtactile._types import Array
from mjtactile.contact.options import vector
from mjtactile.errors import IndenterError, SceneError, of_type
from mjtactile.geometry.indenter import Indenter, mesh_indenter, punch
from mjtactile.geometry.lower_surface import LowerSurface
from mjtactile.geometry.planar import areal, polygons_of, support_points
from mjtactile.pad import Pad, require_pad
from mjtactile.sim.mjcf import press_mjcf
from mjtactile.sim.mujoco_library import check_data, element_id
from mjtactile.sim.wrench import contact_wrench, site_frame
from mjtactile.units import GRAM_FORCE, finite_number

#: Distance of feet from the pad's edge [m], so that they do not creep over it during a long press.
EDGE_MARGIN = 1e-4
#: A press is settled when its force has been this close to the commanded one, relative, for `STEADY_STEPS` steps.
FORCE_TOLERANCE = 1e-4
STEADY_STEPS = 5
#: Simulated time after which a press that has not settled is given up [s].
TIME_LIMIT = 0.2
#: Number of points along each axis of the grid on which the first contact point with a curved pad is searched.
_SAMPLES = 129


@dataclass(frozen=True, kw_only=True, eq=False)
class PressResult:
    """Result of a press."""

    time: float  #: simulated time until it settled [s]
    steps: int  #: number of steps
    wrench: Array  #: wrench of the indenter on the pad, in the pad frame [N, N m], shape (6,)
    error: float  #: difference between contact force and commanded force, relative to the commanded force [-]


def press_spec(
    shape: str | Path | Indenter | trimesh.Trimesh,
    *,
    shift: tuple[float, float] = (0.0, 0.0),
    rotate_deg: float = 0.0,
    pad: Pad | None = None,
    tilt_free: bool = False,
) -> mujoco.MjSpec:
    """A press scene as an editable `MjSpec`; arguments and errors as in `press_scene`."""
    indenter = _as_indenter(shape)
    if not isinstance(tilt_free, bool | np.bool_):
        raise SceneError(f"tilt_free is of type {type(tilt_free).__name__}; expected True or False.")
    pad = Pad() if pad is None else require_pad(pad)
    feet = _feet(indenter, pad, shift, rotate_deg)
    height = 0.0 if pad.surface.is_flat else _touching_height(indenter, pad, shift, rotate_deg)
    place = (*shift, height)
    text = press_mjcf(indenter, pad=pad, shift=place, rotate_deg=rotate_deg, feet=feet, tilt_free=tilt_free)
    return mujoco.MjSpec.from_string(text)


def press_scene(
    shape: str | Path | Indenter | trimesh.Trimesh,
    *,
    shift: tuple[float, float] = (0.0, 0.0),
    rotate_deg: float = 0.0,
    pad: Pad | None = None,
    tilt_free: bool = False,
) -> mujoco.MjModel:
    """A compiled model with an indenter just above a pad; `press` presses it.

    A flat punch that overhangs the pad's edge has feet only on the part of its face over the pad, balanced about that
    part's centroid.

    Args:
        shape: one of the seven punches by name, an `Indenter`, or a watertight mesh in metres or its file.
        shift: position of the indenter's origin in the pad frame [m].
        rotate_deg: counter-clockwise rotation about the indenter's origin, before the shift [deg].
        pad: the pad, of which only the shape is used; the default pad if None. On a flat pad, flat punches have feet.
            On a curved pad their solid collides, in convex parts if the face has notches or holes.
        tilt_free: whether the indenter may rotate about its origin, through which the force then passes.

    Raises:
        IndenterError: unknown shape, or a mesh that is not a valid solid.
        PadError: `pad` is no pad.
        SceneError: the indenter is off the pad; `tilt_free` is no bool; or the pad is curved, and the indenter's face
            has a hole though it is not the prism over that face.
    """
    return press_spec(shape, shift=shift, rotate_deg=rotate_deg, pad=pad, tilt_free=tilt_free).compile()


def press(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    force: npt.ArrayLike,
    *,
    tolerance: float = FORCE_TOLERANCE,
    time_limit: float = TIME_LIMIT,
) -> PressResult:
    """Apply a force to the indenter of a press scene and step until the contact force is steady.

    The press continues from the state in `data`; call `mujoco.mj_resetData` first for an independent press.

    Args:
        model: model of a press scene, from `press_scene` or scenes/press*.xml.
        data: its state, which is advanced in place.
        force: force on the indenter in the pad frame [N], shape (3,), at most 2.5 N along each axis; see
            `force_vector`. Wider ranges of the actuators, `model.actuator_ctrlrange`, allow more.
        tolerance: allowed difference of the contact force, relative to the force's magnitude [-].
        time_limit: simulated time after which the press has failed [s].

    Raises:
        SceneError: the model is not a press scene, `data` belongs to another model, a number is out of range, the force
            pulls or exceeds the actuators' range, or the press does not settle; the message gives the remaining
            difference.
    """
    of_type(mujoco.MjModel, "model", model, SceneError, "press_scene(...) makes one")
    of_type(mujoco.MjData, "data", data, SceneError, "mujoco.MjData(model) makes one")
    check_data(model, data, "the press scene")
    command = vector("force", force, SceneError)
    tolerance, time_limit = _positive("tolerance", tolerance), _positive("time_limit", time_limit)
    actuators = [_id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, f"press_{axis}") for axis in "xyz"]
    pad = _id(model, mujoco.mjtObj.mjOBJ_GEOM, "pad")
    surface = _id(model, mujoco.mjtObj.mjOBJ_SITE, "pad_surface")
    _check_force(command, model.actuator_ctrlrange[actuators])
    data.ctrl[actuators] = command
    magnitude = float(np.linalg.norm(command))
    start, steady, error, wrench = data.time, 0, math.inf, np.zeros(6)
    for step in range(1, math.ceil(time_limit / model.opt.timestep) + 1):
        mujoco.mj_step(model, data)
        wrench = contact_wrench(model, data, pad, site_frame(data, surface))
        error = float(np.linalg.norm(wrench[:3] - command)) / magnitude
        steady = steady + 1 if error <= tolerance else 0
        if steady == STEADY_STEPS:
            return PressResult(time=data.time - start, steps=step, wrench=wrench, error=error)
    raise SceneError(_why_not_settled(command, wrench, error, time_limit, float(model.geom_friction[pad, 0])))


def _as_indenter(shape: str | Path | Indenter | trimesh.Trimesh) -> Indenter:
    if isinstance(shape, Indenter):
        return shape
    # A punch has no dot in its name, a file has.
    return punch(shape) if isinstance(shape, str) and not Path(shape).suffix else mesh_indenter(shape)


def _feet(indenter: Indenter, pad: Pad, shift: tuple[float, float], rotate_deg: float) -> Array | None:
    """Positions of a flat indenter's feet in its own frame [m], shape (n, 2); None if it is not flat."""
    face = indenter.outline_at(shift=shift, rotate_deg=rotate_deg)
    loaded = areal(face.intersection(_rectangle(pad, 0.0)))
    if loaded.area == 0.0:
        raise SceneError(
            f"indenter '{indenter.name}' shifted by ({shift[0] * 1e3:.6g}, {shift[1] * 1e3:.6g}) mm misses the pad, "
            f"which reaches to ({pad.size[0] * 500:.6g}, {pad.size[1] * 500:.6g}) mm from its middle. Shift it less."
        )
    if indenter.outline is None:
        return None
    if not pad.surface.is_flat:
        if any(polygon.interiors for polygon in polygons_of(loaded)) and not indenter.convex_solids:
            raise SceneError(
                f"indenter '{indenter.name}' has a hole in its face, which MuJoCo would fill where it collides with a "
                "curved pad: only prisms over their face are cut into convex parts. Press with such a prism, or build "
                "the scene of convex pieces and read it with TactileSensor."
            )
        return None
    inside = _rectangle(pad, EDGE_MARGIN)
    if inside.contains(face):
        return support_points(indenter.outline)
    try:
        feet = support_points(loaded, areal(loaded.intersection(inside)))
    except IndenterError as error:
        raise SceneError(
            f"only a sliver of indenter '{indenter.name}', {loaded.area * 1e6:.3g} mm2, is over the pad. Shift it less."
        ) from error
    turn = math.radians(rotate_deg)
    return (feet - shift) @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])


def _touching_height(indenter: Indenter, pad: Pad, shift: tuple[float, float], rotate_deg: float) -> float:
    """Height z of the indenter's origin in the pad frame at which it touches a curved pad [m]."""
    turn = math.radians(rotate_deg)
    rotation = np.array(
        [[math.cos(turn), -math.sin(turn), 0.0], [math.sin(turn), math.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    )
    x, y = np.meshgrid(*(np.linspace(-side / 2, side / 2, _SAMPLES) for side in pad.size))
    above = LowerSurface.of_solid(indenter.solid).heights(np.array([*shift, 0.0]), rotation, x.ravel(), y.ravel())
    return float(np.max(pad.surface.height(x, y).ravel() - above))


def _rectangle(pad: Pad, margin: float) -> Polygon:
    x, y = pad.size[0] / 2 - margin, pad.size[1] / 2 - margin
    return shapely.box(-x, -y, x, y)


def _id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    found = element_id(model, kind, name, "name")
    if found < 0:
        count = {
            mujoco.mjtObj.mjOBJ_ACTUATOR: model.nu,
            mujoco.mjtObj.mjOBJ_GEOM: model.ngeom,
            mujoco.mjtObj.mjOBJ_SITE: model.nsite,
        }[kind]
        names = [mujoco.mj_id2name(model, kind, i) for i in range(count)]
        label = mujoco.mju_type2Str(kind)
        raise SceneError(
            f"{label} '{name}' does not exist in the model. Available: {[n for n in names if n]}. "
            "Press scenes come from press_scene or scenes/press.xml."
        )
    return found


def _positive(name: str, value: float) -> float:
    if not finite_number(value) > 0.0:
        raise SceneError(f"{name} = {value!r}; expected a positive finite number.")
    return float(value)


def _check_force(command: Array, ranges: Array) -> None:
    if command[2] >= 0.0:
        raise SceneError(f"force = {command} N does not press: its z component must be negative, into the pad.")
    if (command < ranges[:, 0]).any() or (command > ranges[:, 1]).any():
        most = float(np.abs(ranges).min())
        raise SceneError(
            f"force = {command} N exceeds the actuators' range {ranges.tolist()} N: at most {most:g} N "
            f"({most / GRAM_FORCE:.4g} gf) along each axis. For more, make the scene in Python and widen the ctrlrange "
            "of press_x, press_y and press_z."
        )


def _why_not_settled(command: Array, wrench: Array, error: float, time_limit: float, friction: float) -> str:
    message = f"after {time_limit:g} s the pad feels {wrench[:3]} N where {command} N were commanded: {error:.3%} off."
    if np.hypot(*command[:2]) > friction * -command[2]:
        most = math.degrees(math.atan(friction))
        return message + f" Friction {friction:g} holds forces tilted by up to {most:.3g} degrees: the indenter slides."
    if wrench[2] >= 0.0:
        return message + " Nothing presses on the pad: has the indenter slid or tipped off it?"
    return message + " The indenter may be tipping or rocking: press nearer its middle, or allow more time."
