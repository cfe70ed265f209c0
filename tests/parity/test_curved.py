"""Curved bodies pressed by the compiled core against the NumPy code: heights, search for the contact, its forces."""

import functools
import itertools

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import mjtactile
from mjtactile.compliance import surface_compliance
from mjtactile.envelope import TriangleSurface
from mjtactile.facing import LowerSurface, lower_surface
from mjtactile.footprint import FACING_GAP, REACH, Footprint
from mjtactile.foundation import foundation_springs
from mjtactile.gap import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose
from mjtactile.native import native_pad, without_native
from mjtactile.native_bodies import NativeBody
from mjtactile.options import contact_options
from mjtactile.region import Region
from mjtactile.search import Rectangle

PAD = mjtactile.Pad()
HERE = {0: Pose(np.zeros(3), np.eye(3))}
ROUGH = trimesh.creation.icosphere(2, radius=4e-3)
ROUGH.vertices[:, 2] *= 0.6
TORUS = trimesh.creation.torus(4e-3, 1.5e-3, major_sections=40, minor_sections=24)


def surface_of(solid: trimesh.Trimesh) -> TriangleSurface:
    return TriangleSurface(np.array(solid.vertices), np.array(solid.faces), closed=True)


SHAPES = {
    "ellipsoid": Ellipsoid((5e-3, 3e-3, 4e-3)),
    "sphere": Ellipsoid((5e-3, 5e-3, 5e-3)),
    "capsule": Capsule(3e-3, 2e-3),
    "long capsule": Capsule(3e-3, 2e-2),
    "cylinder": Cylinder(4e-3, 3e-3),
    "box": Box((4e-3, 3e-3, 5e-3)),
    "mesh": surface_of(ROUGH),
    "torus": surface_of(TORUS),
    "plane": HalfSpace(),
}
#: Lying as they do on a table, apart from what a test turns them by.
LYING = {"capsule": [0, 0.5, 0], "long capsule": [0, 0.5, 0], "cylinder": [0, 0.5, 0], "plane": [1, 0, 0]}


@functools.cache
def fast():
    return mjtactile.influence_matrices(PAD, preset="fast")


@pytest.fixture(scope="module")
def influence():
    return fast()


def touching(influence, name: str, x: float, y: float, turn: Rotation) -> tuple[Pose, LowerSurface]:
    """The pose of a shape that touches the sheet at first, and its lower surface."""
    shape, sheet = SHAPES[name], Rectangle(*influence.surface.sheet.bounds)
    rotation = (turn * Rotation.from_euler("xyz", np.pi * np.array(LYING.get(name, [0.0, 0.0, 0.0])))).as_matrix()
    high = Pose(np.array([x, y, 0.0]), rotation)
    pose = Pose(high.position - (0.0, 0.0, shape.lowest(high, sheet, -np.inf)), rotation)
    return pose, lower_surface([(shape, pose)], sheet, depth=PAD.thickness, facing_gap=FACING_GAP)


def native_body(name: str) -> NativeBody:
    return NativeBody({0: SHAPES[name]}, HERE, np.zeros((0, 3)), (PAD.thickness, REACH * PAD.thickness, FACING_GAP))


@pytest.mark.parametrize("name", SHAPES)
@settings(max_examples=10, deadline=None)
@given(
    place=st.tuples(st.floats(-5e-3, 5e-3), st.floats(-5e-3, 5e-3)),
    turn=st.tuples(*[st.floats(-0.6, 0.6)] * 3),
)
def test_heights(name, place, turn):
    pose, surface = touching(fast(), name, place[0], place[1], Rotation.from_euler("zyx", turn))
    points = np.random.default_rng(0).uniform(-7.5e-3, 7.5e-3, (500, 2))
    found = native_body(name).heights(pose, np.array(surface.sheet), points)
    assert found is not None
    expected = surface.gap(*points.T)
    expected = np.where(expected <= REACH * PAD.thickness, expected, np.inf)
    both = np.isfinite(found) & np.isfinite(expected)
    # What touches first is looked for in two ways, roughly in the core: it only says what is out of reach.
    assert (np.isfinite(found) != np.isfinite(expected)).mean() <= 0.03
    apart = found[both] - expected[both]
    assert np.abs(apart).max(initial=0.0) <= 0.1 * REACH * PAD.thickness
    assert np.abs(apart - apart.mean()).max(initial=0.0) <= 1e-12 if both.any() else name == "box"


