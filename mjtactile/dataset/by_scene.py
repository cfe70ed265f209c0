"""Presses simulated by MuJoCo: a press scene is settled for every force and read by a TactileSensor."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.dataset.sampling import OutlinePresses, PosePresses
from mjtactile.dataset.shapes import shape_indenter
from mjtactile.errors import SceneError, quiet_contacts
from mjtactile.geometry.indenter import Indenter
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad
from mjtactile.sensor import TactileSensor
from mjtactile.sim.press_scene import press, press_spec
from mjtactile.sim.wrench import centre_of_pressure


def mujoco_readings(influence: InfluenceMatrices, presses: OutlinePresses) -> tuple[Array, Array, Array]:
    """Readings of all presses that share an outline, from influence matrices at their fidelity.

    On a curved pad, bodies are upright and approach along z.

    Returns:
        Readings [Pa], (presses, *reading_shape); forces of MuJoCo's contacts on the pad [N], (presses, 3), which may
        differ from the commanded ones; and centres of pressure (x, y) [m], (presses, 2); in the pad frame. They are NaN
        for a press that does not settle; callers drop it.
    """
    indenter = shape_indenter(presses.shape, presses.size)
    readings, forces, points = [], [], []
    for pose in presses.poses:
        model = pose_scene(indenter, influence.pad, presses, pose).compile()
        sensor = TactileSensor(model, influence=influence, law=presses.law, tangential=presses.tangential)
        for direction, magnitude in zip(pose.directions, pose.magnitudes, strict=True):
            data = mujoco.MjData(model)
            with quiet_contacts():
                reading, wrench = _settled(model, data, sensor, direction * magnitude)
            readings.append(reading)
            forces.append(wrench[:3])
            points.append(centre_of_pressure(wrench, influence.pad)[:2])
    return np.array(readings), np.array(forces), np.array(points)


def pose_scene(indenter: Indenter, pad: Pad, presses: OutlinePresses, pose: PosePresses) -> mujoco.MjSpec:
    """Press scene of a body, `shape_indenter` of the presses' shape and size, at a pose.

    Raises:
        SceneError: the body misses the pad, or all but a sliver of it does.
    """
    rotate_deg = math.degrees(pose.rotation)
    return press_spec(indenter, shift=pose.shift, rotate_deg=rotate_deg, pad=pad, tilt_free=presses.free)


def _settled(model: mujoco.MjModel, data: mujoco.MjData, sensor: TactileSensor, force: Array) -> tuple[Array, Array]:
    """Readings and wrench of one press; NaN if it does not settle. A press that is refused at once is an error."""
    try:
        press(model, data, force)
    except SceneError:
        if data.time == 0.0:
            raise
        return np.full(sensor.pad.reading_shape, math.nan), np.full(6, math.nan)
    return sensor.read(data), sensor.wrench(data)
