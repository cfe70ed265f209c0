"""Contact parameters of pads by name, and the geom of a pad in any model.

All contact parameters of pads are defined here, with the reason for each value. This package's own models and scenes
use them by name.
"""

from __future__ import annotations

import copy
from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.errors import SceneError
from mjtactile.pad import Pad
from mjtactile.sim.pad_solid import PadSolid, pad_solid

#: Parameters of a stiff contact, and the differences of the others; `contact_constants` has the reasons.
_STIFF: dict[str, Any] = {
    "condim": 4,
    "friction": [1.0, 0.0005, 0.0001],
    "priority": 10,
    "gap": 0.0,
    "solref": [0.005, 1.0],
    "solimp": [0.98, 0.99, 0.001, 0.5, 2.0],
    "margin": 0.0,
}
_DIFFERENT: dict[str, dict[str, Any]] = {
    "stiff": {},
    "soft": {"solref": [0.02, 1.0], "solimp": [0.5, 0.998, 0.002, 0.7, 3.0], "margin": 0.001},
    "press": {"solref": [0.003, 1.0], "priority": 1},
    "hand": {"solref": [0.01, 1.0], "solimp": [0.9, 0.9, 0.001, 0.5, 2.0]},
}
#: Contacts of a pad by name, see `contact_constants`.
CONTACTS = tuple(_DIFFERENT)
#: MuJoCo's defaults, which need not be written to models.
_PLAIN = {"gap": 0.0, "margin": 0.0}
#: Collides with every geom that collides at all: all bits of contype and conaffinity.
_EVERY_GROUP = 0x7FFFFFFF
_COLOUR = [0.75, 0.8, 0.85, 1.0]
_DENSITY = 965.0  # of PDMS [kg/m^3]


def contact_constants(contact: str) -> dict[str, Any]:
    """Contact parameters of a pad's geom, by their names in MuJoCo.

    All contacts:

    - condim 4: a pad resists torsion about its normal.
    - friction 1: silicone; torsional friction 0.5 mm, for a patch of that size (MuJoCo's default is 5 mm); rolling
      friction 0.1 mm, which condim 4 does not use.
    - priority 10: these values replace those of the hand or the object.
    - gap 0: every contact carries force.

    "stiff", for bodies that align themselves, such as fingertips on a gimbal or objects that lie on the pad:

    - solref 0.005 s, critically damped: the fastest that steps of 2 ms allow (MuJoCo requires at least two steps); 10
      to 200 gf settle within 0.1 % in 100 ms.
    - solimp 0.98 to 0.99: bodies penetrate by a few hundredths of a millimetre, as flat bodies do into the real pad.
    - margin 0: there is no force before contact.

    "soft", for rigid grippers: a face tilted by 5 degrees in the grip has a gap of 1.3 mm at the far side of 15 mm.
    MuJoCo lists only corners that are nearer than the margin, so a stiff contact has a single edge or corner.

    - margin 1 mm: contacts begin at this distance. Objects under their own weight rest within 0.03 mm of the surface;
      objects gripped with 2 to 20 N penetrate by up to 0.8 mm.
    - solimp 0.5 to 0.998 over 2 mm, midpoint 0.7, power 3: compliant over the first millimetre, so that all four
      corners press; then stiff, so that an object of 10 g under 20 N penetrates by 0.9 mm at most, even when tilted.
      The centre of pressure is within 1.5 mm of that on 5 mm of PDMS (mean over 0.5 to 5 degrees and 2 to 20 N).
    - solref 0.02 s, critically damped, MuJoCo's default: among contacts as soft as this, one with a longer time
      constant creeps less under a constant weight. 10 to 200 gf settle within 0.1 % in 160 ms.

    "press", for a punch that is pressed on a pad in one of this package's scenes, at steps of 1 ms:

    - solref 0.003 s, critically damped: near the fastest that steps of 1 ms allow; 10 to 200 gf settle within 0.1 % in
      40 ms, and under a force tilted by 35 degrees a punch creeps by less than 0.01 mm/s.
    - solimp and margin of "stiff": a punch penetrates by 10 micrometres at most.
    - priority 1: other geoms in these scenes have priority 0; models that include the pad may use a higher one.

    "hand", for pads and links of this package's hands, for the objects they hold and the ground under them:

    - solref 0.01 s, critically damped, and solimp 0.9: penetration of about 0.1 mm under 5 N, for the compliance of
      fingers and rubber together. In sliding contacts, MuJoCo's convex friction separates the bodies by friction times
      speed times this time constant; a stiffer contact would open and bounce.
    - margin 0, as "stiff".

    Raises:
        SceneError: there is no such contact.
    """
    if contact not in CONTACTS:
        raise SceneError(f"contact {contact!r} does not exist. Available: {', '.join(CONTACTS)}.")
    return copy.deepcopy(_STIFF | _DIFFERENT[contact])


