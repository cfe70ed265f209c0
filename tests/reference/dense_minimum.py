"""The minimum that a contact is: forces between zero and a bound that carry given resultants.

Found by an active set from where a contact was on coarser cells, or from the interior.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg

from mjtactile._types import Array, Mask

#: Forces and gaps this small, over the largest force and the deepest sinking, are rounding.
ROUNDING = 1e-10


class Problem(NamedTuple):
    """The minimum that is asked for; see the top of this module. Scaled so that forces and heights are about 1."""

    matrix: Array  #: (n, n)
    heights: Array  #: (n,)
    modes: Array  #: (n, motions)
    resultants: Array  #: (motions,)
    most: Array  #: bound of each force, (n,)

    def gaps(self, forces: Array, motion: Array) -> Array:
        """Between bodies and surface, (n,)."""
        return self.heights + self.matrix @ forces - self.modes @ motion


def active_set(problem: Problem, pressed: Mask, full: Mask) -> tuple[Array, Array] | None:
    """Forces and motion, changing all cells at once that are in the wrong state; None if that goes round in circles.

    Args:
        problem: to solve.
        pressed: cells whose gap is zero, to begin with, (n,).
        full: cells whose force is at its bound.
    """
    seen: set[bytes] = set()
    for _ in range(100):
        state = pressed.tobytes() + full.tobytes()
        if state in seen or not pressed.any():
            return None
        seen.add(state)
        forces, motion = _held(problem, pressed, full)
        gaps = problem.gaps(forces, motion)
        verge, sunk = ROUNDING * np.abs(forces).max(), ROUNDING * max(1.0, np.abs(problem.heights - gaps).max())
        drops, fills = pressed & (forces < -verge), pressed & (forces > problem.most + verge)
        comes, eases = ~pressed & ~full & (gaps < -sunk), full & (gaps > sunk)
        if not (drops | fills | comes | eases).any():
            return forces, motion
        if (drops | comes).any():  # first where it presses at all, then where it presses too hard
            pressed = (pressed & ~drops) | comes
        else:
            pressed, full = (pressed & ~fills) | eases, (full & ~eases) | fills
    return None


def _held(problem: Problem, pressed: Mask, full: Mask) -> tuple[Array, Array]:
    """Forces and motion where gaps are zero on the pressed cells and the other forces are known."""
    forces = np.where(full, problem.most, 0.0)
    sunk = problem.heights + (problem.matrix[:, full] @ forces[full] if full.any() else 0.0)
    modes = problem.modes[pressed]
    factor = scipy.linalg.cho_factor(problem.matrix[np.ix_(pressed, pressed)], lower=True, check_finite=False)
    per_motion = scipy.linalg.cho_solve(factor, modes, check_finite=False)
    from_gaps = scipy.linalg.cho_solve(factor, sunk[pressed], check_finite=False)
    wanted = problem.resultants - problem.modes[full].T @ forces[full] + modes.T @ from_gaps
    # Cells in one row leave a tilt open: the least one is taken.
    motion = np.linalg.lstsq(modes.T @ per_motion, wanted, rcond=1e-13)[0]
    forces[pressed] = per_motion @ motion - from_gaps
    return forces, motion


def interior_point(problem: Problem) -> tuple[Mask, Mask]:
    """Cells that are pressed, and those at their bound: Mehrotra's predictor and corrector.

    Source: Nocedal, Wright, Numerical Optimization, 2006, chapter 16.6.
    """
    M, count = problem.modes, len(problem.heights)
    bounded = np.isfinite(problem.most)
    most = np.where(bounded, problem.most, 1.0)
    F, d = np.where(bounded, np.minimum(1.0, most / 2), 1.0), np.zeros(M.shape[1])
    low, high = np.ones(count), bounded.astype(float)  # multipliers of both bounds
    pairs = count + int(bounded.sum())
    for _ in range(100):
        room = np.where(bounded, most - F, 1.0)
        dual, primal = problem.gaps(F, d) - low + high, problem.resultants - M.T @ F
        mean = float(F @ low + room @ high) / pairs
        if mean < 1e-8 and np.abs(primal).max() < 1e-7 * count and np.abs(dual).max() < 1e-7:
            break
        newton = _Newton(problem, F, room, low, high)
        change, _, d_low, d_high = newton.step(dual, primal, -F * low, -room * high)
        reach = _reach((F, change), (room, -change * bounded), (low, d_low), (high, d_high))
        after = (F + reach * change) @ (low + reach * d_low)
        after += (room - reach * change * bounded) @ (high + reach * d_high)
        centred = (float(after) / pairs / mean) ** 3 * mean
        misses = centred - F * low - change * d_low, bounded * (centred - room * high + change * d_high)
        change, turn, d_low, d_high = newton.step(dual, primal, *misses)
        reach = min(1.0, 0.995 * _reach((F, change), (room, -change * bounded), (low, d_low), (high, d_high)))
        F, d, low, high = F + reach * change, d + reach * turn, low + reach * d_low, high + reach * d_high
    room = np.where(bounded, most - F, np.inf)
    full = bounded & (high > room) & (room < F)
    return (low < F) & ~full, full


class _Newton:
    """Newton's steps of the interior point from one place: forces, room to their bounds, multipliers of both."""

    def __init__(self, problem: Problem, F: Array, room: Array, low: Array, high: Array) -> None:
        self.F, self.room, self.low, self.high, self.modes = F, room, low, high, problem.modes
        H = problem.matrix.copy()
        H[np.diag_indices(len(F))] += low / F + high / room
        self.factor = scipy.linalg.cho_factor(H, lower=True, overwrite_a=True, check_finite=False)
        self.per_motion = scipy.linalg.cho_solve(self.factor, self.modes, check_finite=False)

    def step(self, dual: Array, primal: Array, low_miss: Array, high_miss: Array) -> tuple[Array, Array, Array, Array]:
        """Changes of forces, motion and multipliers, given what is missing to forces times multipliers."""
        right = -dual + low_miss / self.F - high_miss / self.room
        free = scipy.linalg.cho_solve(self.factor, right, check_finite=False)
        turn = np.linalg.lstsq(self.modes.T @ self.per_motion, primal - self.modes.T @ free, rcond=1e-14)[0]
        change = free + self.per_motion @ turn
        return change, turn, (low_miss - self.low * change) / self.F, (high_miss + self.high * change) / self.room


