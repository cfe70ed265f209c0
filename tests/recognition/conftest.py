"""Readings for recognisers, made without MuJoCo."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mjtactile import influence_matrices
from mjtactile.dataset.by_law import physics_readings
from mjtactile.dataset.sampling import OutlinePresses, PosePresses

Pressed = Callable[..., np.ndarray]


@pytest.fixture(scope="session")
def pressed() -> Pressed:
    """Readings (forces, layers, rows, columns) of a shape in a pose under forces (forces, 3)."""
    influence = influence_matrices(fidelity="precise", progress=False)

    def readings(shape, forces, *, shift=(0.0, 0.0), rotation=0.0, size=1.0):
        forces = np.atleast_2d(forces)
        magnitudes = np.linalg.norm(forces, axis=1)
        directions = forces / magnitudes[:, None]
        pose = PosePresses(shift=shift, rotation=rotation, directions=directions, magnitudes=magnitudes)
        contact = OutlinePresses(
            first=0,
            shape=shape,
            size=size,
            preset="precise",
            law="elastic",
            tangential="proportional",
            free=False,
            poses=(pose,),
        )
        return physics_readings(influence, contact)[0]

    return readings