def contact_attributes(contact: str, *names: str) -> dict[str, str]:
    """Contact parameters as attributes of a geom in MJCF.

    Args:
        contact: name of the contact, see `contact_constants`.
        names: names of the requested attributes, in order; by default all that differ from MuJoCo's defaults.

    Raises:
        SceneError: there is no such contact.
    """
    constants = contact_constants(contact)
    wanted = names or [name for name, value in constants.items() if value != _PLAIN.get(name)]
    return {name: " ".join(f"{value:g}" for value in np.atleast_1d(constants[name])) for name in wanted}


#: Part of the names of a pad's further geoms if it is not convex: `<pad>`, `<pad>_piece_1` and so on.
PIECE = "_piece_"


def add_pad_geom(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, pad: Pad, place: tuple[Array, Array], contact: str
) -> mujoco.MjsGeom:
    """Add a pad's geom `<name>_pad` and site `<name>_surface` to a body; the model's defaults do not affect them.

    The geom of a flat pad is a box. That of a curved pad is a mesh in the pad frame, which MuJoCo collides as its
    convex hull. A curved pad with hollows has several such geoms; the further ones are `<name>_pad_piece_1` and so on.
    MuJoCo moves a mesh's frame to its centre of mass; `sim.wrench.geom_frame` gives the pad frame.

    Args:
        spec: model specification.
        body: the body to add to.
        name: name of the pad's sensor.
        pad: the pad.
        place: pose of the pad frame in the body's frame: position [m], (3,), and unit quaternion, (4,).
        contact: name of the contact, see `contact_constants`.

    Raises:
        SceneError: there is no such contact.
    """
    position, quat = place
    contype, conaffinity = collision_groups(body)
    look: dict[str, Any] = {"contype": contype, "conaffinity": conaffinity, "rgba": _COLOUR, "density": _DENSITY}
    look |= {"quat": quat, **contact_constants(contact)}
    # The default class of an empty model has MuJoCo's own values in every field of this version.
    blank = mujoco.MjSpec()
    if pad.surface.is_flat:
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, quat)
        geom = body.add_geom(
            blank.default,
            name=f"{name}_pad",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[pad.size[0] / 2, pad.size[1] / 2, pad.thickness / 2],
            pos=position - rotation.reshape(3, 3)[:, 2] * pad.thickness / 2,
            **look,
        )
    else:
        meshes = _add_meshes(spec, f"{name}_pad", pad_solid(pad))
        look |= {"type": mujoco.mjtGeom.mjGEOM_MESH, "pos": position}
        geom = body.add_geom(blank.default, name=f"{name}_pad", meshname=meshes[0], **look)
        for mesh in meshes[1:]:
            body.add_geom(blank.default, name=mesh, meshname=mesh, **look)
    size = [0.0002, *blank.default.site.size[1:]]  # a ball's radius
    body.add_site(blank.default, name=f"{name}_surface", pos=position, quat=quat, size=size, group=4)
    return geom


def pad_geoms(spec: mujoco.MjSpec, name: str) -> list[mujoco.MjsGeom]:
    """All geoms of a sensor's pad in a specification: `<name>_pad` and, for hollows, `<name>_pad_piece_1` and so on."""
    first = f"{name}_pad"
    return [geom for geom in spec.geoms if geom.name == first or geom.name.startswith(f"{first}{PIECE}")]


def pad_pieces(model: Any, geom: int) -> list[int]:
    """Ids of all geoms of a pad in a model or a `ModelCopy` of one: for hollows also `<name>_piece_1` and so on."""
    pieces = [geom]
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        return pieces
    beginning = f"{model.geom(geom).name}{PIECE}"
    # Their ids are consecutive, since they were added to one body one after the other.
    for other in range(geom + 1, len(model.geom_type)):
        if not model.geom(other).name.startswith(beginning):
            break
        pieces.append(other)
    return pieces


def piece_names(pad: str, solid: PadSolid) -> list[str]:
    """Names of a curved pad's geoms or meshes by that of the first: for hollows also `<name>_piece_1` and so on."""
    return [pad, *(f"{pad}{PIECE}{number}" for number in range(1, len(solid.pieces)))]


def _add_meshes(spec: mujoco.MjSpec, name: str, solid: PadSolid) -> list[str]:
    """Add a pad's meshes, unaffected by the model's defaults, and return their names."""
    names = piece_names(name, solid)
    for mesh, piece in zip(names, solid.pieces, strict=True):
        spec.add_mesh(
            mujoco.MjSpec().default,
            name=mesh,
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT,
            uservert=piece.vertices.ravel().tolist(),
            userface=piece.faces.ravel().tolist(),
        )
    return names


def collision_groups(body: mujoco.MjsBody) -> tuple[int, int]:
    """Bit masks (contype, conaffinity) of a pad, so that it collides with what its body's own geoms collide with.

    The masks are the unions of those of the body's geoms. If none of these geoms collides, as on fingertips that are
    only visual, the masks are those of the nearest parent body with colliding geoms. Without such a body, or on the
    world body, the pad collides with every geom that collides at all.
    """
    one = body
    while one.name != "world" and one.parent is not None:
        contype = conaffinity = 0
        for geom in one.geoms:
            contype, conaffinity = contype | geom.contype, conaffinity | geom.conaffinity
        if contype or conaffinity:
            return contype, conaffinity
        one = one.parent
    return _EVERY_GROUP, _EVERY_GROUP
