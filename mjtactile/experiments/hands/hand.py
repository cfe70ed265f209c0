"""A three-finger hand of this package: two fingers and an opposing thumb, each with two joints and a fingertip pad.

Lengths are metres, angles radians, torques newton metres. The origin of the hand's body `hand` is the mounting flange.
Its z axis points up, and the fingers point down around site `grasp`. At angle zero, the fingers hang straight down;
positive angles close them. In the pad frame of a straight finger, z points towards the middle of the hand, and y
towards the knuckle.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from mjtactile.experiments.hands.fingertip import CONTACT, GREY, FingertipPads, HandModel, add_pad, pad_sensor
from mjtactile.pad import Pad
from mjtactile.sim.mjcf import numbers

#: Sensors of the hand, with the azimuth of their fingers about the hand's axis [deg]. The thumb faces the gap between
#: the two fingers.
HAND_PADS = {"thumb": 180.0, "left": 35.0, "right": -35.0}
#: Joints of a finger, from the palm outwards.
HAND_JOINTS = ("knuckle", "middle")
#: Distance of the knuckles from the hand's axis, and lengths of the links [m].
KNUCKLE_RADIUS, UPPER_LINK, LOWER_LINK = 0.045, 0.05, 0.045
#: Ranges of the joints [rad]: (fully open, fully closed).
RANGES = {"knuckle": (-0.7, 1.2), "middle": (-0.3, 1.6)}
#: Position servos: stiffness [N m/rad], and largest torque [N m], which gives 10 N at a fingertip.
STIFFNESS, TORQUE = 3.0, 0.95
#: Joints with gears: damping [N m s/rad], reflected inertia of the rotors [kg m^2], dry friction [N m].
_JOINT = {"type": "hinge", "damping": "0.05", "armature": "0.0004", "frictionloss": "0.005"}
_PALM_MASS, _LINK_MASSES = 0.5, (0.06, 0.04)
_PALM_HEIGHT, _WIDTH = 0.03, 0.008


def _add_fingers(root: ET.Element, palm: ET.Element, pads: FingertipPads) -> None:
    actuators, sensors = ET.Element("actuator"), ET.Element("sensor")
    for finger, around in HAND_PADS.items():
        palm.append(_finger(finger, math.radians(around), pads.pad))
        sensors.append(pad_sensor(finger, pads))
        for joint in HAND_JOINTS:
            name = f"{finger}_{joint}"
            ET.SubElement(
                actuators,
                "position",
                name=name,
                joint=name,
                kp=numbers((STIFFNESS,)),
                ctrlrange=numbers(RANGES[joint]),
                forcerange=numbers((-TORQUE, TORQUE)),
            )
            ET.SubElement(sensors, "jointpos", name=name, joint=name)
    root.extend((actuators, sensors))


#: Actuators `<finger>_<joint>`: commanded angle of a joint [rad]. Sensors `<finger>`: readings of the finger's pad.
#: Sensors `<finger>_<joint>`: angle of the joint [rad].
HAND = HandModel(
    name="hand",
    reach=_PALM_HEIGHT + UPPER_LINK + LOWER_LINK,
    module="experiments/hands/hand.py",
    palm={
        "type": "cylinder",
        "size": numbers((KNUCKLE_RADIUS - 0.005, _PALM_HEIGHT / 2)),
        "pos": numbers((0.0, 0.0, -_PALM_HEIGHT / 2)),
        "mass": numbers((_PALM_MASS,)),
    },
    add_fingers=_add_fingers,
)


def _finger(name: str, around: float, pad: Pad) -> ET.Element:
    """One finger. The z axis of its frame points up, the x axis away from the hand."""
    knuckle = (KNUCKLE_RADIUS * math.cos(around), KNUCKLE_RADIUS * math.sin(around), -_PALM_HEIGHT)
    turn = numbers((math.cos(around / 2), 0.0, 0.0, math.sin(around / 2)))
    upper = ET.Element("body", name=f"{name}_upper", pos=numbers(knuckle), quat=turn, gravcomp="1")
    _add_joint(upper, name, "knuckle")
    _add_link(upper, f"{name}_upper_link", UPPER_LINK, _LINK_MASSES[0])
    lower = ET.SubElement(upper, "body", name=f"{name}_lower", pos=numbers((0.0, 0.0, -UPPER_LINK)), gravcomp="1")
    _add_joint(lower, name, "middle")
    _add_link(lower, f"{name}_lower_link", LOWER_LINK, _LINK_MASSES[1])
    add_pad(lower, name, pad, (-_WIDTH - pad.thickness, 0.0, -LOWER_LINK), -1.0)
    return upper


def _add_joint(body: ET.Element, finger: str, joint: str) -> None:
    # A positive rotation about y moves a finger that points along -z towards -x, which is inwards.
    ET.SubElement(body, "joint", _JOINT, name=f"{finger}_{joint}", axis="0 1 0", range=numbers(RANGES[joint]))


def _add_link(body: ET.Element, name: str, length: float, mass: float) -> None:
    ET.SubElement(
        body,
        "geom",
        CONTACT,
        name=name,
        type="capsule",
        size=numbers((_WIDTH,)),
        fromto=numbers((0.0, 0.0, 0.0, 0.0, 0.0, -length)),
        mass=numbers((mass,)),
        rgba=GREY,
    )
