"""A rigid body in contact with the cells of a surface: what every contact law solves for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile.pad import Array

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RigidContact:
    """Solution of one contact.

    Attributes:
        forces: pressing on each cell [N], shape (cells,); bonded contacts have shear x and y in front, (3 cells,).
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
