"""Offsets of the fields that the plugin reads in the structures of the running MuJoCo.

Structures change from version to version, so a plugin compiled against one version would misread another.
`mujoco.introspect` lists all fields of the imported MuJoCo; C's rules of alignment give their offsets. Before use,
pointers and numbers at these offsets are compared with those of MuJoCo's Python bindings.

Functions import MuJoCo, not the module: MuJoCo has the plugin registered while it is imported, with this module whole.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mjtactile.errors import NativeError

_SIZES = {
    "int": 4, "float": 4, "char": 1, "mjtByte": 1, "mjtBool": 1, "mjtNum": 8, "mjtSize": 8,
    "size_t": 8, "uint64_t": 8, "uintptr_t": 8,
}  # fmt: skip
_POINTER = 8

#: Fields of `Layout` in native/plugin/mujoco_view.hpp, in its order.
_FIELDS = (
    ("mjModel", ("opt", "nsensor", "nbody", "npair", "nexclude", "body_parentid", "body_weldid", "body_mocapid",
                 "body_pos", "body_quat", "geom_type", "geom_bodyid", "geom_contype", "geom_conaffinity",
                 "geom_dataid", "geom_size", "geom_pos", "geom_quat", "body_geomnum", "body_geomadr", "mesh_vertadr",
                 "mesh_vertnum", "mesh_faceadr", "mesh_facenum", "mesh_vert", "mesh_face", "mesh_pos", "mesh_quat",
                 "hfield_nrow", "hfield_ncol", "hfield_adr", "hfield_size", "hfield_data", "pair_geom1", "pair_geom2",
                 "exclude_signature", "names", "name_geomadr", "sensor_plugin", "sensor_objtype", "sensor_objid",
                 "sensor_adr", "sensor_dim", "nplugin", "plugin_stateadr", "nflex", "flex_dim", "flex_contype",
                 "flex_conaffinity")),
    ("mjOption", ("disableflags", "enableflags")),
    ("mjData", ("ncon", "contact", "xpos", "xmat", "geom_xpos", "geom_xmat", "sensordata",
                "plugin_state")),
    ("mjContact", ("", "dist", "pos", "frame", "friction", "geom", "exclude")),
    ("mjvScene", ("ngeom", "maxgeom", "geoms")),
    ("mjvGeom", ("", "objid", "category", "segid")),
)  # fmt: skip
#: Fields of `Layout` that not every MuJoCo has: which bodies are asleep, and how many earlier readings of a sensor are
#: kept. The offset of a field that does not exist is -1.
_OPTIONAL = (("mjData", "body_awake"), ("mjModel", "sensor_history"))
#: Functions in the order of `Functions` in native/plugin/mujoco_view.hpp.
FUNCTIONS = ("mj_contactForce", "mj_getPluginConfig", "mju_warning", "mjp_registerPlugin", "mjv_initGeom")
#: Those that follow, which older versions of MuJoCo, such as 3.8, lack. They run tasks on a simulation's threads.
OPTIONAL_FUNCTIONS = ("mju_dispatch", "mju_numThread")


class TypeSize(NamedTuple):
    """Size and alignment of a type [bytes]."""

    size: int
    alignment: int


class MujocoLayout(NamedTuple):
    """Offsets and sizes of the running MuJoCo's structures."""

    offsets: dict[str, dict[str, int]]  #: offset by structure and field [bytes]
    sizes: dict[str, int]  #: size by structure [bytes]

    def packed(self) -> np.ndarray:
        """The layout as integers in the order of `Layout`, for the plugin."""
        import mujoco

        numbers = [
            self.offsets[structure][name] if name else self.sizes[structure]
            for structure, names in _FIELDS
            for name in names
        ]
        kinds = (
            mujoco.mjtObj.mjOBJ_GEOM,
            mujoco.mjtGeom.mjGEOM_BOX,
            mujoco.mjtStage.mjSTAGE_ACC,
            mujoco.mjtPluginCapabilityBit.mjPLUGIN_SENSOR,
            mujoco.mjtDisableBit.mjDSBL_FILTERPARENT,
            mujoco.mjtCatBit.mjCAT_DECOR,
            getattr(mujoco.mjtEnableBit, "mjENBL_IPC", 0),
        )
        numbers += [self.offsets[structure].get(name, -1) for structure, name in _OPTIONAL]
        return np.array([*numbers, *(int(kind) for kind in kinds)], dtype=np.int64)


