"""A face pressed by the compiled core carries what the NumPy law finds on the same cells."""

import numpy as np
import pytest
from shapely import affinity

import mjtactile
from mjtactile.compliance import surface_compliance
from mjtactile.faces import BodyFace
from mjtactile.foundation import foundation_springs
from mjtactile.gap import Pose
from mjtactile.native import native_pad, without_native
from mjtactile.native_bodies import NativeFace

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


@pytest.mark.parametrize("through", [(4.1e-3, 0.0), (-6e-3, 5e-3), (0.2e-3, -2e-2)])
@pytest.mark.filterwarnings("ignore:the mean pressure")
def test_a_force_beside_the_face_presses_where_it_can(influence, through):
    outline, friction = mjtactile.indenter_outline("square", scale=0.8), None
    face = NativeFace(BodyFace(np.eye(3), 0.0, outline, 1e-2), 60)
    force, moment = np.array([0.0, 0.0, -0.05]), np.cross([*through, 0.0], [0.0, 0.0, -0.05])
    here = Pose(np.zeros(3), np.eye(3))
    found = face.nodal_forces(influence, here, np.concatenate([force, moment]), tilting=True, friction=friction)
    footprint = mjtactile.Footprint(outline, influence.surface)
    with without_native(), pytest.warns(mjtactile.ContactWarning, match="outside the area"):
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, cells=60, law="elastic")
    assert found is not None
    assert np.abs(found - load.forces).max() / np.abs(load.forces).max() <= 1e-6


@pytest.mark.parametrize("tilt", ["free", "fixed"])
def test_foundation_is_that_of_the_reference(influence, tilt):
    native_pad(influence).set_foundation(*foundation_springs(surface_compliance(influence)))
    outline = mjtactile.indenter_outline("star", scale=0.7)
    face = NativeFace(BodyFace(np.eye(3), 0.0, outline, 1e-2), 60)
    force, moment = np.array([0.02, 0.01, -0.5]), np.array([2e-4, -7e-4, 1e-5])
    wrench, here = np.concatenate([force, moment]), Pose(np.zeros(3), np.eye(3))
    found = face.nodal_forces(influence, here, wrench, tilting=tilt == "free", friction=None, law="foundation")
    with without_native():
        footprint = mjtactile.Footprint(outline, influence.surface)
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, cells=60, tilt=tilt, law="foundation")
    assert found is not None
    assert np.abs(found - load.forces).max() / np.abs(load.forces).max() <= 1e-9


@pytest.mark.parametrize("shape", ["circle", "doughnut", "star"])
def test_uniform_is_that_of_the_reference(influence, shape):
    outline, angle, shift = mjtactile.indenter_outline(shape, scale=0.8), -0.7, (2e-3, 3e-3)
    face = NativeFace(BodyFace(np.eye(3), 0.0, outline, 1e-2), 60)
    pose = Pose(np.array([*shift, 0.0]), turned(angle))
    force = np.array([0.03, -0.05, -0.6])
    moment = np.cross([2.2e-3, 2.9e-3, 0.0], force) + np.array([0.0, 0.0, 4e-5])
    wrench = np.concatenate([force, moment])
    found = face.nodal_forces(influence, pose, wrench, tilting=True, friction=None, law="uniform")
    placed = affinity.translate(affinity.rotate(outline, angle, origin=(0, 0), use_radians=True), *shift)
    with without_native():
        footprint = mjtactile.Footprint(placed, influence.surface)
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, law="uniform")
    assert found is not None
    # Cells of outlines with many corners leave some of these out.
    exact = 1e-9 if shape != "doughnut" else 1e-3
    assert np.abs(found - load.forces).max() / np.abs(load.forces).max() <= exact
    # A pressure that would pull somewhere ends before it does: that is for the reference.
    tipping = np.array([0.0, 0.0, -0.6, 0.0, 3e-3, 0.0])
    assert face.nodal_forces(influence, pose, tipping, tilting=True, friction=None, law="uniform") is None


def test_what_the_core_leaves_to_the_reference(influence):
    face = NativeFace(BodyFace(np.eye(3), 0.0, mjtactile.indenter_outline("circle"), 1e-2), 60)
    here = Pose(np.zeros(3), np.eye(3))
    pulled, slipping = np.array([0, 0, 0.5, 0, 0, 0]), np.array([0.4, 0, -0.5, 0, 0, 0])
    for wrench, friction in ((pulled, None), (slipping, 0.5)):
        assert face.nodal_forces(influence, here, wrench, tilting=True, friction=friction) is None
    lean = turned(0.0) @ np.array([[1, 0, 0], [0, np.cos(0.1), -np.sin(0.1)], [0, np.sin(0.1), np.cos(0.1)]])
    assert face.nodal_forces(influence, Pose(np.zeros(3), lean), slipping, tilting=True, friction=None) is None
