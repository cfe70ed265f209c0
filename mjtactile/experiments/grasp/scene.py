"""Grasp scenes: a hand on a driven wrist over a table, and an object with given shape, mass and friction on it.

Lengths are metres, in the world's frame: the table's top is z = 0, the gripper closes along x.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from mjtactile.errors import SceneError
from mjtactile.experiments.hands.fingertip import CONTACT, DEFAULT_PADS, FingertipPads
from mjtactile.experiments.hands.gripper import GRIPPER
from mjtactile.experiments.hands.hand import HAND
from mjtactile.plugin.registration import ensure_registered
from mjtactile.sim.mjcf import OPTION, numbers, text_of

#: Contact priority of objects: above that of pads, so that the object determines the friction everywhere.
OBJECT_PRIORITY = 11
#: Position servos of the wrist [N/m, N s/m]: critically damped for the gripper of 1 kg, stiff as an arm's.
WRIST_STIFFNESS, WRIST_DAMPING = 4e4, 4e2
#: Largest force of a wrist's drive [N].
WRIST_FORCE = 150.0
#: Shapes of objects.
SHAPES = ("box", "cylinder", "sphere")
#: Torsional friction of one contact point, relative to its sliding friction [m]. Pads touch in several points, which
#: carry torsion together; a single point counts as a patch 0.5 mm across.
_TORSION = 5e-4
#: Options of the simulation: those of press scenes, and MuJoCo's no-slip iterations, so that held objects do not
#: creep.
_OPTION = {**OPTION, "noslip_iterations": "4"}
#: Hands by the name of their body.
_HANDS = {hand.name: hand for hand in (GRIPPER, HAND)}
#: Range of the wrist about its initial position [m].
_RANGES = {"x": (-0.1, 0.1), "y": (-0.1, 0.1), "z": (-0.15, 0.3)}


@dataclass(frozen=True, kw_only=True)
class GraspObject:
    """An object to be grasped.

    Raises:
        SceneError: the shape is unknown, or size, mass or friction is out of range.
    """

    shape: str = "box"  #: "box", "cylinder" (upright) or "sphere"
    size: tuple[float, float, float] = (0.04, 0.04, 0.06)  #: extent along x, y, z [m]; a sphere uses the first
    mass: float = 0.1  #: [kg]
    friction: float = 0.6  #: sliding, against pads and table [-]

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise SceneError(f"object shape {self.shape!r} does not exist. Available: {', '.join(SHAPES)}.")
        for name, values in (("size", self.size), ("mass", (self.mass,)), ("friction", (self.friction,))):
            if not all(math.isfinite(value) and value > 0.0 for value in values):
                raise SceneError(f"object {name} = {values}; expected positive numbers: metres, kilograms, a ratio.")

    @property
    def height(self) -> float:
        """Height of its top above the table [m]."""
        return self.size[0] if self.shape == "sphere" else self.size[2]


def grasp_spec(grasped: GraspObject, **options: Any) -> mujoco.MjSpec:
    """A grasp scene as an editable `MjSpec`; arguments and errors as in `grasp_mjcf`."""
    ensure_registered()
    return mujoco.MjSpec.from_string(grasp_mjcf(grasped, **options))


def grasp_mjcf(
    grasped: GraspObject,
    *,
    hand: str = "gripper",
    wrist: str = "z",
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    grasp_height: float | None = None,
    pads: FingertipPads = DEFAULT_PADS,
) -> str:
    """MJCF of a scene with a hand around an object on a table; `open_gripper` opens the hand.

    The scene has a body, a free joint and a geom `object`, and the hand of hands/gripper.py or hands/hand.py. Each
    driven axis has an actuator `wrist_<axis>`, whose control is the wrist's displacement from its initial position [m],
    and a position sensor of the same name.

    Args:
        grasped: the object.
        hand: "gripper", or "hand" with three fingers.
        wrist: driven axes, some of "x", "y" and "z"; the others are rigid.
        pose: x, y [m] and rotation about the vertical of the object [rad].
        grasp_height: height of the pads' centres above the table [m]; by default half the object's height.
        pads: pads of the fingertips.

    Raises:
        SceneError: the hand or an axis is unknown.
    """
    if hand not in _HANDS:
        raise SceneError(f"hand = {hand!r}; expected one of {', '.join(map(repr, _HANDS))}.")
    if not set(wrist) <= set(_RANGES) or len(set(wrist)) != len(wrist):
        raise SceneError(f"wrist = {wrist!r}; expected some of the axes x, y and z, each once, such as 'z' or 'xyz'.")
    root = _HANDS[hand].document("grasp", pads)
    root.insert(1, ET.Element("option", _OPTION))
    root.insert(2, ET.Element("statistic", center="0 0 0.1", extent="0.3"))
    world = _child(root, "worldbody")
    world.insert(0, ET.Element("light", pos="0 -0.3 0.6", dir="0 0.45 -0.9"))
    world.insert(1, ET.Element("camera", name="front", pos="0 -0.5 0.25", xyaxes="1 0 0 0 0.3 0.95", fovy="40"))
    table = ET.Element("geom", CONTACT, name="table", type="plane", size="0.3 0.3 0.05", rgba="0.85 0.83 0.8 1")
    world.insert(2, table)
    world.append(object_element(grasped, pose))
    carrier = next(body for body in world.iter("body") if body.get("name") == hand)
    height = grasped.height / 2 if grasp_height is None else grasp_height
    carrier.set("pos", numbers((0.0, 0.0, height + _HANDS[hand].reach)))
    for place, axis in enumerate(wrist):
        _add_drive(root, carrier, axis, place)
    return text_of(root)


def object_element(grasped: GraspObject, pose: tuple[float, float, float]) -> ET.Element:
    """The body of an object on the table; see `grasp_mjcf`."""
    x, y, turn = pose
    body = ET.Element(
        "body",
        name="object",
        pos=numbers((x, y, grasped.height / 2)),
        quat=numbers((math.cos(turn / 2), 0.0, 0.0, math.sin(turn / 2))),
    )
    ET.SubElement(body, "freejoint", name="object")
    half = tuple(length / 2 for length in grasped.size)
    size = {"box": half, "cylinder": (half[0], half[2]), "sphere": half[:1]}[grasped.shape]
    ET.SubElement(
        body,
        "geom",
        CONTACT,
        name="object",
        type=grasped.shape,
        size=numbers(size),
        mass=numbers((grasped.mass,)),
        friction=numbers((grasped.friction, _TORSION * grasped.friction, 1e-4)),
        priority=str(OBJECT_PRIORITY),
        rgba="0.85 0.55 0.3 1",
    )
    return body


def open_gripper(model: mujoco.MjModel, data: mujoco.MjData, opening: float) -> None:
    """Set the opening of the gripper [m]; call it before the first step."""
    for name in ("left_finger", "right_finger"):
        joint = model.joint(name)
        low, high = joint.range
        data.qpos[joint.qposadr[0]] = np.clip(opening / 2, low, high)
    mujoco.mj_forward(model, data)


def _add_drive(root: ET.Element, gripper: ET.Element, axis: str, place: int) -> None:
    name, limits = f"wrist_{axis}", numbers(_RANGES[axis])
    joint = ET.Element(
        "joint", name=name, type="slide", axis=numbers(tuple(float(axis == one) for one in "xyz")), range=limits
    )
    gripper.insert(place, joint)
    ET.SubElement(
        _child(root, "actuator"),
        "general",
        name=name,
        joint=name,
        biastype="affine",
        gainprm=numbers((WRIST_STIFFNESS,)),
        biasprm=numbers((0.0, -WRIST_STIFFNESS, -WRIST_DAMPING)),
        ctrlrange=limits,
        forcerange=numbers((-WRIST_FORCE, WRIST_FORCE)),
    )
    ET.SubElement(_child(root, "sensor"), "jointpos", name=name, joint=name)


def _child(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    assert found is not None, tag
    return found