def mujoco_layout() -> MujocoLayout:
    """Layout of the running MuJoCo, checked.

    Raises:
        NativeError: this MuJoCo has no such description, or its memory does not match it.
    """
    try:
        from mujoco.introspect import structs

        declared = structs.STRUCTS
        offsets = {name: _offsets(declared[name].fields, declared)[0] for name, _ in _FIELDS}
        sizes = {name: _offsets(declared[name].fields, declared)[1].size for name, _ in _FIELDS}
        layout = MujocoLayout(offsets, sizes)
        layout.packed()
    except (ImportError, KeyError, AttributeError, TypeError) as error:
        raise _unknown(f"mujoco.introspect lacks part of its description ({type(error).__name__}: {error})") from error
    _check(layout)
    return layout


def _offsets(fields: Any, declared: Mapping[str, Any]) -> tuple[dict[str, int], TypeSize]:
    """Offset of each field, and the structure's own size and alignment."""
    offsets: dict[str, int] = {}
    at, alignment = 0, 1
    for field in fields:
        shape = _shape(field.type, declared)
        at = _aligned(at, shape.alignment)
        if getattr(field, "name", ""):
            offsets[field.name] = at
        at += shape.size
        alignment = max(alignment, shape.alignment)
    return offsets, TypeSize(_aligned(at, alignment), alignment)


def _shape(kind: Any, declared: Mapping[str, Any]) -> TypeSize:
    name = type(kind).__name__
    if name == "PointerType":
        return TypeSize(_POINTER, _POINTER)
    if name == "ArrayType":
        inner = _shape(kind.inner_type, declared)
        return TypeSize(inner.size * int(np.prod(kind.extents)), inner.alignment)
    if hasattr(kind, "fields"):
        return _offsets(kind.fields, declared)[1]
    if kind.name in declared:
        return _offsets(declared[kind.name].fields, declared)[1]
    size = 4 if kind.name.startswith("mjt") and kind.name not in _SIZES else _SIZES[kind.name]
    return TypeSize(size, size)


def _aligned(at: int, alignment: int) -> int:
    return -(-at // alignment) * alignment


_CHECK = """
<mujoco>
  <worldbody>
    <site name="s"/><geom name="pad" type="box" size=".01 .02 .03"/>
    <body pos="0 0 .035"><freejoint/><geom type="box" size=".006 .005 .01"/></body>
  </worldbody>
  <sensor><accelerometer site="s"/></sensor>
</mujoco>
"""


#: Fields of a contact that are compared, and what they hold.
_CONTACT_FIELDS = (
    ("dist", ctypes.c_double),
    ("pos", ctypes.c_double),
    ("frame", ctypes.c_double),
    ("friction", ctypes.c_double),
    ("geom", ctypes.c_int),
    ("exclude", ctypes.c_int),
)


def _check(layout: MujocoLayout) -> None:
    """Compare the contents at the offsets with the values of MuJoCo's bindings; raises NativeError."""
    import mujoco

    if sys.byteorder != "little":
        raise _unknown("the plugin supports little-endian machines only")
    model = mujoco.MjModel.from_xml_string(_CHECK)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    if data.ncon < 1 or not hasattr(model, "_address"):
        raise _unknown("its Python bindings do not give the addresses of its models")
    pairs: list[tuple[str, int, int]] = []
    for structure, owner in (("mjModel", model), ("mjData", data)):
        offsets = layout.offsets[structure]
        for name in dict(_FIELDS)[structure]:
            value = getattr(owner, name, None)
            at = int(owner._address) + offsets[name]
            if isinstance(value, np.ndarray) and value.size:
                pairs.append((f"{structure}.{name}", _number(at, ctypes.c_uint64), value.ctypes.data))
            elif isinstance(value, int):
                pairs.append((f"{structure}.{name}", _number(at, ctypes.c_int), value))
    contact = _number(int(data._address) + layout.offsets["mjData"]["contact"], ctypes.c_uint64)
    for index in range(data.ncon):
        start = contact + index * layout.sizes["mjContact"]
        for name, kind in _CONTACT_FIELDS:
            said = np.ravel(getattr(data.contact[index], name))
            at = start + layout.offsets["mjContact"][name]
            found = np.ctypeslib.as_array((kind * len(said)).from_address(at))
            pairs.append((f"mjContact.{name}", hash(found.tobytes()), hash(said.astype(found.dtype).tobytes())))
    wrong = [name for name, found, said in pairs if found != said]
    if wrong:
        raise _unknown(f"its memory does not match its description at {', '.join(sorted(set(wrong)))}")


def _number(address: int, kind: Any) -> int:
    return int(kind.from_address(address).value)


def _unknown(reason: str) -> NativeError:
    import mujoco

    return NativeError(
        f"this mjtactile cannot add its sensor plugin to MuJoCo {mujoco.__version__}: {reason}. It is tested with "
        "MuJoCo 3.3.7 to 4.0: install one of these, or a newer mjtactile."
    )
