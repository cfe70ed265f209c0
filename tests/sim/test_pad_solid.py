"""Curved pads as geoms: where they stand, how they collide, and what is refused in their place."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import shapely
import trimesh
from curved_pads import BULGES, CURVED, HOLLOWS, pad_with, stack

from mjtactile.errors import SceneError
from mjtactile.geometry.indenter import indenter_outline, indenter_solid, mesh_indenter, punch, sphere
from mjtactile.pad import Pad
from mjtactile.pad_shape.surfaces import SphereCap
from mjtactile.sim.mjcf import pad_mjcf
from mjtactile.sim.pad_check import check_pad_geom
from mjtactile.sim.pad_geom import add_pad_geom, pad_pieces
from mjtactile.sim.pad_solid import MOST_PIECES, PROUD, SAGITTA, Solid, pad_solid
from mjtactile.sim.press_scene import press, press_scene
from mjtactile.sim.wrench import geom_frame

#: Chords stand lower than this where a surface bends more at one place than its grid was made for [m]: triangles are
#: twice as long as cells.
CHORD = 2.5 * SAGITTA
PLACE = np.array([0.01, -0.02, 0.03]), np.array([0.3, 0.2, 0.8, 0.1]) / np.linalg.norm([0.3, 0.2, 0.8, 0.1])
#: A hand whose meshes are in millimetres and whose geoms are not what a pad is.
HAND = """
<mujoco>
  <default><mesh scale=".001 .001 .001"/><geom margin=".01" group="2" type="box" size="1 1 1" rgba="1 0 0 1"/></default>
  <worldbody><body name="tip" pos="1 2 3" quat=".5 .5 -.5 .5"><joint type="slide"/></body></worldbody>