@pytest.mark.parametrize(
    ("name", "law", "tilt"),
    [
        *itertools.product(["ellipsoid", "sphere", "capsule", "mesh"], ["elastic", "foundation"], ["free", "fixed"]),
        ("long capsule", "elastic", "free"),
        ("torus", "elastic", "free"),
    ],
)
def test_forces_are_those_of_the_reference(influence, name, law, tilt):
    native_pad(influence).set_foundation(*foundation_springs(surface_compliance(influence)))
    pose, surface = touching(influence, name, 0.7e-3, -1.1e-3, Rotation.from_euler("zyx", [0.5, 0.004, 0.01]))
    options = contact_options(influence, law=law, tilt=tilt, cells=60)
    with without_native():
        footprint = Footprint.from_gap(surface.gap, influence, lowest=0.0)
        force = np.array([0.02, -0.01, -0.25])
        moment = np.cross([*footprint.centroid, 0.0], force)
        moment[2] += 2e-5
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, law=law, tilt=tilt, cells=60)
    wrench, body = np.concatenate([force, moment]), native_body(name)
    found = body.nodal_forces(influence, pose, wrench, options)
    assert found is not None
    assert np.abs(found - load.forces).max() / np.abs(load.forces).max() <= 1e-6
    # Where the search begins does not matter much.
    elsewhere = Region.around(footprint.outline)
    again = body.nodal_forces(influence, pose, wrench, options, within=elsewhere)
    assert again is not None
    assert again.reshape(-1, 3).sum(axis=0) == pytest.approx(force, abs=1e-12)
    readings, expected = (native_pad(influence).readings(forces) for forces in (again, load.forces))
    assert np.abs(readings - expected).max() / expected.max() <= 0.06


@settings(max_examples=25, deadline=None)
@given(
    name=st.sampled_from(["sphere", "ellipsoid", "mesh", "capsule"]),
    place=st.tuples(st.floats(-7e-3, 7e-3), st.floats(-7e-3, 7e-3)),
    turn=st.tuples(st.floats(-3, 3), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
    force=st.floats(1e-4, 2.0),
)
def test_what_the_core_answers_carries_the_wrench(name, place, turn, force):
    influence = fast()
    pose, surface = touching(influence, name, place[0], place[1], Rotation.from_euler("zyx", turn))
    sheet = surface.sheet
    x, y = np.meshgrid(np.linspace(sheet.west, sheet.east, 200), np.linspace(sheet.south, sheet.north, 200))
    lowest = surface.gap(x, y).argmin()
    at = np.array([x.ravel()[lowest], y.ravel()[lowest], 0.0])
    wanted = np.array([0.1 * force, -0.05 * force, -force])
    wrench = np.concatenate([wanted, np.cross(at, wanted)])
    found = native_body(name).nodal_forces(influence, pose, wrench, contact_options(influence))
    if found is None:
        return
    assert found.reshape(-1, 3).sum(axis=0) == pytest.approx(wanted, abs=1e-9 * force)
    nodes = np.stack(np.meshgrid(influence.surface.x.nodes, influence.surface.y.nodes), axis=-1)
    moments = np.cross(np.dstack([nodes, np.zeros(nodes.shape[:2])]), found).reshape(-1, 3).sum(axis=0)
    # Where the force passes beside what can carry it, the nearest is carried: within a millimetre of the body's foot.
    assert np.abs(moments - wrench[3:]).max() <= 1e-3 * force


def test_what_ends_at_the_bodys_own_rim_is_left_to_the_reference(influence):
    """The ends of a cylinder that lies on the pad press with their edges."""
    pose, _ = touching(influence, "cylinder", 0.0, 0.0, Rotation.identity())
    wrench = np.array([0.0, 0.0, -0.5, 0.0, 0.0, 0.0])
    assert native_body("cylinder").nodal_forces(influence, pose, wrench, contact_options(influence)) is None


def test_a_body_beside_the_pad_is_left_to_the_reference(influence):
    pose = Pose(np.array([2e-2, 0.0, 5e-3]), np.eye(3))
    wrench = np.array([0.0, 0.0, -0.5, 0.0, 0.0, 0.0])
    assert native_body("sphere").nodal_forces(influence, pose, wrench, contact_options(influence)) is None
    assert native_body("sphere").heights(pose, np.array(influence.surface.sheet.bounds), np.zeros((1, 2))) is None


def test_cells_at_the_sheets_edge_end_there(influence):
    """A long capsule across a corner: the reference cuts its cells with shapely, the core by itself."""
    pose, surface = touching(influence, "long capsule", 5e-3, 5e-3, Rotation.from_euler("z", 2.4))
    with without_native():
        footprint = Footprint.from_gap(surface.gap, influence, lowest=0.0)
        force = np.array([0.0, 0.0, -0.3])
        moment = np.cross([*footprint.centroid, 0.0], force)
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, cells=60)
    found = native_body("long capsule").nodal_forces(
        influence, pose, np.concatenate([force, moment]), contact_options(influence, cells=60)
    )
    assert found is not None
    assert np.abs(found - load.forces).max() / np.abs(load.forces).max() <= 1e-6
    edge = shapely.box(*influence.surface.sheet.bounds).exterior
    assert edge.distance(shapely.Point(footprint.centroid)) < 3e-3
