"""Pads, indenters and press scenes as MJCF text; the files in models/ and scenes/ are made by this module.

Lengths are metres, forces newtons. What every model here shares:

- The pad is a box geom of priority 1, so its contact parameters apply to every contact; its site `pad_surface`
  is the pad frame. A curved pad is a mesh geom of its shape instead.
- An indenter's body carries its true solid as geom in group 2, `<name>_tactile`. If it presses with a flat face, that
  geom does not collide. Small spheres in group 3, the feet `<name>_foot_<i>`, collide instead. MuJoCo places at most
  four contact points between two convex geoms, and meshes collide as their convex hull. So without feet, the centre
  of pressure of a star, or even of an octagon that cannot tilt, would be off by up to a millimetre. Each foot has one
  contact, and the mean of the feet's positions is the face's centroid. The solid of a curved indenter collides itself.
- On a curved pad, the solid of a flat punch collides as well. If the face has notches or holes, the solid is divided
  into convex parts, `<name>_part_<i>` in group 3, because the pad reaches into the notches and holes.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import trimesh

from mjtactile._types import Array, Indices
from mjtactile.geometry.indenter import Indenter
from mjtactile.geometry.planar import support_points
from mjtactile.pad import Pad
from mjtactile.sim.pad_geom import contact_attributes, piece_names
from mjtactile.sim.pad_solid import pad_solid

#: Mass of an indenter [kg]. Much lighter ones lose contact under 1 N at a 1 ms step.
INDENTER_MASS = 15e-3
#: Radius of the feet [m]: far above the 10 micrometres they sink in.
FOOT_RADIUS = 0.5e-3
#: Initial gap between indenter and pad [m]: no contact at rest, contact after one step.
START_GAP = 1e-6
#: End of the names of geoms that press instead of their body's colliding geoms.
SHOWN = "_tactile"
#: Simulation options of every world here.
OPTION = {
    "timestep": "0.001",
    "integrator": "implicitfast",
    "cone": "elliptic",
    "impratio": "100",
    "jacobian": "dense",  # MuJoCo 4.0.0's sparse Cholesky can be wrong
}
#: Time constant of the force [s]: under a sudden oblique force, a punch would slide by 0.1 mm before it sticks.
_FORCE_RISE = "0.004"
_FORCE_RANGE = "-2.5 2.5"
#: The gimbal in which a free indenter tilts. Its inertia [kg m^2] is far above a punch's 1e-7, with which the punch
#: would rock on its feet for a long time. Its damping [N m s/rad] brings the punch to rest in 10 ms. Neither carries
#: load at rest.
_GIMBAL = {"armature": "1e-05", "damping": "0.001"}
_DENSITY = "965"  # PDMS [kg/m3]


def pad_mjcf(pad: Pad | None = None) -> str:
    """MJCF of the pad alone, for `MjSpec.attach` and `<attach>`: body, geom `pad`, site `pad_surface`."""
    root, pad = document("pad"), pad or Pad()
    add_pad_meshes(root, pad, "pad")
    ET.SubElement(root, "worldbody").append(_pad_body(pad))
    return text_of(root)


def indenter_mjcf(indenter: Indenter, *, pad: Pad | None = None) -> str:
    """MJCF of the indenter alone: one body with its name, its lowest point at the body's origin.

    A flat punch has feet only for a flat pad, as the default one is.
    """
    root, on_feet = document(indenter.name), pad is None or pad.surface.is_flat
    _add_meshes(root, indenter, on_feet=on_feet)
    ET.SubElement(root, "worldbody").append(_indenter_body(indenter, None, on_feet=on_feet))
    return text_of(root)


def press_mjcf(
    indenter: Indenter,
    *,
    pad: Pad | None = None,
    shift: tuple[float, ...] = (0.0, 0.0),
    rotate_deg: float = 0.0,
    feet: Array | None = None,
    tilt_free: bool = False,
) -> str:
    """MJCF of a scene in which actuators `press_x`, `press_y`, `press_z` push an indenter onto a pad.

    Each control is a component of the force on the indenter in the pad frame [N]; it acts along a line through the
    indenter's origin, the middle of a punch's face.

    Args:
        indenter: the body that presses.
        pad: the pad; the default pad if None.
        shift: position of the indenter's origin in the pad frame [m]: (x, y), or (x, y, z) if it touches the pad at a
            height z other than 0.
        rotate_deg: counter-clockwise rotation before the shift [deg].
        feet: positions of a flat indenter's feet in its own frame [m], shape (n, 2); distributed over its face if None.
            On a curved pad it has no feet: its solid collides, in convex parts if the face is not convex.
        tilt_free: whether a ball joint at the indenter's origin lets it rotate.
    """
    root, pad = document("press_free" if tilt_free else "press"), pad or Pad()
    on_feet = pad.surface.is_flat
    ET.SubElement(root, "option", OPTION)
    ET.SubElement(root, "statistic", center="0 0 0", extent="0.02")
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "headlight", ambient="0.3 0.3 0.3", diffuse="0.6 0.6 0.6")
    _add_meshes(root, indenter, on_feet=on_feet)
    add_pad_meshes(root, pad, "pad")
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 -0.05 0.1", dir="0 0.45 -0.9", diffuse="0.5 0.5 0.5")
    ET.SubElement(world, "camera", name="oblique", pos="0 -0.035 0.025", xyaxes="1 0 0 0 0.58 0.81", fovy="30")
    world.append(_pad_body(pad))
    carrier = ET.SubElement(world, "body", name="press", pos=numbers((*shift[:2], sum(shift[2:]) + START_GAP)))
    for axis, direction in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1")):
        ET.SubElement(carrier, "joint", name=f"press_{axis}", type="slide", axis=direction)
    if tilt_free:
        ET.SubElement(carrier, "joint", _GIMBAL, name="press_tilt", type="ball")
    body = _indenter_body(indenter, feet, on_feet=on_feet)
    half = math.radians(rotate_deg) / 2
    body.set("quat", numbers((math.cos(half), 0.0, 0.0, math.sin(half))))
    carrier.append(body)
    actuators = ET.SubElement(root, "actuator")
    for axis in "xyz":
        ET.SubElement(
            actuators,
            "general",
            name=f"press_{axis}",
            joint=f"press_{axis}",
            dyntype="filterexact",
            dynprm=_FORCE_RISE,
            ctrlrange=_FORCE_RANGE,
        )
    return text_of(root)


def document(model: str, *, module: str = "sim/mjcf.py") -> ET.Element:
    """Root element of a model, with a comment that names the Python file of the package that writes it."""
    root = ET.Element("mujoco", model=model)
    root.append(ET.Comment(f" Made by mjtactile/{module}. Metres, kilograms, newtons. "))
    return root


def _pad_body(pad: Pad) -> ET.Element:
    body = ET.Element("body", name="pad")
    half = pad.thickness / 2
    look = contact_attributes("press") | {"name": "pad"}
    size, pos = (pad.size[0] / 2, pad.size[1] / 2, half), (0.0, 0.0, -half)
    box = {"type": "box", "size": numbers(size), "pos": numbers(pos)}
    for shape in [box] if pad.surface.is_flat else mesh_geoms(pad, "pad", "pad"):
        ET.SubElement(body, "geom", look | shape | {"density": _DENSITY, "rgba": "0.75 0.8 0.85 1"})
    ET.SubElement(body, "site", name="pad_surface", size="0.0002", group="4")
    return body


def _add_meshes(root: ET.Element, indenter: Indenter, *, on_feet: bool) -> None:
    if indenter.primitive is None:
        _add_asset(root, f"{indenter.name}_solid", indenter.solid.vertices, indenter.solid.faces)
    if not on_feet:
        for name, part in _parts(indenter):
            _add_asset(root, name, part.vertices, part.faces)


def _parts(indenter: Indenter) -> list[tuple[str, trimesh.Trimesh]]:
    """Convex parts of a punch whose face has notches or holes, with the names of their meshes and geoms."""
    return [(f"{indenter.name}_part_{i}", part) for i, part in enumerate(indenter.convex_solids)]


def add_pad_meshes(root: ET.Element, pad: Pad, name: str) -> None:
    """Add the meshes of a curved pad, in its frame, `<name>`, `<name>_piece_1` and so on; none for a flat pad."""
    if pad.surface.is_flat:
        return
    solid = pad_solid(pad)
    for mesh, piece in zip(piece_names(name, solid), solid.pieces, strict=True):
        _add_asset(root, mesh, piece.vertices, piece.faces)


def mesh_geoms(pad: Pad, name: str, mesh: str) -> list[dict[str, str]]:
    """Attributes of the geoms of a curved pad, for the meshes of `add_pad_meshes`."""
    solid = pad_solid(pad)
    both = zip(piece_names(name, solid), piece_names(mesh, solid), strict=True)
    return [{"name": geom, "type": "mesh", "mesh": of_mesh} for geom, of_mesh in both]


def _add_asset(root: ET.Element, name: str, vertices: Array, faces: Indices) -> None:
    assets = root.find("asset")
    if assets is None:
        assets = ET.SubElement(root, "asset")
    text = {"vertex": numbers(vertices.ravel()), "face": " ".join(map(str, faces.ravel()))}
    ET.SubElement(assets, "mesh", {"name": name, "inertia": "exact", **text})


def _indenter_body(indenter: Indenter, feet: Array | None, *, on_feet: bool) -> ET.Element:
    """The indenter's body; its weight is compensated, so that it does not add to the commanded force."""
    body = ET.Element("body", name=indenter.name, gravcomp="1")
    parts = [] if on_feet else _parts(indenter)
    body.append(_solid_geom(indenter, collides=indenter.outline is None or not (on_feet or parts)))
    stands_in = {"group": "3", "mass": "0"}
    for name, _ in parts:
        ET.SubElement(body, "geom", {"name": name, "type": "mesh", "mesh": name, **stands_in})
    if indenter.outline is not None and on_feet:
        for i, (x, y) in enumerate(support_points(indenter.outline) if feet is None else feet):
            ET.SubElement(
                body,
                "geom",
                {
                    "name": f"{indenter.name}_foot_{i}",
                    "type": "sphere",
                    "size": numbers((FOOT_RADIUS,)),
                    "pos": numbers((x, y, FOOT_RADIUS)),
                    **stands_in,
                },
            )
    return body


def _solid_geom(indenter: Indenter, *, collides: bool) -> ET.Element:
    # A geom that does not collide presses only if its name says so.
    name = f"{indenter.name}_solid" if collides else f"{indenter.name}{SHOWN}"
    geom = ET.Element("geom", name=name, group="2", mass=numbers((INDENTER_MASS,)), rgba="0.85 0.55 0.3 1")
    if not collides:
        geom.attrib |= {"contype": "0", "conaffinity": "0"}
    if indenter.primitive is None:
        geom.attrib |= {"type": "mesh", "mesh": f"{indenter.name}_solid"}
        return geom
    kind, size, height, axis = indenter.primitive
    geom.attrib |= {"type": kind, "size": numbers(size), "pos": numbers((0.0, 0.0, height))}
    if axis != (0.0, 0.0, 1.0):
        geom.set("zaxis", numbers(axis))
    return geom


def numbers(values: Array | tuple[float, ...]) -> str:
    """Numbers as text, rounded to 1e-12 and nine digits, so that the text is the same on all platforms."""
    return " ".join(f"{round(float(value), 12) + 0.0:.9g}" for value in values)


def text_of(root: ET.Element) -> str:
    """The XML document as indented text."""
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
