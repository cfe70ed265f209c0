"""Flat faces that lift off in part: read on the cells of a fidelity as on many more."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, affinity, box

from mjtactile._types import Array
from mjtactile.cli.benchmarks.direct import relative_difference
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import build_influence
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Layer, Pad, TaxelGrid

MANY = 1600
#: Relative L2 error over all readings, by the number of cells of "fast" and "balanced".
BOUNDS = {20: 0.15, 60: 0.06}
SIDE, FORCE = 4e-3, 0.1
PLATE = box(-SIDE / 2, -SIDE / 2, SIDE / 2, SIDE / 2)
ANGLE = affinity.rotate(PLATE.difference(box(0.0, 0.0, SIDE, SIDE)), 20.0, origin=(0.0, 0.0))
TRIANGLE = Polygon([(-1.5e-3, -1.2e-3), (1.7e-3, -0.6e-3), (-0.2e-3, 1.8e-3)])


@pytest.fixture(scope="module")
def thin_pad() -> InfluenceMatrices:
    """Thin beside the contacts, so that readings tell where these end."""
    pad = Pad(
        size=(SIDE, SIDE),
        layers=(Layer(thickness=1e-3, young=3e6, poisson=0.49),),
        taxels=TaxelGrid(rows=4, columns=4, pitch=(1e-3, 1e-3)),
        depths=(0.3e-3, 0.7e-3),
        sampling_radius=0.2e-3,
    )
    return build_influence(pad, Fidelity(mesh="draft", precision="float32", law="elastic", cells=60), progress=False)


def readings(influence: InfluenceMatrices, face: Polygon, through: Array, cells: int) -> Array:
    force = np.array([0.0, 0.0, -FORCE])
    footprint = Footprint.from_outline(face, influence.surface)
    load = contact_load(influence, footprint, force, moment=np.cross(through, force), cells=cells)
    return influence.readings(load)


@pytest.mark.parametrize("cells", BOUNDS)
@pytest.mark.parametrize("degrees", [0.0, 15.0, 45.0])
def test_a_plate_lifts_off_wherever_its_load_goes(thin_pad, degrees, cells):
    """Its contact ends within the small cells along its rim, or within the large ones in its middle."""
    errors = []
    for away in np.arange(0.8, 1.65, 0.1) * 1e-3:
        through = away * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
        many = readings(thin_pad, PLATE, through, MANY)
        errors.append(relative_difference(readings(thin_pad, PLATE, through, cells), many))
    assert max(errors) <= BOUNDS[cells]


@pytest.mark.parametrize("cells", BOUNDS)
@pytest.mark.parametrize("face", [ANGLE, TRIANGLE], ids=["angle", "triangle"])
def test_faces_with_corners_lift_off(thin_pad, face, cells):
    middle = np.array([*face.convex_hull.centroid.coords[0], 0.0])
    for corner in np.array(face.exterior.coords)[:-1]:
        for share in (0.4, 0.55):
            through = middle + share * (np.array([*corner, 0.0]) - middle)
            many = readings(thin_pad, face, through, MANY)
            assert relative_difference(readings(thin_pad, face, through, cells), many) <= BOUNDS[cells], (corner, share)
