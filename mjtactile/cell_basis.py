"""A solved contact on cells as a linear map from the wrench to forces on the cells.

While the same cells are pressed, pressing forces are linear in (q, 1), q the normal force and its moments. Shear in
proportion to the pressure is the pressure times a rigid motion c: linear in the products of c and (q, 1). Bonded
contact is linear in q and the shear resultants together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile.cell_laws import CellLoad
from mjtactile.friction import ShearGrip
from mjtactile.options import ContactOptions, Wrench
from mjtactile.pad import Array


@dataclass(frozen=True, eq=False)
class CellBasis:
    """Linear parts of one contact.

    Attributes:
        solved: the contact they belong to.
        options: how it was solved; not "coulomb", which is not linear.
        forces: of each part on each cell, (parts, cells, 3) [N]: one per entry of (q, 1), then for proportional shear
            one per rigid motion and entry.
        shear: of unit pressing forces, what friction and torsion need; None for bonded contact.
        gram: rigid motions times rigid motions of the shear under each entry's pressure, (entries, 3, 3).
    """

    solved: CellLoad
    options: ContactOptions
    forces: Array
    shear: ShearGrip | None
    gram: Array

    @classmethod
    def of(cls, solved: CellLoad, options: ContactOptions) -> CellBasis:
        """Parts of a solved contact."""
        at, contact = solved.pressed.at, solved.pressed.contact
        if solved.bonded is not None:
            maps = solved.bonded.map_forces.reshape(3, int(at.reached.sum()), -1)
            forces = np.zeros((maps.shape[2], at.cells.count, 3))
            forces[:, at.reached] = (maps * np.array([1.0, 1.0, -1.0])[:, None, None]).transpose(2, 1, 0)
            return cls(solved, options, forces, None, np.zeros((0, 3, 3)))
        grip = ShearGrip(at.cells.centroids, np.ones(at.cells.count), at.centre, at.length)
        entries = contact.map_forces.T
        pressing = np.zeros((len(entries), at.cells.count, 3))
        pressing[..., 2] = -entries
        shears = np.zeros((3, len(entries), at.cells.count, 3))
        shears[..., :2] = np.einsum("acj,kc->jkca", grip.modes, entries)
        gram = np.einsum("aci,kc,acj->kij", grip.modes, entries, grip.modes)
        forces = np.concatenate([pressing, shears.reshape(-1, at.cells.count, 3)])
        return cls(solved, options, forces, grip, gram)

    def weights(self, wrench: Wrench) -> Array | None:
        """Share of each part in the load of a wrench, (parts,); None where other cells press, or some would slip."""
        if wrench.normal <= 0.0:
            return None
        at = self.solved.pressed.at
        if at.chosen_for > 0.0 and not at.gaps.any():
            return None  # cells on a part of a flat face lie where this very force pressed
        pressing = at.carried(wrench.normal, wrench.through)
        if pressing is None:
            return None
        if self.shear is None:
            return self._bonded_weights(pressing, wrench)
        if self.solved.pressed.contact.under(pressing) is None:
            return None
        entries = np.append(pressing, 1.0)
        wanted = self.shear.about_centre(wrench.force, wrench.moment[2])
        motion = np.zeros(3)
        if wanted.any():
            motion = np.linalg.solve(np.einsum("k,kij->ij", entries, self.gram), wanted)
        if self.options.friction is not None and self._slips(motion):
            return None
        return np.concatenate([entries, np.outer(motion, entries).ravel()])

    def _bonded_weights(self, pressing: Array, wrench: Wrench) -> Array | None:
        at, bonded = self.solved.pressed.at, self.solved.bonded
        assert bonded is not None
        grip = ShearGrip(at.cells.centroids, np.ones(at.cells.count), at.centre, at.length)
        resultants = np.concatenate([pressing, grip.about_centre(wrench.force, wrench.moment[2])])
        if bonded.under(resultants) is None:
            return None
        if self.options.friction is not None and not self.solved.held(wrench, self.options.friction):
            return None
        return np.append(resultants, 1.0)

    def _slips(self, motion: Array) -> bool:
        """Whether shear in proportion to the pressure would exceed friction on some pressed cell."""
        assert self.shear is not None
        assert self.options.friction is not None
        pressed = self.solved.pressed.contact.pressed
        ratio = np.linalg.norm(self.shear.modes[:, pressed] @ motion, axis=0)
        return bool((ratio > self.options.friction).any())
