"""Rigid bodies on curved pads: what they carry, where they stand, and the flat pad as a limit."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from curved_pads import BULGES
from scipy.interpolate import RectBivariateSpline
from scipy.spatial.transform import Rotation
from shapely import Point, box
from shapely.affinity import rotate
from small_pads import COARSE, DOME, LAYERED_PAD, in_double_precision

from mjtactile.contact.cells.half_space import bent_responses, flat_responses
from mjtactile.contact.contact_load import contact_load, contact_loads, warn_beyond_linear_range
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.linear_range import LINEAR_RANGE
from mjtactile.dataset.shapes import sphere_height
from mjtactile.errors import ContactWarning, FootprintError
from mjtactile.fidelity import MESHES
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import CylinderSector, EllipsoidCap, Flat, SphereCap, Surface, SurfacePatch
from mjtactile.pad_shape.taxels import FreeTaxels

pytestmark = pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")

BALL = 4e-3


@pytest.fixture(scope="module")
def dome() -> InfluenceMatrices:
    return in_double_precision(DOME, COARSE)


def resting_ball(outer: Surface, place: tuple[float, float], radius: float = BALL):
    """Height of a ball that touches a surface above a place."""
    return sphere_height(radius, outer.positions(place[0], place[1], -radius))


def pressed_ball(
    influence: InfluenceMatrices, place=(1.2e-3, -0.7e-3), shear=(0.0, 0.0), torsion=0.0, press=0.2, **options
):
    """A ball pressed along the normal above a place, with shear along the surface: load and wrench."""
    outer = influence.surface.outer
    axes, at = outer.frames(*place), outer.positions(*place)
    force = axes.T @ np.array([*shear, -press])
    moment = np.cross(at, force) + torsion * axes[2]
    footprint = Footprint.from_height(resting_ball(outer, place), influence.surface)
    return contact_load(influence, footprint, force, moment=moment, **options), force, moment


@pytest.mark.parametrize(
    "options",
    [
        {"law": "elastic"},
        {"law": "foundation"},
        {"law": "uniform"},
        {"law": "elastic", "shear": (0.05, -0.02), "torsion": 2e-5},
        {"law": "elastic", "shear": (0.05, -0.02), "tangential": "stick"},
        {"law": "elastic", "shear": (0.03, 0.04), "tangential": "coulomb", "friction": 0.6},
    ],
    ids=["elastic", "foundation", "uniform", "torsion", "stick", "coulomb"],
)
@pytest.mark.parametrize("place", [(0.0, 0.0), (1.2e-3, -0.7e-3), (-2.5e-3, 1.4e-3)])
def test_the_nodes_carry_the_wrench(dome, place, options):
    load, force, moment = pressed_ball(dome, place, **options)
    assert load.resultant()[0] == pytest.approx(force, abs=1e-12)
    assert load.resultant()[1] == pytest.approx(moment, abs=1e-14)
    assert np.abs(load.residual_force).max() < 1e-12
    assert load.contact_area > 0


STEEP = (3.4e-3, 2.4e-3)


@pytest.mark.parametrize("share", [0.0, 0.9, 2.0])
def test_a_force_presses_if_it_points_into_the_surface(dome, share):
    """Also where shear along a slope makes the force point away from the middle's tangent plane."""
    outer = dome.surface.outer
    uphill = outer.frames(*STEEP)[:2, 2]
    shear = share * 0.01 * outer.normals(*STEEP)[2] * uphill / (uphill @ uphill)
    load, force, _ = pressed_ball(dome, STEEP, shear=shear, press=0.01)
    assert (force[2] > 0.0) == (share > 1.0)
    assert load.resultant()[0] == pytest.approx(force, abs=1e-12)
    assert load.contact_area == pytest.approx(pressed_ball(dome, STEEP, press=0.01)[0].contact_area)


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.2e-3, -0.7e-3), STEEP])
def test_a_force_along_the_surface_does_not_press(dome, place):
    outer = dome.surface.outer
    footprint = Footprint.from_height(resting_ball(outer, place), dome.surface)
    force = 0.2 * outer.frames(*place)[0]
    with pytest.warns(ContactWarning, match="no force pressing"):
        load = contact_load(dome, footprint, force, moment=np.cross(outer.positions(*place), force))
    assert not load.forces.any()


