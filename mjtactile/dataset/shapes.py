"""Shapes by name for datasets and recognition: the seven punches, further flat punches, a sphere, and mesh files.

Lengths are metres. A shape at size 1 has the dimensions given here; sizes multiply every length in its plane.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
from shapely import MultiPolygon, Polygon, affinity

from mjtactile._files import unusable, why_unread
from mjtactile._types import Array
from mjtactile.errors import IndenterError
from mjtactile.geometry.indenter import MOST_BYTES, Indenter, body_name, mesh_indenter, sphere
from mjtactile.geometry.outlines import INDENTER_NAMES, ellipse, punch_outline
from mjtactile.geometry.solid import extrude

#: Radius of the disc of Aoyagi 2008, with which forces are applied for their recognition [m].
DISC_RADIUS = 3e-3
#: Radius of the sphere at size 1, that of models/xml/sphere.xml [m].
SPHERE_RADIUS = 6e-3

_HALF_BOX = 5e-3
_PUNCH_HEIGHT = 5e-3


def _hexagon() -> Polygon:
    """Regular, across flats 10 mm, like the octagon."""
    angles = np.pi / 6 + np.pi / 3 * np.arange(6)
    return Polygon(_HALF_BOX / math.cos(math.pi / 6) * np.column_stack([np.cos(angles), np.sin(angles)]))


def _cross() -> Polygon:
    """Two bars of 10 mm by 3.6 mm across each other."""
    long, short = _HALF_BOX, 1.8e-3
    quarter = np.array([(long, -short), (long, short), (short, short)])
    turns = [np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), k) for k in range(4)]
    return Polygon(np.concatenate([quarter @ turn.T for turn in turns]))


_OWN = {"disc": lambda: ellipse(DISC_RADIUS, DISC_RADIUS), "hexagon": _hexagon, "cross": _cross}

#: Names of all shapes; the file of a mesh whose lowest face is flat is a shape as well.
SHAPE_NAMES: tuple[str, ...] = (*INDENTER_NAMES, *_OWN, "sphere")


def shape_face(shape: str) -> Polygon | MultiPolygon | None:
    """Outline of the flat face of a shape or a mesh file at size 1, about its origin [m]; None for the sphere.

    Raises:
        IndenterError: there is no such shape, or it has no flat face.
    """
    if shape == "sphere":
        return None
    return _named_face(shape) if shape in SHAPE_NAMES else _mesh_face(shape, mesh_digest(shape))


def mesh_digest(shape: str) -> str:
    """SHA-256 of the content of a shape's mesh file, 64 hexadecimal digits.

    Raises:
        IndenterError: there is no such shape, or the file cannot be read.
    """
    path = Path(shape)
    if not path.suffix:
        raise IndenterError(f"shape '{shape}' does not exist. Available: {list(SHAPE_NAMES)}, or a mesh file.")
    try:
        found = unusable(path)
        if found is None:
            state = path.stat()
            return _digest(path.absolute(), state.st_size, state.st_mtime_ns)
        why = f"it is {found}"
    except (OSError, ValueError) as error:
        why = why_unread(error)
    raise IndenterError(f"cannot read the mesh file {path}: {why}. Give the path of one, such as an STL file.")


@lru_cache(maxsize=64)
def _digest(path: Path, _size: int, _changed: int) -> str:
    """SHA-256 of a file, read again once its size [bytes] or the time of its last change [ns] is another."""
    with path.open("rb") as file:  # larger files are no indenters
        return hashlib.sha256(file.read(MOST_BYTES + 1)).hexdigest()


@cache
def _named_face(shape: str) -> Polygon:
    return _OWN[shape]() if shape in _OWN else punch_outline(shape)


@lru_cache(maxsize=64)
def _mesh_face(shape: str, digest: str) -> Polygon | MultiPolygon:
    """Outline of a mesh's face; of another one once the file has changed, and with it the digest."""
    outline = mesh_indenter(shape).outline
    if outline is None:
        raise IndenterError(f"{shape} has no flat face. Expected a punch whose lowest face is flat.")
    return outline


def sized_face(shape: str, size: float) -> Polygon | MultiPolygon:
    """Outline of a shape's flat face at a size [m].

    Raises:
        IndenterError: there is no such shape, or it is curved.
    """
    face = shape_face(shape)
    if face is None:
        raise IndenterError(f"shape '{shape}' is curved and has no face.")
    return affinity.scale(face, size, size, origin=(0, 0))


def placed(face: Polygon | MultiPolygon, shift: tuple[float, float], rotation: float) -> Polygon | MultiPolygon:
    """An outline [m], rotated counter-clockwise about the origin by `rotation` [rad], then shifted by (x, y) [m]."""
    turned = affinity.rotate(face, rotation, origin=(0, 0), use_radians=True)
    return affinity.translate(turned, *shift)


def sphere_height(radius: float, centre: Array) -> Callable[[Array, Array], Array]:
    """Height [m] of the lower side of a sphere of this radius [m] over (x, y) [m], by its centre [m], (3,)."""

    def height(x: Array, y: Array) -> Array:
        inside = radius**2 - (x - centre[0]) ** 2 - (y - centre[1]) ** 2
        return np.where(inside > 0.0, centre[2] - np.sqrt(np.maximum(inside, 0.0)), np.inf)

    return height


def shape_indenter(shape: str, size: float = 1.0) -> Indenter:
    """A shape or a mesh file in metres as an indenter for press scenes, with lengths in its plane times `size` [-].

    Raises:
        IndenterError: there is no such shape, or a mesh has no flat face.
    """
    if shape_face(shape) is None:
        return sphere(SPHERE_RADIUS * size)
    outline = sized_face(shape, size)
    name = shape if shape in SHAPE_NAMES else body_name(Path(shape))
    return Indenter(name=name, solid=extrude(outline, _PUNCH_HEIGHT), outline=outline)
