"""Bodies in the compiled core: their lower surfaces against closed forms, their contacts against footprints."""

from __future__ import annotations

import ctypes
import functools

import numpy as np
import pytest
import shapely
import trimesh
from core_calls import pose_numbers, press_body, shape_numbers
from curved_pads import BULGES
from hypothesis import given, settings
from hypothesis import strategies as st
from lower_surfaces import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose, Rectangle, Shape, TriangleMesh
from scipy.spatial.transform import Rotation
from shapely import affinity, box

import mjtactile
from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.contact.core_pad import contact_pad, give_springs
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.foundation import foundation_springs
from mjtactile.contact.laws import BY_NAME as LAWS
from mjtactile.dataset.shapes import sphere_height
from mjtactile.geometry.lower_surface import LowerSurface
from mjtactile.geometry.outlines import ellipse

pytestmark = pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")
HALF = 7.5e-3
LINE = np.linspace(-HALF, HALF, 301)
SHEET = Rectangle(-HALF, -HALF, HALF, HALF)
#: Between these the core looks [m].
FLOOR, CEILING = -5e-3, 20e-3
CELLS = 60
ROUGH = trimesh.creation.icosphere(2, radius=4e-3)
BALL = trimesh.creation.icosphere(3, radius=2e-3)
TORUS = trimesh.creation.torus(4e-3, 1.5e-3, major_sections=40, minor_sections=24)
CUBE = trimesh.creation.box(extents=(6e-3, 4e-3, 8e-3))
SHAPES: dict[str, Shape | trimesh.Trimesh] = {
    "sphere": Ellipsoid((5e-3, 5e-3, 5e-3)),
    "ellipsoid": Ellipsoid((5e-3, 3e-3, 4e-3)),
    "capsule": Capsule(3e-3, 2e-3),
    "long capsule": Capsule(3e-3, 2e-2),
    "cylinder": Cylinder(4e-3, 3e-3),
    "box": Box((4e-3, 3e-3, 5e-3)),
    "plane": HalfSpace(),
    "mesh": ROUGH,
    "torus": TORUS,
    "cube mesh": CUBE,
    "fine cube mesh": CUBE.subdivide().subdivide().subdivide(),
    "two ball meshes, one 2 mm higher": BALL.copy().apply_translation([-4e-3, 0.0, 0.0])
    + BALL.copy().apply_translation([4e-3, 0.0, 2e-3]),
}
#: Lying as they do on a table, half turns about x, y and z.
LYING = {"capsule": (0, 0.5, 0), "long capsule": (0, 0.5, 0), "plane": (1, 0, 0)}


def in_single(solid: trimesh.Trimesh) -> TriangleMesh:
    """A mesh as MuJoCo keeps it."""
    return TriangleMesh(np.asarray(solid.vertices).astype(np.float32).astype(float), np.asarray(solid.faces))


def reference(name: str) -> Shape:
    shape = SHAPES[name]
    return in_single(shape) if isinstance(shape, trimesh.Trimesh) else shape


def posed(name: str, x: float, y: float, turn: Rotation) -> Pose:
    """Where a shape just touches the sheet, to what it rises between the points of a fine grid."""
    rotation = (turn * Rotation.from_euler("xyz", np.pi * np.array(LYING.get(name, (0.0, 0.0, 0.0))))).as_matrix()
    across, along = (line.ravel() for line in np.meshgrid(LINE, LINE))
    heights = reference(name).heights(Pose(np.array([x, y, 0.0]), rotation), across, along, -np.inf)
    return Pose(np.array([x, y, -heights.min()]), rotation)