def test_the_warning_says_where_a_force_beside_the_pad_passes(dome):
    footprint = Footprint.from_height(resting_ball(dome.surface.outer, (0.0, 0.0)), dome.surface)
    force = np.array([0.0, 0.0, -0.2])
    with pytest.warns(ContactWarning, match=r"\(20, 0\) mm"):
        contact_load(dome, footprint, force, moment=np.cross([20e-3, 0.0, 0.0], force), law="elastic")


def test_only_shear_along_the_surface_counts_as_shear(dome):
    load = pressed_ball(dome, STEEP)[0]
    outward = dome.surface.outer.normals(*STEEP)
    most = LINEAR_RANGE * dome.pad.layers[0].young * load.contact_area
    state = replace(load.state, indentation=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_beyond_linear_range(dome, -0.99 * most * outward, outward, state)
    with pytest.warns(ContactWarning, match="mean pressure"):
        warn_beyond_linear_range(dome, -1.01 * most * outward, outward, state)


def test_moments_that_tilt_a_body_of_fixed_orientation_are_results(dome):
    outer = dome.surface.outer
    axes, at = outer.frames(*STEEP), outer.positions(*STEEP)
    force, footprint = -0.2 * axes[2], Footprint.from_height(resting_ball(outer, STEEP), dome.surface)
    moment = np.cross(at + 1e-4 * (axes[0] + axes[1]), force)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        contact_load(dome, footprint, force, moment=moment, tilt="fixed")
    assert not [one for one in heard if "cannot carry" in str(one.message)]


def test_indentation_counts_from_first_contact(dome):
    def above(shift: float) -> Footprint:
        ball = resting_ball(dome.surface.outer, (0.0, 0.0))
        return Footprint.from_height(lambda x, y: ball(x, y) + shift, dome.surface)

    loads = [contact_load(dome, above(shift), (0.0, 0.0, -0.2), law="elastic") for shift in (-4e-4, 0.0, 3e-4)]
    assert [one.indentation for one in loads] == pytest.approx([loads[1].indentation] * 3, rel=1e-6)
    assert 0.0 < loads[1].indentation < 3e-4


def test_what_friction_cannot_hold_is_left_over(dome):
    load, force, moment = pressed_ball(dome, shear=(0.2, 0.0), friction=0.5, law="elastic")
    assert np.linalg.norm(load.residual_force) == pytest.approx(0.1, rel=0.02)
    assert load.resultant()[0] + load.residual_force == pytest.approx(force, abs=1e-12)
    assert load.resultant()[1] + load.residual_moment == pytest.approx(moment, abs=1e-14)


@pytest.mark.parametrize("surface", [SphereCap(1e3), CylinderSector(1e3)])
def test_far_centres_of_curvature_leave_the_flat_pad(surface):
    flat, bent = (in_double_precision(replace(LAYERED_PAD, surface=one), COARSE) for one in (Flat(), surface))
    readings = []
    for influence in (flat, bent):
        footprint = Footprint.from_gap(
            lambda x, y: ((x - 1e-3) ** 2 + (y + 0.5e-3) ** 2) / (2 * BALL), influence.surface
        )
        force = np.array([0.03, 0.01, -0.2])
        moment = np.cross([1e-3, -0.5e-3, 0.0], force)
        readings.append(influence.readings(contact_load(influence, footprint, force, moment=moment, law="elastic")))
    np.testing.assert_allclose(readings[1], readings[0], rtol=0, atol=2e-3 * readings[0].max())


def off_by(influence: InfluenceMatrices, turn: float, cells: int) -> float:
    """Error of a flat square's readings that so many cells make, turned by an angle [deg], against 1,500 cells."""
    face = rotate(box(-2e-3, -2e-3, 2e-3, 2e-3), turn, origin=(0, 0))
    footprint = Footprint.from_height(lambda x, _: np.zeros_like(x), influence.surface, outline=face)
    found, dense = (
        influence.readings(contact_load(influence, footprint, (0.0, 0.0, -0.5), law="elastic", cells=count))
        for count in (cells, 1500)
    )
    return float(np.linalg.norm(found - dense) / np.linalg.norm(dense))


def test_a_square_may_lie_askew_to_its_cells():
    """On a dome of 100 mm. Measured: 1.3 % along the cells, .6 to .9 % askew, at 20 cells; .5 and .4 % at 60."""
    influence = in_double_precision(replace(LAYERED_PAD, surface=SphereCap(0.1)), COARSE)
    askew = [off_by(influence, turn, 20) for turn in (15.0, 30.0, 45.0)]
    assert max(askew) < max(off_by(influence, 0.0, 20), 0.015)
    assert off_by(influence, 30.0, 60) < min(0.006, askew[1])


@pytest.mark.parametrize(("askew", "tangential"), [(0.0, "proportional"), (20.0, "proportional"), (20.0, "stick")])
def test_a_contact_turned_with_its_dome_reads_turned(askew, tangential):
    """To rounding, cut balls at the sides included: cells, patches of the compliance and taxels' balls turn along."""
    taxels = TaxelGrid(rows=9, columns=9, pitch=(1.45e-3, 1.45e-3))
    bulge, readings = in_double_precision(replace(BULGES["dome"], taxels=taxels), COARSE), []
    outer = bulge.surface.outer
    for turns, (x, y) in enumerate([(3e-3, 2.5e-3), (-2.5e-3, 3e-3)]):
        normal, z = outer.normals(x, y), float(outer.height(x, y))
        face = rotate(box(x - 1.5e-3, y - 1.5e-3, x + 1.5e-3, y + 1.5e-3), askew + 90.0 * turns)
        plate = Footprint.from_height(
            lambda u, v, at=(x, y, z), n=normal: at[2] - (n[0] * (u - at[0]) + n[1] * (v - at[1])) / n[2],
            bulge.surface,
            outline=face,
        )
        shear = 0.3 * np.cross(normal, [-y, x, 0.0]) / np.hypot(x, y)
        force = -0.8 * normal + (shear if tangential == "stick" else 0.0)
        moment = np.cross([x, y, z], force)
        load = contact_load(bulge, plate, force, moment=moment, law="elastic", tangential=tangential, cells=20)
        readings.append(bulge.readings(load))
    expected = np.rot90(readings[0], -1, (1, 2))
    np.testing.assert_allclose(readings[1], expected, rtol=0, atol=1e-12 * expected.max())


def as_patch(surface: Surface) -> SurfacePatch:
    """The same surface over the pad as splines, which know of no mirrors."""
    lines = [np.linspace(-half, half, 33) for half in (5.2e-3, 3.7e-3)]
    heights = surface.height(*np.meshgrid(*lines, indexing="ij"))
    spline = RectBivariateSpline(lines[0], lines[1], heights, kx=5, ky=5)
    (knots_x, knots_y), coefficients = spline.get_knots(), spline.get_coeffs()
    shape = len(knots_x) - 6, len(knots_y) - 6
    return SurfacePatch(tuple(knots_x), tuple(knots_y), tuple(map(tuple, np.reshape(coefficients, shape))))


def test_a_patch_feels_as_the_surface_it_follows(dome):
    patch = in_double_precision(replace(DOME, surface=as_patch(DOME.surface)), COARSE)
    assert len(patch.mirrors.classes) == 1
    expected, found = (one.readings(pressed_ball(one, shear=(0.03, -0.02), law="elastic")[0]) for one in (dome, patch))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * expected.max())


