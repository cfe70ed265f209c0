"""What faces a curved pad: the part of a body within a small gap over the surface."""

from __future__ import annotations

import numpy as np
import pytest
from curved_pads import BULGES, CURVED

from mjtactile.errors import FootprintError
from mjtactile.geometry.primitives import Ellipsoid, HalfSpace, Pose
from mjtactile.sim.curved_outline import curved_outline

GAP = 2e-5


def ball_on(pad, x, y, radius, lift=0.0):
    middle = pad.surface.positions(x, y) + (radius + lift) * pad.surface.normals(x, y)
    return Ellipsoid((radius, radius, radius)), Pose(middle, np.eye(3))


@pytest.mark.parametrize("name", CURVED)
@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (2e-3, -3e-3)])
def test_a_ball_faces_an_ellipse_about_its_touch(name, x, y):
    """Of half-axes sqrt(2 gap / relative curvature); the third order moves them by some per cent."""
    pad, radius = CURVED[name], 3e-3
    found = curved_outline([ball_on(pad, x, y, radius, lift=1e-5)], pad, facing_gap=GAP)
    first, second = pad.surface.curvatures(x, y) + 1 / radius
    on_surface = np.pi * 2 * GAP / np.sqrt(first * second)
    assert found.area * pad.surface.stretch(x, y) == pytest.approx(on_surface, rel=0.05)
    middle = found.centroid
    assert np.hypot(middle.x - x, middle.y - y) < 0.1 * np.sqrt(found.area)


def test_a_plane_faces_the_apex_of_a_dome():
    found = curved_outline(
        [(HalfSpace(), Pose(np.zeros(3), np.diag([1.0, -1.0, -1.0])))], BULGES["dome"], facing_gap=GAP
    )
    # Where the dome is GAP / cosine of its slope below its apex: a cap of the sphere of 12 mm.
    assert found.area == pytest.approx(np.pi * 2 * 12e-3 * GAP, rel=0.01)


def test_what_is_beside_the_pad_faces_nothing():
    dome = BULGES["dome"]
    with pytest.raises(FootprintError, match="nothing of it is over the surface"):
        curved_outline([(Ellipsoid((1e-3, 1e-3, 1e-3)), Pose(np.array([9e-3, 0, 0]), np.eye(3)))], dome, facing_gap=GAP)
    with pytest.raises(FootprintError, match="nothing of it is over the surface"):
        curved_outline([ball_on(dome, 0.0, 0.0, 3e-3, lift=5e-3)], dome, facing_gap=GAP)
