"""A rigid body in contact with the cells of a surface: what every contact law solves for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from mjtactile.pad import Array

Mask = npt.NDArray[np.bool_]

#: Forces and separations this small beside the largest count as zero.
TOLERANCE = 1e-11
#: Heights this large beside the approach drown what presses.
HIGH = 1e3
#: Violations left where cells on the verge of contact keep changing sides.
ON_THE_VERGE = 1e-8
#: Motions that the contact resists less than this, over the one it resists most, are open.
_OPEN = 1e-12
#: Motions this small beside the largest do not move the cells.
_DEPENDENT = 1e-9
#: Resultants along an open motion that are more than rounding.
_LOADED = 1e-11
#: Resultants must come out to this fraction of the normal force.
RESULTANTS = 1e-9


def flexibility(stiffness: Array, resultants: Array) -> Array:
    """Motion per resultant of a contact with a symmetric stiffness (motions, motions).

    Cells in one row leave a tilt open. It stays as it is, unless the resultants load it: then it goes far, until other
    cells come into contact.
    """
    values, vectors = np.linalg.eigh(stiffness)
    largest = max(float(values[-1]), np.finfo(float).tiny)
    loaded = np.abs(vectors.T @ resultants) > _LOADED * np.abs(resultants).max()
    open_motions = values < _OPEN * largest
    inverse = np.where(
        open_motions, np.where(loaded, 1.0 / (_OPEN * largest), 0.0), 1.0 / np.maximum(values, _OPEN * largest)
    )
    return (vectors * inverse) @ vectors.T


@dataclass(frozen=True, eq=False)
class Motions:
    """Rigid motions, mixed so that they are orthonormal on the cells, and what of the resultants they can take up.

    Tilts about a point far from the cells hardly differ from an approach; mixed, no digits are lost between them.

    Attributes:
        modes: displacement of each cell per unit of each mixed motion, (cells, kept).
        to_mixed: resultants to those of the mixed motions, (kept, motions).
    """

    modes: Array
    to_mixed: Array

    @classmethod
    def of(cls, modes: Array) -> Motions:
        """From the displacements of any motions, (cells, motions)."""
        basis, sizes, mixing = np.linalg.svd(modes, full_matrices=False)
        kept = sizes > _DEPENDENT * sizes[0]
        spread = np.sqrt(len(modes))
        return cls(spread * basis[:, kept], spread / sizes[kept, None] * mixing[kept])

    def unmixed(self, contact: RigidContact, resultants: Array) -> RigidContact:
        """A contact under mixed motions, in terms of the motions they were made of."""
        kept = len(self.to_mixed)

        def back(mapped: Array) -> Array:
            return np.column_stack([mapped[:, :kept] @ self.to_mixed, mapped[:, kept]])

        return RigidContact(
            resultants,
            contact.pressed,
            back(contact.map_forces),
            self.to_mixed.T @ back(contact.map_motion),
            back(contact.map_separation),
        )


@dataclass(frozen=True, eq=False)
class RigidContact:
    """Solution of one contact, which is linear in its resultants while the same cells are pressed.

    Attributes:
        resultants: sum of the pressing forces times each rigid motion's displacement, (motions,).
        pressed: cells in contact, (cells,).
        map_forces: (resultants, 1) to forces pressing on each cell [N], (cells, motions + 1); bonded contacts have
            shear x and y in front, (3 cells, motions + 1).
        map_motion: (resultants, 1) to the body's motion into the pad, approach [m] first, (motions, motions + 1).
        map_separation: (resultants, 1) to the separation of body and surface at each cell [m], (cells, motions + 1).
    """

    resultants: Array
    pressed: Mask
    map_forces: Array
    map_motion: Array
    map_separation: Array

    @cached_property
    def forces(self) -> Array:
        """Pressing on each cell [N], shape (cells,); bonded contacts have shear x and y in front, (3 cells,)."""
        return self.map_forces @ np.append(self.resultants, 1.0)

    @cached_property
    def motion(self) -> Array:
        """Of the body into the pad, one per resultant; the first is the approach [m]."""
        return self.map_motion @ np.append(self.resultants, 1.0)

    @cached_property
    def separation(self) -> Array:
        """Of body and surface at each cell [m]."""
        return self.map_separation @ np.append(self.resultants, 1.0)

    @cached_property
    def violation(self) -> Array:
        """How far each cell is from its condition, pressure where pressed and a gap elsewhere; 0 where it is met."""
        pressing, separation = self.forces[-len(self.pressed) :], self.separation
        pull = np.where(self.pressed, -pressing, 0.0) / np.abs(self.forces).max()
        apart = np.isfinite(separation)
        overlap = np.where(self.pressed | ~apart, 0.0, -separation)
        # What the body moves is the measure of what overlaps.
        scale = max(float(np.abs(separation[apart]).max(initial=0.0)), float(np.abs(self.motion[0])))
        violation = np.maximum(pull, overlap / scale if scale > 0.0 else overlap)
        return np.where(violation > TOLERANCE, violation, 0.0)

    def under(self, resultants: Array) -> RigidContact | None:
        """The contact under other resultants; None where other cells would be pressed."""
        changed = RigidContact(resultants, self.pressed, self.map_forces, self.map_motion, self.map_separation)
        return None if changed.violation.any() else changed

    def balanced(self, modes: Array) -> RigidContact:
        """With forces that carry the resultants to rounding, which heights huge beside the approach cost digits.

        Args:
            modes: displacement of each of the forces per unit of each motion, (forces, motions).
        """
        bearing = np.tile(self.pressed, len(modes) // len(self.pressed))
        own, wanted = modes[bearing], np.eye(*self.map_motion.shape)
        map_forces = self.map_forces.copy()
        for _ in range(2):
            missing = wanted - own.T @ map_forces[bearing]
            map_forces[bearing] += np.linalg.lstsq(own.T, missing, rcond=_DEPENDENT)[0]
        return RigidContact(self.resultants, self.pressed, map_forces, self.map_motion, self.map_separation)

    def scaled(self, force: float, give: float, lowest: float) -> RigidContact:
        """The same contact in units `force` [N] and `give` [m/N] times it, heights counted from `lowest` [m]."""
        units = np.append(np.ones(len(self.resultants)), force)
        map_motion = give * self.map_motion * units
        map_motion[0, -1] += lowest
        return RigidContact(
            force * self.resultants,
            self.pressed,
            self.map_forces * units,
            map_motion,
            give * self.map_separation * units,
        )

    def spread(self, places: Mask) -> RigidContact:
        """A contact solved on some cells, on all of them: the others are out of reach."""
        if places.all():
            return self
        pressed = np.zeros(len(places), dtype=bool)
        map_forces = np.zeros((len(places), self.map_forces.shape[1]))
        map_separation = np.zeros_like(map_forces)
        map_separation[:, -1] = np.inf
        pressed[places], map_forces[places], map_separation[places] = self.pressed, self.map_forces, self.map_separation
        return RigidContact(self.resultants, pressed, map_forces, self.map_motion, map_separation)
