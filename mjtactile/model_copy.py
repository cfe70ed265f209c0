"""A copy of the geoms of a compiled MuJoCo model that only its address is known of.

The plugin is handed models by MuJoCo itself: while they are being compiled, or as copies that Python has no object
for. What footprints are made from is copied out of them, under the names MjModel has.
"""

from __future__ import annotations

import ctypes
from typing import Any

import mujoco
import numpy as np

from mjtactile.errors import SceneError
from mjtactile.mujoco_layout import MujocoLayout

_KINDS = {"int": np.int32, "float": np.float32, "mjtNum": np.float64, "char": np.int8}
#: Arrays, and sizes by which they are counted.
_ARRAYS = (
    "geom_type", "geom_bodyid", "geom_contype", "geom_conaffinity", "geom_dataid", "geom_plugin", "geom_size",
    "geom_rbound", "geom_pos", "geom_quat", "mesh_vertadr", "mesh_vertnum", "mesh_faceadr", "mesh_facenum",
    "mesh_vert", "mesh_face", "hfield_nrow", "hfield_ncol", "hfield_adr", "hfield_size", "hfield_data",
    "name_bodyadr", "name_geomadr", "names",
)  # fmt: skip


class _Named:
    """What `model.geom(number)` is asked for."""

    def __init__(self, name: str) -> None:
        self.name = name


class ModelCopy:
    """Geoms, meshes and height fields of a model; attributes as MjModel's.

    Args:
        address: of the model.
        layout: of the running MuJoCo.
    """

    geom_type: Any
    geom_bodyid: Any
    geom_contype: Any
    geom_conaffinity: Any
    geom_pos: Any
    geom_quat: Any
    geom_size: Any
    names: Any
    name_bodyadr: Any
    name_geomadr: Any

    def __init__(self, address: int, layout: MujocoLayout) -> None:
        from mujoco.introspect import structs

        fields: dict[str, Any] = {getattr(field, "name", ""): field for field in structs.STRUCTS["mjModel"].fields}
        offsets = layout.offsets["mjModel"]

        def size(name: str) -> int:
            return int(ctypes.c_int.from_address(address + offsets[name]).value)

        self.ngeom = size("ngeom")
        self.nbody = size("nbody")
        for name in _ARRAYS:
            field = fields[name]
            shape = [one if isinstance(one, int) else size(one) for one in field.array_extent]
            kind = np.dtype(_KINDS.get(field.type.inner_type.name, np.uint8))
            start = int(ctypes.c_uint64.from_address(address + offsets[name]).value)
            count = int(np.prod(shape))
            raw = ctypes.string_at(start, count * kind.itemsize) if count else b""
            setattr(self, name, np.frombuffer(raw, dtype=kind).reshape(shape))

    def geom(self, number: int) -> _Named:
        """The geom's name, as `MjModel.geom` has it."""
        return _Named(self._name(int(self.name_geomadr[number])))

    def body(self, number: int) -> _Named:
        """The body's name, as `MjModel.body` has it."""
        return _Named(self._name(int(self.name_bodyadr[number])))

    def _name(self, at: int) -> str:
        return bytes(self.names[at:]).split(b"\0", 1)[0].decode()


def refuse_plugin_geoms(model: ModelCopy, body: int) -> None:
    """Signed distance functions of plugins are seen by rays through a whole model, which a copy is not.

    Raises:
        SceneError: when a geom of the body is one.
    """
    own = np.flatnonzero(np.asarray(model.geom_bodyid) == body)
    kinds = np.asarray(model.geom_type)[own]
    if (kinds == int(mujoco.mjtGeom.mjGEOM_SDF)).any():
        raise SceneError(
            f"body '{model.body(body).name}' is a signed distance function, which the plugin cannot look at. Read the "
            "pad with mjtactile.TactileSensor(model, geom=...), or give the body a mesh that shows its shape."
        )
