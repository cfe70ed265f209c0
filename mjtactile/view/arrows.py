"""Wrenches as arrows in the pad frame: the force at its centre of pressure, and the torsional moment there."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.pad import Pad
from mjtactile.sim.wrench import centre_of_pressure

#: Shorter arrows are not drawn [m].
LEAST_LENGTH = 1e-4


def force_arrow(wrench: Array, length: float, pad: Pad) -> Array | None:
    """The force on the pad as an arrow from the centre of pressure; a pressing force points into the pad.

    Tail and head in the pad frame [m], (2, 3); None for a force too small to be drawn.

    Args:
        wrench: force [N] and moment about the pad's origin [N m], pad frame, (6,).
        length: length of the arrow per force [m/N].
        pad: gives the surface.
    """
    arrow = wrench[:3] * length
    tail = centre_of_pressure(wrench, pad)
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None


def torsion_arrow(wrench: Array, length: float, pad: Pad) -> Array | None:
    """The moment about the surface's normal at the centre of pressure, as an arrow along the normal.

    Tail and head in the pad frame [m], (2, 3); None for a moment too small to be drawn.

    Args:
        wrench: force [N] and moment about the pad's origin [N m], pad frame, (6,).
        length: length of the arrow per moment [m/(N m)].
        pad: gives the surface.
    """
    tail = centre_of_pressure(wrench, pad)
    normal = pad.surface.normals(tail[0], tail[1])
    arrow = (wrench[3:] - np.cross(tail, wrench[:3])) @ normal * length * normal
    return np.stack([tail, tail + arrow]) if np.linalg.norm(arrow) >= LEAST_LENGTH else None
