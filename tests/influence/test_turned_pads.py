"""A square pad that is turned by 90 degrees is the same pad: what is stored of it must not know which axis is x."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon

from mjtactile import Fidelity, Layer, Pad, TaxelGrid
from mjtactile.influence.cache import build_influence
from mjtactile.influence.low_rank import _ends_of_ties
from mjtactile.influence.surface_load import SurfaceLoad

SQUARE = Pad(
    size=(6e-3, 6e-3),
    layers=(Layer(thickness=4e-3, young=3e6, poisson=0.49),),
    taxels=TaxelGrid(rows=5, columns=5, pitch=(1e-3, 1e-3)),
    depths=(1e-3, 3e-3),
    sampling_radius=0.375e-3,
)


@pytest.mark.parametrize(
    "storage", [{"loads": "corners"}, {"reduction": 0.03, "averaging": "mean"}], ids=["corners", "reduced"]
)
def test_a_turned_load_turns_the_readings(storage):
    influence = build_influence(SQUARE, Fidelity(mesh="draft", precision="float64", **storage), progress=False)
    surface, rng = influence.surface, np.random.default_rng(3)
    forces = rng.normal(size=(*surface.node_shape, 3))
    # Mirrored at the diagonal: x and y change places, as places and as directions.
    other = np.ascontiguousarray(np.swapaxes(forces, 0, 1)[..., [1, 0, 2]])
    first, second = (influence.readings(SurfaceLoad(one, surface, Polygon())) for one in (forces, other))
    # Rounding of the factorisation.
    np.testing.assert_allclose(second, np.swapaxes(first, 1, 2), atol=1e-10 * first.max())


def test_equal_singular_values_are_taken_together():
    np.testing.assert_array_equal(_ends_of_ties(np.array([5.0, 3.0, 3.0 - 1e-9, 2.0, 1.0, 1.0])), [0, 1, 3, 3, 4, 6, 6])