@pytest.mark.parametrize("mirrors", [(True, False), (False, True), (False, False)])
def test_the_core_reads_pads_with_fewer_mirrors(mirrors):
    """By its own sums it reads what the matrices say in NumPy."""

    class Lopsided(EllipsoidCap):
        @property
        def mirrors(self) -> tuple[bool, bool]:
            return mirrors

    influence = in_double_precision(replace(DOME, surface=Lopsided((11e-3, 8e-3, 9e-3))), COARSE)
    load = SurfaceLoad.from_tractions(
        influence, Point(1e-3, -0.7e-3).buffer(1.4e-3), lambda points, normals: -1e4 * normals + [300.0, 0.0, 0.0]
    )
    expected = influence.readings_of(influence.point_response(load))
    np.testing.assert_allclose(influence.readings(load), expected, rtol=1e-9)


def test_a_body_stands_where_it_is_said_to(dome):
    """Heights over the pad's plane and over its surface are two ways to say the same."""
    outer, place = dome.surface.outer, (1.2e-3, -0.7e-3)
    height = resting_ball(outer, place)
    upright = Footprint.from_height(height, dome.surface)
    over = Footprint.from_gap(lambda x, y: height(x, y) - outer.height(x, y), dome.surface)
    force = -0.2 * outer.normals(*place)
    moment = np.cross(outer.positions(*place), force)
    first, second = (contact_load(dome, one, force, moment=moment, law="elastic") for one in (upright, over))
    np.testing.assert_allclose(first.forces, second.forces, rtol=0, atol=1e-9)


