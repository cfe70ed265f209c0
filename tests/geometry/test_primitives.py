"""Heights of every kind of geom's lower surface, in random poses, against MuJoCo's own ray casting."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjtactile.geometry.height_minimum import Rectangle
from mjtactile.geometry.indenter import indenter_solid
from mjtactile.geometry.primitives import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose
from mjtactile.geometry.triangle_mesh import TriangleSurface
from mjtactile.sim.geoms import geom_shape

SHEET = Rectangle(-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)
FLOOR = -1.0
MILLIMETRE = 1e-3
#: Rotations for which closed forms divide by nothing: upright, on each side, upside down, and all but so.
SPECIAL = [
    *Rotation.from_euler("xyz", [[0, 0, 0], [90, 0, 0], [0, 90, 0], [180, 0, 30], [45, 0, 0]], degrees=True),
    *Rotation.from_euler("xyz", [[1e-9, 0, 0], [90, 1e-9, 0], [0, 1e-13, 0]]),
]
PRIMITIVES = {
    "sphere": "0.004",
    "capsule": "0.002 0.004",
    "ellipsoid": "0.002 0.003 0.006",
    "cylinder": "0.003 0.002",
    "box": "0.002 0.003 0.005",
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
    model = one_geom(f'type="{kind}" size="{PRIMITIVES[kind]}"')
    shape, number = geom_shape(model, 0), int(model.geom_type[0])
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
    surface = geom_shape(model, 0)
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


def test_a_mesh_slides_and_turns_on_the_pad_without_new_work_and_tilts_a_little_in_the_same_grid():
    surface = geom_shape(one_geom('type="mesh" mesh="m"', mesh_asset("star")), 0)
    x, y = points(100)
    turn = Rotation.from_euler("xyz", [0.3, -0.2, 0.1])
    pose = Pose(np.array([1e-3, 0.0, 5e-3]), turn.as_matrix())
    assert isinstance(surface, TriangleSurface)
    surface.heights(pose, x, y, FLOOR)
    view, grid = surface._view, surface._grid
    spin = Rotation.from_euler("z", 0.7)
    slide = np.array([2e-3, -1e-3, 1e-4])
    moved = Pose(spin.apply(pose.position) + slide, (spin * turn).as_matrix())
    turned = spin.apply(np.column_stack([x, y, np.zeros(100)])) + slide
    expected = surface.heights(pose, x, y, FLOOR) + 1e-4
    np.testing.assert_allclose(surface.heights(moved, turned[:, 0], turned[:, 1], FLOOR), expected, atol=1e-15)
    assert surface._view is view
    for angle, same in ((5e-4, True), (5e-3, False)):
        tilted = Pose(pose.position, (Rotation.from_euler("x", angle) * turn).as_matrix())
        ours = surface.heights(tilted, x, y, FLOOR)
        anew = geom_shape(one_geom('type="mesh" mesh="m"', mesh_asset("star")), 0)
        np.testing.assert_allclose(ours, anew.heights(tilted, x, y, FLOOR), atol=1e-15)
        assert (surface._grid is grid) == same


def test_both_sides_of_an_open_mesh_count():
    mesh = '<mesh name="m" vertex="0 0 0 .004 0 0 0 .004 0 0 0 .004" face="0 2 1 0 1 3 0 3 2"/>'
    surface = geom_shape(one_geom('type="mesh" mesh="m"', mesh), 0)
    model = one_geom('type="mesh" mesh="m"', mesh)
    x, y = points(200)
    for pose in poses(6):
        data = placed(model, pose)
        theirs = cast(lambda p, up, d=data: mujoco.mj_rayMesh(model, d, 0, p, up), x, y)
        assert_same_heights(surface.heights(pose, x, y, FLOOR), theirs, 1e-12)


def height_field() -> mujoco.MjModel:
    asset = '<hfield name="h" nrow="7" ncol="5" size=".006 .005 .003 .001"/>'
    model = one_geom('type="hfield" hfield="h"', asset)
    model.hfield_data[:] = np.random.default_rng(2).random(35)
    return model


def test_height_fields_are_as_high_as_rays_say():
    model = height_field()
    surface = geom_shape(model, 0)
    x, y = points(200)
    facing_down = Pose(np.array([1e-3, 0.0, 4e-3]), np.diag([1.0, -1.0, -1.0]))
    for pose in (facing_down, *poses(10)):
        data = placed(model, pose)
        theirs = cast(lambda p, up, d=data: mujoco.mj_rayHfield(model, d, 0, p, up), x, y)
        assert_same_heights(surface.heights(pose, x, y, FLOOR), theirs, 1e-12)


TORUS = """<mujoco><extension><plugin plugin="mujoco.sdf.torus"><instance name="t">
    <config key="radius1" value="0.005"/><config key="radius2" value="0.002"/></instance></plugin></extension>
    <asset><mesh name="t"><plugin instance="t"/></mesh></asset>
    <worldbody><geom type="sphere" size="0.0005"/>
    <body><freejoint/><geom type="sdf" mesh="t" mass="0.01" group="3"><plugin instance="t"/></geom></body></worldbody>
    </mujoco>"""


def test_a_signed_distance_function_is_seen_through_rays():
    """A torus: its lowest point over a circle in the middle of its tube is one tube radius under its plane."""
    surface = geom_shape(mujoco.MjModel.from_xml_string(TORUS), 1)
    pose = Pose(np.array([1e-3, 0.0, 2.5e-3]), np.eye(3))
    radius = np.array([0.0, 2.9e-3, 3.5e-3, 5e-3, 6e-3, 6.9e-3, 7.1e-3])
    x, y = 1e-3 + radius * np.cos(2.0), radius * np.sin(2.0)
    over = np.abs(radius - 5e-3) < 2e-3
    tube = np.where(over, 2.5e-3 - np.sqrt(np.maximum(4e-6 - (radius - 5e-3) ** 2, 0.0)), np.inf)
    # MuJoCo follows a ray to the surface within 1e-7 of the model's unit, a metre.
    np.testing.assert_allclose(surface.heights(pose, x, y, FLOOR), tube, atol=3e-7)
    assert surface.lowest(pose, SHEET, FLOOR) == pytest.approx(0.5e-3, abs=3e-7)
    assert np.isinf(surface.heights(pose, x, y, 0.6e-3)).tolist() == [*~over[:3], True, *~over[4:]]


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


@pytest.mark.parametrize("kind", [*PRIMITIVES, "star", "doughnut", "hfield"])
def test_the_least_height_over_a_sheet_is_found_wherever_the_body_is(kind):
    """Against a fine grid, which can only be higher, and by no more than a steep flank rises within a step."""
    if kind in PRIMITIVES:
        model = one_geom(f'type="{kind}" size="{PRIMITIVES[kind]}"')
    else:
        model = height_field() if kind == "hfield" else one_geom('type="mesh" mesh="m"', mesh_asset(kind))
    shape = geom_shape(model, 0)
    sheet = Rectangle(-2e-3, -1.5e-3, 2e-3, 1.5e-3)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-2e-3, 2e-3, 121), np.linspace(-1.5e-3, 1.5e-3, 91)))
    found = 0
    for pose in poses(25, seed=3):
        lowest, on_grid = shape.lowest(pose, sheet, FLOOR), shape.heights(pose, x, y, FLOOR).min()
        if not np.isfinite(lowest):
            assert np.isinf(on_grid)
            continue
        found += 1
        assert lowest <= on_grid + 1e-9
        if np.isfinite(on_grid):
            assert on_grid - lowest < 2e-4
    assert found > 10


def test_the_least_height_of_a_needle_that_dips_beside_the_sheet_is_at_the_sheets_edge():
    radius, slope, start = 2e-5, np.radians(5.0), np.array([1.1e-4, 2.3e-4, 0.0])
    for heading in (0.3, 0.9, 2.0):
        turn = Rotation.from_euler("z", heading) * Rotation.from_euler("y", np.pi / 2 + slope)
        lowest = Capsule(radius, 2e-2).lowest(Pose(start, turn.as_matrix()), SHEET, FLOOR)
        ahead = np.array([np.cos(heading), np.sin(heading)])
        reach = ((7.5e-3 - np.sign(ahead) * start[:2]) / np.abs(ahead)).min()
        # Off its axis the needle's underside is over the sheet a little further out.
        assert lowest == pytest.approx(-reach * np.tan(slope) - radius / np.cos(slope), abs=radius * np.tan(slope))


def test_what_is_below_the_floor_is_not_above_the_pad():
    pose = Pose(np.array([0.0, 0.0, -1e-3]), np.eye(3))
    x = np.array([0.0, 3.9e-3])
    assert np.isfinite(Ellipsoid((4e-3, 4e-3, 4e-3)).heights(pose, x, x * 0, -2.5e-3)).tolist() == [False, True]
    assert np.isinf(Box((4e-3, 4e-3, 4e-3)).heights(pose, x, x * 0, -2.5e-3)).all()
    assert np.isinf(Capsule(4e-3, 4e-3).heights(pose, x, x * 0, -2.5e-3)).all()
    assert np.isinf(Box((4e-3, 4e-3, 4e-3)).lowest(pose, SHEET, -2.5e-3))
    mesh = geom_shape(one_geom('type="mesh" mesh="m"', mesh_asset("octagon")), 0)
    assert np.isinf(mesh.heights(pose, x, x * 0, -2.5e-3)).all()
    assert np.isinf(mesh.lowest(pose, SHEET, -2.5e-3))
    assert np.isfinite(mesh.heights(pose, x * 0, x * 0, -9e-3)).all()
