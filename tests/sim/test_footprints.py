"""What bodies turn to a pad: outlines of flat faces, gap functions of all others, wherever they stand."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import shapely
import trimesh
from scipy.spatial.transform import Rotation

from mjtactile.contact.footprint import Footprint
from mjtactile.errors import FootprintError
from mjtactile.geometry.indenter import INDENTER_NAMES, indenter_outline, indenter_solid
from mjtactile.geometry.lower_surface import LowerSurface
from mjtactile.geometry.primitives import Pose
from mjtactile.sim.footprints import GapImprints
from mjtactile.sim.press_scene import press_scene
from mjtactile.sim.wrench import geom_frame

FACING_GAP = 50e-6
PAD = '<geom name="pad" type="box" size="0.0075 0.0075 0.0025" pos="0 0 -0.0025"/>'
EDGE = 7.5e-3
UPRIGHT = Rotation.identity()


def world(geoms: str, assets: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset>{assets}</asset><worldbody>{PAD}
        <body name="body">{geoms}</body></worldbody></mujoco>"""
    )


def mesh(solid: trimesh.Trimesh) -> str:
    vertices, faces = (" ".join(map(repr, a.ravel().tolist())) for a in (solid.vertices, solid.faces))
    return f'<mesh name="m" vertex="{vertices}" face="{faces}" inertia="exact"/>'


class Standing:
    """A body of some geoms in a place over a pad."""

    def __init__(self, model, influence, position, turn: Rotation = UPRIGHT, *, level: bool = False):
        self.model, self.data = model, mujoco.MjData(model)
        self.body = model.body("body").id
        self.imprints = GapImprints(model, model.geom("pad").id, influence.surface, facing_gap=FACING_GAP, level=level)
        self.move(position, turn)

    def move(self, position, turn: Rotation = UPRIGHT) -> None:
        self.model.body_pos[self.body], self.model.body_quat[self.body] = position, turn.as_quat(scalar_first=True)
        mujoco.mj_kinematics(self.model, self.data)

    def footprint(self) -> Footprint:
        frame = geom_frame(self.model, self.data, self.model.geom("pad").id)
        own = np.flatnonzero(self.model.geom_bodyid == self.body)
        return self.imprints.footprint(self.data, frame, self.body, own)

    def surface(self) -> LowerSurface:
        own = np.flatnonzero(self.model.geom_bodyid == self.body)
        xpos, xmat = self.data.geom_xpos, self.data.geom_xmat
        return self.imprints.surface({int(g): Pose(xpos[g], xmat[g].reshape(3, 3)) for g in own})


