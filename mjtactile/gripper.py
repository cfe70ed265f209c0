"""A parallel gripper of our own: two coupled fingers on slides, a pad on each fingertip, one force-controlled drive.

Lengths are metres, forces newtons. The gripper's body `gripper` has its origin at the mounting flange, z up, and holds
its fingers downwards; site `grasp` stands between the pads. Pad frames: z towards the other finger, y up, so that the
weight of what is held pulls along -y of both pads.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from mjtactile.mjcf import document, numbers, text_of
from mjtactile.pad import Pad
from mjtactile.plugin import PLUGIN

#: Sensors of the gripper; geoms are `<name>_pad`, pad frames are sites `<name>_surface`.
GRIPPER_PADS = ("left", "right")
#: Distance of the fingers, and of the pads where they are closed [m]: pads of an empty gripper never touch.
STROKE, CLOSED_GAP = 80e-3, 0.5e-3
#: Force with which each finger may press [N].
GRIP_LIMIT = 40.0
#: From the flange to the middle of the pads [m].
REACH = 0.12
#: Contact of pads: settles 10 to 200 gf within 0.1 %, 20 N within 1 % (docs/plugin.md). `friction` counts only against
#: objects of lower priority; those of the grasp experiments bring their own.
PAD_CONTACT = {
    "condim": "4",
    "friction": "1 0.0005 0.0001",
    "solref": "0.005 1",
    "solimp": "0.98 0.99 0.001 0.5 2",
    "priority": "10",
}
_PAD_DENSITY = "965"  # PDMS [kg/m^3]
_GREY, _DARK = "0.55 0.57 0.6 1", "0.25 0.26 0.28 1"
#: A finger with its carriage, as in commercial grippers of that stroke [kg]; what the drive's rotor adds behind its
#: gears [kg]; damping of gears and guides [N s/m]: 1 N closes a free finger at 5 cm/s.
_FINGER_MASS, _ROTOR, _DAMPING = 0.06, 0.1, 20.0
_PALM_MASS = 0.7
#: The drive's force follows its command with this time constant [s].
_DRIVE_TIME = "0.005"
#: Of the drive that opens [N].
_OPENING = 10.0


def gripper_mjcf(pad: Pad | None = None, *, pad_name: str = "default", fidelity: str = "fast") -> str:
    """The gripper alone, for `MjSpec.attach` and `<attach>`; arguments as in `gripper_document`."""
    return text_of(gripper_document("gripper", pad, pad_name=pad_name, fidelity=fidelity))


def gripper_document(
    model: str, pad: Pad | None = None, *, pad_name: str = "default", fidelity: str = "fast"
) -> ET.Element:
    """A model that holds the gripper, to be written or built upon.

    Actuator `grip`: force with which each finger closes [N], -10 (opens) to 40. Sensors `left` and `right`: readings of
    the pads. Sensors `opening` [m] and `opening_rate` [m/s]: distance of the pads less `CLOSED_GAP`.

    Args:
        model: its name.
        pad: its size and thickness are used; the default pad if None.
        pad_name: by which the plugin knows that pad, see `register_pad`.
        fidelity: preset of the readings by name.
    """
    pad = pad or Pad()
    root = document(model, module="gripper.py")
    ET.SubElement(ET.SubElement(root, "extension"), "plugin", plugin=PLUGIN)
    palm = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name="gripper", gravcomp="1")
    ET.SubElement(
        palm,
        "geom",
        name="palm",
        type="box",
        size="0.06 0.03 0.03",
        pos="0 0 -0.03",
        mass=numbers((_PALM_MASS,)),
        rgba=_DARK,
    )
    ET.SubElement(palm, "site", name="grasp", pos=numbers((0.0, 0.0, -REACH)), size="0.001", group="4")
    for name, side in zip(GRIPPER_PADS, (-1.0, 1.0), strict=True):
        palm.append(_finger(name, side, pad))
    contact = ET.SubElement(root, "contact")
    ET.SubElement(contact, "exclude", body1="left_finger", body2="right_finger")
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
    sensors = ET.SubElement(root, "sensor")
    for name in GRIPPER_PADS:
        sensors.append(pad_sensor(name, pad_name, fidelity))
    ET.SubElement(sensors, "tendonpos", name="opening", tendon="opening")
    ET.SubElement(sensors, "tendonvel", name="opening_rate", tendon="opening")
    return root


def pad_sensor(name: str, pad_name: str, fidelity: str) -> ET.Element:
    """A sensor of the plugin on geom `<name>_pad`."""
    sensor = ET.Element("plugin", name=name, plugin=PLUGIN, objtype="geom", objname=f"{name}_pad")
    for key, value in (("pad", pad_name), ("fidelity", fidelity), ("output", "von_mises")):
        ET.SubElement(sensor, "config", key=key, value=value)
    return sensor


def add_pad(body: ET.Element, name: str, pad: Pad, surface: tuple[float, float, float], rotation: np.ndarray) -> None:
    """A pad's geom and the site of its frame.

    Args:
        body: it is added to.
        name: of the sensor.
        pad: its size and thickness.
        surface: where the middle of its sensing surface stands in the body's frame [m].
        rotation: of the pad frame there, (3, 3), axes as columns.
    """
    axes = numbers(rotation[:, :2].T.ravel())
    centre = np.array(surface) - rotation[:, 2] * pad.thickness / 2
    ET.SubElement(
        body,
        "geom",
        PAD_CONTACT,
        name=f"{name}_pad",
        type="box",
        size=numbers((pad.size[0] / 2, pad.size[1] / 2, pad.thickness / 2)),
        pos=numbers(centre),
        xyaxes=axes,
        density=_PAD_DENSITY,
        rgba="0.75 0.8 0.85 1",
    )
    ET.SubElement(body, "site", name=f"{name}_surface", pos=numbers(surface), xyaxes=axes, size="0.0002", group="4")


def _finger(name: str, side: float, pad: Pad) -> ET.Element:
    """A finger on the left (-1) or on the right (+1); its frame's origin is the middle of its pad's surface."""
    body = ET.Element("body", name=f"{name}_finger", pos=numbers((side * CLOSED_GAP / 2, 0.0, -REACH)), gravcomp="1")
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
    inward = np.array([-side, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    rotation = np.column_stack([np.cross(up, inward), up, inward])
    add_pad(body, name, pad, (0.0, 0.0, 0.0), rotation)
    # The finger's own bar stands behind the pad: what the pad does not touch, nothing touches.
    low, high = -pad.size[1] / 2, REACH - 0.06
    ET.SubElement(
        body,
        "geom",
        name=f"{name}_bar",
        type="box",
        size=numbers((0.004, pad.size[0] / 2, (high - low) / 2)),
        pos=numbers((side * (pad.thickness + 0.004), 0.0, (high + low) / 2)),
        mass=numbers((_FINGER_MASS,)),
        rgba=_GREY,
    )
    return body
