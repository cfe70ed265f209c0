"""Contact with a bed of independent springs (Winkler; Johnson, Contact Mechanics, 1985, section 4.3)."""

from __future__ import annotations

import numpy as np

from mjtactile.errors import ContactError
from mjtactile.pad import Array
from mjtactile.rigid import RESULTANTS, RigidContact, flexibility

_ITERATIONS = 200
#: Resultants fit to this fraction of the normal force; on the cells found, they are then made exact.
_TOLERANCE = 1e-12
_SUFFICIENT_DECREASE = 1e-4
_DAMPING = 1e-12


def winkler_contact(stiffness: Array, modes: Array, gaps: Array, resultants: Array) -> RigidContact:
    """Press a rigid body into a bed of springs that do not pull.

    The motion d minimises the convex energy  1/2 sum k (B d - g)_+^2 - q.d;  Newton's method with a line search finds
    the springs under pressure, on which the problem is linear.

    Args:
        stiffness: of each cell's spring, (cells,) [N/m].
        modes: downward displacement of each cell per unit of each rigid motion, (cells, motions).
        gaps: of the body above the surface before it moves, (cells,) [m].
        resultants: sum of the forces times each mode, (motions,); the first is the normal force [N], positive.

    Raises:
        ContactError: when no contact carries the resultants.
    """
    scale, lowest = resultants[0] / stiffness.sum(), gaps.min()
    # Heights are counted from the lowest: they can be huge beside the approach.
    weights, gaps, wanted = stiffness / stiffness.sum(), (gaps - lowest) / scale, resultants / resultants[0]
    motion = np.zeros(modes.shape[1])
    motion[0] = 1.0 + gaps.max()

    def energy_of(trial: Array) -> float:
        overlap = np.maximum(modes @ trial - gaps, 0.0)
        return float(0.5 * weights @ overlap**2 - wanted @ trial)

    energy = energy_of(motion)
    for _ in range(_ITERATIONS):
        pressed = modes @ motion > gaps
        gradient = modes[pressed].T @ (weights[pressed] * (modes[pressed] @ motion - gaps[pressed])) - wanted
        if np.abs(gradient).max() <= _TOLERANCE:
            break
        curvature = modes[pressed].T @ (weights[pressed, None] * modes[pressed])
        # Where the springs under pressure leave a tilt open, damping sends the body far along it, to the next springs.
        step = -np.linalg.solve(curvature + _DAMPING * (np.trace(curvature) + 1.0) * np.eye(len(wanted)), gradient)
        length = 1.0
        while energy_of(motion + length * step) > energy + _SUFFICIENT_DECREASE * length * float(gradient @ step):
            length /= 2
            if length < 1e-12:
                break
        motion = motion + length * step
        energy = energy_of(motion)
    contact = _on(modes @ motion > gaps, weights, modes, gaps, wanted)
    if np.abs(modes.T @ contact.forces - wanted).max() > RESULTANTS:
        raise ContactError(
            "no contact carries this wrench: the force passes too near the edge of what the body covers."
        )
    return contact.scaled(float(resultants[0]), scale / float(resultants[0]), lowest)


def _on(pressed: np.ndarray, weights: Array, modes: Array, gaps: Array, wanted: Array) -> RigidContact:
    """The exact solution on the cells under pressure."""
    own = modes[pressed]
    curvature = own.T @ (weights[pressed, None] * own)
    to_motion = flexibility(curvature, wanted + own.T @ (weights[pressed] * gaps[pressed]))
    map_motion = np.column_stack([to_motion, to_motion @ (own.T @ (weights[pressed] * gaps[pressed]))])
    map_separation = -modes @ map_motion
    map_separation[:, -1] += gaps
    map_forces = np.zeros_like(map_separation)
    map_forces[pressed] = -weights[pressed, None] * map_separation[pressed]
    map_separation[pressed] = 0.0
    return RigidContact(wanted, pressed, map_forces, map_motion, map_separation)
