"""Wrenches as arrows in the pad frame: the force on the pad through its centre of pressure, and the twist there."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array

#: Shorter arrows are not drawn [m].
LEAST_LENGTH = 1e-4
#: Smaller pressing forces say nothing of where [N].
_LEAST_FORCE = 1e-6


def centre_of_pressure(wrench: Array) -> Array:
    """Where the force passes through the sensing surface [m], (3,); the pad's origin where nothing presses."""
    _, _, fz, mx, my, _ = wrench
    return np.array([-my / fz, mx / fz, 0.0]) if fz < -_LEAST_FORCE else np.zeros(3)


def force_arrow(wrench: Array, length: float) -> Array | None:
    """Tail, where the force acts, and head (2, 3) [m]: what presses points through the pad and out of its back.

    Args:
        wrench: force [N] and moment about the origin [N m], pad frame, (6,).
        length: of the arrow per force [m/N].

    Returns:
        None for a force too small to be seen.
    """
    arrow = wrench[:3] * length
    tail = centre_of_pressure(wrench)
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None


def twist_arrow(wrench: Array, length: float) -> Array | None:
    """The moment about the pad's normal through the centre of pressure, as an arrow along it, (2, 3) [m].

    Args:
        wrench: force [N] and moment about the origin [N m], pad frame, (6,).
        length: of the arrow per moment [m/(N m)].

    Returns:
        None for a moment too small to be seen.
    """
    tail = centre_of_pressure(wrench)
    twist = wrench[5] - (tail[0] * wrench[1] - tail[1] * wrench[0])
    arrow = np.array([0.0, 0.0, twist * length])
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None
