"""MuJoCo geoms as solids and as shapes with a lower surface, and the face of a body towards a pad.

Contact points do not determine a footprint (a pair of convex geoms has at most four), so it comes from the geometry:
the body's lower surface, or the section of its true solid just above its lowest point over the pad.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import shapely
import trimesh
from shapely import MultiPolygon, Polygon

from mjtactile._types import Array, Indices
from mjtactile.errors import IndenterError, SceneError
from mjtactile.geometry.outlines import SIDES
from mjtactile.geometry.planar import areal
from mjtactile.geometry.primitives import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Shape
from mjtactile.geometry.solid import checked, face_outline
from mjtactile.geometry.triangle_mesh import TriangleSurface
from mjtactile.pad import Pad
from mjtactile.sim.mujoco_library import element_id
from mjtactile.sim.pad_geom import pad_pieces
from mjtactile.sim.pad_solid import pad_solid
from mjtactile.sim.rays import RaySurface
from mjtactile.sim.wrench import PadFrame

#: Largest difference between a pad's size and its geom's [m]; while a simulation runs, the core checks it, too.
SIZE_TOLERANCE = 1e-6
#: Tolerance on the distance of a curved pad's mesh vertices from the pad, and on its extent [m].
_MESH_TOLERANCE = 3e-5
#: End of the names of geoms that press instead of their body's colliding geoms.
SHOWN = "_tactile"
#: Size and depth of the solid that represents MuJoCo's infinite plane [m].
_PLANE_EXTENT = 1.0


def geom_solid(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """A geom's true solid in the geom's own frame [m]; for a mesh the mesh itself, not its convex hull.

    For a signed distance function (SDF), it is MuJoCo's mesh of the SDF, which is accurate to 1e-3 of its size or
    better.

    Args:
        model: compiled model.
        geom: id of the geom.

    Raises:
        SceneError: a mesh is not watertight, or the geom's type has no surface.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    kinds = mujoco.mjtGeom
    if kind in (kinds.mjGEOM_MESH, kinds.mjGEOM_SDF):
        return _mesh_solid(model, geom)
    if kind == kinds.mjGEOM_HFIELD:
        return trimesh.Trimesh(*_height_field(model, int(model.geom_dataid[geom])), process=False)
    if kind == kinds.mjGEOM_BOX:
        return trimesh.creation.box(extents=2 * size)
    if kind == kinds.mjGEOM_PLANE:
        half_x, half_y = (s if s > 0 else _PLANE_EXTENT for s in size[:2])
        slab = trimesh.creation.box(extents=(2 * half_x, 2 * half_y, _PLANE_EXTENT))
        return slab.apply_translation((0.0, 0.0, -_PLANE_EXTENT / 2))
    # Unit size first: trimesh drops triangles of millimetre size as degenerate while it revolves a profile.
    if kind == kinds.mjGEOM_SPHERE:
        return _unit_sphere().apply_scale(size[0])
    if kind == kinds.mjGEOM_ELLIPSOID:
        return _unit_sphere().apply_scale(size)
    if kind == kinds.mjGEOM_CYLINDER:
        return trimesh.creation.cylinder(radius=1.0, height=2.0, sections=SIDES).apply_scale(
            (size[0], size[0], size[1])
        )
    if kind == kinds.mjGEOM_CAPSULE:
        unit = trimesh.creation.capsule(radius=1.0, height=2 * size[1] / size[0], count=[SIDES // 4, SIDES // 4])
        unit.vertices -= unit.bounds.mean(axis=0)
        return unit.apply_scale(size[0])
    raise SceneError(_no_surface(model, geom))


def geom_shape(model: mujoco.MjModel, geom: int) -> Shape:
    """A geom as a shape with a lower surface, in the geom's own frame [m].

    For a mesh, it is the mesh itself, not its convex hull; it need not be watertight. Signed distance functions of
    plugins are sampled by rays. Planes are infinite, as in MuJoCo's collisions.

    Args:
        model: compiled model.
        geom: id of the geom.

    Raises:
        SceneError: the geom's type has no surface.
    """
    kind, size = int(model.geom_type[geom]), [float(s) for s in model.geom_size[geom]]
    kinds = mujoco.mjtGeom
    if kind in (kinds.mjGEOM_MESH, kinds.mjGEOM_SDF):
        mesh = _mesh(model, geom)
        if model.geom_plugin[geom] >= 0:
            return RaySurface(model, geom, np.asarray(mesh.vertices, dtype=float))
        closed = mesh.is_watertight and mesh.is_winding_consistent
        if closed and mesh.volume < 0.0:
            mesh.invert()
        return TriangleSurface(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces), closed=closed)
    if kind == kinds.mjGEOM_HFIELD:
        return TriangleSurface(*_height_field(model, int(model.geom_dataid[geom])), closed=True)
    if kind == kinds.mjGEOM_SPHERE:
        return Ellipsoid((size[0], size[0], size[0]))
    if kind == kinds.mjGEOM_ELLIPSOID:
        return Ellipsoid((size[0], size[1], size[2]))
    if kind == kinds.mjGEOM_CAPSULE:
        return Capsule(size[0], size[1])
    if kind == kinds.mjGEOM_CYLINDER:
        return Cylinder(size[0], size[1])
    if kind == kinds.mjGEOM_BOX:
        return Box((size[0], size[1], size[2]))
    if kind == kinds.mjGEOM_PLANE:
        return HalfSpace()
    raise SceneError(_no_surface(model, geom))


def pressing_geoms(model: mujoco.MjModel, body: int, touching: Indices) -> Indices:
    """Ids of the geoms whose shapes a body presses with: those named "*_tactile" or, without any, the touching ones.

    Geoms named "*_tactile" have the true shape of a body that collides with simplified geoms (feet, convex pieces).

    Args:
        model: compiled model.
        body: id of the body.
        touching: ids of its geoms that touch the pad, (n,).
    """
    own = np.flatnonzero(model.geom_bodyid == body)
    shown = [int(geom) for geom in own if model.geom(int(geom)).name.endswith(SHOWN)]
    return np.array(shown, dtype=np.int64) if shown else touching


def body_face(
    solids: list[tuple[trimesh.Trimesh, Array, Array]], frame: PadFrame, facing_gap: float
) -> Polygon | MultiPolygon:
    """Section of a body parallel to the pad, in the pad frame [m].

    Its height is `facing_gap` above the body's lowest point, but at least that of the sensing surface. A body may
    extend below the surface: beside the pad, or because soft contacts let it penetrate.

    Args:
        solids: solid of each of its geoms, with position [m] and rotation matrix in the world.
        frame: pose of the pad frame in the world.
        facing_gap: height of the section above the lowest point [m].
    """
    placed = []
    for solid, position, rotation in solids:
        vertices = (solid.vertices @ rotation.T + position - frame.position) @ frame.rotation
        moved = solid.copy()
        moved.vertices = vertices
        placed.append(moved)
    height = max(min(float(solid.bounds[0, 2]) for solid in placed) + facing_gap, 0.0)
    return areal(shapely.union_all([face_outline(solid, height) for solid in placed]))


def _unit_sphere() -> trimesh.Trimesh:
    return trimesh.creation.uv_sphere(radius=1.0, count=[SIDES // 4, SIDES // 4])


def _mesh(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    mesh = int(model.geom_dataid[geom])
    first_vertex, vertices = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    first, triangles = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    solid = trimesh.Trimesh(
        model.mesh_vert[first_vertex : first_vertex + vertices],
        model.mesh_face[first : first + triangles],
        process=False,
    )
    solid.merge_vertices()
    return solid


def _mesh_solid(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    try:
        return checked(_mesh(model, geom))
    except IndenterError as error:
        raise SceneError(f"geom {_label(model, geom)} cannot press on a pad: {error}") from error


def _height_field(model: mujoco.MjModel, field: int) -> tuple[Array, Indices]:
    """The closed solid of a height field, as MuJoCo collides it: vertices [m] and outward triangles."""
    rows, columns, start = (int(a[field]) for a in (model.hfield_nrow, model.hfield_ncol, model.hfield_adr))
    half_x, half_y, scale, base = model.hfield_size[field]
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    top = scale * model.hfield_data[start : start + rows * columns].astype(float)
    vertices = np.vstack(
        [np.column_stack([x.ravel(), y.ravel(), z]) for z in (top, np.full(rows * columns, -float(base)))]
    )
    number = np.arange(rows * columns).reshape(rows, columns)
    here, right, up, across = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    upper = np.concatenate([_triangles(here, right, across), _triangles(here, across, up)])
    rim = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    after = np.roll(rim, -1)
    below = rows * columns
    walls = np.concatenate([_triangles(rim, rim + below, after + below), _triangles(rim, after + below, after)])
    return vertices, np.concatenate([upper, upper[:, ::-1] + below, walls])


def _triangles(a: Indices, b: Indices, c: Indices) -> Indices:
    return np.column_stack([a.ravel(), b.ravel(), c.ravel()])


def _no_surface(model: mujoco.MjModel, geom: int) -> str:
    kind = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
    return (
        f"geom {_label(model, geom)} is a {kind}, which has no surface to press with. Give its body a geom of another "
        f"type whose name ends in '{SHOWN}'."
    )


def _label(model: mujoco.MjModel, geom: int) -> str:
    return f"'{model.geom(geom).name}'" if model.geom(geom).name else f"number {geom}"


def pad_geom(model: mujoco.MjModel, name: str, pad: Pad) -> int:
    """Id of the geom that is a pad.

    Args:
        model: compiled model.
        name: name of the geom.
        pad: the pad whose shape the geom must have.

    Raises:
        SceneError: the model has no such geom, or the geom does not have the pad's shape.
    """
    geom = element_id(model, mujoco.mjtObj.mjOBJ_GEOM, name, "geom")
    if geom < 0:
        names = [model.geom(i).name for i in range(model.ngeom) if model.geom(i).name]
        raise SceneError(f"geom '{name}' does not exist in the model. Available: {names}. Pass geom=... of the pad.")
    check_pad_geom(model, geom, pad)
    return geom


def check_pad_geom(model: Any, geom: int, pad: Pad) -> None:
    """Check that a geom has the shape of a pad.

    Args:
        model: compiled model, or a `ModelCopy` of one.
        geom: id of the geom.
        pad: the pad whose shape the geom must have.

    Raises:
        SceneError: the geom of a flat pad is not a box of its size, or that of a curved pad not a mesh of its shape
            with vertices in the pad frame.
    """
    name = model.geom(geom).name
    if not pad.surface.is_flat:
        _check_pad_mesh(model, geom, pad)
        return
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_BOX:
        raise SceneError(f"geom '{name}' is not a box. A pad is a box geom whose +z face senses.")
    actual, expected = 2 * model.geom_size[geom], np.array([*pad.size, pad.thickness])
    if np.abs(actual - expected).max() > SIZE_TOLERANCE:
        raise SceneError(
            f"geom '{name}' measures {_millimetres(actual)} mm, but the pad measures {_millimetres(expected)} mm. "
            "Give the geom half of the pad's lengths as its size, or pass the Pad that fits it."
        )


def _check_pad_mesh(model: Any, geom: int, pad: Pad) -> None:
    name = model.geom(geom).name
    cure = "Let mjtactile.attach_pad add the geom, or write the mesh in the pad frame and pass the Pad that fits it."
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        raise SceneError(f"geom '{name}' is not a mesh, but the pad is curved, a {pad.summary}. {cure}")
    found = np.concatenate([_as_written(model, int(model.geom_dataid[one])) for one in pad_pieces(model, geom)])
    expected = np.concatenate([piece.vertices for piece in pad_solid(pad).pieces])
    for extreme, side in ((np.min, "least"), (np.max, "greatest")):
        actual, wanted = extreme(found, axis=0), extreme(expected, axis=0)
        if np.abs(actual - wanted).max() > _MESH_TOLERANCE:
            raise SceneError(
                f"the {side} x, y and z of geom '{name}' are {_millimetres(actual)} mm, but those of the pad "
                f"{_millimetres(wanted)} mm. {cure}"
            )
    depths = pad.feet(found)[0][:, 2]
    if depths.min() < -_MESH_TOLERANCE or depths.max() > pad.thickness + _MESH_TOLERANCE:
        raise SceneError(
            f"geom '{name}' has vertices at depths from {depths.min() * 1e3:.4g} to {depths.max() * 1e3:.4g} mm under "
            f"the pad's surface; expected 0 to {pad.thickness * 1e3:.4g} mm. {cure}"
        )


def _as_written(model: Any, mesh: int) -> Array:
    """Vertices of a mesh before MuJoCo moved it to its centre of mass, (n, 3) [m]."""
    first, turn = int(model.mesh_vertadr[mesh]), np.empty(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(float)
    return vertices @ turn.reshape(3, 3).T + model.mesh_pos[mesh]


def _millimetres(lengths: Array) -> str:
    return " x ".join(f"{length * 1e3:.4g}" for length in lengths)