@pytest.mark.parametrize("press", [0.3, 1.0])
def test_the_steep_sides_of_a_block_change_nothing(press):
    """It leans on a dome beside its apex. Lines along the dome's normal pass its edges, where it rises steeply."""
    bulge = in_double_precision(BULGES["dome"], COARSE)
    turn = Rotation.from_quat([0.956062, 0.053337, -0.067021, -0.280372], scalar_first=True).as_matrix()
    middle, half = np.array([-3.707e-3, -1.512e-3, 11.111e-3]), np.array([11.48e-3, 3.014e-3, 11.461e-3])

    def side(x, y, axis, sign):
        normal = sign * turn[:, axis]
        return middle[2] + (half[axis] - normal[0] * (x - middle[0]) - normal[1] * (y - middle[1])) / normal[2]

    def block(x, y):
        lower = np.max([side(x, y, axis, -np.sign(turn[2, axis])) for axis in range(3)], axis=0)
        upper = np.min([side(x, y, axis, np.sign(turn[2, axis])) for axis in range(3)], axis=0)
        return np.where(lower <= upper, lower, np.inf)

    def face(x, y):
        alone = side(x, y, 2, -1.0)
        return np.where(block(x, y) == alone, alone, np.inf)

    force = -press * turn[:, 2]
    moment = np.cross([-1.8e-3, -0.9e-3, -0.2e-3], force)
    found, expected = (
        bulge.readings(
            contact_load(bulge, Footprint.from_height(one, bulge.surface), force, moment=moment, law="elastic")
        )
        for one in (block, face)
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3 * expected.max())


def test_a_function_written_for_the_sheet_has_no_body_beside_it(dome):
    """Its square root is of a negative number there."""
    east = dome.surface.bounds[2]

    def rises(x, _):
        return np.sqrt(east - x)

    footprint = Footprint.from_height(rises, dome.surface)
    assert footprint.bounds[2] > east
    found = footprint.heights(np.array([[east - 1e-4, 0.0], [east + 1e-4, 0.0]]))
    assert found == pytest.approx([1e-2, np.inf])
    with pytest.raises(FootprintError, match="the height function is nan"):
        Footprint.from_height(lambda x, y: np.where(x > 0.0, np.nan, rises(x, y)), dome.surface)


def test_from_height_on_a_flat_pad_is_from_gap(layered):
    def height(x, y):
        return (x**2 + y**2) / (2 * BALL) + 3e-3

    made = [make(height, layered.surface) for make in (Footprint.from_height, Footprint.from_gap)]
    first, second = (contact_load(layered, one, [0.0, 0.0, -0.2], law="elastic") for one in made)
    np.testing.assert_array_equal(first.forces, second.forces)


def test_a_face_as_curved_as_the_pad_presses_evenly(dome):
    footprint = Footprint.from_outline(Point(0.0, 0.0).buffer(1.5e-3), dome.surface)
    load = contact_load(dome, footprint, [0.0, 0.0, -0.2], law="uniform")
    assert load.contact_area == pytest.approx(np.pi * 1.5e-3**2, rel=0.03)
    assert load.peak_pressure == pytest.approx(0.2 / (np.pi * 1.5e-3**2), rel=0.05)


def test_two_bodies_feel_each_other(dome):
    outer = dome.surface.outer
    places = [(-2.2e-3, 0.0), (2.2e-3, 0.0)]
    footprints = [Footprint.from_height(resting_ball(outer, place, 2e-3), dome.surface) for place in places]
    forces = np.array([-0.1 * outer.normals(*place) for place in places])
    moments = np.array([np.cross(outer.positions(*place), force) for place, force in zip(places, forces, strict=True)])
    loads = contact_loads(dome, footprints, forces, moments=moments, law="elastic")
    alone = contact_load(dome, footprints[0], forces[0], moment=moments[0], law="elastic")
    for load, force in zip(loads, forces, strict=True):
        np.testing.assert_allclose(load.resultant()[0], force, atol=1e-12)
    # Mirror images of each other, each a little deeper or higher than alone.
    np.testing.assert_allclose(loads[0].indentation, loads[1].indentation, rtol=1e-6)
    assert 1e-4 < abs(loads[0].indentation / alone.indentation - 1) < 0.2


