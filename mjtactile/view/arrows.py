"""Wrenches as arrows in the pad frame: the force on the pad through its centre of pressure, and the twist there."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.pad import Pad
from mjtactile.sim.wrench import centre_of_pressure

#: Shorter arrows are not drawn [m].
LEAST_LENGTH = 1e-4


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
    """The moment about the surface's normal at the centre of pressure, as an arrow along it, (2, 3) [m].

    Args:
        wrench: force [N] and moment about the origin [N m], pad frame, (6,).
        length: of the arrow per moment [m/(N m)].
        pad: on whose surface it acts; a flat one if None.

    Returns:
        None for a moment too small to be seen.
    """
    tail = centre_of_pressure(wrench, pad)
    normal = np.array([0.0, 0.0, 1.0]) if pad is None else pad.surface.normals(tail[0], tail[1])
    arrow = (wrench[3:] - np.cross(tail, wrench[:3])) @ normal * length * normal
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None
