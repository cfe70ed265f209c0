"""Frictionless contact of a rigid body with an elastic surface as a convex quadratic programme.

Cell forces F >= 0 minimise the complementary energy 1/2 F.A F + g.F under the given resultants B^T F = q. The
multipliers of the resultants are the body's rigid motion d (approach and tilts), and the conditions for a minimum are
those of contact: the separation  A F - (B d - g)  is nowhere negative, and zero wherever the surface is pressed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from mjtactile import native
from mjtactile.errors import ContactError
from mjtactile.interior import interior_point, positive_definite, resting_cells
from mjtactile.pad import Array
from mjtactile.rigid import HIGH, ON_THE_VERGE, RESULTANTS, TOLERANCE, Mask, Motions, RigidContact, flexibility
from mjtactile.winkler import springs_under_pressure

#: Exchanges of whole sets before single cells change sides.
_SET_EXCHANGES = 30
_SINGLE_EXCHANGES = 20
#: Springs that start the search, over the stiffness of single cells.
_SPRINGS = 0.2
#: What forces may miss of the resultants before they are corrected, over the normal force, and what a correction mends,
#: over the largest resultant: more would be another contact.
_EXACT, _MENDED = 1e-12, 1e-6


def rigid_contact(
    compliance: Array, modes: Array, gaps: Array, resultants: Array, start: Mask | None = None
) -> RigidContact:
    """Press a rigid body into an elastic surface, without friction.

    Args:
        compliance: of the cells, symmetric, (cells, cells) [m/N].
        modes: downward displacement of each cell per unit of each rigid motion, (cells, motions).
        gaps: of the body above the surface before it moves, (cells,) [m].
        resultants: sum of the forces times each mode, (motions,); the first is the normal force [N], positive.
        start: cells that are likely in contact, as those of the last time.

    Raises:
        ContactError: when no contact was found, which the resultants or the compliance must be to blame for.
    """
    return _solve(compliance, modes, gaps, resultants, 1, start)


def bonded_contact(
    compliance: Array, modes: Array, gaps: Array, resultants: Array, start: Mask | None = None
) -> RigidContact:
    """Press a rigid body into an elastic surface that sticks to it wherever they touch.

    Args:
        compliance: symmetric, (3, cells, 3, cells) [m/N]: shear x, shear y, pressing.
        modes: displacement per unit of each rigid motion, (3, cells, motions); the first motion is the approach.
        gaps: of the body above the surface before it moves, (cells,) [m].
        resultants: sum of the forces times each mode, (motions,); the first is the normal force [N], positive.
        start: cells that are likely in contact.
    Returns: the contact, its forces and their map in three blocks of cells.

    Raises:
        ContactError: when no contact was found.
    """
    size = 3 * len(gaps)
    heights = np.concatenate([np.zeros(2 * len(gaps)), gaps])
    return _solve(compliance.reshape(size, size), modes.reshape(size, -1), heights, resultants, 3, start)


def _solve(
    compliance: Array, modes: Array, heights: Array, resultants: Array, blocks: int, start: Mask | None
) -> RigidContact:
    normal = slice(len(heights) - len(heights) // blocks, None)
    force, give = resultants[0], float(np.diagonal(compliance).mean())
    lowest = heights[normal].min()  # heights are counted from it: they can be huge beside the approach
    gaps = heights.copy()
    gaps[normal] -= lowest
    motions = Motions.of(modes)
    mixed = motions.to_mixed @ (resultants / force)
    solved = _Programme(compliance / give, motions.modes, gaps / (give * force), mixed, blocks).solve(start)
    if solved is None:
        raise ContactError(
            "no contact carries this wrench: the force passes too near the edge of what the body covers, or the gap "
            "map is not finite there. Move the force inward, or check the gap map."
        )
    return motions.unmixed(solved, resultants / force).scaled(force, give, lowest)


@dataclass(frozen=True, eq=False)
class _Programme:
    """The programme in units of the normal force and of a cell's own give.

    Unknowns stand in one block (pressing) or three (shear x, shear y, pressing) of one per cell; only pressing forces
    are bound to be positive.
    """

    compliance: Array
    modes: Array
    gaps: Array
    resultants: Array
    blocks: int = 1

    @property
    def cells(self) -> int:
        return len(self.gaps) // self.blocks

    @property
    def _normal(self) -> slice:
        return slice((self.blocks - 1) * self.cells, None)

    def solve(self, start: Mask | None) -> RigidContact | None:
        """Forces, motion and separation that meet all conditions; None if none were found."""
        solved = None if start is None else self._exchange_sets(start)
        if solved is None and not self.gaps.any():
            solved = self._exchange_sets(np.ones(self.cells, dtype=bool))
        if solved is None and self.blocks == 1:
            springs = _SPRINGS / np.diagonal(self.compliance)
            likely = springs_under_pressure(springs, self.modes, self.gaps, self.resultants)
            solved = self._exchange_sets(likely)
        carrying = self._carrying(solved)
        if carrying is None:
            definite = replace(self, compliance=positive_definite(self.compliance))
            carrying = definite._from_interior()
        return carrying

    def _carrying(self, solved: RigidContact | None) -> RigidContact | None:
        """The contact, with forces that carry the resultants; None if they miss them by more than rounding.

        Few cells of very different size, or close together under much torsion, cost the resultants digits.
        """
        if solved is None or self._missing(solved) <= _EXACT:
            return solved
        size = float(np.abs(self.resultants).max())
        if self._missing(solved) > _MENDED * size:
            return None
        solved = solved.balanced(self.modes)
        return solved if self._missing(solved) <= RESULTANTS * size else None

    def _missing(self, solved: RigidContact) -> float:
        """Largest part of the resultants that the forces do not carry."""
        return float(np.abs(self.modes.T @ solved.forces - self.resultants).max())

    def _from_interior(self) -> RigidContact | None:
        """The slow way that does not cycle; None if not even that finds forces that carry the resultants."""
        bounded = np.arange(len(self.gaps)) >= self._normal.start
        if self.blocks == 1 and self.gaps.max() > HIGH:
            resting = self._exchange_sets(resting_cells(self.gaps, self.modes, self.resultants))
            if resting is not None and (resting := self._carrying(resting.balanced(self.modes))) is not None:
                return resting
        forces, multipliers = interior_point(self.compliance, self.gaps, self.modes, self.resultants, bounded)
        normal, apart = forces[self._normal], multipliers[self._normal]
        pressed = normal * self.cells > apart
        solved = self._carrying(self._exchange_sets(pressed))
        if solved is None:
            # Cells on the verge of contact, which rounding moves from one side to the other and back.
            solved = self._on(pressed)
            if solved is None or solved.violation.max() > ON_THE_VERGE:
                solved = self._descend(np.where(pressed, normal, 0.0)) if self.blocks == 1 else None
        return self._carrying(solved)

    def _on(self, pressed: Mask) -> RigidContact | None:
        """The solution if exactly these cells were in contact; None where they cannot carry the resultants."""
        places = np.flatnonzero(np.tile(pressed, self.blocks))
        if not len(places):
            return None
        own = self.compliance if pressed.all() else self.compliance[np.ix_(places, places)]
        factor, failed = scipy.linalg.lapack.dpotrf(own, lower=1)  # type: ignore[attr-defined]
        if failed:
            return None
        right = np.column_stack([self.modes[places], self.gaps[places]])
        answers = scipy.linalg.lapack.dpotrs(factor, right, lower=1)[0]  # type: ignore[attr-defined]
        stiffness = self.modes[places].T @ answers[:, :-1]
        # With the motion d = S^-1 (q + B^T A^-1 g), forces are A^-1 (B d - g): linear in q, constant in g.
        to_motion = flexibility(stiffness, self.resultants + self.modes[places].T @ answers[:, -1])
        map_motion = np.column_stack([to_motion, to_motion @ (self.modes[places].T @ answers[:, -1])])
        map_forces = np.zeros((len(self.gaps), len(self.resultants) + 1))
        map_forces[places] = answers[:, :-1] @ map_motion
        map_forces[places, -1] -= answers[:, -1]
        normal = self._normal
        map_separation = np.zeros((self.cells, map_forces.shape[1]))
        if not pressed.all():
            map_separation = self.compliance[normal, places] @ map_forces[places] - self.modes[normal] @ map_motion
            map_separation[:, -1] += self.gaps[normal]
            map_separation[pressed] = 0.0
        return RigidContact(self.resultants, pressed, map_forces, map_motion, map_separation)

    def _exchange_sets(self, pressed: Mask) -> RigidContact | None:
        """Move every cell that violates its condition to the other side until none does."""
        if native.enabled() and self.blocks == 1:
            heights = self.gaps if self.gaps.any() else None
            found = native.rigid_contact(self.compliance, self.modes, heights, self.resultants, pressed)
            if found is not None:
                return RigidContact(self.resultants, *found)
        seen = set()
        for _ in range(_SET_EXCHANGES):
            solved = self._on(pressed)
            if solved is None or pressed.tobytes() in seen:
                return None
            violated = solved.violation > 0.0
            if not violated.any():
                return solved
            seen.add(pressed.tobytes())
            pressed = pressed ^ violated
        return None

    def _descend(self, forces: Array) -> RigidContact | None:
        """Primal active-set method from forces that carry the resultants: the energy falls at every step.

        Slower than exchanging sets, but it cannot cycle.
        """
        pressed = forces > 0.0
        for _ in range(_SINGLE_EXCHANGES * len(forces)):
            solved = self._on(pressed)
            if solved is None:
                return None
            step = solved.forces - forces
            blocking = pressed & (solved.forces < -TOLERANCE * np.abs(solved.forces).max())
            if blocking.any():
                length = float((forces[blocking] / -step[blocking]).min())
                forces = np.maximum(forces + length * step, 0.0)
                pressed = pressed & ~(blocking & (forces <= TOLERANCE * forces.max()))
                continue
            violation = solved.violation
            if not violation.any():
                return solved
            forces = np.maximum(solved.forces, 0.0)
            pressed = pressed.copy()
            pressed[violation.argmax()] = True
        return None
