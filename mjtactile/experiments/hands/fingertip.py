"""Common parts of this package's hands: the MJCF document with the palm, pads on fingertips, contact parameters.

Lengths are metres, masses kilograms.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from mjtactile.fidelity import DEFAULT, Fidelity, fidelity_text
from mjtactile.pad import Pad
from mjtactile.pad_names import PLUGIN, pad_text
from mjtactile.pad_shape.surfaces import SphereCap
from mjtactile.sim.mjcf import add_pad_meshes, document, mesh_geoms, numbers, text_of
from mjtactile.sim.pad_geom import contact_attributes

#: Contact parameters of links and held objects: those of pads, without friction and priority, which objects define.
CONTACT = contact_attributes("hand", "condim", "solref", "solimp")
#: Name of the mesh of every fingertip's pad, if the pad is curved.
_MESH = "fingertip_pad"
_PAD_DENSITY = "965"  # PDMS [kg/m^3]
#: Colours of links and palms.
GREY, _DARK = "0.55 0.57 0.6 1", "0.25 0.26 0.28 1"


@dataclass(frozen=True, kw_only=True)
class FingertipPads:
    """The pad of all fingertips of a hand, and its fidelity."""

    pad: Pad = field(default_factory=Pad)  #: flat, as recognisers require, or curved
    name: str = "default"  #: name of the pad for the plugin: `pad_text(pad)`, or a name of `register_pad`
    fidelity: str | Fidelity = DEFAULT  #: fidelity of the readings, a preset by name or a Fidelity


#: The default pad, read at the default fidelity.
DEFAULT_PADS = FingertipPads()
_DOME = Pad(surface=SphereCap(14e-3))
#: Pads with a round surface, which recognisers and experiments do not support.
CURVED_PADS = FingertipPads(pad=_DOME, name=pad_text(_DOME))


@dataclass(frozen=True, kw_only=True)
class HandModel:
    """A hand as MJCF."""

    name: str  #: name of the hand's body, whose origin is the mounting flange
    reach: float  #: distance from the flange down to site `grasp`, the middle of the pads [m]
    module: str  #: name of the Python file that writes it
    palm: Mapping[str, str]  #: attributes of the palm's geom, including its mass
    #: Function that adds fingers, drives and sensors to a document and the hand's body in it.
    add_fingers: Callable[[ET.Element, ET.Element, FingertipPads], None]

    def document(self, model: str, pads: FingertipPads) -> ET.Element:
        """The hand as an MJCF document, to be extended or written."""
        root = document(model, module=self.module)
        ET.SubElement(root, "compiler", angle="radian")
        ET.SubElement(ET.SubElement(root, "extension"), "plugin", plugin=PLUGIN)
        add_pad_meshes(root, pads.pad, _MESH)
        body = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name=self.name, gravcomp="1")
        ET.SubElement(body, "geom", {"name": "palm", **self.palm, "rgba": _DARK})
        ET.SubElement(body, "site", name="grasp", pos=numbers((0.0, 0.0, -self.reach)), size="0.001", group="4")
        self.add_fingers(root, body, pads)
        return root

    def mjcf(self, pads: FingertipPads = DEFAULT_PADS) -> str:
        """MJCF of the hand alone, for `MjSpec.attach` and `<attach>`."""
        return text_of(self.document(self.name, pads))


def pad_sensor(name: str, pads: FingertipPads) -> ET.Element:
    """A sensor of the plugin on geom `<name>_pad`."""
    sensor = ET.Element("plugin", name=name, plugin=PLUGIN, objtype="geom", objname=f"{name}_pad")
    for key, value in (("pad", pads.name), ("fidelity", fidelity_text(pads.fidelity)), ("output", "von_mises")):
        ET.SubElement(sensor, "config", key=key, value=value)
    return sensor


def add_pad(body: ET.Element, name: str, pad: Pad, surface: tuple[float, float, float], inward: float) -> None:
    """Add a pad's geom, and the site of its frame with its origin at `surface` [m], to a body.

    Its z axis points along the body's x axis times `inward`, a sign; its y axis is the body's z axis.
    """
    axes = numbers((0.0, inward, 0.0, 0.0, 0.0, 1.0))
    look = contact_attributes("hand")  # its friction applies only to objects of lower priority
    if pad.surface.is_flat:
        size = numbers((pad.size[0] / 2, pad.size[1] / 2, pad.thickness / 2))
        centre = surface[0] - inward * pad.thickness / 2, *surface[1:]
        shapes = [{"name": f"{name}_pad", "type": "box", "size": size, "pos": numbers(centre)}]
    else:
        shapes = [one | {"pos": numbers(surface)} for one in mesh_geoms(pad, f"{name}_pad", _MESH)]
    for shape in shapes:
        ET.SubElement(body, "geom", look | shape, xyaxes=axes, density=_PAD_DENSITY, rgba="0.75 0.8 0.85 1")
    ET.SubElement(body, "site", name=f"{name}_surface", pos=numbers(surface), xyaxes=axes, size="0.0002", group="4")
