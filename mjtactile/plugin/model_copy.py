"""Geoms and names of a MuJoCo model that is known only by its address.

MuJoCo passes models to the plugin while they are being compiled, when there is no Python object for them yet. The
fields that are needed to check a sensor's attributes are copied from memory, under the names of MjModel.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from mjtactile.plugin.mujoco_layout import MujocoLayout

_KINDS = {"int": np.int32, "float": np.float32, "mjtNum": np.float64, "char": np.int8}


class _Named(NamedTuple):
    """The result of `model.geom(number)`, with a name only."""

    name: str


class ModelCopy:
    """Types, sizes, meshes and names of a model's geoms, and names of its bodies; attributes as in MjModel.

    Attributes:
        nbody: number of bodies.
        geom_type: types of the geoms, (geoms,).
        geom_size: half lengths and radii of the geoms [m], (geoms, 3).
        geom_dataid: ids of the geoms' meshes, (geoms,).
        mesh_vertadr, mesh_vertnum: index of each mesh's first vertex, and number of its vertices, (meshes,).
        mesh_vert: vertices [m], (vertices, 3).
        mesh_pos, mesh_quat: translation [m] and rotation that MuJoCo applied to the meshes, (meshes, 3), (meshes, 4).
    """

    def __init__(self, address: int, layout: MujocoLayout) -> None:
        from mujoco.introspect import structs

        fields: dict[str, Any] = {getattr(field, "name", ""): field for field in structs.STRUCTS["mjModel"].fields}
        offsets = layout.offsets["mjModel"]

        def size(name: str) -> int:
            return int(ctypes.c_int.from_address(address + offsets[name]).value)

        def array(name: str) -> Any:
            field = fields[name]
            shape = [one if isinstance(one, int) else size(one) for one in field.array_extent]
            kind = np.dtype(_KINDS[field.type.inner_type.name])
            start = int(ctypes.c_uint64.from_address(address + offsets[name]).value)
            count = int(np.prod(shape))
            raw = ctypes.string_at(start, count * kind.itemsize) if count else b""
            return np.frombuffer(raw, dtype=kind).reshape(shape)

        self.nbody = size("nbody")
        self.geom_type, self.geom_size = array("geom_type").ravel(), array("geom_size")
        self.geom_dataid, self.mesh_vert = array("geom_dataid").ravel(), array("mesh_vert")
        self.mesh_vertadr, self.mesh_vertnum = array("mesh_vertadr").ravel(), array("mesh_vertnum").ravel()
        self.mesh_pos, self.mesh_quat = array("mesh_pos"), array("mesh_quat")
        self._geoms, self._bodies = array("name_geomadr").ravel(), array("name_bodyadr").ravel()
        self._names = array("names").tobytes()

    def geom(self, number: int) -> _Named:
        """A geom by its id, with its name, like `MjModel.geom`."""
        return _Named(self._name(int(self._geoms[number])))

    def body(self, number: int) -> _Named:
        """A body by its id, with its name, like `MjModel.body`."""
        return _Named(self._name(int(self._bodies[number])))

    def _name(self, at: int) -> str:
        return self._names[at:].split(b"\0", 1)[0].decode()