class CoreBody:
    """A body of one shape, as the core holds it."""

    def __init__(self, name: str) -> None:
        shape = SHAPES[name]
        is_mesh = isinstance(shape, trimesh.Trimesh)
        self._surface = LowerSurface.of_solid(shape) if is_mesh else LowerSurface._of_shape(*shape_numbers(shape))
        self.handle = self._surface.handle

    def heights(self, pose: Pose, points: Array, ceiling: float = CEILING) -> Array | None:
        """Lower surface over points (count, 2) [m]; None where nothing of it is over the sheet."""
        found, where, sheet, points = np.empty(len(points)), pose_numbers(pose), np.array(SHEET), contiguous(points)
        there = library().mjt_body_heights(
            self.handle,
            pointer(where),
            pointer(sheet),
            ctypes.c_double(FLOOR),
            ctypes.c_double(ceiling),
            ctypes.c_size_t(len(points)),
            pointer(points),
            pointer(found),
        )
        return found if there else None

    def press(self, influence: mjtactile.InfluenceMatrices, pose: Pose, wrench: Array, law: str) -> tuple[Array, Array]:
        """Nodal forces (nodes y, nodes x, 3) [N], and the wrench carried (6,)."""
        return press_body(influence, self.handle, pose, wrench, law=law, cells=CELLS)


@functools.cache
def fast() -> mjtactile.InfluenceMatrices:
    influence = mjtactile.influence_matrices(fidelity="fast")
    give_springs(contact_pad(influence), *foundation_springs(influence))
    return influence


@pytest.mark.parametrize("name", SHAPES)
@settings(max_examples=15, deadline=None)
@given(
    place=st.tuples(st.floats(-5e-3, 5e-3), st.floats(-5e-3, 5e-3)),
    turn=st.tuples(st.floats(-3, 3), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)),
)
def test_heights_are_those_of_the_reference(name, place, turn):
    pose = posed(name, place[0], place[1], Rotation.from_euler("zyx", turn))
    points = np.random.default_rng(0).uniform(-HALF, HALF, (500, 2))
    found = CoreBody(name).heights(pose, points)
    assert found is not None
    expected = reference(name).heights(pose, points[:, 0], points[:, 1], FLOOR)
    assert np.isfinite(expected).any()
    np.testing.assert_allclose(found, np.where(expected <= CEILING, expected, np.inf), rtol=0, atol=1e-12)


def test_a_leaning_torus_has_heights_up_to_its_far_outline():
    pose = posed("torus", 0.0, 0.0, Rotation.from_euler("zyx", (0.0, 0.5, 0.5)))
    points = np.array([[-0.00339226, 0.00303978], [-0.0033429, 0.00309162]])
    expected = reference("torus").heights(pose, points[:, 0], points[:, 1], FLOOR)
    assert np.isfinite(expected).all()
    found = CoreBody("torus").heights(pose, points, ceiling=20e-3)
    assert found is not None
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_a_mesh_that_hangs_low_has_heights_where_it_meets_the_surface():
    """Over a curved pad, or beside a rim, its lowest point is far below the place where it touches."""
    pose = Pose(np.array([0.0, 0.0, 1.7e-3]), Rotation.from_euler("y", 40, degrees=True).as_matrix())
    points = np.column_stack([np.linspace(-4.5e-3, -0.8e-3, 40), np.zeros(40)])
    expected = reference("fine cube mesh").heights(pose, points[:, 0], points[:, 1], FLOOR)
    assert expected.min() < -2.5e-3
    assert (np.abs(expected) < 1e-4).any()
    found = CoreBody("fine cube mesh").heights(pose, points, ceiling=5e-3)
    assert found is not None
    touching = expected < 1e-3
    np.testing.assert_allclose(found[touching], expected[touching], rtol=0, atol=1e-12)


def test_a_mesh_tilts_onto_a_part_that_is_high_above_the_pad():
    """The load acts between two balls, so each of them carries a part, though only one of them touches at first.

    The body tilts by 2 in 8 mm. Both balls then touch beside their middles, where they have this slope.
    """
    influence = fast()
    wrench = np.array([0.0, 0.0, -0.5, 0.0, 0.0, 0.0])
    name = "two ball meshes, one 2 mm higher"
    forces, carried = CoreBody(name).press(influence, posed(name, 0.0, 0.0, Rotation.identity()), wrench, "elastic")
    np.testing.assert_allclose(carried, wrench, rtol=0, atol=1e-9)
    right = influence.surface.x.nodes > 0.0
    aside = 2e-3 * np.sin(np.arctan(2.0 / 8.0))
    assert forces[:, right, 2].sum() == pytest.approx(wrench[2] * (4e-3 - aside) / 8e-3, rel=0.05)


