"""Heights of lower surfaces in random poses, against MuJoCo's own ray casting."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from lower_surfaces import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose, TriangleMesh
from scipy.spatial.transform import Rotation

from mjtactile.geometry.indenter import indenter_solid

FLOOR = -1.0
MILLIMETRE = 1e-3
#: Rotations for which closed forms divide by nothing: upright, on each side, upside down, and all but so.
SPECIAL = [
    *Rotation.from_euler("xyz", [[0, 0, 0], [90, 0, 0], [0, 90, 0], [180, 0, 30], [45, 0, 0]], degrees=True),
    *Rotation.from_euler("xyz", [[1e-9, 0, 0], [90, 1e-9, 0], [0, 1e-13, 0]]),
]
PRIMITIVES = {
    "sphere": ("0.004", Ellipsoid((4e-3, 4e-3, 4e-3))),
    "capsule": ("0.002 0.004", Capsule(2e-3, 4e-3)),
    "ellipsoid": ("0.002 0.003 0.006", Ellipsoid((2e-3, 3e-3, 6e-3))),
    "cylinder": ("0.003 0.002", Cylinder(3e-3, 2e-3)),
    "box": ("0.002 0.003 0.005", Box((2e-3, 3e-3, 5e-3))),
}


def poses(count: int, seed: int = 0) -> list[Pose]:
    random = np.random.default_rng(seed)
    turns = [*SPECIAL, *Rotation.random(count, rng=random)]
    return [Pose(random.uniform(-5e-3, 5e-3, 3), turn.as_matrix()) for turn in turns]


def points(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.random.default_rng(seed).uniform(-7.5e-3, 7.5e-3, (2, count))
    return x, y


def one_geom(geom: str, assets: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><asset>{assets}</asset><worldbody><geom {geom}/></worldbody></mujoco>"
    )


def mesh_asset(name: str) -> str:
    solid = indenter_solid(name)
    vertices, faces = (" ".join(map(repr, a.ravel().tolist())) for a in (solid.vertices, solid.faces))
    return f'<mesh name="m" vertex="{vertices}" face="{faces}" inertia="exact"/>'


def mesh_of(model: mujoco.MjModel, *, closed: bool = True) -> TriangleMesh:
    return TriangleMesh(model.mesh_vert.astype(float), model.mesh_face, closed=closed)


def placed(model: mujoco.MjModel, pose: Pose) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.geom_xpos[0], data.geom_xmat[0] = pose.position, pose.rotation.ravel()
    return data


def cast(ray, x: np.ndarray, y: np.ndarray, start: float = -0.1) -> np.ndarray:
    """Heights by single rays upwards from z = start, where `ray(point, up)` is their length or negative."""
    up = np.array([0.0, 0.0, 1.0])
    lengths = np.array([ray(np.array([a, b, start]), up) for a, b in zip(x, y, strict=True)])
    return np.where(lengths < 0.0, np.inf, lengths + start)


def assert_same_heights(ours: np.ndarray, theirs: np.ndarray, tolerance: float, at_the_rim: int = 0) -> None:
    """Up to `at_the_rim` points may be above the body for one and beside it for the other."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    assert (np.isfinite(ours) ^ np.isfinite(theirs)).sum() <= at_the_rim
    np.testing.assert_allclose(ours[both], theirs[both], rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("kind", PRIMITIVES)
def test_primitives_are_as_high_as_rays_say(kind):
    size, shape = PRIMITIVES[kind]
    model = one_geom(f'type="{kind}" size="{size}"')
    number = int(model.geom_type[0])
    x, y = points(150)
    hits = 0
    for pose in poses(25):
        ours = shape.heights(pose, x, y, FLOOR)
        rotation, size = pose.rotation.ravel(), model.geom_size[0]
        theirs = cast(
            lambda p, up, at=pose.position, r=rotation, s=size: mujoco.mju_rayGeom(at, r, s, p, up, number), x, y
        )
        # Steep flanks magnify the rays' own rounding.
        assert_same_heights(ours, theirs, 1e-12, at_the_rim=1)
        hits += np.isfinite(ours).sum()
    assert hits > 300


def test_a_plane_is_as_high_as_its_equation_and_counts_only_from_in_front():
    x, y = points(50)
    for pose in poses(25):
        normal = pose.rotation[:, 2]
        heights = HalfSpace().heights(pose, x, y, -np.inf)
        if normal[2] >= -1e-12:
            assert np.isinf(heights).all()
            continue
        distance = (np.column_stack([x, y, heights]) - pose.position) @ normal
        np.testing.assert_allclose(distance, 0.0, atol=1e-14)


@pytest.mark.parametrize("name", ["star", "doughnut"])
def test_meshes_are_as_high_as_rays_say_notches_and_holes_included(name):
    model = one_geom('type="mesh" mesh="m"', mesh_asset(name))
    surface = mesh_of(model)
    x, y = points(150)
    hull = missed = 0
    for pose in poses(15):
        data = placed(model, pose)
        theirs = cast(lambda p, up, d=data: mujoco.mj_rayMesh(model, d, 0, p, up), x, y)
        assert_same_heights(surface.heights(pose, x, y, FLOOR), theirs, 1e-12)
        hull += len(x)
        missed += np.isinf(theirs).sum()
    assert 0.1 * hull < missed < 0.95 * hull
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)  # MuJoCo turns meshes to their principal axes
    upright = Pose(data.geom_xpos[0], data.geom_xmat[0].reshape(3, 3))
    middle = surface.heights(upright, np.zeros(2), np.array([0.0, -4e-3]), FLOOR)
    # The star's notch between its lower arms is open as the doughnut's hole is.
    assert np.isfinite(middle).tolist() == [name == "star", name == "doughnut"]


