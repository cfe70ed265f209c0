"""A face pressed by the compiled core carries what the NumPy law finds on the same cells."""

import numpy as np
import pytest
from shapely import affinity

import mjtactile
from mjtactile.faces import BodyFace, NativeFace
from mjtactile.gap import Pose
from mjtactile.native import without_native

PAD = mjtactile.Pad()


@pytest.fixture(scope="module")
def influence():
    return mjtactile.influence_matrices(PAD, preset="fast")


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("shape", mjtactile.INDENTER_NAMES)
@pytest.mark.parametrize("tilt", ["free", "fixed"])
def test_forces_are_those_of_the_reference(influence, shape, tilt):
    outline, angle, shift = mjtactile.indenter_outline(shape, scale=0.8), 0.4, (1e-3, -0.6e-3)
    face = NativeFace(BodyFace(np.eye(3), 0.0, outline, 1e-2), 60)
    pose = Pose(np.array([*shift, 0.0]), turned(angle))
    force, moment = np.array([0.03, -0.05, -0.6]), np.array([4e-4, 8e-4, 3e-5])
    found = face.nodal_forces(influence, pose, np.concatenate([force, moment]), tilting=tilt == "free", friction=None)
    placed = affinity.translate(affinity.rotate(outline, angle, origin=(0, 0), use_radians=True), *shift)
    with without_native():
        # Not from_outline: cutting at the sheet begins the outline elsewhere, and the cells with it.
        footprint = mjtactile.Footprint(placed, influence.surface)
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, cells=60, tilt=tilt, law="elastic")
    assert found is not None
    assert np.abs(found - load.forces).max() / np.abs(load.forces).max() <= 1e-9


def test_what_the_core_leaves_to_the_reference(influence):
    face = NativeFace(BodyFace(np.eye(3), 0.0, mjtactile.indenter_outline("circle"), 1e-2), 60)
    here = Pose(np.zeros(3), np.eye(3))
    pulled, outside, slipping = (np.array(w) for w in (
        (0, 0, 0.5, 0, 0, 0), (0, 0, -0.5, 0, 3e-3, 0), (0.4, 0, -0.5, 0, 0, 0),
    ))  # fmt: skip
    for wrench, friction in ((pulled, None), (outside, None), (slipping, 0.5)):
        assert face.nodal_forces(influence, here, wrench, tilting=True, friction=friction) is None
    lean = turned(0.0) @ np.array([[1, 0, 0], [0, np.cos(0.1), -np.sin(0.1)], [0, np.sin(0.1), np.cos(0.1)]])
    assert face.nodal_forces(influence, Pose(np.zeros(3), lean), slipping, tilting=True, friction=None) is None
