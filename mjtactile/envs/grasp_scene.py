"""The gripper over an object with a handle that is smaller than the pads, so that slip is visible in the readings."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.attach import pad_table
from mjtactile.envs.options import TouchOptions
from mjtactile.envs.touch import feel_force, observe_pad
from mjtactile.experiments.grasp.scene import GraspObject, grasp_spec
from mjtactile.experiments.hands.fingertip import FingertipPads
from mjtactile.experiments.hands.gripper import GRIPPER_PADS
from mjtactile.sim.pad_geom import contact_constants, pad_geoms

#: Names of the sensors of the total contact force on each pad, world frame, for rewards only.
PAD_FORCES = tuple(f"{name}_force" for name in GRIPPER_PADS)
#: Top speed of the wrist's drives [m/s], their stiffness [N/m] and damping [N s/m], critical for 1 kg; half a kilogram
#: deflects them by 12 micrometres.
_TOP_SPEED, _STIFFNESS, _DAMPING = 0.5, 4e5, 1.3e3
#: Extent of the handle [m]; it is gripped along x, on faces of y times z.
HANDLE = (0.012, 0.009, 0.008)


def gripper_spec(
    options: TouchOptions, *, wrist: str, grasp_height: float, timestep: float, friction: float
) -> mujoco.MjSpec:
    """Model specification with the gripper on its wrist, a camera `task`, and a body `object` with a handle.

    Args:
        options: observation of the pads.
        wrist: driven axes of the wrist, such as "z" or "xyz".
        grasp_height: height of the pads' centres over the table [m].
        timestep: time step of MuJoCo [s].
        friction: sliding friction of the object [-].
    """
    table, pad = pad_table(options.pad)
    grasped = GraspObject(size=HANDLE, mass=0.02, friction=friction)
    pads = FingertipPads(pad=pad, name=table, fidelity=options.fidelity)
    spec = grasp_spec(grasped, wrist=wrist, grasp_height=grasp_height, pads=pads)
    spec.option.timestep = timestep
    spec.option.impratio = 10.0
    spec.body("object").pos = [0.0, 0.0, grasp_height]
    # In sliding contacts, bodies separate by friction times speed times the contact's time constant. With softer
    # contacts, this would show in the gripper's encoders, unlike in real ones.
    stiff = contact_constants("stiff")
    for geom in (spec.geom("object"), *(geom for name in GRIPPER_PADS for geom in pad_geoms(spec, name))):
        geom.solref, geom.solimp = stiff["solref"], stiff["solimp"]
    for name, force in zip(GRIPPER_PADS, PAD_FORCES, strict=True):
        observe_pad(spec, name, options)
        feel_force(spec, force, f"{name}_tip")
    for axis in wrist:
        _drive_by_speed(spec.actuator(f"wrist_{axis}"), spec.joint(f"wrist_{axis}").range)
    camera = spec.camera("front")
    camera.name, camera.pos, camera.fovy = "task", [0.0, -0.35, 0.12], 38.0
    camera.quat = _looking(np.array([0.0, 0.0, 0.06]) - camera.pos)
    return spec


def _drive_by_speed(actuator: Any, reach: Array) -> None:
    """Make a position servo integrate a commanded speed [m/s], since jumps of its target would cause jerks."""
    actuator.gainprm[0], actuator.biasprm[1:3] = _STIFFNESS, [-_STIFFNESS, -_DAMPING]
    actuator.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    actuator.actlimited, actuator.actrange = True, reach
    actuator.ctrlrange = [-_TOP_SPEED, _TOP_SPEED]


def _looking(along: Array) -> Array:
    """Orientation (w, x, y, z) of a camera that looks along a direction, with the world's z up in the image."""
    back = -along / np.linalg.norm(along)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.column_stack([right, np.cross(back, right), back]).ravel())
    return quat