def on_two_edges(seed: int) -> tuple[trimesh.Trimesh, Array]:
    """A body that stands on two parallel edges, one higher and leaning, and a load between them (6,) [N, N m]."""
    random = np.random.default_rng(seed)
    apart, length = random.uniform(1.5e-3, 4e-3), random.uniform(1.5e-3, 5e-3)
    higher = np.exp(random.uniform(np.log(1e-6), np.log(2e-4)))
    edges = []
    for y, height, slope in ((-apart / 2, 0.0, 0.0), (apart / 2, higher, random.normal(0.0, 4e-3))):
        ends = [(x, y, height + slope * x) for x in (-length / 2, length / 2)]
        top = [(x, y + side, height + 1.5e-4) for x in (-length / 2, length / 2) for side in (-6e-4, 6e-4)]
        edges.append(trimesh.Trimesh([*ends, *top]).convex_hull)
    yaw, share = random.uniform(0.0, np.pi), random.uniform(0.05, 0.95)
    turn = Rotation.from_euler("z", yaw)
    force = np.array([0.0, 0.0, -np.exp(random.uniform(np.log(3e-3), np.log(0.2)))])
    body = edges[0] + edges[1]
    body.apply_transform(trimesh.transformations.rotation_matrix(yaw, (0.0, 0.0, 1.0)))
    return body, np.concatenate([force, np.cross(turn.apply([0.0, (share - 0.5) * apart, 0.0]), force)])


@pytest.mark.parametrize("seed", [31, 52, 73, 97, 153, 157, 170, 186, 196, 219, 249, 304])
def test_a_load_between_two_edges_is_carried_by_both(monkeypatch, seed):
    """One edge alone cannot carry it, though the search sees only that one at first, or cells that miss the other."""
    body, wrench = on_two_edges(seed)
    monkeypatch.setitem(SHAPES, "edges", body)
    _, carried = CoreBody("edges").press(fast(), posed("edges", 0.0, 0.0, Rotation.identity()), wrench, "elastic")
    np.testing.assert_allclose(carried, wrench, rtol=0, atol=1e-9 * abs(wrench[2]))


def test_a_body_beside_the_sheet_has_no_heights():
    assert CoreBody("sphere").heights(Pose(np.array([0.02, 0.0, 5e-3]), np.eye(3)), np.zeros((1, 2))) is None


FORCE = np.array([0.02, -0.01, -0.25])


#: What faces the pad of bodies that stand on it.
FACES = {
    "box": box(-4e-3, -3e-3, 4e-3, 3e-3),
    "cylinder": ellipse(4e-3, 4e-3),
    "cube mesh": box(-3e-3, -2e-3, 3e-3, 2e-3),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", FACES)
def test_flat_faces_press_as_footprints_do(name, law):
    influence = fast()
    pose = posed(name, 0.7e-3, -1.1e-3, Rotation.from_euler("z", 0.5))
    outline = affinity.translate(affinity.rotate(FACES[name], 0.5, (0, 0), use_radians=True), 0.7e-3, -1.1e-3)
    # The core's own circle has other corners, and corners of a mesh are in single precision.
    tolerance = {"box": 1e-9, "cylinder": 5e-3, "cube mesh": 1e-5}[name]
    check(name, pose, Footprint.from_outline(outline, influence.surface), law, tolerance)


@pytest.mark.parametrize("law", ["elastic", "foundation"])
@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "mesh"])
def test_curved_bodies_press_as_footprints_do(name, law):
    influence = fast()
    pose = posed(name, 0.7e-3, -1.1e-3, Rotation.from_euler("zyx", (0.5, 0.004, 0.01)))

    def gap(x: Array, y: Array) -> Array:
        return reference(name).heights(pose, x.ravel(), y.ravel(), FLOOR).reshape(x.shape)

    # What is looked at ends at the body there, and where it is out of reach here: cells lie otherwise.
    check(name, pose, Footprint.from_gap(gap, influence.surface), law, 5e-3)


