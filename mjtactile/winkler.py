"""Contact with a bed of independent springs (Winkler; Johnson, Contact Mechanics, 1985, section 4.3)."""

from __future__ import annotations

import numpy as np

from mjtactile.errors import ContactError
from mjtactile.interior import interior_point, resting_cells
from mjtactile.pad import Array
from mjtactile.rigid import HIGH, ON_THE_VERGE, RESULTANTS, Mask, Motions, RigidContact, flexibility

_ITERATIONS = 200
#: Resultants fit to this fraction of the normal force; on the cells found, they are then made exact.
_TOLERANCE = 1e-12
_SUFFICIENT_DECREASE = 1e-4
_DAMPING = 1e-12
_EXCHANGES = 30


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
    force, lowest = float(resultants[0]), gaps.min()
    # Heights are counted from the lowest: they can be huge beside the approach.
    scale, weights = force / stiffness.sum(), stiffness / stiffness.sum()
    heights, motions = (gaps - lowest) / scale, Motions.of(modes)
    wanted = motions.to_mixed @ (resultants / force)
    contact = _on(
        springs_under_pressure(weights, motions.modes, heights, wanted), weights, motions.modes, heights, wanted
    )
    if not _solves(contact, motions.modes):
        everywhere = np.ones(len(gaps), dtype=bool)
        forces, multipliers = interior_point(1.0 / weights, heights, motions.modes, wanted, everywhere)
        contact = _on(forces * len(gaps) > multipliers, weights, motions.modes, heights, wanted)
    if not _solves(contact, motions.modes) and heights.max() > HIGH:
        contact = _on(resting_cells(heights, motions.modes, wanted), weights, motions.modes, heights, wanted)
        for _ in range(_EXCHANGES):
            violated = contact.violation > ON_THE_VERGE
            if not violated.any():
                break
            contact = _on(contact.pressed ^ violated, weights, motions.modes, heights, wanted)
        contact = contact.balanced(motions.modes)
    if not _solves(contact, motions.modes):
        raise ContactError(
            "no contact carries this wrench: the force passes too near the edge of what the body covers."
        )
    return motions.unmixed(contact, resultants / force).scaled(force, scale / force, lowest)


def springs_under_pressure(weights: Array, modes: Array, gaps: Array, wanted: Array) -> Mask:
    """Which springs are under pressure, as far as Newton's method finds out.

    Arguments as in `winkler_contact`, in units in which the stiffnesses and the normal force add up to about 1; the
    modes are orthonormal, apart from a factor: their mean moves every spring by 1.
    """
    motion = (1.0 + gaps.max()) * modes.mean(axis=0)  # moves every spring by that much: the modes are orthonormal

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
    return modes @ motion > gaps


def _solves(contact: RigidContact, modes: Array) -> bool:
    left = np.abs(modes.T @ contact.forces - contact.resultants).max()
    return bool(left <= RESULTANTS * np.abs(contact.resultants).max() and contact.violation.max() <= ON_THE_VERGE)


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