</mujoco>
"""


def as_mesh(piece: Solid) -> trimesh.Trimesh:
    return trimesh.Trimesh(piece.vertices, piece.faces, process=False)


def with_pad(pad: Pad, text: str = HAND) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_string(text)
    add_pad_geom(spec, spec.body("tip"), "t", pad, PLACE, "stiff")
    return spec


def at_rest(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def volume(pad: Pad) -> float:
    """Of the swept solid [m^3]: the mean curvature H and the Gaussian K of parallel surfaces, Gray, Tubes (2004)."""
    x, y = (np.polynomial.legendre.leggauss(40)[0] * side / 2 for side in pad.size)
    weights = np.outer(*(np.polynomial.legendre.leggauss(40)[1] * side / 2 for side in pad.size))
    u, v = np.meshgrid(x, y, indexing="ij")
    first, second = np.moveaxis(pad.surface.curvatures(u, v), -1, 0)
    t = pad.thickness
    along = t - (first + second) * t**2 / 2 + first * second * t**3 / 3
    return float((weights * pad.surface.stretch(u, v) * along).sum())


@pytest.mark.parametrize("name", CURVED)
def test_pieces_are_closed_and_fill_the_pad(name):
    pad = CURVED[name]
    pieces = pad_solid(pad).pieces
    meshes = [as_mesh(piece) for piece in pieces]
    assert all(mesh.is_watertight and mesh.is_winding_consistent for mesh in meshes)
    # Chords cut off at most their sagitta of the thickness on either side.
    assert sum(mesh.volume for mesh in meshes) == pytest.approx(volume(pad), rel=2 * CHORD / pad.thickness)
    for piece in pieces:
        depths = pad.feet(piece.vertices)[0][:, 2]
        half = len(depths) // 2
        np.testing.assert_allclose(depths[:half], 0.0, atol=1e-12)
        np.testing.assert_allclose(depths[half:], pad.thickness, atol=1e-12)


@pytest.mark.parametrize("name", BULGES)
def test_what_bulges_is_one_piece(name):
    solid = pad_solid(BULGES[name])
    assert len(solid.pieces) == 1
    assert solid.proud == 0.0


@pytest.mark.parametrize("name", HOLLOWS)
def test_hulls_of_pieces_stand_little_over_a_hollow(name):
    pad = HOLLOWS[name]
    solid = pad_solid(pad)
    assert 1 < len(solid.pieces) <= MOST_PIECES
    if name == "saddle":
        assert solid.proud <= PROUD
    for piece in solid.pieces:
        hull = as_mesh(piece).convex_hull
        outer = piece.vertices[: len(piece.vertices) // 2, :2]
        middles = hull.triangles_center
        above = ((middles[:, :2] >= outer.min(axis=0)) & (middles[:, :2] <= outer.max(axis=0))).all(axis=1)
        x, y, z = middles[above & (hull.face_normals[:, 2] > 0.3)].T
        over = (z - pad.surface.height(x, y)) * pad.surface.normals(x, y)[:, 2]
        assert over.min() >= -CHORD
        assert over.max() <= solid.proud + 1e-9


@pytest.mark.parametrize("name", CURVED)
def test_the_pad_frame_is_found_again_wherever_mujoco_puts_the_mesh(name):
    spec = with_pad(CURVED[name])
    for model in (spec.compile(), mujoco.MjModel.from_xml_string(spec.to_xml())):
        data = at_rest(model)
        frame, site = geom_frame(model, data, model.geom("t_pad").id), data.site("t_surface")
        np.testing.assert_allclose(frame.position, site.xpos, atol=1e-12)
        np.testing.assert_allclose(frame.rotation.ravel(), site.xmat, atol=1e-12)
        check_pad_geom(model, model.geom("t_pad").id, CURVED[name])


def test_a_part_of_another_model_keeps_its_frame_and_pieces():
    spec = mujoco.MjSpec.from_string("<mujoco><worldbody><body name='arm' pos='0 0 1'/></worldbody></mujoco>")
    frame = spec.body("arm").add_frame(pos=[0.1, 0.0, 0.0], quat=[0.6, 0.0, 0.8, 0.0])
    spec.attach(with_pad(HOLLOWS["saddle"]), prefix="left_", frame=frame)
    model = spec.compile()
    geom = model.geom("left_t_pad").id
    assert len(pad_pieces(model, geom)) == len(pad_solid(HOLLOWS["saddle"]).pieces)
    found, site = geom_frame(model, data := at_rest(model), geom), data.site("left_t_surface")
    np.testing.assert_allclose(found.position, site.xpos, atol=1e-12)
    np.testing.assert_allclose(found.rotation.ravel(), site.xmat, atol=1e-12)


def test_pieces_with_an_ending_after_their_names_are_refused_with_what_keeps_the_names():
    spec = mujoco.MjSpec()
    spec.attach(with_pad(HOLLOWS["saddle"]), prefix="left_", suffix="_1", frame=spec.worldbody.add_frame())
    model, count = spec.compile(), len(pad_solid(HOLLOWS["saddle"]).pieces)
    with pytest.raises(SceneError, match=rf"{count} geoms, 1 were found: 'left_t_pad_1', .*prefix and no suffix"):
        check_pad_geom(model, model.geom("left_t_pad_1").id, HOLLOWS["saddle"])


@pytest.mark.parametrize("name", CURVED)
def test_rays_meet_the_surface(name):
    """Up to the chords between vertices, which stand below a bulge and above a hollow."""
    pad = CURVED[name]
    model = with_pad(pad).compile()
    frame = geom_frame(model, data := at_rest(model), model.geom("t_pad").id)
    for x, y in np.random.default_rng(0).uniform(-0.495, 0.495, (60, 2)) * pad.size:
        start = frame.position + frame.rotation @ np.array([x, y, 0.05])
        found = 0.05 - mujoco.mj_ray(model, data, start, -frame.rotation[:, 2], None, 1, -1, np.zeros(1, np.int32))
        assert abs(found - pad.surface.height(x, y)) * pad.surface.normals(x, y)[2] <= CHORD


@pytest.mark.parametrize("name", CURVED)
def test_it_weighs_what_its_silicone_weighs(name):
    model = with_pad(CURVED[name]).compile()
    assert model.body("tip").mass[0] == pytest.approx(965.0 * volume(CURVED[name]), rel=5e-3)
    assert (model.geom_margin == 0).all()
    assert (model.geom_group == 0).all()
    assert (model.geom_priority == 10).all()


@pytest.mark.parametrize("name", CURVED)
def test_a_ball_meets_the_surfaces_own_normal(name):
    """Within the angle of facets: chords of cells, their halves as seen from vertices; and of what hulls add."""
    pad = CURVED[name]
    radius, sunk = 3e-3, 5e-6
    spec = mujoco.MjSpec()
    spec.worldbody.add_body(name="tip")
    add_pad_geom(spec, spec.body("tip"), "t", pad, (np.zeros(3), np.array([1.0, 0, 0, 0])), "stiff")
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0])
    spec.geoms[0].margin = 2e-5
    model = spec.compile()
    data = mujoco.MjData(model)
    bend = np.abs(pad.surface.curvatures(*np.meshgrid(*(np.linspace(-s / 2, s / 2, 33) for s in pad.size)))).max()
    allowed = 2.0 * np.sqrt(8 * SAGITTA * bend) + 4 * np.sqrt(2 * pad_solid(pad).proud * bend)
    for x, y in np.random.default_rng(1).uniform(-0.45, 0.45, (60, 2)) * pad.size:
        normal = pad.surface.normals(x, y)
        data.qpos[:3] = pad.surface.positions(x, y) + (radius - sunk) * normal
        mujoco.mj_forward(model, data)
        assert data.ncon >= 1
        deepest = data.contact[int(np.argmin(data.contact.dist))]
        sign = 1.0 if model.geom_bodyid[deepest.geom[1]] == model.body("ball").id else -1.0
        assert np.arccos(min(1.0, sign * deepest.frame[:3] @ normal)) <= allowed
        assert -deepest.dist == pytest.approx(sunk, abs=CHORD + pad_solid(pad).proud)


def test_geoms_of_another_shape_are_refused():
    dome = BULGES["dome"]
    model = with_pad(dome).compile()
    with pytest.raises(SceneError, match="is not a mesh, but the pad is curved"):
        check_pad_geom(with_pad(stack(dome)).compile(), 0, dome)
    with pytest.raises(SceneError, match="is not a box"):
        check_pad_geom(model, 0, stack(dome))
    with pytest.raises(SceneError, match="the least x, y and z of geom 't_pad' are"):
        check_pad_geom(model, 0, replace(dome, surface=SphereCap(13e-3)))
    # The same extent, and another shape within.
    model = with_pad(pad_with(lambda x, y: -(x**2 + y**2) / 24e-3)).compile()
    dent = pad_with(lambda x, y: -(x**2 + y**2) / 24e-3 - 1e-4 * np.sin(np.pi * x / 6e-3) ** 2)
    with pytest.raises(SceneError, match="has vertices at depths from"):
        check_pad_geom(model, 0, dent)


def test_a_ball_settles_on_a_dome_where_it_was_put():
    dome = BULGES["dome"]
    model = press_scene("circle", pad=dome)
    assert not any("_foot_" in model.geom(k).name for k in range(model.ngeom))
    model = press_scene(sphere(6e-3), pad=dome, shift=(3e-3, -2e-3))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    data.joint("press_z").qpos = -6e-6  # it waits 1 um above the pad, of which facets stand up to 5 um below the dome
    mujoco.mj_forward(model, data)
    assert data.ncon == 1
    settled = press(model, mujoco.MjData(model), (0.0, 0.0, -1.0))
    assert settled.time < 0.1
    # It touches on the line between the two middles: 12 mm of 18 from that of the dome. Facets move that by .1 mm.
    np.testing.assert_allclose(settled.wrench[3:5], [2e-3 * 12 / 18, 3e-3 * 12 / 18], atol=1e-4)


def test_a_face_with_a_hole_stands_on_its_rim_about_the_apex():
    """It comes to rest lower than a plate by the height of the cap in the hole."""
    dome, hole = BULGES["dome"], 1.25e-3
    model = press_scene(punch("doughnut", scale=0.5), pad=dome)
    parts = [model.geom(k).name for k in range(model.ngeom) if "_part_" in model.geom(k).name]
    assert len(parts) > 20
    assert model.geom("doughnut_tactile").contype[0] == 0
    data = mujoco.MjData(model)
    settled = press(model, data, (0.0, 0.0, -0.5))
    cap = 12e-3 - np.sqrt(12e-3**2 - hole**2)
    # It sinks in by some micrometres, and facets of pad and rim are chords.
    assert data.xpos[model.body("doughnut").id][2] == pytest.approx(-cap, abs=1e-5)
    touching = np.hypot(*data.contact.pos[:, :2].T)
    np.testing.assert_allclose(touching, hole, atol=1.5e-4)
    np.testing.assert_allclose(settled.wrench[3:5], 0.0, atol=5e-5 * 0.5)  # 50 um off the middle
    np.testing.assert_allclose(settled.wrench[:3], [0.0, 0.0, -0.5], atol=1e-4)


def test_a_ring_on_a_ridge_presses_about_the_middle_of_what_touches():
    for shift in ((0.0, 0.0), (1.5e-3, 1e-3)):
        model = press_scene(punch("doughnut", scale=0.5), pad=BULGES["tip"], shift=shift)
        data = mujoco.MjData(model)
        wrench = press(model, data, (0.0, 0.0, -0.5)).wrench
        # Parts of one size have contacts about evenly along the ridge; those of a coarse partition were 1 mm off.
        assert wrench[3] / wrench[2] == pytest.approx(shift[1], abs=1.5e-4)
        assert -wrench[4] / wrench[2] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("shape", ["star", "doughnut"])
def test_notches_and_holes_stay_open_where_a_dome_reaches_into_them(shape):
    """Contacts lie under the face, not under its hull."""
    for shift in ((1.5e-3, 1e-3), (-1e-3, 1.2e-3), (0.5e-3, -1.5e-3)):
        model = press_scene(punch(shape, scale=0.5), pad=BULGES["dome"], shift=shift)
        data = mujoco.MjData(model)
        press(model, data, (0.0, 0.0, -0.3))
        face = indenter_outline(shape, scale=0.5, shift=shift).buffer(1e-4)
        assert data.ncon > 0
        assert shapely.contains_xy(face, *data.contact.pos[:, :2].T).all()


def test_convex_faces_collide_as_one_solid_and_pads_that_are_flat_keep_feet():
    for shape in ("circle", "ellipse", "octagon", "square", "triangle"):
        assert punch(shape).convex_solids == []
        assert press_scene(shape, pad=BULGES["dome"]).ngeom == 2
    model = press_scene("doughnut", pad=stack(BULGES["dome"]))
    names = [model.geom(k).name for k in range(model.ngeom)]
    assert any("_foot_" in name for name in names)
    assert not any("_part_" in name for name in names)


def test_a_hole_in_a_body_that_is_no_prism_is_refused_on_a_curved_pad():
    ring = indenter_solid("doughnut", scale=0.5)
    ring.vertices[ring.vertices[:, 2] > 0.0, :2] *= 1.1
    with pytest.raises(SceneError, match=r"has a hole in its face.*only prisms over their face.*TactileSensor"):
        press_scene(mesh_indenter(ring, name="cup"), pad=BULGES["dome"])
    assert press_scene(mesh_indenter(ring, name="cup"), pad=stack(BULGES["dome"])).ngeom > 2


def test_a_pads_own_model_has_its_shape():
    model = mujoco.MjModel.from_xml_string(pad_mjcf(HOLLOWS["saddle"]))
    check_pad_geom(model, model.geom("pad").id, HOLLOWS["saddle"])
    assert model.ngeom == len(pad_solid(HOLLOWS["saddle"]).pieces)
