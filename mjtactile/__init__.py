"""mjtactile: a sense of touch for robot hands in MuJoCo.

A layered elastic finite-element model of a fingertip pad, precomputed as influence matrices, turns the contact
wrenches of a MuJoCo scene into the von Mises stress at 676 taxels below the pad's surface.

Everything public is reachable from here; a module is imported when one of its names is first used, so that
`import mjtactile` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjtactile import envs as envs
    from mjtactile import recognition
    from mjtactile.attach import attach_pad
    from mjtactile.basis import WrenchBasis
    from mjtactile.cache import influence_matrices
    from mjtactile.contact import contact_load
    from mjtactile.errors import (
        ContactError,
        ContactWarning,
        CorruptInfluenceError,
        FootprintError,
        IndenterError,
        InfluenceError,
        InfluenceWarning,
        MeshError,
        MeshWarning,
        MjTactileError,
        NativeError,
        PadError,
        PresetError,
        SceneError,
        StaleInfluenceError,
    )
    from mjtactile.footprint import Footprint
    from mjtactile.indenter import (
        INDENTER_NAMES,
        Indenter,
        box,
        convex_pieces,
        cylinder,
        indenter_outline,
        indenter_solid,
        mesh_indenter,
        punch,
        sphere,
    )
    from mjtactile.influence import InfluenceMatrices, load_influence
    from mjtactile.load import ContactState, SurfaceLoad
    from mjtactile.mesh import MESHES, MeshDensity
    from mjtactile.native_host import Health, set_warnings
    from mjtactile.pad import Layer, Pad, TaxelGrid
    from mjtactile.pad_json import pad_text
    from mjtactile.plugin_attributes import plugin_health, register_pad
    from mjtactile.preset import PRESETS, Fidelity
    from mjtactile.scene import PressResult, force_vector, press, press_scene
    from mjtactile.sensor import TactileSensor
    from mjtactile.several import contact_loads

from mjtactile import plugin_hook as _plugin_hook

__version__ = "0.1.0"

_MODULE_OF = {
    name: module
    for module, names in {
        "attach": ("attach_pad",),
        "cache": ("influence_matrices",),
        "basis": ("WrenchBasis",),
        "contact": ("contact_load",),
        "errors": (
            "ContactError",
            "ContactWarning",
            "CorruptInfluenceError",
            "FootprintError",
            "IndenterError",
            "InfluenceError",
            "InfluenceWarning",
            "MeshError",
            "MeshWarning",
            "MjTactileError",
            "NativeError",
            "PadError",
            "PresetError",
            "SceneError",
            "StaleInfluenceError",
        ),
        "footprint": ("Footprint",),
        "indenter": (
            "INDENTER_NAMES",
            "Indenter",
            "box",
            "convex_pieces",
            "cylinder",
            "indenter_outline",
            "indenter_solid",
            "mesh_indenter",
            "punch",
            "sphere",
        ),
        "influence": ("InfluenceMatrices", "load_influence"),
        "load": ("ContactState", "SurfaceLoad"),
        "mesh": ("MESHES", "MeshDensity"),
        "pad": ("Layer", "Pad", "TaxelGrid"),
        "pad_json": ("pad_text",),
        "native_host": ("Health", "set_warnings"),
        "plugin_attributes": ("plugin_health", "register_pad"),
        "preset": ("PRESETS", "Fidelity"),
        "scene": ("PressResult", "force_vector", "press", "press_scene"),
        "sensor": ("TactileSensor",),
        "several": ("contact_loads",),
    }.items()
    for name in names
}

__all__ = [
    "INDENTER_NAMES",
    "MESHES",
    "PRESETS",
    "ContactError",
    "ContactState",
    "ContactWarning",
    "CorruptInfluenceError",
    "Fidelity",
    "Footprint",
    "FootprintError",
    "Health",
    "Indenter",
    "IndenterError",
    "InfluenceError",
    "InfluenceMatrices",
    "InfluenceWarning",
    "Layer",
    "MeshDensity",
    "MeshError",
    "MeshWarning",
    "MjTactileError",
    "NativeError",
    "Pad",
    "PadError",
    "PresetError",
    "PressResult",
    "SceneError",
    "StaleInfluenceError",
    "SurfaceLoad",
    "TactileSensor",
    "TaxelGrid",
    "WrenchBasis",
    "attach_pad",
    "box",
    "contact_load",
    "contact_loads",
    "convex_pieces",
    "cylinder",
    "force_vector",
    "indenter_outline",
    "indenter_solid",
    "influence_matrices",
    "load_influence",
    "mesh_indenter",
    "pad_text",
    "plugin_health",
    "press",
    "press_scene",
    "punch",
    "recognition",
    "register_pad",
    "set_warnings",
    "sphere",
]


#: Packages inside this one that are reached as attributes as well.
_PACKAGES = ("envs", "recognition", "torch")

_plugin_hook.install()


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return import_module(f"mjtactile.{name}")
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'mjtactile' has no attribute {name!r}")
    value = getattr(import_module(f"mjtactile.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
