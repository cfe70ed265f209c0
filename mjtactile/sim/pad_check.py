"""Geoms that are pads, and whether they have the shape of their pad."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.errors import SceneError
from mjtactile.pad import Pad
from mjtactile.sim.mujoco_library import element_id, pad_sensor_names
from mjtactile.sim.pad_geom import PIECE, pad_pieces
from mjtactile.sim.pad_solid import pad_solid

#: Largest difference between a pad's size and its geom's [m]; while a simulation runs, the core checks it, too.
SIZE_TOLERANCE = 1e-6
#: Tolerance on the distance of a curved pad's mesh vertices from the pad, and on its extent [m].
_MESH_TOLERANCE = 3e-5


def pad_geom(model: mujoco.MjModel, name: str, pad: Pad) -> int:
    """Id of the geom that is a pad, by its name.

    Raises:
        SceneError: the model has no such geom, or the geom does not have the pad's shape.
    """
    geom = element_id(model, mujoco.mjtObj.mjOBJ_GEOM, name, "geom")
    if geom < 0:
        names = [model.geom(i).name for i in range(model.ngeom) if model.geom(i).name]
        sensors = pad_sensor_names(model)
        cure = f", or the name of a sensor of the plugin: {sensors}" if sensors else ""
        raise SceneError(
            f"geom '{name}' does not exist in the model. Available: {names}. Pass geom=... of the pad{cure}."
        )
    check_pad_geom(model, geom, pad)
    return geom


def check_pad_geom(model: Any, geom: int, pad: Pad) -> None:
    """Check that a geom of a compiled model, or of a `ModelCopy` of one, has the shape of a pad.

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
    pieces, solid = pad_pieces(model, geom), pad_solid(pad).pieces
    if len(pieces) < len(solid):  # an ending after their names, for example
        cure = (
            f"Of the pad's {len(solid)} geoms, {len(pieces)} were found: '{name}', '{name}{PIECE}1' and so on. If "
            "mjtactile.attach_pad added them, keep these names: attach the model with a prefix and no suffix, and put "
            f"no <replicate> around the pad. {cure}"
        )
    found = np.concatenate([_as_written(model, int(model.geom_dataid[one])) for one in pieces])
    expected = np.concatenate([piece.vertices for piece in solid])
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
