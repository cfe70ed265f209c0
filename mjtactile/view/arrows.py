"""Wrenches as arrows in the pad frame: the force on the pad through its centre of pressure, and the twist there."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.pad import Pad

#: Shorter arrows are not drawn [m].
LEAST_LENGTH = 1e-4
#: Smaller pressing forces say nothing of where [N].
_LEAST_FORCE = 1e-6
#: Steps towards where the force passes through a curved surface; each brings it nearer by the slope times the force's
#: own.
_STEPS = 20


def centre_of_pressure(wrench: Array, pad: Pad | None = None) -> Array:
    """Where the force passes through the sensing surface [m], (3,); the pad's origin where nothing presses.

    Args:
        wrench: force [N] and moment about the origin [N m], pad frame, (6,).
        pad: whose surface that is; the plane z = 0 if None.
    """
    fx, fy, fz, mx, my, _ = wrench
    if not fz < -_LEAST_FORCE:
        return np.zeros(3)
    found = np.array([-my / fz, mx / fz, 0.0])
    if pad is None or pad.surface.is_flat:
        return found
    half = np.array(pad.size) / 2
    for _ in range(_STEPS):
        found[:2] = np.clip([(found[2] * fx - my) / fz, (found[2] * fy + mx) / fz], -half, half)
        found[2] = pad.surface.height(*found[:2])
    return found


def force_arrow(wrench: Array, length: float, pad: Pad | None = None) -> Array | None:
    """Tail, where the force acts, and head (2, 3) [m]: what presses points through the pad and out of its back.

    Args:
        wrench: force [N] and moment about the origin [N m], pad frame, (6,).
        length: of the arrow per force [m/N].
        pad: on whose surface it acts; a flat one if None.

    Returns:
        None for a force too small to be seen.
    """
    arrow = wrench[:3] * length
    tail = centre_of_pressure(wrench, pad)
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None


def twist_arrow(wrench: Array, length: float, pad: Pad | None = None) -> Array | None:
    """The moment about the pad's normal through the centre of pressure, as an arrow along it, (2, 3) [m].

    Args:
        wrench: force [N] and moment about the origin [N m], pad frame, (6,).
        length: of the arrow per moment [m/(N m)].
        pad: on whose surface it acts; a flat one if None.

    Returns:
        None for a moment too small to be seen.
    """
    tail = centre_of_pressure(wrench, pad)
    twist = wrench[5] - (tail[0] * wrench[1] - tail[1] * wrench[0])
    arrow = np.array([0.0, 0.0, twist * length])
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None
