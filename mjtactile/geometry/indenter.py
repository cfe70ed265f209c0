"""Bodies that press on a pad: the seven flat punches of Aoyagi 2008, spheres, cylinders, boxes and meshes.

Lengths are metres. Every indenter's lowest point is at z = 0 and its body above, so it presses along -z onto a pad
surface at z = 0.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

import trimesh
from shapely import MultiPolygon, Polygon, affinity

from mjtactile.errors import IndenterError, shortened
from mjtactile.geometry.outlines import SIDES, ellipse, punch_outline
from mjtactile.geometry.planar import convex_parts, even_parts
from mjtactile.geometry.solid import checked, extrude, face_outline, is_prism, silhouette
from mjtactile.units import finite_number

#: A mesh is treated as a flat punch if its lowest face covers at least this fraction of its silhouette.
FLAT_FACE_SHARE = 0.1

#: A face is convex if it covers at least this fraction of its convex hull.
_CONVEX = 1.0 - 1e-6
#: Largest number of triangles of a mesh: with more, MuJoCo's compiler and the sections of the mesh take minutes.
MOST_TRIANGLES = 200_000
#: Largest size of a mesh file [bytes]: enough for that many triangles in any format.
MOST_BYTES = 100_000_000

#: Default height of a punch's body above its face [m].
_PUNCH_HEIGHT = 5e-3
#: Names of bodies in press scenes, which an indenter cannot have.
_TAKEN = ("pad", "press", "world")

Area = TypeVar("Area", Polygon, Polygon | MultiPolygon)


class Primitive(NamedTuple):
    """A MuJoCo geom with exactly the shape of an indenter's solid."""

    kind: Literal["sphere", "cylinder", "box"]  #: geom type
    size: tuple[float, ...]  #: geom size, MuJoCo's meaning: radii and half lengths [m]
    height: float  #: z of the geom's centre in the indenter's frame [m]
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)  #: direction of the geom's own z axis


@dataclass(frozen=True, kw_only=True, eq=False)
class Indenter:
    """A rigid body that presses on a pad: its solid, and its flat face if it has one.

    Make one with `punch`, `sphere`, `cylinder`, `box` or `mesh_indenter`.

    Raises:
        IndenterError: the mesh is not a valid solid, or its lowest point is not at z = 0.
    """

    name: str  #: of its body in MuJoCo models
    solid: trimesh.Trimesh  #: watertight, lowest point at z = 0, body above [m]
    outline: Polygon | MultiPolygon | None = None  #: the flat face in the plane z = 0 [m]; None for a curved indenter
    primitive: Primitive | None = None  #: the MuJoCo geom that equals the solid; None for a mesh

    def __post_init__(self) -> None:
        checked(self.solid)
        bottom = float(self.solid.bounds[0, 2])
        if abs(bottom) > 1e-9:
            raise IndenterError(
                f"indenter '{self.name}': its lowest point is at z = {bottom:.6g} m; expected 0. "
                "Use mesh_indenter, which moves it there."
            )

    @cached_property
    def convex_solids(self) -> list[trimesh.Trimesh]:
        """The solid in convex parts if it is the prism over a flat face with notches or holes; otherwise an empty list.

        MuJoCo collides convex hulls, which would fill notches and holes. The parts are of about one size: MuJoCo places
        up to four contact points on each, so that many small parts on one side would draw the force there.
        """
        if self.outline is None or self.outline.area > _CONVEX * self.outline.convex_hull.area:
            return []
        if not is_prism(self.solid):
            return []
        return [extrude(part, float(self.solid.bounds[1, 2])) for part in even_parts(self.outline)]

    def outline_at(self, *, shift: tuple[float, float] = (0.0, 0.0), rotate_deg: float = 0.0) -> Polygon | MultiPolygon:
        """Outline that faces the pad [m]: that of the flat face, or the convex hull of a curved indenter's silhouette.

        Args:
            shift: position of the indenter's origin in the pad frame [m].
            rotate_deg: counter-clockwise rotation about the indenter's origin, before the shift [deg].

        Raises:
            IndenterError: the shift or rotation is not finite.
        """
        return _placed(self.outline if self.outline is not None else silhouette(self.solid), shift, rotate_deg)