@pytest.mark.parametrize("law", ["foundation", "uniform"])
def test_each_of_two_bodies_has_its_own_contact_region(dome, law):
    outer = dome.surface.outer
    places = [(-2.2e-3, 0.0), (2.2e-3, 0.5e-3)]
    footprints = [Footprint.from_height(resting_ball(outer, place, 2e-3), dome.surface) for place in places]
    forces = np.array([-0.1 * outer.normals(*place) for place in places])
    moments = np.array([np.cross(outer.positions(*place), force) for place, force in zip(places, forces, strict=True)])
    loads = contact_loads(dome, footprints, forces, moments=moments, law=law)
    for load, footprint, force, moment, place in zip(loads, footprints, forces, moments, places, strict=True):
        alone = contact_load(dome, footprint, force, moment=moment, law=law)
        np.testing.assert_allclose(load.contact.bounds, alone.contact.bounds, rtol=0, atol=1e-9)
        assert load.contact.distance(Point(place)) == 0.0


@pytest.mark.parametrize("degrees", [5.0, 12.0])
def test_a_ball_rolled_about_the_centre_gives_rolled_readings(degrees):
    """Of a sphere cap about its centre, by taxels rolled with it; what is left is the coarse mesh's error."""
    radius, turn = 12e-3, Rotation.from_euler("y", degrees, degrees=True)
    outer, centre = SphereCap(radius), np.array([0.0, 0.0, -radius])
    across = np.stack(np.meshgrid(np.linspace(-1.5e-3, 1.5e-3, 5), np.linspace(-1e-3, 1e-3, 3)), axis=-1).reshape(-1, 2)
    still = outer.positions(across[:, 0], across[:, 1], 1.5e-3)
    rolled = turn.apply(still - centre) + centre
    taxels = FreeTaxels(np.concatenate([still, rolled]), np.full(2 * len(still), 0.4e-3))  # type: ignore[arg-type]
    pad = Pad(
        size=(14e-3, 10e-3), layers=(Layer(thickness=3e-3, young=3e6, poisson=0.49),), taxels=taxels, surface=outer
    )
    influence = in_double_precision(pad, MESHES["draft"])
    readings = []
    for angle in (Rotation.identity(), turn):
        middle = angle.apply([0.0, 0.0, radius + BALL]) + centre
        force, touch = angle.apply([0.02, 0.01, -0.3]), angle.apply([0.0, 0.0, radius]) + centre
        footprint = Footprint.from_height(sphere_height(BALL, middle), influence.surface)
        load = contact_load(influence, footprint, force, moment=np.cross(touch, force), law="elastic")
        readings.append(influence.readings(load).reshape(2, -1)[len(readings)])
    assert np.linalg.norm(readings[1] - readings[0]) < 0.03 * np.linalg.norm(readings[0])


ROLLED = (4.0, 9.0, 15.0)


@pytest.fixture(scope="module")
def rolled_tip() -> InfluenceMatrices:
    """A cylinder whose far sides are three thicknesses away from all that is looked at; taxels, and the same rolled."""
    radius, thickness = 8e-3, 1.3e-3
    outer, axis = CylinderSector(radius), np.array([0.0, 0.0, -radius])
    angles, across, depths = np.radians([-9.0, -4.0, 0.0, 5.0]), (-0.9e-3, 0.0, 0.6e-3), (0.55e-3, 0.9e-3)
    x, y, depth = (grid.ravel() for grid in np.meshgrid(radius * np.sin(angles), across, depths))
    still = outer.positions(x, y, depth)
    turns = [Rotation.from_euler("y", degrees, degrees=True) for degrees in (0.0, *ROLLED)]
    points = np.concatenate([turn.apply(still - axis) + axis for turn in turns])
    taxels = FreeTaxels(points, np.full(len(points), 0.26e-3))  # type: ignore[arg-type]
    layers = (Layer(thickness=thickness, young=1e6, poisson=0.49),)
    pad = Pad(size=(13.2e-3, 5e-3), layers=layers, taxels=taxels, surface=outer)
    density = replace(MESHES["draft"], in_plane_size=0.25)
    return in_double_precision(pad, density)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", ROLLED)
