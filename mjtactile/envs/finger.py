"""A finger with one pad facing down, on slides and a hinge: driven sideways by position, pressed down by force.

The pad's middle hangs at the finger's origin; at rest it hovers, held up by a weak spring.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjtactile.envs.options import TouchOptions
from mjtactile.envs.touch import add_pad

#: Mass of the finger [kg].
MASS = 0.05
#: Position servos of x and y [N/m, N s/m], and of the turn [N m/rad, N m s/rad]: critically damped.
STIFFNESS, DAMPING = 2000.0, 2.0 * np.sqrt(2000.0 * MASS)
TURN_STIFFNESS, TURN_DAMPING = 0.5, 0.01
#: Inertia about the vertical [kg m^2], drive included.
TURN_INERTIA = 5e-5
#: The spring that lifts the finger [N/m], the damping of its way up and down [N s/m], and how high it hovers [m].
LIFT, LIFT_DAMPING, HOVER = 20.0, 4.0, 2e-3
#: Time constant of the pressing force [s].
FORCE_RISE = 0.01
#: Quaternion that turns a pad's face down.
DOWN = (0.0, 1.0, 0.0, 0.0)
#: Joints, in the order of qpos, and actuators, in that of ctrl: targets [m, m, rad] and the pressing force [N].
JOINTS = ("finger_x", "finger_y", "finger_turn", "finger_z")
#: Names of the finger's pad, and of the sensor of all forces on it (world frame).
PAD, PAD_FORCE = "finger", "finger_force"


def world(timestep: float) -> mujoco.MjSpec:
    """An empty world with light, and the settings that pads want."""
    spec = mujoco.MjSpec()
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.55, 0.55, 0.55]
    spec.worldbody.add_light(pos=[0.0, -0.1, 0.3], dir=[0.0, 0.3, -1.0], diffuse=[0.4, 0.4, 0.4])
    return spec


def add_finger(spec: mujoco.MjSpec, options: TouchOptions) -> mujoco.MjsBody:
    """The finger, at the world's origin, with its actuators, its pad and a camera `task` that follows it."""
    finger = spec.worldbody.add_body(name="finger", gravcomp=1.0)
    finger.mass, finger.inertia, finger.explicitinertial = MASS, [1e-5] * 3, True
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for name, kind, axis in zip(JOINTS[:3], (slide, slide, hinge), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True):
        finger.add_joint(name=name, type=kind, axis=axis)
    finger.joints[2].armature = TURN_INERTIA
    finger.add_joint(
        name=JOINTS[3],
        type=slide,
        axis=(0, 0, 1),
        stiffness=[LIFT, 0.0, 0.0] if _polynomial(finger) else LIFT,
        springref=HOVER,
        damping=[LIFT_DAMPING, 0.0, 0.0] if _polynomial(finger) else LIFT_DAMPING,
    )
    for name, gain, damping in (
        (JOINTS[0], STIFFNESS, DAMPING),
        (JOINTS[1], STIFFNESS, DAMPING),
        (JOINTS[2], TURN_STIFFNESS, TURN_DAMPING),
    ):
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=gain, kv=damping)
    press = spec.add_actuator(name=JOINTS[3], target=JOINTS[3], trntype=mujoco.mjtTrn.mjTRN_JOINT)
    press.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
    press.dynprm[0] = FORCE_RISE
    press.gainprm[0] = -1.0
    add_pad(spec, options, body="finger", name=PAD, quat=DOWN)
    finger.add_geom(
        name="finger_rod",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[3e-3, 15e-3, 0.0],
        pos=[0.0, 0.0, 20e-3],
        contype=0,
        conaffinity=0,
        rgba=[0.5, 0.5, 0.55, 1.0],
    )
    finger.add_camera(name="task", pos=[0.03, -0.08, 0.05], xyaxes=[0.94, 0.34, 0, -0.17, 0.48, 0.86], fovy=45.0)
    return finger