def indenter_outline(
    name: str, *, shift: tuple[float, float] = (0.0, 0.0), rotate_deg: float = 0.0, scale: float = 1.0
) -> Polygon:
    """Outline of one of the seven punches in the pad frame [m].

    Args:
        name: one of `INDENTER_NAMES`.
        shift: position of the centre in the pad frame, after the rotation [m].
        rotate_deg: counter-clockwise rotation about the centre [deg].
        scale: size relative to the 10 mm original [-].

    Returns:
        A counter-clockwise polygon; the doughnut's has a hole. Curves are polygons of the same area.

    Raises:
        IndenterError: the name is unknown, the scale is not positive, or the shift or rotation is not finite.
    """
    if not finite_number(scale) > 0.0:
        raise IndenterError(f"scale = {shortened(scale)}; expected a positive number, 1 for the 10 mm original.")
    return _placed(affinity.scale(punch_outline(name), scale, scale, origin=(0, 0)), shift, rotate_deg)


def indenter_solid(name: str, *, height: float = _PUNCH_HEIGHT, scale: float = 1.0) -> trimesh.Trimesh:
    """One of the seven punches as a watertight prism: face at z = 0, body up to z = height [m].

    Args:
        name: one of `INDENTER_NAMES`.
        height: of the prism [m].
        scale: size of the face relative to the 10 mm original [-].

    Raises:
        IndenterError: the name is unknown, or the height or scale is not positive.
    """
    return extrude(indenter_outline(name, scale=scale), height)


def convex_pieces(
    name: str, *, shift: tuple[float, float] = (0.0, 0.0), rotate_deg: float = 0.0, scale: float = 1.0
) -> list[Polygon]:
    """A punch's outline cut into convex polygons [m], which do not overlap and leave nothing out.

    Args:
        name: one of `INDENTER_NAMES`.
        shift: position of the centre in the pad frame, after the rotation [m].
        rotate_deg: counter-clockwise rotation about the centre [deg].
        scale: size relative to the 10 mm original [-].

    Raises:
        IndenterError: the name is unknown, the scale is not positive, or the shift or rotation is not finite.
    """
    return convex_parts(indenter_outline(name, shift=shift, rotate_deg=rotate_deg, scale=scale))


def punch(name: str, *, height: float = _PUNCH_HEIGHT, scale: float = 1.0) -> Indenter:
    """One of the seven flat punches.

    Args:
        name: one of `INDENTER_NAMES`.
        height: of its body above the face [m].
        scale: size of the face relative to the 10 mm original [-].

    Raises:
        IndenterError: the name is unknown, or the height or scale is not positive.
    """
    return Indenter(
        name=name, solid=indenter_solid(name, height=height, scale=scale), outline=indenter_outline(name, scale=scale)
    )


def sphere(radius: float) -> Indenter:
    """A sphere of this radius [m].

    Raises:
        IndenterError: the radius is not positive.
    """
    _require_positive("radius", radius)
    # Unit size first: trimesh drops triangles of millimetre size as degenerate while it revolves a profile.
    solid = trimesh.creation.uv_sphere(radius=1.0, count=[SIDES // 4, SIDES // 4]).apply_scale(radius)
    return Indenter(name="sphere", solid=_standing(solid), primitive=Primitive("sphere", (radius,), radius))


def cylinder(radius: float, length: float, axis: Literal["x", "y", "z"] = "x") -> Indenter:
    """A cylinder that presses with its side ("x", "y") or with its flat end ("z").

    Args:
        radius: of the cylinder [m].
        length: of the cylinder along its axis [m].
        axis: direction of the cylinder's axis, "x", "y" or "z".

    Raises:
        IndenterError: the radius or length is not positive, or the axis is unknown.
    """
    _require_positive("radius", radius)
    _require_positive("length", length)
    if not (isinstance(axis, str) and axis in ("x", "y", "z")):
        raise IndenterError(f"axis = {shortened(axis)}; expected 'x', 'y' or 'z'.")
    size = (radius, length / 2)
    if axis == "z":
        outline = ellipse(radius, radius)
        return Indenter(
            name="cylinder",
            solid=extrude(outline, length),
            outline=outline,
            primitive=Primitive("cylinder", size, length / 2),
        )
    direction = (1.0, 0.0, 0.0) if axis == "x" else (0.0, 1.0, 0.0)
    solid = trimesh.creation.cylinder(radius=radius, height=length, sections=SIDES)
    solid.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], direction))
    return Indenter(name="cylinder", solid=_standing(solid), primitive=Primitive("cylinder", size, radius, direction))


