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
    from mjtactile import dataset as dataset
    from mjtactile import envs as envs
    from mjtactile import hands as hands
    from mjtactile import lerobot as lerobot
    from mjtactile import recognition
    from mjtactile import torch as torch
    from mjtactile import transducer as transducer
    from mjtactile import view as view
    from mjtactile.attach import attach_pad
    from mjtactile.contact.contact_load import contact_load, contact_loads
    from mjtactile.contact.footprint import Footprint
    from mjtactile.contact.wrench_basis import WrenchBasis
    from mjtactile.errors import (
        ContactError,
        ContactWarning,
        CorruptInfluenceError,
        DatasetError,
        FootprintError,
        IndenterError,
        InfluenceError,
        InfluenceWarning,
        MeshError,
        MeshWarning,
        MissingExtraError,
        MjTactileError,
        NativeError,
        OutputError,
        PadError,
        PresetError,
        RenderError,
        SceneError,
        StaleInfluenceError,
        ViewError,
    )
    from mjtactile.fidelity import MESHES, PRESETS, Fidelity, MeshDensity
    from mjtactile.geometry.indenter import (
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
    from mjtactile.geometry.outlines import INDENTER_NAMES
    from mjtactile.influence.cache import influence_matrices
    from mjtactile.influence.matrices import InfluenceMatrices, load_influence
    from mjtactile.influence.surface_load import ContactState, SurfaceLoad
    from mjtactile.pad import Layer, Pad, TaxelGrid, force_vector
    from mjtactile.pad_names import pad_from_file, pad_text, register_pad
    from mjtactile.pad_shape.surfaces import CylinderSector, EllipsoidCap, Flat, SphereCap, SurfacePatch
    from mjtactile.pad_shape.taxels import FreeTaxels
    from mjtactile.plugin.attributes import plugin_health
    from mjtactile.plugin.health import Health, set_warnings
    from mjtactile.sensor import TactileSensor
    from mjtactile.sim.press_scene import PressResult, press, press_scene
    from mjtactile.sim.preview import preview_pad

from mjtactile._installed import __version__ as __version__
from mjtactile.plugin import import_hook as _import_hook

__all__ = [
    "INDENTER_NAMES",
    "MESHES",
    "PRESETS",
    "ContactError",
    "ContactState",
    "ContactWarning",
    "CorruptInfluenceError",
    "CylinderSector",
    "DatasetError",
    "EllipsoidCap",
    "Fidelity",
    "Flat",
    "Footprint",
    "FootprintError",
    "FreeTaxels",
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
    "MissingExtraError",
    "MjTactileError",
    "NativeError",
    "OutputError",
    "Pad",
    "PadError",
    "PresetError",
    "PressResult",
    "RenderError",
    "SceneError",
    "SphereCap",
    "StaleInfluenceError",
    "SurfaceLoad",
    "SurfacePatch",
    "TactileSensor",
    "TaxelGrid",
    "ViewError",
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
    "pad_from_file",
    "pad_text",
    "plugin_health",
    "press",
    "press_scene",
    "preview_pad",
    "punch",
    "recognition",
    "register_pad",
    "set_warnings",
    "sphere",
]

_MODULE_OF = {
    name: module
    for module, names in {
        "attach": ("attach_pad",),
        "influence.cache": ("influence_matrices",),
        "contact.wrench_basis": ("WrenchBasis",),
        "contact.contact_load": ("contact_load", "contact_loads"),
        "errors": tuple(name for name in __all__ if name.endswith(("Error", "Warning"))),
        "contact.footprint": ("Footprint",),
        "geometry.outlines": ("INDENTER_NAMES",),
        "geometry.indenter": (
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
        "influence.matrices": ("InfluenceMatrices", "load_influence"),
        "influence.surface_load": ("ContactState", "SurfaceLoad"),
        "pad": ("Layer", "Pad", "TaxelGrid", "force_vector"),
        "pad_names": ("pad_from_file", "pad_text", "register_pad"),
        "plugin.health": ("Health", "set_warnings"),
        "plugin.attributes": ("plugin_health",),
        "fidelity": ("MESHES", "PRESETS", "Fidelity", "MeshDensity"),
        "sim.preview": ("preview_pad",),
        "sim.press_scene": ("PressResult", "press", "press_scene"),
        "sensor": ("TactileSensor",),
        "pad_shape.surfaces": ("CylinderSector", "EllipsoidCap", "Flat", "SphereCap", "SurfacePatch"),
        "pad_shape.taxels": ("FreeTaxels",),
    }.items()
    for name in names
}

#: Subpackages that can be used as attributes of `mjtactile` without an import of their own.
_PACKAGES = ("dataset", "envs", "hands", "lerobot", "recognition", "torch", "transducer", "view")

_import_hook.install()


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
