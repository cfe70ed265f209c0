"""Geoms and names of a compiled MuJoCo model of which only the address is known.

The plugin is handed models by MuJoCo itself while they are being compiled, when Python has no object for them yet. What
the meaning of a sensor's attributes depends on is copied out of them, under the names MjModel has.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from mjtactile.plugin.mujoco_layout import MujocoLayout

_KINDS = {"int": np.int32, "float": np.float32, "mjtNum": np.float64, "char": np.int8}


class _Named:
    """What `model.geom(number)` is asked for."""

    def __init__(self, name: str) -> None:
        self.name = name


class ModelCopy:
    """Kinds, sizes, meshes and names of a model's geoms, and names of its bodies; attributes as MjModel's.

    Args:
        address: of the model.
        layout: of the running MuJoCo.

    Attributes:
        nbody: bodies of the model.
        geom_type: kinds of its geoms, (geoms,).
        geom_size: half lengths and radii of its geoms [m], (geoms, 3).
        geom_dataid: their meshes, (geoms,).
        mesh_vertadr, mesh_vertnum: where vertices of the meshes begin, and how many they are, (meshes,).
        mesh_vert: vertices [m], (vertices, 3).
        mesh_pos, mesh_quat: how MuJoCo moved the meshes [m] and turned them, (meshes, 3) and (meshes, 4).
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
        """The geom's name, as `MjModel.geom` has it."""
        return _Named(self._name(int(self._geoms[number])))

    def body(self, number: int) -> _Named:
        """The body's name, as `MjModel.body` has it."""
        return _Named(self._name(int(self._bodies[number])))

    def _name(self, at: int) -> str:
        return self._names[at:].split(b"\0", 1)[0].decode()
