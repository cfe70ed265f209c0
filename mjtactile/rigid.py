"""Frictionless contact of a rigid body with an elastic surface as a convex quadratic programme.

Cell forces F >= 0 minimise the complementary energy 1/2 F.A F + g.F under the given resultants B^T F = q. The
multipliers of the resultants are the body's rigid motion d (approach and tilts), and the conditions for a minimum are
those of contact: the separation  A F - (B d - g)  is nowhere negative, and zero wherever the surface is pressed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.optimize

from mjtactile.errors import ContactError
from mjtactile.pad import Array

Mask = npt.NDArray[np.bool_]

#: Forces and separations this small beside the largest count as zero.
_TOLERANCE = 1e-11
#: Exchanges of whole sets before one cell at a time changes sides.
_SET_EXCHANGES = 40
_SINGLE_EXCHANGES = 4
#: Weight of the resultants in the least-squares start.
_EQUALITY_WEIGHT = 1e3


@dataclass(frozen=True, eq=False)
class RigidContact:
    """Solution of one contact.

    Attributes:
        forces: pressing on each cell [N], shape (cells,).
        motion: of the body into the pad, one per resultant: approach [m], tilts [rad].
        separation: of body and surface at each cell [m].
        pressed: cells in contact.
        map_forces: forces as `map_forces @ (q, 1)` while the same cells are in contact, (cells, resultants + 1).
    """

    forces: Array
    motion: Array
    separation: Array
    pressed: Mask
    map_forces: Array


def rigid_contact(
    compliance: Array, modes: Array, gaps: Array, resultants: Array, start: Mask | None = None
) -> RigidContact:
    """Press a rigid body into an elastic surface.

    Args:
        compliance: of the cells, symmetric, (cells, cells) [m/N].
        modes: downward displacement of each cell per unit of each rigid motion, (cells, motions).
        gaps: of the body above the surface before it moves, (cells,) [m].
        resultants: sum of the forces times each mode, (motions,); the first is the normal force [N], positive.
        start: cells that are likely in contact, as those of the last time.

    Raises:
        ContactError: when no contact was found, which the resultants or the compliance must be to blame for.
    """
    force, give = resultants[0], float(np.diagonal(compliance).mean())
    scaled = _Programme(compliance / give, modes, gaps / (give * force), resultants / force)
    solved = scaled.solve(np.ones(len(gaps), dtype=bool) if start is None else start)
    if solved is None:
        raise ContactError(
            "no contact carries this wrench: the force passes too near the edge of what the body covers, or the gap "
            "map is not finite there. Move the force inward, or check the gap map."
        )
    pressed, forces, motion, separation, map_forces = solved
    map_forces = map_forces * np.append(np.ones(len(resultants)), force)
    return RigidContact(forces * force, motion * give * force, separation * give * force, pressed, map_forces)


_Solved = tuple[Mask, Array, Array, Array, Array]


@dataclass(frozen=True, eq=False)
class _Programme:
    """The programme in units of the normal force and of a cell's own give."""

    compliance: Array
    modes: Array
    gaps: Array
    resultants: Array

    def solve(self, start: Mask) -> _Solved | None:
        """Forces, motion and separation that meet all conditions; None if none were found."""
        return self._exchange_sets(start) or self._exchange_one_by_one(self._least_squares_start())

    def _on(self, pressed: Mask) -> _Solved | None:
        """The solution if exactly these cells were in contact; None where they cannot carry the resultants."""
        places = np.flatnonzero(pressed)
        if len(places) < len(self.resultants):
            return None
        factor, failed = scipy.linalg.lapack.dpotrf(self.compliance[np.ix_(places, places)], lower=1)
        if failed:
            return None
        right = np.column_stack([self.modes[places], self.gaps[places]])
        answers = scipy.linalg.lapack.dpotrs(factor, right, lower=1)[0]
        stiffness = self.modes[places].T @ answers[:, :-1]
        if np.linalg.cond(stiffness) > 1e13:
            return None
        # With the motion d = S^-1 (q + B^T A^-1 g), forces are A^-1 (B d - g): linear in q, constant in g.
        to_motion = np.linalg.inv(stiffness)
        map_places = np.column_stack(
            [answers[:, :-1] @ to_motion, answers[:, :-1] @ to_motion @ (self.modes[places].T @ answers[:, -1])]
        )
        map_places[:, -1] -= answers[:, -1]
        map_forces = np.zeros((len(self.gaps), len(self.resultants) + 1))
        map_forces[places] = map_places
        forces = map_forces @ np.append(self.resultants, 1.0)
        motion = to_motion @ (self.resultants + self.modes[places].T @ answers[:, -1])
        separation = self.compliance[:, places] @ forces[places] - (self.modes @ motion - self.gaps)
        separation[places] = 0.0
        return pressed, forces, motion, separation, map_forces

    def _violated(self, solved: _Solved) -> Array:
        """How far each cell is from its condition, zero where it is met."""
        pressed, forces, _, separation, _ = solved
        pull = np.where(pressed, -forces, 0.0) / np.abs(forces).max()
        overlap = np.where(pressed, 0.0, -separation) / max(np.abs(separation).max(), 1.0)
        violation = np.maximum(pull, overlap)
        return np.where(violation > _TOLERANCE, violation, 0.0)

    def _exchange_sets(self, pressed: Mask) -> _Solved | None:
        """Move every cell that violates its condition to the other side until none does."""
        seen = set()
        for _ in range(_SET_EXCHANGES):
            solved = self._on(pressed)
            if solved is None or pressed.tobytes() in seen:
                return None
            violated = self._violated(solved) > 0.0
            if not violated.any():
                return solved
            seen.add(pressed.tobytes())
            pressed = pressed ^ violated
        return None

    def _exchange_one_by_one(self, pressed: Mask) -> _Solved | None:
        """As above, the worst cell only: slow, but it does not cycle in practice."""
        for _ in range(_SINGLE_EXCHANGES * len(self.gaps)):
            solved = self._on(pressed)
            if solved is None:
                return None
            violation = self._violated(solved)
            if not violation.any():
                return solved
            pressed = pressed.copy()
            pressed[violation.argmax()] ^= True
        return None

    def _least_squares_start(self) -> Mask:
        """Cells in contact in a least-squares solution without the resultants as strict conditions."""
        factor = np.linalg.cholesky(self.compliance)
        matrix = np.vstack([factor.T, _EQUALITY_WEIGHT * self.modes.T])
        target = np.concatenate(
            [-scipy.linalg.solve_triangular(factor, self.gaps, lower=True), _EQUALITY_WEIGHT * self.resultants]
        )
        forces, _ = scipy.optimize.nnls(matrix, target, maxiter=20 * len(self.gaps))
        return forces > 0.0