def check(name: str, pose: Pose, footprint: Footprint, law: str, tolerance: float) -> None:
    """A body pressed at its footprint's middle is read in both ways alike, and carries the wrench."""
    influence = fast()
    moment = np.cross([*footprint.centroid, 0.0], FORCE)
    moment[2] += 2e-5
    load = mjtactile.contact_load(influence, footprint, FORCE, moment=moment, law=law, cells=CELLS)
    expected = influence.readings(load)
    wrench = np.concatenate([FORCE, moment])
    forces, carried = CoreBody(name).press(influence, pose, wrench, law)
    np.testing.assert_allclose(carried, wrench, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(forces.sum(axis=(0, 1)), FORCE, rtol=1e-9)
    found = contact_pad(influence).readings(forces)
    assert np.linalg.norm(found - expected) <= tolerance * np.linalg.norm(expected)


@pytest.mark.parametrize("name", ["dome", "tip"])
def test_a_ball_at_a_leaning_rim_presses_as_its_footprint_does(monkeypatch, name):
    """Part of it touches from beside the sheet, as seen from above; readings are .64 and .78 % off without."""
    influence = mjtactile.influence_matrices(BULGES[name], fidelity="fast")
    outer, place, radius = influence.surface.outer, (5.9e-3, 1e-3), 4e-3
    centre = outer.positions(*place, -radius)
    force = -0.2 * outer.normals(*place)
    wrench = np.concatenate([force, np.cross(outer.positions(*place), force)])
    footprint = Footprint.from_height(sphere_height(radius, centre), influence.surface)
    load = mjtactile.contact_load(influence, footprint, force, moment=wrench[3:], law="elastic", cells=CELLS)
    monkeypatch.setitem(SHAPES, "ball", Ellipsoid((radius, radius, radius)))
    forces, carried = CoreBody("ball").press(influence, Pose(centre, np.eye(3)), wrench, "elastic")
    np.testing.assert_allclose(carried, wrench, atol=1e-9)
    expected, found = influence.readings(load), contact_pad(influence).readings(forces)
    assert np.linalg.norm(found - expected) <= 2e-3 * np.linalg.norm(expected)


def test_law_uniform_on_a_whole_face_is_exact():
    """It needs no cells: a pressure that is linear over the face."""
    influence = fast()
    footprint = Footprint.from_outline(box(-4e-3, -3e-3, 4e-3, 3e-3), influence.surface)
    moment = np.array([1e-4, -2e-4, 0.0])
    forces, _ = CoreBody("box").press(
        influence, posed("box", 0.0, 0.0, Rotation.identity()), np.concatenate([FORCE, moment]), "uniform"
    )
    load = mjtactile.contact_load(influence, footprint, FORCE, moment=moment, law="uniform")
    np.testing.assert_allclose(forces, load.forces, atol=1e-9 * np.abs(load.forces).max())


def test_a_part_of_a_ring_presses_as_its_mirror_image_does():
    """A ring has more edges than are looked at for every point: all of them count, on either side of the pad."""
    influence = fast()
    ring = shapely.Point(0.0, 0.0).buffer(5e-3, 16).difference(shapely.Point(0.0, 0.0).buffer(4e-3, 16))
    footprint = Footprint.from_outline(ring, influence.surface)
    force = np.array([0.0, 0.0, -0.5])
    found = []
    for side in (1.0, -1.0):
        moment = np.cross([0.0, side * 4.9e-3, 0.0], force)
        load = mjtactile.contact_load(influence, footprint, force, moment=moment, law="elastic", cells=CELLS)
        found.append(load.forces[..., 2])
        assert found[-1].sum() == pytest.approx(force[2], rel=1e-9)
    forces, mirrored = found
    assert np.abs(forces - mirrored[::-1]).max() <= 1e-6 * np.abs(forces).max()