def test_both_sides_of_an_open_mesh_count():
    mesh = '<mesh name="m" vertex="0 0 0 .004 0 0 0 .004 0 0 0 .004" face="0 2 1 0 1 3 0 3 2"/>'
    model = one_geom('type="mesh" mesh="m"', mesh)
    surface = mesh_of(model, closed=False)
    x, y = points(200)
    for pose in poses(6):
        data = placed(model, pose)
        theirs = cast(lambda p, up, d=data: mujoco.mj_rayMesh(model, d, 0, p, up), x, y)
        assert_same_heights(surface.heights(pose, x, y, FLOOR), theirs, 1e-12)


def test_a_spheres_gap_is_half_the_square_of_the_distance_over_its_radius():
    radius = 6e-3
    shape, pose = Ellipsoid((radius, radius, radius)), Pose(np.array([1e-3, -2e-3, radius]), np.eye(3))
    r = np.linspace(0.0, 0.2e-3, 20)
    gap = shape.heights(pose, 1e-3 + r, np.full(20, -2e-3), FLOOR)
    np.testing.assert_allclose(gap, r**2 / (2 * radius), rtol=3e-4, atol=1e-15)


def test_a_cylinder_on_its_side_is_a_circle_across_and_straight_along():
    turn = (Rotation.from_euler("z", 30, degrees=True) * Rotation.from_euler("y", 90, degrees=True)).as_matrix()
    shape, pose = Cylinder(3e-3, 4e-3), Pose(np.array([0.0, 0.0, 3e-3]), turn)
    along, across = np.meshgrid(np.linspace(-3.9e-3, 3.9e-3, 9), np.linspace(-2.9e-3, 2.9e-3, 9))
    axis, normal = turn[:2, 2], np.array([-turn[1, 2], turn[0, 2]])
    at = along.ravel()[:, None] * axis + across.ravel()[:, None] * normal
    expected = 3e-3 - np.sqrt(9e-6 - across.ravel() ** 2)
    np.testing.assert_allclose(shape.heights(pose, at[:, 0], at[:, 1], FLOOR), expected, atol=1e-15)
    beyond = np.array([[4.1e-3, -4.1e-3]]).T * axis
    assert np.isinf(shape.heights(pose, beyond[:, 0], beyond[:, 1], FLOOR)).all()


def test_an_edge_of_a_box_is_a_roof_and_a_corner_a_pyramid():
    half, x = 2e-3, np.linspace(-1e-3, 1e-3, 11)
    edge = Pose(np.array([0.0, 0.0, half * np.sqrt(2)]), Rotation.from_euler("x", 45, degrees=True).as_matrix())
    roof = Box((half, half, half)).heights(edge, np.zeros(11), x, FLOOR)
    np.testing.assert_allclose(roof, np.abs(x), atol=1e-15)
    corner = Rotation.align_vectors([[0.0, 0.0, -1.0]], [[1.0, 1.0, 1.0]])[0].as_matrix()
    pyramid = Pose(np.array([0.0, 0.0, half * np.sqrt(3)]), corner)
    turns = 2 * np.pi * np.arange(6) / 6 + np.arctan2(corner[1, 0], corner[0, 0])
    heights = Box((half, half, half)).heights(pyramid, 1e-3 * np.cos(turns), 1e-3 * np.sin(turns), FLOOR)
    # Edges rise by 1/sqrt 2 per length, faces between them by sqrt 2 halved by the angle.
    np.testing.assert_allclose(np.sort(heights), 1e-3 * np.repeat([1 / np.sqrt(2), np.sqrt(2)], 3), atol=1e-15)


def test_what_is_below_the_floor_is_not_above_the_pad():
    pose = Pose(np.array([0.0, 0.0, -1e-3]), np.eye(3))
    x = np.array([0.0, 3.9e-3])
    assert np.isfinite(Ellipsoid((4e-3, 4e-3, 4e-3)).heights(pose, x, x * 0, -2.5e-3)).tolist() == [False, True]
    assert np.isinf(Box((4e-3, 4e-3, 4e-3)).heights(pose, x, x * 0, -2.5e-3)).all()
    assert np.isinf(Capsule(4e-3, 4e-3).heights(pose, x, x * 0, -2.5e-3)).all()
    mesh = mesh_of(one_geom('type="mesh" mesh="m"', mesh_asset("octagon")))
    assert np.isinf(mesh.heights(pose, x, x * 0, -2.5e-3)).all()
    assert np.isfinite(mesh.heights(pose, x * 0, x * 0, -9e-3)).all()
