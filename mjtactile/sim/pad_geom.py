"""How pads touch, by name, and the geom of a pad in somebody else's model.

All contact constants of pads stand here, with the reason for each value; models and scenes of ours ask for them by
name.
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

#: Parameters of a stiff contact, and what the others have in their place; `contact_constants` has the reasons.
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
#: What models need not say, since MuJoCo says it too.
_PLAIN = {"gap": 0.0, "margin": 0.0}
#: Touches whatever touches anything: every bit that MuJoCo's groups have.
_EVERY_GROUP = 0x7FFFFFFF
_COLOUR = [0.75, 0.8, 0.85, 1.0]
_DENSITY = 965.0  # of PDMS [kg/m^3]


def contact_constants(contact: str) -> dict[str, Any]:
    """Contact parameters of a pad's geom, by their names in MuJoCo.

    All contacts:

    - condim 4: a pad resists a twist about its normal.
    - friction 1: silicone; .5 mm for that twist, as of a patch of that size (MuJoCo's default would be as of 5 mm), and
      .1 mm for rolling, of which condim 4 uses the first.
    - priority 10: these values count against whatever the hand or the object brings along.
    - gap 0: what touches is pressed.

    "stiff", for what aligns itself, such as fingertips on a gimbal or things that lie:

    - solref .005 s, critically damped: the fastest that steps of 2 ms allow (MuJoCo wants two steps); 10 to 200 gf
      settle within .1 % in 100 ms.
    - solimp .98 to .99: bodies sink in by some hundredths of a millimetre, as into the real pad, flat.
    - margin 0: nothing is felt before it touches.

    "soft", for rigid grippers: a face that leans in the grip by 5 degrees stands off by 1.3 mm at the far side of
    15 mm. MuJoCo lists only corners that are nearer than the margin, so that a stiff contact has one edge or corner.

    - margin 1 mm: contacts begin there, so that surfaces meet half way into what gives: things under their own weight
      stand within .03 mm of the surface, and those gripped with 2 to 20 N up to .8 mm deep.
    - solimp .5 to .998 over 2 mm, in the middle at .7, power 3: gives way softly over the first millimetre, so that all
      four corners press, and hardens, so that a thing of 10 g under 20 N sinks in no deeper than .9 mm even askew. The
      middle of pressure stands where it does on 5 mm of PDMS within 1.5 mm, mean over .5 to 5 degrees and 2 to 20 N.
    - solref .02 s, critically damped: of what is as soft, slower contacts creep less while they hold a weight; .02 s is
      MuJoCo's own. 10 to 200 gf settle within .1 % in 160 ms.

    "press", for a punch that is pressed on a pad in a world of ours, at steps of 1 ms:

    - solref .003 s, critically damped: near the fastest that steps of 1 ms allow; 10 to 200 gf settle within .1 % in
      40 ms, and a punch creeps by less than .01 mm/s at 35 degrees.
    - solimp and margin of "stiff": a punch sinks in by 10 micrometres at most.
    - priority 1: nothing in that world has any, and models that a pad is put into may go above it.

    "hand", for pads of our hands, their links, and what they hold or stand it on:

    - solref .01 s, critically damped, and solimp .9: gives way by some .1 mm under 5 N, fingers and rubber together.
      Where a contact slides, MuJoCo's convex friction pushes the bodies apart by friction times speed times that time
      constant, and a stiffer contact would open and hop.
    - margin 0, as "stiff".

    Args:
        contact: "stiff", "soft", "press" or "hand".

    Raises:
        SceneError: when there is no such contact.
    """
    if contact not in CONTACTS:
        raise SceneError(f"contact {contact!r} does not exist. Available: {', '.join(CONTACTS)}.")
    return copy.deepcopy(_STIFF | _DIFFERENT[contact])


def contact_attributes(contact: str, *names: str) -> dict[str, str]:
    """The same as attributes of a geom in MJCF.

    Args:
        contact: see `contact_constants`.
        names: of the attributes that are wanted, in that order; by default all that differ from MuJoCo's own.

    Raises:
        SceneError: when there is no such contact.
    """
    constants = contact_constants(contact)
    wanted = names or [name for name, value in constants.items() if value != _PLAIN.get(name)]
    return {name: " ".join(f"{value:g}" for value in np.atleast_1d(constants[name])) for name in wanted}


#: Geoms of one pad that is not convex: `<pad>`, `<pad>_piece_1` and so on.
PIECE = "_piece_"


def add_pad_geom(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    name: str,
    pad: Pad,
    place: tuple[Array, Array],
    contact: str,
) -> mujoco.MjsGeom:
    """A pad's geom `<name>_pad` and the site `<name>_surface` on it, without anything from the model's defaults.

    A flat pad is a box. A curved one is a mesh in the pad frame, which MuJoCo collides as its convex hull; where its
    surface has hollows, several, of which those after the first are called `<name>_pad_piece_1` and so on. MuJoCo moves
    a mesh's frame to its centre of mass, so the pad frame is the geom's frame, moved back (`sim.wrench.geom_frame`).

    Args:
        spec: of the model.
        body: it is part of.
        name: of the pad.
        pad: whose size it has.
        place: of the pad frame in the body's frame: position [m], (3,), and unit quaternion, (4,).
        contact: see `contact_constants`.

    Raises:
        SceneError: when there is no such contact.
    """
    position, quat = place
    contype, conaffinity = collision_groups(body)
    look: dict[str, Any] = {"contype": contype, "conaffinity": conaffinity, "rgba": _COLOUR, "density": _DENSITY}
    look |= {"quat": quat, **contact_constants(contact)}
    # Made from the default class of an empty model: MuJoCo's own values in every field that this version has.
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


def pad_pieces(model: Any, geom: int) -> list[int]:
    """Ids of the geoms that are one pad: its own, and `<name>_piece_1` and so on of one with hollows.

    Args:
        model: compiled model, or a `ModelCopy` of one.
        geom: id of the pad's geom.
    """
    pieces = [geom]
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        return pieces
    beginning = f"{model.geom(geom).name}{PIECE}"
    # They stand behind one another, since they were added to one body.
    for other in range(geom + 1, len(model.geom_type)):
        if not model.geom(other).name.startswith(beginning):
            break
        pieces.append(other)
    return pieces


def piece_names(pad: str, solid: PadSolid) -> list[str]:
    """Names of the geoms and meshes of a curved pad: its own, and `<name>_piece_1` and so on."""
    return [pad, *(f"{pad}{PIECE}{number}" for number in range(1, len(solid.pieces)))]


def _add_meshes(spec: mujoco.MjSpec, name: str, solid: PadSolid) -> list[str]:
    """A pad's meshes, without anything from the model's defaults; their names."""
    names = piece_names(name, solid)
    for mesh, piece in zip(names, solid.pieces, strict=True):
        if spec.mesh(mesh) is not None:
            raise SceneError(f"the model has a mesh '{mesh}' already. Give the pad another name.")
        spec.add_mesh(
            mujoco.MjSpec().default,
            name=mesh,
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT,
            uservert=piece.vertices.ravel().tolist(),
            userface=piece.faces.ravel().tolist(),
        )
    return names


def collision_groups(body: mujoco.MjsBody) -> tuple[int, int]:
    """Groups (contype, conaffinity) of a pad on a body: it touches what the body's own geoms touch, and nothing else.

    They are the union of those of the body's geoms; of the next body towards the root that has geoms which collide,
    where the body has none, as hands whose fingertips are only drawn. A pad on no such body, or on the world itself,
    touches whatever touches anything.
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