@pytest.mark.parametrize("body", ["ball", "plate"])
def test_a_body_rolled_about_the_axis_gives_rolled_readings(rolled_tip, body, degrees):
    """Of a cylinder, whatever of the mesh it stands on. Sides do not roll: where they are near, readings tell."""
    outer, places = rolled_tip.surface.outer, (0.0, *ROLLED)
    readings = []
    for angle in (0.0, degrees):
        turn, place = Rotation.from_euler("y", angle, degrees=True), (8e-3 * np.sin(np.radians(angle)), 0.0)
        touch, (along, across) = outer.positions(*place), -outer.normals(*place)[:2] / outer.normals(*place)[2]
        plane = Footprint.from_height(
            lambda x, y, at=touch, slopes=(along, across): at[2] + slopes[0] * (x - at[0]) + slopes[1] * (y - at[1]),
            rolled_tip.surface,
        )
        ball = Footprint.from_height(resting_ball(outer, place), rolled_tip.surface)
        force = turn.apply([0.01, 0.005, -0.15])
        footprint = ball if body == "ball" else plane
        load = contact_load(rolled_tip, footprint, force, moment=np.cross(touch, force), law="elastic")
        readings.append(rolled_tip.readings(load).reshape(len(places), -1)[places.index(angle)])
    assert np.linalg.norm(readings[1] - readings[0]) < 0.01 * np.linalg.norm(readings[0])


@pytest.mark.slow
def test_a_small_contact_reads_beside_the_middle_as_in_it():
    """On mesh "default". With the flat pad's grading, readings of this ball change by 2 % as it rolls."""
    outer, axis = CylinderSector(8e-3), np.array([0.0, 0.0, -8e-3])
    angles, across, depths = np.radians([-8.0, 0.0, 4.0]), (-0.6e-3, 0.0), (0.5e-3,)
    x, y, depth = (grid.ravel() for grid in np.meshgrid(8e-3 * np.sin(angles), across, depths))
    still, turn = outer.positions(x, y, depth), Rotation.from_euler("y", 10.0, degrees=True)
    points = np.concatenate([still, turn.apply(still - axis) + axis])
    taxels = FreeTaxels(points, np.full(len(points), 0.3e-3))  # type: ignore[arg-type]
    layers = (Layer(thickness=2e-3, young=1e6, poisson=0.49),)
    pad = Pad(size=(13.6e-3, 8e-3), layers=layers, taxels=taxels, surface=outer)
    influence, readings = in_double_precision(pad, MESHES["default"]), []
    for angle in (0.0, 10.0):
        place = (8e-3 * np.sin(np.radians(angle)), 0.0)
        footprint = Footprint.from_height(resting_ball(outer, place), influence.surface)
        force = Rotation.from_euler("y", angle, degrees=True).apply([0.0, 0.0, -0.05])
        load = contact_load(influence, footprint, force, moment=np.cross(outer.positions(*place), force), law="elastic")
        readings.append(influence.readings(load).reshape(2, -1)[len(readings)])
    assert np.linalg.norm(readings[1] - readings[0]) < 0.01 * np.linalg.norm(readings[0])


def test_patches_of_a_nearly_flat_surface_answer_as_flat_ones():
    x, y = np.linspace(-4e-3, 4e-3, 8), np.linspace(-3e-3, 3e-3, 7)
    flat, bent = flat_responses(x, y), bent_responses(x, y, SphereCap(1e3))
    largest = flat.inverse_distance.max()
    for name in ("inverse_distance", "xx", "xy", "yy", "along", "across"):
        # Those far apart are integrated by points.
        np.testing.assert_allclose(getattr(bent, name), getattr(flat, name), rtol=0, atol=2e-4 * largest, err_msg=name)


def test_patches_of_a_curved_surface_answer_each_other_alike():
    x, y = np.linspace(-4e-3, 4e-3, 8), np.linspace(-3e-3, 3e-3, 7)
    compliance = bent_responses(x, y, EllipsoidCap((11e-3, 8e-3, 9e-3))).compliance(1e-6, 0.4)
    whole = compliance.reshape(compliance.shape[0] * compliance.shape[1], -1)
    np.testing.assert_allclose(whole, whole.T, rtol=0, atol=1e-12 * whole.max())
