"""Bodies of a model as the dense contact takes them: what collides, where it is, and what it presses with."""

import mujoco
import numpy as np
import pytest
import trimesh
from bodies_of_model import bodies_on_pad, compare, on_surface
from lower_surfaces import Box, Pose, triangle_heights
from measured_scenes import NAMES, pressed

import mjtactile
from mjtactile.sim.wrench import contact_wrench

PAD = '<geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025"/>'


def at_rest(body: str, *, pad_first: bool = True) -> tuple[mujoco.MjModel, mujoco.MjData, int]:
    """A pad in the world or in a body after the one that presses; its number is the higher one then."""
    falling = f'<body name="falls" pos="0 0 .0049"><freejoint/>{body}</body>'
    parts = PAD + falling if pad_first else falling + f'<body name="holder">{PAD}</body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{parts}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    for _ in range(50):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return model, data, model.geom("pad").id


@pytest.mark.parametrize("pad_first", [True, False])
def test_wrench_is_that_of_all_contacts(pad_first):
    box = '<geom type="box" size=".004 .003 .005" mass=".02" friction="1 .005 .0001" euler="0 0 20"/>'
    model, data, pad = at_rest(box, pad_first=pad_first)
    (body,) = bodies_on_pad(model, data, pad, 5e-3)
    expected = contact_wrench(model, data, pad)
    assert expected[2] < -0.1
    np.testing.assert_allclose([*body.force, *body.moment], expected, rtol=1e-12, atol=1e-15)


def test_geoms_that_do_not_collide_have_no_surface():
    seen = '<geom type="box" size=".004 .004 .006" contype="0" conaffinity="0" mass="0"/>'
    model, data, pad = at_rest(f'<geom type="sphere" size=".005" mass=".02"/>{seen}')
    (body,) = bodies_on_pad(model, data, pad, 5e-3)
    x, y = np.array([0.0, 1e-3, 4e-3, 6e-3]), np.zeros(4)
    heights = body.heights(x, y)
    expected = 5e-3 - np.sqrt(np.maximum(5e-3**2 - x**2, 0.0))
    np.testing.assert_allclose(heights[1:3] - heights[0], expected[1:3], atol=1e-12)
    assert heights[3] == np.inf


def test_what_leans_is_beside_the_surface():
    assert on_surface(np.array([0.0, np.sin(0.7), -np.cos(0.7)]), np.array([0.0, 0.0, -1.0]))
    assert not on_surface(np.array([0.0, np.sin(0.9), -np.cos(0.9)]), np.array([0.0, 0.0, -1.0]))
    assert not on_surface(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))


def test_triangles_are_as_high_as_the_box_they_make():
    turn = trimesh.transformations.euler_matrix(0.3, -0.5, 1.1)[:3, :3]
    pose = Pose(np.array([1e-3, -2e-3, 6e-3]), turn)
    solid = trimesh.creation.box(extents=(6e-3, 8e-3, 10e-3)).subdivide().subdivide()
    corners = pose.points(np.asarray(solid.vertices))[np.asarray(solid.faces)]
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-8e-3, 8e-3, (2, 5000))
    found = triangle_heights(corners, -1.0)(x, y)
    expected = Box((3e-3, 4e-3, 5e-3)).heights(pose, x, y, -1.0)
    assert 1000 < np.isfinite(expected).sum() < 4000
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    np.testing.assert_allclose(found[np.isfinite(found)], expected[np.isfinite(expected)], atol=1e-9)


def test_triangles_below_the_floor_do_not_count():
    solid = trimesh.creation.box(extents=(6e-3, 8e-3, 10e-3))
    corners = np.asarray(solid.vertices)[np.asarray(solid.faces)]
    assert triangle_heights(corners, -4e-3)(np.zeros(1), np.zeros(1))[0] == np.inf
    assert triangle_heights(corners, -6e-3)(np.zeros(1), np.zeros(1))[0] == pytest.approx(-5e-3)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")
def test_every_scene_has_a_dense_contact_that_carries_its_force(name):
    model, data = pressed(name, "fast")
    found = compare(model, data)
    force = contact_wrench(model, data, mjtactile.TactileSensor(model, "touch").geom)[2]
    assert found.dense.wrench[2] == pytest.approx(force, rel=1e-9)
    assert max(found.dense.violations.values()) < 1e-7


def test_ball_is_read_by_the_plugin_as_by_the_dense_contact():
    assert compare(*pressed("ball", "fast")).error < 0.02
