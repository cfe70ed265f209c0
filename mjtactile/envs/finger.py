"""A finger with one pad facing down, on slides and a hinge: position control sideways, force control downwards.

The finger's origin is the middle of the pad's surface; for a pad with hollows, it is at the height of the pad's highest
point. At rest, a weak spring holds the finger above the ground.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.envs.options import TouchOptions
from mjtactile.envs.simulation import Rows
from mjtactile.envs.task import Channel, Task
from mjtactile.envs.touch import feel_force, observe_pad
from mjtactile.sim.pad_geom import add_pad_geom, pad_geoms
from mjtactile.sim.pad_solid import rise

#: Height of the finger at rest [m], and the stiffness of its spring [N/m].
HOVER, LIFT = 2e-3, 20.0
#: Name of the finger's pad, and of the sensor of the total force on it (world frame, for rewards only).
PAD, PAD_FORCE = "finger", "finger_force"

#: The servos of x and y (2000 N/m) and of the rotation (0.5 N m/rad) are critically damped for 50 g and 5e-5 kg m^2.
#: With the vertical damping, the finger moves up or down in a tenth of a second. The pressing force rises in 10 ms.
_WORLD = """
<mujoco model="finger">
  <option timestep="{timestep}" integrator="implicitfast" cone="elliptic" impratio="10" jacobian="dense"/>
  <statistic center="0 0 0" extent="0.1"/>
  <visual><headlight ambient="0.35 0.35 0.35" diffuse="0.55 0.55 0.55"/></visual>
  <worldbody>
    <light pos="0 -0.1 0.3" dir="0 0.3 -1" diffuse="0.4 0.4 0.4"/>
    <body name="finger" gravcomp="1">
      <inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/>
      <joint name="finger_x" type="slide" axis="1 0 0"/>
      <joint name="finger_y" type="slide" axis="0 1 0"/>
      <joint name="finger_turn" type="hinge" axis="0 0 1" armature="4e-5"/>
      <joint name="finger_z" type="slide" axis="0 0 1" stiffness="{lift}" springref="{hover}" damping="4"/>
      <geom name="finger_rod" type="cylinder" size="0.003 0.015" pos="0 0 0.02" contype="0" conaffinity="0" mass="0"
        rgba="0.5 0.5 0.55 1"/>
      <camera name="task" pos="0.03 -0.08 0.05" xyaxes="0.94 0.34 0 -0.17 0.48 0.86" fovy="45"/>
    </body>
  </worldbody>
  <actuator>
    <position joint="finger_x" kp="2000" kv="20"/>
    <position joint="finger_y" kp="2000" kv="20"/>
    <position joint="finger_turn" kp="0.5" kv="0.01"/>
    <general joint="finger_z" gainprm="-1" dyntype="filterexact" dynprm="0.01"/>
  </actuator>
</mujoco>
"""


def press_control(force: Array) -> Array:
    """Controls [N] with which fingers press on a plane at height 0 with given forces [N], against their springs."""
    return np.where(force > 0.0, force + LIFT * HOVER, 0.0)


def turn_and_press(speed: float, force: float) -> tuple[Channel, Channel]:
    """The last two of a finger's actions: turn about the vertical [rad/s] and press [N], with their largest values."""
    told = f"pressing force: {force:g} N at 1, proportionally less below; the finger lifts at 0 and below"
    return (
        Channel("turn", "-", -1, 1, f"rotation speed about the vertical, up to {speed:g} rad/s"),
        Channel("press", "-", -1, 1, told),
    )


def finger_spec(options: TouchOptions, *, timestep: float, friction: float) -> mujoco.MjSpec:
    """Model specification with the finger at the world's origin and a camera `task` that follows it.

    Joints and controls in this order: x, y [m] and rotation about the vertical [rad], with their targets as controls,
    and z, whose control is the downward force [N], see `press_control`.

    Args:
        options: observation of the pad.
        timestep: time step of MuJoCo [s].
        friction: sliding friction of the pad [-].
    """
    spec = mujoco.MjSpec.from_string(_WORLD.format(timestep=timestep, hover=HOVER, lift=LIFT))
    pad = options.finger_pad
    down = np.array([0.0, 0.0, rise(pad)]), np.array([0.0, 1.0, 0.0, 0.0])
    add_pad_geom(spec, spec.body("finger"), PAD, pad, down, "stiff")
    for geom in pad_geoms(spec, PAD):
        geom.friction[0] = friction
    observe_pad(spec, PAD, options)
    feel_force(spec, PAD_FORCE, "finger")
    return spec


class FingerTask(Task):
    """A task of a finger that starts above what it presses on."""

    PADS = (PAD,)
    TIMESTEP, SUBSTEPS = 2e-3, 20

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        count = self.simulation.count
        # Start of the finger, and its target: x, y [m], rotation [rad]; commanded force [N].
        self._start, self._target, self._force = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)

    def _place(self, rows: Rows) -> None:
        self.simulation.qpos[rows] = np.column_stack([self._start[rows], np.full(len(rows), HOVER)])
        self.simulation.ctrl[rows] = np.column_stack([self._start[rows], np.zeros(len(rows))])
