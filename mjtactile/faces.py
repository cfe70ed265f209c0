"""Flat faces of rigid bodies as the compiled core presses them: cells cut once, in the face's own frame.

The frame depends on the body's geometry alone: which pose a face was first seen in leaves no trace in its cells.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, affinity

from mjtactile.cells import Cells
from mjtactile.errors import FootprintError
from mjtactile.facing import FlatPart, lower_surface
from mjtactile.gap import Box, HalfSpace, Pose, Shape
from mjtactile.influence import InfluenceMatrices
from mjtactile.native import contiguous, library, native_pad, pointer
from mjtactile.pad import Array
from mjtactile.partition import outline_cells
from mjtactile.planar import areal
from mjtactile.search import Rectangle

#: Bodies reach no further than this from their middle [m]; what does is looked at anew at every pose.
_FARTHEST = 1.0
#: Directions of faces in their body's frame are rounded to this [-]: rounding must not make another face of it.
_DIRECTION = 1e-7
_EVERYWHERE = Rectangle(-_FARTHEST, -_FARTHEST, _FARTHEST, _FARTHEST)
#: Cosine of the angle up to which a face is looked for that leans when it is first seen: 8 degrees.
_NEARLY = 0.99
#: Share of what is clear above a face by which it may lean over its own width before it is looked at anew, and how much
#: is tried, over the facing gap.
_LEAN, _CLEARANCES = 0.5, (5.0, 25.0, 100.0)


@dataclass(frozen=True, eq=False)
class BodyFace:
    """A flat face that a body turns to pads, wherever over the sheet it stands.

    Attributes:
        rotation: from the body's frame to the face's, whose z axis is the pad's when the face lies on it, (3, 3).
        height: of the face in that frame [m].
        outline: in that frame [m].
        most_slope: to which the body may lean before other parts of it may touch [-].
    """

    rotation: Array
    height: float
    outline: Polygon | MultiPolygon
    most_slope: float

    def over(self, sheet: Polygon, place: tuple[float, float, float]) -> BodyFace | None:
        """The part over a sheet, in the pad frame, of the face at (x, y) [m], turned by an angle [rad], if any."""
        x, y, angle = place
        turned = affinity.rotate(self.outline, angle, origin=(0, 0), use_radians=True)
        part = areal(affinity.translate(turned, x, y).intersection(sheet))
        return None if part.is_empty else BodyFace(self.rotation, self.height, part, self.most_slope)


class NativeFace:
    """A face's cells as the core holds them.

    Attributes:
        handle: what the core's functions take.
    """

    def __init__(self, face: BodyFace, count: int, *, cut: bool = False) -> None:
        cells = outline_cells(face.outline, count)
        ends, sides = _cell_edges(cells)
        corners = contiguous(shapely.get_coordinates(face.outline.convex_hull)[:-1])
        arrays = [contiguous(one) for one in (cells.centroids, cells.areas, cells.half_space.inverse_distance)]
        rotation, core = contiguous(face.rotation), library()
        self.handle = ctypes.c_void_p(
            core.mjt_face_new(
                pointer(rotation),
                ctypes.c_double(face.height),
                ctypes.c_double(face.most_slope),
                ctypes.c_size_t(cells.count),
                *(pointer(one) for one in arrays),
                ctypes.c_size_t(len(ends)),
                pointer(ends),
                pointer(sides),
                ctypes.c_size_t(len(corners)),
                pointer(corners),
                ctypes.c_int(cut),
            )
        )
        self._finalizer = weakref.finalize(self, core.mjt_face_free, self.handle)

    def nodal_forces(
        self, influence: InfluenceMatrices, pose: Pose, wrench: Array, *, tilting: bool, friction: float | None
    ) -> Array | None:
        """Nodal forces (nodes y, nodes x, 3) [N] of the face at a pose in the pad frame under a wrench (6,) [N, N m].

        None where the NumPy reference has to take over.
        """
        forces = np.empty((*influence.surface.node_shape, 3))
        numbers, wanted = contiguous([*pose.position, *pose.rotation.ravel()]), contiguous(wrench)
        found = library().mjt_face_press(
            native_pad(influence).handle,
            self.handle,
            pointer(numbers),
            pointer(wanted),
            ctypes.c_int(tilting),
            ctypes.c_double(-1.0 if friction is None else friction),
            pointer(forces),
        )
        return forces if found else None


def body_face(
    shapes: Mapping[int, Shape], local: Mapping[int, Pose], pose: Pose, *, facing_gap: float, level: bool
) -> BodyFace | None:
    """The flat face that a body turns to a pad, with nothing else of the body as low; None where it has none.

    Args:
        shapes: of the body's geoms.
        local: their poses in the body's frame.
        pose: of the body in the pad frame.
        facing_gap: what is no higher than this above the first touch faces the pad [m].
        level: whether the face must be parallel to the pad, because the body cannot tilt.
    """
    if any(isinstance(shape, HalfSpace) for shape in shapes.values()):
        return None
    first = _flat_part(shapes, local, pose, facing_gap, level=False)
    if first is not None:
        rotation = _face_axes(_normal(first, pose))
        height = float(((first.corners - pose.position) @ pose.rotation @ rotation.T)[:, 2].mean())
    else:
        # A face that leans when it is first seen is the face that it is once it lies on the pad.
        upward = _leaning_normal(shapes, local, pose)
        if upward is None:
            return None
        rotation = _face_axes(upward)
        turned = Pose(np.zeros(3), rotation)
        height = min(
            shape.lowest(composed(turned, local[geom]), _EVERYWHERE, -_FARTHEST) for geom, shape in shapes.items()
        )
    lying = Pose(np.array([0.0, 0.0, -height]), rotation)
    part = _flat_part(shapes, local, lying, facing_gap, level=False)
    if part is None:
        return None
    width = float(np.ptp(shapely.get_coordinates(part.outline), axis=0).max())
    lean = 1e-7 if level else _LEAN * _clearance(shapes, local, lying, facing_gap, part)
    return BodyFace(rotation, height, part.outline, lean / width)


def _clearance(
    shapes: Mapping[int, Shape], local: Mapping[int, Pose], lying: Pose, facing_gap: float, part: FlatPart
) -> float:
    """How far above its face, at least, all else of a body begins [m].

    A body that may tilt lies on the pad as its wrench has it: that contacts in MuJoCo, which give way, lean it a little
    matters only once something else of it might touch.
    """
    clear = facing_gap
    for gap in (facing_gap * factor for factor in _CLEARANCES):
        wider = _flat_part(shapes, local, lying, gap, level=False)
        if wider is None or wider.outline.symmetric_difference(part.outline).area > 1e-6 * part.outline.area:
            break
        clear = gap
    return clear


def _flat_part(
    shapes: Mapping[int, Shape], local: Mapping[int, Pose], pose: Pose, facing_gap: float, *, level: bool
) -> FlatPart | None:
    """The flat face of the whole body, over the sheet or beside it."""
    x, y = pose.position[:2]
    everywhere = Rectangle(x - _FARTHEST, y - _FARTHEST, x + _FARTHEST, y + _FARTHEST)
    placed = [(shape, composed(pose, local[geom])) for geom, shape in shapes.items()]
    try:
        surface = lower_surface(placed, everywhere, depth=_FARTHEST, facing_gap=facing_gap)
    except FootprintError:
        return None
    return surface.flat_part(facing_gap, level=level)


def composed(body: Pose, local: Pose) -> Pose:
    """Pose of a geom in the pad frame, from its body's and its own in the body's frame."""
    return Pose(body.position + body.rotation @ local.position, body.rotation @ local.rotation)


def _leaning_normal(shapes: Mapping[int, Shape], local: Mapping[int, Pose], pose: Pose) -> Array | None:
    """Upward normal in the body's frame of the face of a box that is nearest to lying on the pad; None for none."""
    towards = -pose.rotation[2]
    axes = [
        sign * local[geom].rotation.T for geom, shape in shapes.items() if isinstance(shape, Box) for sign in (1, -1)
    ]
    if not axes:
        return None
    normals = np.concatenate(axes)
    nearest = normals[int((normals @ towards).argmax())]
    return None if nearest @ towards < _NEARLY else -nearest


