"""Every geom type as a solid, and faces cut from it, against closed forms."""

import mujoco
import numpy as np
import pytest

from mjtactile.errors import SceneError
from mjtactile.sim.geoms import body_face, geom_solid, pressing_geoms
from mjtactile.sim.wrench import PadFrame

HERE = PadFrame(np.zeros(3), np.eye(3))


def model_of(geoms, assets=""):
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><asset>{assets}</asset><worldbody><body name='b'>{geoms}</body></worldbody></mujoco>"
    )


@pytest.mark.parametrize(
    ("geom", "volume", "extents"),
    [
        ('type="box" size=".001 .002 .003"', 8 * 6e-9, (2e-3, 4e-3, 6e-3)),
        ('type="sphere" size=".002"', 4 / 3 * np.pi * 8e-9, (4e-3,) * 3),
        ('type="ellipsoid" size=".001 .002 .003"', 4 / 3 * np.pi * 6e-9, (2e-3, 4e-3, 6e-3)),
        ('type="cylinder" size=".001 .003"', np.pi * 6e-9, (2e-3, 2e-3, 6e-3)),
        ('type="capsule" size=".001 .003"', np.pi * (6 + 4 / 3) * 1e-9, (2e-3, 2e-3, 8e-3)),
    ],
)
def test_primitives_are_solids_of_their_size(geom, volume, extents):
    solid = geom_solid(model_of(f"<geom {geom}/>"), 0)
    assert solid.is_watertight
    # Curved surfaces are polyhedra inscribed with 64 or more sides.
    assert solid.volume == pytest.approx(volume, rel=3e-3)
    np.testing.assert_allclose(solid.extents, extents, rtol=1e-3)
    np.testing.assert_allclose(solid.bounds.mean(axis=0), 0.0, atol=1e-9)


def test_a_plane_faces_the_pad_with_everything_under_it():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom type="plane" size="0 0 1" quat="0 1 0 0"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    solid = geom_solid(model, 0)
    face = body_face([(solid, data.geom_xpos[0], data.geom_xmat[0].reshape(3, 3))], HERE, 5e-5)
    assert face.area == pytest.approx(4.0)


def test_a_sphere_presses_with_its_cap():
    radius, gap = 6e-3, 5e-5
    solid = geom_solid(model_of(f'<geom type="sphere" size="{radius}"/>'), 0)
    face = body_face([(solid, np.array([1e-3, 2e-3, radius - 1e-5]), np.eye(3))], HERE, gap)
    # The solid is inscribed, 64 sides around: its surface lies up to 1.2e-3 R / 2 inside the sphere's, against the gap.
    assert face.area == pytest.approx(np.pi * (2 * radius * gap - gap**2), rel=0.05)
    assert (face.centroid.x, face.centroid.y) == pytest.approx((1e-3, 2e-3), abs=1e-6)


def test_a_body_with_shown_geoms_presses_with_them_and_not_with_its_feet():
    model = model_of(
        '<geom name="true_tactile" type="box" size=".004 .004 .001" contype="0" conaffinity="0" pos="0 0 .001"/>'
        '<geom type="sphere" size=".0005" pos=".003 0 .0005"/>'
    )
    np.testing.assert_array_equal(pressing_geoms(model, 1, np.array([1])), [0])
    bare = model_of('<geom type="sphere" size=".001"/><geom type="sphere" size=".001" pos=".01 0 0"/>')
    np.testing.assert_array_equal(pressing_geoms(bare, 1, np.array([1])), [1])


def test_an_open_mesh_is_refused_by_name():
    mesh = '<mesh name="m" vertex="0 0 0 .01 0 0 0 .01 0 0 0 .01" face="0 2 1 0 1 3 0 3 2"/>'
    model = model_of('<geom name="open" type="mesh" mesh="m"/>', mesh)
    with pytest.raises(SceneError, match=r"open.*watertight"):
        geom_solid(model, 0)


def test_a_body_that_reaches_below_the_surface_is_cut_at_the_surface():
    radius, depth = 6e-3, 5e-4
    solid = geom_solid(model_of(f'<geom type="sphere" size="{radius}"/>'), 0)
    face = body_face([(solid, np.array([0.0, 0.0, radius - depth]), np.eye(3))], HERE, 5e-5)
    # The inscribed solid again, with a deeper cap and so a smaller share of it missing.
    assert face.area == pytest.approx(np.pi * (2 * radius * depth - depth**2), rel=0.01)