def _reach(*pairs: tuple[Array, Array]) -> float:
    """Largest share of the changes that leaves every value above zero, 1 at most without a margin."""
    reach = 1.0 / 0.995
    for value, change in pairs:
        falling = change < 0.0
        if falling.any():
            reach = min(reach, float((-value[falling] / change[falling]).min()))
    return reach


def conditions(problem: Problem, forces: Array, motion: Array) -> dict[str, float]:
    """How far a solution is from each of its conditions, over the largest force or the deepest sinking."""
    gaps = problem.gaps(forces, motion)
    largest, sunk = float(np.abs(forces).max()), max(1.0, float(np.abs(problem.heights - gaps).max()))
    room = np.where(np.isfinite(problem.most), problem.most - forces, largest)
    full = room <= ROUNDING * largest
    apart = np.where(full, np.maximum(gaps, 0.0), np.abs(gaps))
    carried = np.abs(problem.modes.T @ forces - problem.resultants).max() / np.abs(problem.resultants).max()
    return {
        "pressure below zero": max(0.0, float(-forces.min())) / largest,
        "pressure above its bound": max(0.0, float(-room.min())) / largest,
        "overlap": max(0.0, float(-gaps[~full].min(initial=0.0))) / sunk,
        "pressure across a gap": float(np.minimum(np.abs(forces) / largest, apart / sunk).max()),
        "resultants": float(carried),
    }