def _normal(part: FlatPart, pose: Pose) -> Array:
    """The face's upward normal in the body's frame."""
    offset = part.corners - part.corners.mean(axis=0)
    slope, *_ = np.linalg.lstsq(offset[:, :2], offset[:, 2], rcond=None)
    upward = pose.rotation.T @ np.array([-slope[0], -slope[1], 1.0])
    rounded = np.round(upward / np.linalg.norm(upward) / _DIRECTION) * _DIRECTION + 0.0
    return rounded / np.linalg.norm(rounded)


def _face_axes(normal: Array) -> Array:
    """Axes of the face in the body's frame, as rows, shape (3, 3)."""
    along = np.zeros(3)
    along[int(np.argmin(np.abs(normal)))] = 1.0
    x = along - normal * (along @ normal)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal])


def _cell_edges(cells: Cells) -> tuple[Array, np.ndarray]:
    """Distinct edges (count, 2 ends, 2) [m], and the cells to their left and right, -1 for none."""
    first, steps = cells.steps
    sides = np.full((len(first), 2), -1, dtype=np.int32)
    coordinates = steps.tocoo()
    for side, sign in enumerate((1.0, -1.0)):
        there = coordinates.data == sign
        sides[coordinates.row[there], side] = coordinates.col[there]
    return contiguous(cells.edges[first]), np.ascontiguousarray(sides)
