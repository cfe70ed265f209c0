"""A parallel gripper of this package: two coupled fingers on slides with a pad on each fingertip, and one drive.

Lengths are metres, forces newtons. The origin of the gripper's body `gripper` is the mounting flange; z points up, and
the fingers point down. Site `grasp` is between the pads. In the pad frames, z points towards the other finger and y up,
so the weight of a held object pulls both pads along -y. The drive is controlled by force.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from mjtactile.experiments.hands.fingertip import GREY, FingertipPads, HandModel, add_pad, pad_sensor
from mjtactile.pad import Pad
from mjtactile.sim.mjcf import numbers
from mjtactile.sim.pad_solid import rise

#: Sensors of the gripper; geoms are `<name>_pad`, pad frames are sites `<name>_surface`.
GRIPPER_PADS = ("left", "right")
#: Stroke of both fingers together, and distance of the pads when the gripper is closed [m], so that they never touch.
STROKE, CLOSED_GAP = 80e-3, 0.5e-3
#: Largest force of each finger [N].
GRIP_LIMIT = 40.0
#: Distance from the flange to the middle of the pads [m].
_REACH = 0.12
#: Mass of a finger with its carriage, as in commercial grippers of that stroke [kg]; reflected inertia of the drive's
#: rotor [kg]; damping of gears and guides [N s/m]: 1 N closes a free finger at 5 cm/s.
_FINGER_MASS, _ROTOR, _DAMPING = 0.06, 0.05, 20.0
_PALM_MASS = 0.7
#: Fingertips align themselves with the object. Each rotates about two axes through its pad's middle against a spring,
#: by 2 degrees under 0.1 N at the pad's edge.
_TIP_JOINT = {
    "type": "hinge",
    "range": "-0.15 0.15",
    "limited": "true",
    "stiffness": "0.02",
    "damping": "0.0008",
    "armature": "5e-06",
}
#: The drive's force follows its command with this time constant [s].
_DRIVE_TIME = "0.005"
#: Largest opening force of the drive [N].
_OPENING = 10.0


def _add_fingers(root: ET.Element, palm: ET.Element, pads: FingertipPads) -> None:
    for name, side in zip(GRIPPER_PADS, (-1.0, 1.0), strict=True):
        palm.append(_finger(name, side, pads.pad))
    contact = ET.SubElement(root, "contact")
    for left in ("left_finger", "left_tip"):
        for right in ("right_finger", "right_tip"):
            ET.SubElement(contact, "exclude", body1=left, body2=right)
    _add_drive(root)
    sensors = ET.SubElement(root, "sensor")
    for name in GRIPPER_PADS:
        sensors.append(pad_sensor(name, pads))
    ET.SubElement(sensors, "tendonpos", name="opening", tendon="opening")
    ET.SubElement(sensors, "tendonvel", name="opening_rate", tendon="opening")


#: Actuator `grip`: closing force of each finger [N], from -10 (opens) to 40. Sensors `left` and `right`: readings of
#: the pads. Sensors `opening` [m] and `opening_rate` [m/s]: distance of the pads minus `CLOSED_GAP`, and its rate.
GRIPPER = HandModel(
    name="gripper",
    reach=_REACH,
    module="experiments/hands/gripper.py",
    palm={"type": "box", "size": "0.06 0.03 0.03", "pos": "0 0 -0.03", "mass": numbers((_PALM_MASS,))},
    add_fingers=_add_fingers,
)


def _add_drive(root: ET.Element) -> None:
    """One motor that drives both fingers at equal distances from the middle."""
    coupling = ET.SubElement(root, "equality")
    ET.SubElement(
        coupling,
        "joint",
        name="coupling",
        joint1="left_finger",
        joint2="right_finger",
        polycoef="0 1 0 0 0",
        solref="0.005 1",
        solimp="0.98 0.99 0.001 0.5 2",
    )
    grip = ET.SubElement(ET.SubElement(root, "tendon"), "fixed", name="opening")
    for name in GRIPPER_PADS:
        ET.SubElement(grip, "joint", joint=f"{name}_finger", coef="1")
    ET.SubElement(
        ET.SubElement(root, "actuator"),
        "general",
        name="grip",
        tendon="opening",
        gear="-1",
        dyntype="filterexact",
        dynprm=_DRIVE_TIME,
        ctrlrange=numbers((-_OPENING, GRIP_LIMIT)),
        forcerange=numbers((-_OPENING, GRIP_LIMIT)),
    )


def _finger(name: str, side: float, pad: Pad) -> ET.Element:
    """The left (-1) or right (+1) finger.

    The origin of its frame is the middle of its pad's surface. A pad with hollows is set back by the height of its
    highest point, so that the closed gripper has the same gap.
    """
    back = side * rise(pad)
    body = ET.Element("body", name=f"{name}_finger", pos=numbers((side * CLOSED_GAP / 2, 0.0, -_REACH)), gravcomp="1")
    ET.SubElement(
        body,
        "joint",
        name=f"{name}_finger",
        type="slide",
        axis=numbers((side, 0.0, 0.0)),
        range=numbers((0.0, STROKE / 2)),
        damping=numbers((_DAMPING,)),
        armature=numbers((_ROTOR,)),
    )
    tip = ET.SubElement(body, "body", name=f"{name}_tip", gravcomp="1")
    for axis, direction in (("turn", "0 0 1"), ("nod", "0 1 0")):
        ET.SubElement(tip, "joint", _TIP_JOINT, name=f"{name}_{axis}", axis=direction)
    add_pad(tip, name, pad, (back, 0.0, 0.0), -side)
    # The finger's bar is behind the pad, so that objects touch nothing but the pad.
    low, high = -pad.size[1] / 2, _REACH - 0.06
    ET.SubElement(
        body,
        "geom",
        name=f"{name}_bar",
        type="box",
        size=numbers((0.004, pad.size[0] / 2, (high - low) / 2)),
        pos=numbers((back + side * (pad.thickness + 0.004), 0.0, (high + low) / 2)),
        mass=numbers((_FINGER_MASS,)),
        rgba=GREY,
    )
    return body
