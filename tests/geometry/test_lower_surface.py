"""The core's lower surfaces of single shapes against closed forms."""

from __future__ import annotations

import gc

import numpy as np
import pytest
import trimesh
from lower_surfaces import Box, Cylinder, Ellipsoid, Pose, TriangleMesh
from scipy.spatial.transform import Rotation

from mjtactile.geometry.lower_surface import LowerSurface

TORUS = trimesh.creation.torus(4e-3, 1.5e-3)
SHAPES = {
    "sphere": (LowerSurface.of_sphere(4e-3), Ellipsoid((4e-3, 4e-3, 4e-3))),
    "cylinder": (LowerSurface.of_cylinder(4e-3, 6e-3), Cylinder(4e-3, 3e-3)),
    "box": (LowerSurface.of_box((4e-3, 5e-3, 6e-3)), Box((2e-3, 2.5e-3, 3e-3))),
    "solid": (
        LowerSurface.of_solid(TORUS),
        TriangleMesh(TORUS.vertices.astype(np.float32).astype(float), np.asarray(TORUS.faces)),
    ),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("floor", [-np.inf, 0.0])
def test_heights_are_those_of_closed_forms(name, floor):
    gc.collect()  # what the core was given is not kept by Python
    surface, reference = SHAPES[name]
    random, over = np.random.default_rng(0), 0
    for turn in Rotation.random(5, rng=random):
        position, (x, y) = random.uniform(-3e-3, 3e-3, 3), random.uniform(-7e-3, 7e-3, (2, 500))
        found = surface.heights(position, turn.as_matrix(), x, y, floor=floor)
        expected = reference.heights(Pose(position, turn.as_matrix()), x, y, floor)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)
        over += int(np.isfinite(found).sum())
    assert over > 0


def test_nothing_is_over_points_beside_a_shape():
    beside = LowerSurface.of_sphere(1e-3).heights(np.zeros(3), np.eye(3), np.full(3, 5e-3), np.zeros(3))
    assert np.isinf(beside).all()
    nowhere = LowerSurface.of_sphere(1e-3).heights(np.zeros(3), np.eye(3), np.empty(0), np.empty(0))
    assert nowhere.shape == (0,)