def box(size: tuple[float, float, float]) -> Indenter:
    """A box of this full size along (x, y, z) [m].

    Raises:
        IndenterError: a length is not positive.
    """
    try:
        x, y, z = size
    except (TypeError, ValueError):
        raise IndenterError(f"size = {shortened(size)}; expected three lengths (x, y, z) in metres.") from None
    for name, length in (("size x", x), ("size y", y), ("size z", z)):
        _require_positive(name, length)
    x, y, z = x / 2, y / 2, z / 2
    outline = Polygon([(-x, -y), (x, -y), (x, y), (-x, y)])
    return Indenter(
        name="box", solid=extrude(outline, 2 * z), outline=outline, primitive=Primitive("box", (x, y, z), z)
    )


def mesh_indenter(mesh: trimesh.Trimesh | str | Path, *, name: str = "mesh", scale: float = 1.0) -> Indenter:
    """Any watertight mesh, moved along z so that its lowest point is at z = 0; x and y are unchanged.

    It is treated as a flat punch if its lowest face covers at least `FLAT_FACE_SHARE` of its silhouette. MuJoCo
    collides curved meshes as their convex hull.

    Args:
        mesh: a trimesh mesh, or the path of a file trimesh can read.
        name: of the indenter's MuJoCo body.
        scale: metres per unit of the mesh: 1e-3 for a mesh drawn in millimetres.

    Raises:
        IndenterError: the file cannot be read, or the mesh is not a solid, or has more than `MOST_TRIANGLES`; the
            message says what is wrong.
    """
    _require_positive("scale", scale)
    if not isinstance(mesh, trimesh.Trimesh):
        if not isinstance(mesh, str | Path):
            kind = type(mesh).__name__
            raise IndenterError(f"the mesh is of type {kind}; expected a trimesh.Trimesh or the path of a file.")
        mesh = _loaded(Path(mesh))
    if len(mesh.faces) > MOST_TRIANGLES:
        raise IndenterError(
            f"the mesh has {len(mesh.faces):,} triangles; expected at most {MOST_TRIANGLES:,}. Decimate it: a pad "
            "feels nothing smaller than a tenth of a millimetre."
        )
    solid = _standing(mesh.copy().apply_scale(scale))
    outline = face_outline(checked(solid), 0.0)
    flat = outline.area >= FLAT_FACE_SHARE * silhouette(solid).area
    return Indenter(name=name, solid=solid, outline=outline if flat else None)


def _loaded(path: Path) -> trimesh.Trimesh:
    try:
        there = path.is_file()
    except OSError as error:  # a name that is too long
        raise IndenterError(f"there is no mesh file {path}: {error.strerror}.") from error
    if not there:
        raise IndenterError(f"there is no mesh file {path}. Give the path of one, such as an STL file.")
    if path.stat().st_size > MOST_BYTES:
        raise IndenterError(
            f"{path} has {path.stat().st_size / 1e6:.0f} MB; expected at most {MOST_BYTES / 1e6:.0f} MB. Decimate the "
            f"mesh to {MOST_TRIANGLES:,} triangles."
        )
    try:
        loaded: Any = trimesh.load_mesh(path)
        return loaded if isinstance(loaded, trimesh.Trimesh) else loaded.to_mesh()
    except Exception as error:  # readers of file formats raise many types
        why = str(error) or type(error).__name__
        raise IndenterError(
            f"cannot read {path} as a mesh: {why}. Is it a closed surface, such as an STL file?"
        ) from error


def body_name(path: Path) -> str:
    """Name of the MuJoCo body for a mesh file: the file's name if a body can have it, otherwise "mesh"."""
    name = path.stem
    return name if re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,40}", name) and name not in _TAKEN else "mesh"


def _standing(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    """Move a solid along z, in place, so that its lowest vertex is at exactly z = 0."""
    if len(solid.vertices):
        solid.vertices[:, 2] -= solid.vertices[:, 2].min()
    return solid


def _placed(outline: Area, shift: tuple[float, float], rotate_deg: float) -> Area:
    try:
        x, y = map(finite_number, shift)
    except (TypeError, ValueError):
        raise IndenterError(f"shift = {shortened(shift)}; expected two lengths (x, y) in metres.") from None
    angle = finite_number(rotate_deg)
    if not all(map(math.isfinite, (x, y, angle))):
        raise IndenterError(
            f"shift = {shortened(shift)} m, rotate_deg = {shortened(rotate_deg)}; expected finite numbers."
        )
    return affinity.translate(affinity.rotate(outline, angle, origin=(0, 0)), x, y)


def _require_positive(name: str, value: float) -> None:
    if not finite_number(value) > 0.0:
        raise IndenterError(
            f"{name} = {shortened(value)}; expected a positive, finite number (lengths in metres: 5 mm is 5e-3)."
        )