def gap_at(surface: LowerSurface, x: float, y: float) -> float:
    return float(surface.gap(np.array([x]), np.array([y]))[0])


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_punches_have_flat_faces_with_their_outlines(name, coarse_square):
    model = press_scene(name, shift=(1e-3, -2e-3), rotate_deg=25.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pad = model.geom("pad").id
    imprints = GapImprints(model, pad, coarse_square.surface, facing_gap=FACING_GAP, level=True)
    body = int(model.geom_bodyid[model.geom(f"{name}_tactile").id])
    footprint = imprints.footprint(data, geom_frame(model, data, pad), body, np.array([], dtype=np.int64))
    sheet = shapely.box(-EDGE, -EDGE, EDGE, EDGE)
    expected = indenter_outline(name, shift=(1e-3, -2e-3), rotate_deg=25.0).intersection(sheet)
    assert footprint.gap is None
    assert footprint.outline.symmetric_difference(expected).area < 1e-6 * expected.area


@pytest.mark.parametrize(
    ("geom", "area"),
    [('type="box" size=".002 .003 .004"', 24e-6), ('type="cylinder" size=".003 .004"', np.pi * 9e-6)],
)
def test_a_tilt_leaves_a_face_flat_unless_it_must_be_level(geom, area, coarse_square):
    """A body that tilts under its load brings the face onto the pad; up to 12 degrees nothing else of it comes near."""
    for degrees, flat, level in ((0.0, True, True), (0.2, True, False), (1.5, True, False), (15.0, False, False)):
        turn = Rotation.from_euler("xyz", [degrees, 0.0, 33.0], degrees=True)
        for required, expected in ((False, flat), (True, level)):
            there = Standing(world(f"<geom {geom}/>"), coarse_square, (0, 0, 4e-3), turn, level=required)
            footprint = there.footprint()
            assert (footprint.gap is None) == expected
            if expected:
                assert footprint.area == pytest.approx(area, rel=1e-4)


def test_a_mesh_that_tilts_a_little_keeps_its_outline(coarse_square):
    askew = Rotation.from_euler("xyz", [0.5, 0.7, -0.2])  # so that its corners are rounded to single precision
    solid = indenter_solid("star")
    solid.vertices = askew.apply(solid.vertices)
    back = " ".join(map(repr, askew.inv().as_quat(scalar_first=True).tolist()))
    there = Standing(world(f'<geom type="mesh" mesh="m" quat="{back}"/>', mesh(solid)), coarse_square, (0, 0, 0))
    first = there.footprint()
    for turn, shift in ((np.array([0.0, 5e-5, 0.3]), 1e-3), (np.array([0.0, 2e-3, 0.3]), -1e-3)):
        there.move((shift, 0, 0), Rotation.from_euler("xyz", turn))
        moved = there.footprint()
        assert moved.gap is None
        expected = shapely.affinity.translate(shapely.affinity.rotate(first.outline, 0.3, (0, 0), True), shift, 0.0)
        assert moved.outline.symmetric_difference(expected).area < 1e-5 * expected.area
        assert moved.area == pytest.approx(np.cos(turn[1]) * first.area, rel=2e-7)


def test_the_flanks_of_a_small_box_that_leans_are_part_of_its_face(coarse_square):
    """All of its bottom is within 50 um of its lowest point, but so are parts of its sides."""
    turn = Rotation.from_euler("x", 13.0, degrees=True)
    there = Standing(world('<geom type="box" size=".0001 .0001 .001"/>'), coarse_square, (0, 0, 1e-3), turn)
    assert there.footprint().gap is not None


def test_a_chamfer_makes_a_face_curved(coarse_square):
    face, wide = indenter_outline("square", scale=0.5), indenter_outline("square", scale=0.6)
    corners = np.vstack(
        [np.column_stack([np.array(o.exterior.coords)[:4], np.full(4, z)]) for o, z in ((face, 0.0), (wide, 5e-4))]
    )
    solid = trimesh.convex.convex_hull(corners)
    there = Standing(world('<geom type="mesh" mesh="m"/>', mesh(solid)), coarse_square, (0, 0, 1e-3))
    footprint = there.footprint()
    assert footprint.gap is not None
    # MuJoCo moves the mesh to its centre of mass, and turns it about z.
    assert gap_at(there.surface(), 2.4e-3, 0.0) == pytest.approx(0.0, abs=1e-9)
    assert gap_at(there.surface(), 2.75e-3, 0.0) == pytest.approx(2.5e-4, rel=1e-4)


def test_legs_of_one_height_are_one_flat_face_and_others_are_not(coarse_square):
    legs = (
        '<geom type="box" size=".001 .001 .002" pos="-.004 0 0"/><geom type="box" size=".001 .001 {}" pos=".004 0 0"/>'
    )
    even = Standing(world(legs.format(0.002)), coarse_square, (0, 0, 2e-3)).footprint()
    assert even.gap is None
    assert even.area == pytest.approx(8e-6, rel=1e-9)
    uneven = Standing(world(legs.format(0.00199)), coarse_square, (0, 0, 2e-3))
    assert uneven.footprint().gap is not None
    assert gap_at(uneven.surface(), 4e-3, 0.0) == pytest.approx(1e-5, rel=1e-6)


@pytest.mark.parametrize(
    ("geom", "turn", "height"),
    [
        ('type="sphere" size=".006"', (0, 0, 0), 6e-3),
        ('type="capsule" size=".003 .004"', (0, 90, 20), 3e-3),
        ('type="cylinder" size=".003 .004"', (0, 90, 20), 3e-3),
        ('type="box" size=".004 .004 .004"', (45, 0, 0), 4e-3 * np.sqrt(2)),
        ('type="ellipsoid" size=".004 .005 .003"', (0, 0, 10), 3e-3),
    ],
)
def test_curved_bodies_edges_and_corners_have_gap_functions_that_touch_below_them(geom, turn, height, coarse_square):
    place = np.array([1e-3, -5e-4])
    turn = Rotation.from_euler("xyz", turn, degrees=True)
    there = Standing(world(f"<geom {geom}/>"), coarse_square, (*place, height - 2e-5), turn)
    footprint, surface = there.footprint(), there.surface()
    assert footprint.gap is not None
    assert surface.touch == pytest.approx(-2e-5, abs=1e-12)
    assert gap_at(surface, *place) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(footprint.centroid, place, atol=1e-4)


def test_what_touches_first_is_over_the_sheet_although_the_lowest_point_is_beside_it(coarse_square):
    radius, beyond = 6e-3, 1e-3
    there = Standing(world(f'<geom type="sphere" size="{radius}"/>'), coarse_square, (EDGE + beyond, 0, radius - 5e-4))
    expected = radius - 5e-4 - np.sqrt(radius**2 - beyond**2)
    assert there.surface().touch == pytest.approx(expected, abs=1e-9)
    footprint = there.footprint()
    assert footprint.outline.bounds[2] == pytest.approx(EDGE, abs=1e-9)
    assert footprint.centroid[0] > EDGE - 1e-3


def test_a_leg_beside_the_pad_does_not_hide_the_foot_on_it(coarse_square):
    """It even digs 10 um into the flank."""
    legs = f"""<geom type="box" size=".002 .002 .001" pos="0 0 .001"/>
        <geom type="box" size=".001 .002 .003" pos="{EDGE + 1e-3 - 1e-5} 0 -.001"/>"""
    there = Standing(world(legs), coarse_square, (0, 0, -1e-6))
    assert there.surface().touch == pytest.approx(-1e-6, abs=1e-12)
    footprint = there.footprint()
    assert footprint.gap is None
    np.testing.assert_allclose(footprint.outline.bounds, (-2e-3, -2e-3, 2e-3, 2e-3), atol=1e-12)


def test_a_clamp_that_reaches_under_the_pad_presses_with_its_upper_jaw(coarse_square):
    jaws = (
        """<geom type="sphere" size=".003" pos="0 0 .003"/><geom type="box" size=".003 .003 .001" pos="0 0 -.007"/>"""
    )
    there = Standing(world(jaws), coarse_square, (0, 0, 0))
    assert there.surface().touch == pytest.approx(0.0, abs=1e-12)
    assert there.footprint().gap is not None


@pytest.mark.parametrize(
    ("geom", "position"),
    [
        ('type="box" size=".002 .002 .002"', (EDGE + 2e-3 - 1e-5, 0, 0)),  # 10 um into the flank
        ('type="box" size=".002 .002 .002"', (EDGE + 3e-3, 0, 0)),
        ('type="sphere" size=".002"', (0, 0, 0.5)),
        ('type="sphere" size=".002"', (0, 0, -8e-3)),
        ('type="plane" size="1 1 1"', (0, 0, -1e-3)),  # faces away
        ('type="plane" size="1 1 1" quat="0 1 0 0"', (0, 0, 6e-3)),
    ],
)
def test_what_is_not_over_the_surface_is_refused(geom, position, coarse_square):
    with pytest.raises(FootprintError, match="nothing of it is over the surface"):
        Standing(world(f"<geom {geom}/>"), coarse_square, position).footprint()


@pytest.mark.parametrize("tilt", [0.0, 0.1])
@pytest.mark.parametrize("geom", ['type="plane" size="0 0 1" quat="0 1 0 0"', 'type="box" size="2 2 .1" pos="0 0 .1"'])
def test_something_huge_covers_the_whole_sheet(geom, tilt, coarse_square):
    turn = Rotation.from_euler("y", tilt, degrees=True)
    footprint = Standing(world(f"<geom {geom}/>"), coarse_square, (0, 0, 0), turn).footprint()
    assert footprint.gap is None
    assert footprint.area == pytest.approx(225e-6, rel=1e-9)


def test_a_steep_plane_touches_at_the_sheets_edge(coarse_square):
    turn = Rotation.from_euler("y", 20.0, degrees=True)
    there = Standing(world('<geom type="plane" size="0 0 1" quat="0 1 0 0"/>'), coarse_square, (0, 0, 0), turn)
    assert there.footprint().gap is not None
    assert there.surface().touch == pytest.approx(-EDGE * np.tan(np.radians(20.0)), abs=1e-12)


@pytest.mark.parametrize("height", [1e-5, 0.0, -1e-5])
def test_grazing_and_hovering_bodies_have_the_footprint_of_those_that_press(height, coarse_square):
    there = Standing(world('<geom type="sphere" size=".006"/>'), coarse_square, (0, 0, 6e-3 + height))
    assert there.surface().touch == pytest.approx(height, abs=1e-15)
    deep = Standing(world('<geom type="sphere" size=".006"/>'), coarse_square, (0, 0, 6e-3 - 1e-4))
    points = np.linspace(-1e-3, 1e-3, 20), np.linspace(-5e-4, 5e-4, 20)
    np.testing.assert_allclose(there.surface().gap(*points), deep.surface().gap(*points), atol=1e-15)


def test_a_body_over_the_edge_presses_with_what_is_over_the_sheet(coarse_square):
    box = Standing(world('<geom type="box" size=".003 .003 .003"/>'), coarse_square, (EDGE, EDGE, 3e-3)).footprint()
    assert box.area == pytest.approx(9e-6, rel=1e-9)
    ball = Standing(world('<geom type="sphere" size=".006"/>'), coarse_square, (EDGE, -EDGE, 6e-3)).footprint()
    assert ball.outline.within(shapely.box(-EDGE, -EDGE, EDGE, EDGE).buffer(1e-9))


def test_a_pin_finer_than_any_grid_is_found(coarse_square):
    footprint = Standing(
        world('<geom type="sphere" size="4e-5"/>'), coarse_square, (1.03e-3, 2.07e-3, 4e-5)
    ).footprint()
    np.testing.assert_allclose(footprint.centroid, (1.03e-3, 2.07e-3), atol=4e-5)


def test_visual_geoms_far_above_leave_the_pressing_to_those_that_collide(coarse_square):
    lamp = '<geom type="box" size=".1 .1 .01" pos="0 0 1" contype="0" conaffinity="0"/>'
    model = world(lamp + '<geom type="box" size=".002 .002 .002"/>')
    assert Standing(model, coarse_square, (0, 0, 2e-3)).footprint().area == pytest.approx(16e-6, rel=1e-9)


def test_colliding_geoms_that_do_not_touch_yet_are_part_of_the_body(coarse_square):
    feet = '<geom type="sphere" size=".002"/><geom type="sphere" size=".002" pos=".005 0 3e-5"/>'
    there = Standing(world(feet), coarse_square, (0, 0, 2e-3))
    frame = geom_frame(there.model, there.data, 0)
    footprint = there.imprints.footprint(there.data, frame, there.body, np.array([1]))
    assert footprint.gap is not None
    heights = np.asarray(footprint.gap(np.array([0.0, 5e-3]), np.zeros(2)))
    np.testing.assert_allclose(heights - heights[0], [0.0, 3e-5], atol=1e-12)


KINDS = [
    'type="sphere" size=".004"',
    'type="capsule" size=".001 .004"',
    'type="ellipsoid" size=".001 .003 .006"',
    'type="cylinder" size=".004 .002"',
    'type="box" size=".002 .003 .005"',
    'type="plane" size="0 0 1"',
    'type="mesh" mesh="m"',
]


@pytest.mark.parametrize("kind", KINDS)
def test_every_pose_has_a_footprint_or_says_why_not(kind, coarse_square):
    """Near the pad, over its edge, through it, beside it; warnings are errors here."""
    random = np.random.default_rng(4)
    there = Standing(world(f"<geom {kind}/>", mesh(indenter_solid("star"))), coarse_square, (0, 0, 0))
    made = 0
    quarter_turns = Rotation.create_group("O")
    for k in range(40):
        turn = Rotation.random(rng=random) if k % 2 else quarter_turns[k // 2]
        there.move(random.uniform(-1e-2, 1e-2, 3), turn)
        try:
            footprint = there.footprint()
        except FootprintError:
            continue
        made += 1
        assert footprint.area > 0.0
        if footprint.gap is not None:
            points = random.uniform(-EDGE, EDGE, (2, 50))
            heights = np.asarray(footprint.gap(*points))
            assert not np.isnan(heights).any()
            assert (heights >= 0.0).all()
    assert made >= 5
