"""What tests of pads on bodies share: where a pad's surface is, and a ball on a slide that presses on it."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjtactile.hands import HandPad


def surface_in_body(one: HandPad, lines: int = 21) -> tuple[np.ndarray, np.ndarray]:
    """Points of a pad's surface over a grid of so many lines, in its body's frame [m], and the normals there."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.array(one.quat))
    turn = turn.reshape(3, 3)
    x, y = (line.ravel() for line in np.meshgrid(*(np.linspace(-side / 2, side / 2, lines) for side in one.pad.size)))
    return np.array(one.pos) + one.pad.surface.positions(x, y) @ turn.T, one.pad.surface.normals(x, y) @ turn.T


def add_ball(spec: Any, at: np.ndarray, normal: np.ndarray, radius: float, gap: float) -> None:
    """A ball above a point of a surface, on a slide against the normal there; all lengths in m."""
    ball = spec.worldbody.add_body(name="ball", pos=at + (radius + gap) * normal)
    ball.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=-normal, damping=1.0)
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], mass=0.05)


def hold_all_but_the_ball(model: Any) -> None:
    """Make every other joint hard to move."""
    held = np.arange(model.nv) != model.joint("slide").dofadr[0]
    model.dof_armature[held], model.dof_damping[held] = 1e3, 1e5
