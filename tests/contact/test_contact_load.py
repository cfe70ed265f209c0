"""Contact loads: the wrench that goes in comes out, pressure never pulls, and what cannot be carried is said."""

from __future__ import annotations

import itertools
import math
import pickle
import warnings
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from nodal_integrals import nodal_integrals
from numpy.typing import ArrayLike
from shapely import LineString, MultiPolygon, Point, Polygon, affinity, box

from mjtactile.contact.contact_load import contact_load, contact_loads
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.wrench_basis import WrenchBasis
from mjtactile.errors import ContactError, ContactWarning, FootprintError, InfluenceError
from mjtactile.fem.line import Line
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.fidelity import Fidelity
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.geometry.planar import polygons_of, triangulate
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import SphereCap

INFLUENCE = influence_matrices(fidelity=Fidelity(mesh="draft"), progress=False)
SIDE = 6e-3
SQUARE = Footprint.from_outline(box(-SIDE / 2, -SIDE / 2, SIDE / 2, SIDE / 2), INFLUENCE.surface)
#: The resultant is the wrench to this fraction of it.
CARRIED = 1e-9


def wrench_size(force: np.ndarray, moment: np.ndarray, length: float) -> float:
    return float(np.linalg.norm(force) + np.linalg.norm(moment) / length)


def wrench_difference(load: SurfaceLoad, force: np.ndarray, moment: np.ndarray, length: float) -> float:
    got_force, got_moment = load.resultant()
    return wrench_size(got_force - force, got_moment - moment, length) / wrench_size(force, moment, length)


def moment_of(force: np.ndarray, through: tuple[float, float], torsion: float = 0.0) -> np.ndarray:
    return np.cross([*through, 0.0], force) + np.array([0.0, 0.0, torsion])


quietly = pytest.mark.filterwarnings("ignore:the mean pressure:mjtactile.errors.ContactWarning")
#: Powers of ten of the mean pressure [Pa]: over the modulus nothing more is carried.
decades = st.floats(-12, 4)
fractions = st.floats(0.0, 0.9)


@quietly
@settings(max_examples=80, deadline=None)
@given(
    name=st.sampled_from(INDENTER_NAMES),
    shift=st.tuples(st.floats(-6e-3, 6e-3), st.floats(-6e-3, 6e-3)),
    turn=st.floats(0, 360),
    decade=decades,
    direction=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    towards=st.integers(0, 1000),
    fraction=fractions,
    torsion=st.floats(-1e-3, 1e-3),
)
def test_resultant_is_the_wrench(name, shift, turn, decade, direction, towards, fraction, torsion):
    """Any force that presses through the hull, over 16 decades, with shear and torsion: carried, and no warning."""
    footprint = Footprint.from_outline(indenter_outline(name, shift=shift, rotate_deg=turn), INFLUENCE.surface)
    assume(footprint.area > 1e-7)
    corners = shapely.get_coordinates(footprint.outline.convex_hull)
    corner = corners[towards % len(corners)]
    through = tuple(footprint.centroid + fraction * (corner - footprint.centroid))
    size = 10.0**decade * footprint.area
    force = size * np.array([*direction, -1.0])
    moment = moment_of(force, through, size * torsion)
    load = contact_load(INFLUENCE, footprint, force, moment=moment)
    length = math.sqrt(footprint.area)
    assert wrench_difference(load, force, moment, length) <= CARRIED
    assert wrench_size(load.residual_force, load.residual_moment, length) <= CARRIED * wrench_size(
        force, moment, length
    )


def nodal_pressure(load: SurfaceLoad) -> np.ndarray:
    """Coefficients c0, c1, c2 of the pressure c0 + c1 x + c2 y whose nodal forces the load's z components are."""
    integrals = nodal_integrals(load.surface, load.contact).reshape(3, -1).T
    scale = np.abs(integrals).max(axis=0)
    return np.linalg.lstsq(integrals / scale, -load.forces[..., 2].ravel(), rcond=None)[0] / scale


def corners_of(contact: Polygon | MultiPolygon) -> np.ndarray:
    return np.concatenate([triangulate(polygon)[0] for polygon in polygons_of(contact)])


@quietly
@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(INDENTER_NAMES),
    turn=st.floats(0, 360),
    towards=st.integers(0, 1000),
    fraction=st.floats(0, 0.98),
)
def test_pressure_never_pulls(name, turn, towards, fraction):
    """A linear function is least at a corner of the contact: reconstruct it from the nodal forces and look there."""
    footprint = Footprint.from_outline(indenter_outline(name, shift=(1e-3, 0), rotate_deg=turn), INFLUENCE.surface)
    corners = shapely.get_coordinates(footprint.outline.convex_hull)
    through = footprint.centroid + fraction * (corners[towards % len(corners)] - footprint.centroid)
    force = np.array([0.0, 0.0, -1e-6])  # what slivers bear
    load = contact_load(INFLUENCE, footprint, force, moment=moment_of(force, tuple(through)))
    coefficients = nodal_pressure(load)
    pressure = coefficients[0] + corners_of(load.contact) @ coefficients[1:]
    # Where the pressure ends it is zero, to the grid its outline is drawn on.
    assert pressure.min() >= -1e-5 * pressure.max()
    assert footprint.outline.buffer(1e-9).covers(load.contact)


@pytest.mark.parametrize("share", [0.2, 0.3, 0.45])
def test_force_near_an_edge_stands_on_a_strip(share):
    """Three times as long as the force is from the edge, under a triangular pressure twice the mean at the edge."""
    force = np.array([0.0, 0.0, -0.2])
    load = contact_load(INFLUENCE, SQUARE, force, moment=moment_of(force, (share * SIDE, 0.0)))
    length = 3 * (0.5 - share) * SIDE
    x_low, y_low, x_high, y_high = load.contact.bounds
    assert x_high - x_low == pytest.approx(length, rel=1e-8)  # where the search for the contact stops
    assert (x_high, y_low, y_high) == pytest.approx((SIDE / 2, -SIDE / 2, SIDE / 2), rel=1e-12)
    coefficients = nodal_pressure(load)
    at_edge = coefficients @ [1.0, SIDE / 2, 0.0]
    assert at_edge == pytest.approx(2 * 0.2 / (length * SIDE), rel=1e-7)
    assert coefficients @ [1.0, SIDE / 2 - length, 0.0] == pytest.approx(0.0, abs=1e-6 * float(at_edge))


def test_central_force_is_a_constant_traction():
    load = contact_load(INFLUENCE, SQUARE, (0.03, -0.02, -0.1))
    traction = np.array([0.03, -0.02, -0.1]) / SIDE**2
    integrals = nodal_integrals(INFLUENCE.surface, SQUARE.outline)[0]
    expected = integrals[..., None] * traction
    np.testing.assert_allclose(load.forces, expected, atol=1e-13 * np.abs(expected).max())  # rounding
    assert load.contact.symmetric_difference(SQUARE.outline).area <= 1e-6 * SQUARE.area


def test_torsion_is_a_rotation_about_the_contacts_middle():
    footprint = Footprint.from_outline(affinity.translate(SQUARE.outline, 1e-3, 2e-3), INFLUENCE.surface)
    force = np.array([0.0, 0.0, -0.1])
    load = contact_load(INFLUENCE, footprint, force, moment=moment_of(force, footprint.centroid, 1e-5))
    rate = 1e-5 / (SIDE**4 / 6)  # over the square's polar moment
    integrals = nodal_integrals(INFLUENCE.surface, footprint.outline)
    expected_x = -rate * (integrals[2] - 2e-3 * integrals[0])
    expected_y = rate * (integrals[1] - 1e-3 * integrals[0])
    np.testing.assert_allclose(load.forces[..., 0], expected_x, atol=1e-12 * np.abs(expected_x).max())
    np.testing.assert_allclose(load.forces[..., 1], expected_y, atol=1e-12 * np.abs(expected_y).max())


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_by_default_the_force_acts_at_the_centroid(name):
    outline = indenter_outline(name, shift=(1.25e-3, -0.7e-3), rotate_deg=20)
    footprint = Footprint.from_outline(outline, INFLUENCE.surface)
    force = np.array([0.02, 0.01, -0.1])
    load = contact_load(INFLUENCE, footprint, force)
    assert wrench_difference(load, force, moment_of(force, footprint.centroid), 1e-2) <= 1e-12
    there = contact_load(INFLUENCE, footprint, force, moment=moment_of(force, footprint.centroid))
    np.testing.assert_allclose(there.forces, load.forces, atol=1e-12 * np.abs(load.forces).max())


def test_footprint_over_the_edge_is_loaded_where_it_is_on_the_sheet():
    footprint = Footprint.from_outline(indenter_outline("circle", shift=(6e-3, 0)), INFLUENCE.surface)
    load = contact_load(INFLUENCE, footprint, (0, 0, -0.1))
    assert footprint.outline.bounds[2] == pytest.approx(7.5e-3)
    assert (
        wrench_difference(load, np.array([0, 0, -0.1]), moment_of(np.array([0, 0, -0.1]), footprint.centroid), 1e-2)
        < 1e-12
    )


@quietly
@pytest.mark.parametrize("through", [(0.6 * SIDE, 0.0), (0.0, -2 * SIDE), (SIDE, SIDE)])
def test_force_outside_the_hull_warns_and_leaves_the_rest(through):
    force = np.array([1e-6, 0.0, -1e-6])  # what the sliver at a corner bears
    moment = moment_of(force, through)
    with pytest.warns(ContactWarning, match=r"cannot carry this wrench: the force passes through .* outside"):
        load = contact_load(INFLUENCE, SQUARE, force, moment=moment)
    got_force, got_moment = load.resultant()
    np.testing.assert_allclose(got_force, force, atol=CARRIED * 1e-6)
    np.testing.assert_allclose(load.residual_moment, moment - got_moment, atol=1e-15)
    # The nearest it can carry: through the hull's edge, a thousandth of the side inside.
    carried_through = np.array([got_moment[1], -got_moment[0]]) / 1e-6
    np.testing.assert_allclose(carried_through, np.clip(through, -0.499 * SIDE, 0.499 * SIDE), atol=1e-6 * SIDE)


@quietly
@pytest.mark.parametrize("door", ["contact_load", "contact_loads", "readings", "load"])
def test_warnings_point_at_the_line_that_called(door):
    force, moment = (0, 0, -0.01), moment_of(np.array([0, 0, -0.01]), (6e-3, 0))
    doors = {
        "contact_load": lambda: contact_load(INFLUENCE, SQUARE, force, moment=moment),
        "contact_loads": lambda: contact_loads(INFLUENCE, [SQUARE], [force], moments=[moment]),
        "readings": lambda: WrenchBasis(INFLUENCE, SQUARE).readings(force, moment),
        "load": lambda: WrenchBasis(INFLUENCE, SQUARE).load(force, moment),
    }
    with pytest.warns(ContactWarning) as heard:
        doors[door]()
    assert {one.filename for one in heard} == {__file__}


@quietly
def test_warning_tells_how_much_is_left_over_and_where_the_force_passed():
    with pytest.warns(
        ContactWarning, match=r"\(6, -?0\) mm, outside its contact cells .* moment \(.*, 3\.\d+e-05, .*\) N m"
    ):
        contact_load(INFLUENCE, SQUARE, (0, 0, -0.01), moment=moment_of(np.array([0, 0, -0.01]), (6e-3, 0)))


def test_pulling_warns_and_loads_nothing():
    with pytest.warns(ContactWarning, match="pulls the indenter off"):
        load = contact_load(INFLUENCE, SQUARE, (0.1, 0.0, 0.2))
    assert not load.forces.any()
    np.testing.assert_array_equal(load.residual_force, [0.1, 0.0, 0.2])


def test_a_load_does_not_change_with_the_callers_arrays():
    force, moment = np.array([0.0, 0.0, 0.2]), np.array([1e-4, 0.0, 0.0])
    with pytest.warns(ContactWarning, match="pulls"):
        load = contact_load(INFLUENCE, SQUARE, force, moment=moment)
    force[:] = moment[:] = 7.0
    np.testing.assert_array_equal(load.residual_force, [0.0, 0.0, 0.2])
    np.testing.assert_array_equal(load.residual_moment, [1e-4, 0.0, 0.0])


@pytest.mark.parametrize("moment", [None, (1e-4, 0.0, 0.0)])
def test_shear_without_a_press_warns_and_is_left_over(moment):
    with pytest.warns(ContactWarning, match="no force pressing"):
        load = contact_load(INFLUENCE, SQUARE, (0.1, 0.0, 0.0), moment=moment)
    assert not load.forces.any()
    np.testing.assert_array_equal(load.residual_force, [0.1, 0.0, 0.0])


def test_no_force_is_no_load():
    load = contact_load(INFLUENCE, SQUARE, (0.0, 0.0, 0.0))
    assert not load.forces.any()
    assert not load.residual_force.any()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(6))
def test_numbers_that_are_none_are_refused(bad, place):
    wrench = np.array([0.0, 0.0, -0.1, 0.0, 0.0, 0.0])
    wrench[place] = bad
    name = "force" if place < 3 else "moment"
    with pytest.raises(ContactError, match=rf"{name} = .*(nan|inf).*three finite numbers"):
        contact_load(INFLUENCE, SQUARE, wrench[:3], moment=wrench[3:])


@pytest.mark.parametrize("force", [(0, 0), -0.1, [(0, 0, -0.1)], (0, 0, "-0.1"), np.array([0, 0, 1j - 1])], ids=str)
def test_forces_of_another_shape_are_refused(force):
    with pytest.raises(ContactError, match="three finite numbers"):
        contact_load(INFLUENCE, SQUARE, force)


@pytest.mark.parametrize("option", ["law", "tangential", "tilt"])
def test_a_name_in_an_array_is_refused_as_an_unknown_one(option):
    chosen: dict[str, ArrayLike] = {option: np.array(["elastic", "stick"])}
    with pytest.raises(ContactError, match=rf"{option} array\(.*does not exist.*Available: \w+, "):
        contact_load(INFLUENCE, SQUARE, (0, 0, -0.1), **chosen)  # type: ignore[arg-type]


@quietly
@pytest.mark.parametrize("law", ["uniform", "foundation", "elastic"])
def test_readings_are_proportional_until_the_modulus_is_reached_and_the_rest_is_left(law):
    """As docs/extremes.md says: a square of 10 mm bears 3 MPa over 100 mm^2, 300 N."""
    face = Footprint.from_outline(box(-5e-3, -5e-3, 5e-3, 5e-3), INFLUENCE.surface)
    once = INFLUENCE.readings(contact_load(INFLUENCE, face, (0, 0, -1.0), law=law))
    for force in (2e-10, 30.0 if law == "elastic" else 299.0):
        readings = INFLUENCE.readings(contact_load(INFLUENCE, face, (0, 0, -force), law=law))
        # Single precision over a few hundred terms.
        assert np.linalg.norm(readings / force - once) < 1e-6 * np.linalg.norm(once)
    with pytest.warns(ContactWarning, match="more than its area can bear"):
        load = contact_load(INFLUENCE, face, (0, 0, -2000.0), law=law)
    assert load.resultant()[0][2] == pytest.approx(-300.0)
    assert load.residual_force[2] == pytest.approx(-1700.0)


def test_unknown_law_lists_those_that_exist():
    with pytest.raises(ContactError, match=r"'hertz' does not exist. Available: uniform, foundation, elastic\."):
        contact_load(INFLUENCE, SQUARE, (0, 0, -0.1), law="hertz")


def test_large_pressure_warns_of_the_linear_range():
    limit = 0.1 * 3e6 * SIDE**2
    with pytest.warns(ContactWarning, match="over 10% of the top layer's modulus"):
        contact_load(INFLUENCE, SQUARE, (0, 0, -1.01 * limit))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        contact_load(INFLUENCE, SQUARE, (0, 0, -0.99 * limit))


#: How far beside the load the pressure may be centred: the narrowest cells are as wide [m].
MISSED = 0.05e-3


@quietly
@pytest.mark.parametrize("higher", [30e-6, 70e-6, 80e-6, 90e-6, 100e-6])
def test_two_feet_of_which_one_bears_little_carry_the_load_together(higher):
    pin, blunt = np.array([-6e-3, 6e-3]), np.zeros(2)
    footprint = Footprint.from_height(feet([pin, blunt], [0.2e-3, 5e-3], [0.0, higher]), INFLUENCE.surface)
    force = np.array([0.0, 0.0, -0.046])
    for share in (0.3, 0.5, 0.7):
        moment = moment_of(force, tuple(share * pin + (1 - share) * blunt))
        load = contact_load(INFLUENCE, footprint, force, moment=moment, law="elastic")
        assert wrench_difference(load, force, moment, SIDE) < CARRIED


#: Among them those in which the body would have fallen over beside a foot that stands a little higher, or far away.
@quietly
@pytest.mark.parametrize("seed", [*range(25), 70, 80, 381, 1130, 1182, 1198, 1392, 1443, 1471, 1495, 1607, 1609, 1673])
def test_a_body_on_feet_tilts_onto_all_that_it_takes_to_carry_the_load(seed):
    random = np.random.default_rng(seed)
    count = random.integers(2, 5)
    places = random.uniform(-7e-3, 7e-3, (count, 2))
    radii = np.exp(random.uniform(np.log(0.2e-3), np.log(20e-3), count))
    heights = random.uniform(0, 0.15e-3, count) * random.integers(0, 2, count)
    through = random.dirichlet(np.ones(count)) @ places
    force = np.array([0.0, 0.0, -np.exp(random.uniform(np.log(0.02), np.log(2)))])
    footprint = Footprint.from_height(feet(places, radii, heights), INFLUENCE.surface)
    load = contact_load(INFLUENCE, footprint, force, moment=moment_of(force, tuple(through)), law="elastic")
    assert np.abs(load.residual_force).max() <= CARRIED * -force[2]
    assert np.linalg.norm(load.residual_moment) < MISSED * -force[2]


def feet(places: ArrayLike, radii: ArrayLike, heights: ArrayLike) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Lower side of a body that stands on paraboloids: their lowest points (n, 2), radii and heights (n) [m]."""

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        each = zip(np.asarray(places), np.asarray(radii), np.asarray(heights), strict=True)
        return np.min([((x - at[0]) ** 2 + (y - at[1]) ** 2) / 2 / radius + high for at, radius, high in each], axis=0)

    return height


#: A thin pad: where a face ends at its edge, the few cells that a lifted face presses matter most.
THIN_PAD = Pad(
    size=(4e-3, 4e-3),
    layers=(Layer(thickness=1e-3, young=3e6, poisson=0.48),),
    taxels=TaxelGrid(rows=9, columns=9, pitch=(0.4e-3, 0.4e-3)),
    depths=(0.25e-3, 0.75e-3),
    sampling_radius=0.125e-3,
)


@pytest.mark.parametrize("lean", [0.5, 0.6, 0.7])
def test_a_flat_face_that_lifts_off_in_part_is_read_on_cells_of_what_still_presses(lean):
    """Half to four fifths of a disc at the pad's corner press; 32 cells of that part read as 2,500 do."""
    influence = influence_matrices(THIN_PAD, fidelity=Fidelity(mesh="draft"), progress=False)
    disc = Footprint.from_outline(
        Point(1.2e-3, -0.8e-3).buffer(1.6e-3).intersection(box(-2e-3, -2e-3, 2e-3, 2e-3)), influence.surface
    )
    radius = math.sqrt(disc.area / math.pi)
    force = np.array([0.0, 0.0, -0.01])
    for way in np.radians((0, 90, 150, 230, 300)):
        at = np.asarray(disc.centroid) + 0.8 * lean * radius * np.array([np.cos(way), np.sin(way)])
        few, dense = (
            influence.readings(
                contact_load(
                    influence, disc, force, moment=moment_of(force, (at[0], at[1])), law="elastic", cells=cells
                )
            )
            for cells in (32, 2500)
        )
        assert np.linalg.norm(few - dense) <= 0.1 * np.linalg.norm(dense)


def rod(degrees: float, radius: float) -> Footprint:
    """A rod that lies across the whole pad, through its middle."""
    normal = np.array([-math.sin(math.radians(degrees)), math.cos(math.radians(degrees))])

    def gap(x, y):
        square = radius**2 - (normal[0] * x + normal[1] * y) ** 2
        return np.where(square > 0.0, radius - np.sqrt(np.maximum(square, 0.0)), np.inf)

    return Footprint.from_gap(gap, INFLUENCE.surface)


@pytest.mark.parametrize("cells", [20, 60])
def test_a_rod_across_the_pad_presses_up_to_its_edges_however_it_is_turned(cells):
    force, readings = (0.0, 0.0, -0.3), []
    for degrees in np.arange(41.5, 43.5, 0.2):
        load = contact_load(INFLUENCE, rod(degrees, 3e-3), force, law="elastic", cells=cells)
        readings.append(INFLUENCE.readings(load))
    changes = [np.linalg.norm(b - a) / np.linalg.norm(b) for a, b in itertools.pairwise(readings)]
    assert max(changes) < 0.05


@pytest.mark.parametrize("along", [-1.6e-3, -0.315e-3, 0.0, 1.2e-3])
def test_cells_in_one_row_carry_the_force_where_it_is(along):
    footprint = Footprint.from_outline(box(-2e-3, -2e-3, 2e-3, 2e-3), INFLUENCE.surface)
    force = np.array([0.0, 0.0, -0.01])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)  # a few micrometres across the row are not carried
        load = contact_load(
            INFLUENCE, footprint, force, moment=moment_of(force, (1.996e-3, along)), law="elastic", cells=60
        )
    carried = load.resultant()[1]
    assert carried[0] == pytest.approx(force[2] * along, abs=1e-9)
    assert carried[1] == pytest.approx(-force[2] * 1.996e-3, abs=0.01 * 25e-6)  # within half a cell


def test_readings_change_evenly_as_the_force_nears_a_faces_rim():
    footprint = Footprint.from_outline(box(-2e-3, -2e-3, 2e-3, 2e-3), INFLUENCE.surface)
    force = np.array([0.0, 0.0, -0.01])
    readings = []
    for x in np.arange(1.90e-3, 1.98e-3, 5e-6):
        load = contact_load(INFLUENCE, footprint, force, moment=moment_of(force, (x, 0.0)), law="elastic", cells=120)
        readings.append(INFLUENCE.readings(load))
    changes = [np.linalg.norm(b - a) / np.linalg.norm(b) for a, b in itertools.pairwise(readings)]
    assert max(changes) < 0.01


@pytest.mark.parametrize(("tangential", "friction"), [("stick", None), ("coulomb", 0.8)])
def test_shear_on_soft_layers_does_not_alternate(tangential, friction):
    """Cells as long as the top layer is thick: on their middles alone, 60 cells were 46 % off where they stick."""
    stack = ((1e-3, 1e6, 0.49), (1e-3, 4e6, 0.3), (2e-3, 2e6, 0.45))
    pad = Pad(
        size=(12e-3, 12e-3),
        layers=tuple(Layer(thickness=thickness, young=young, poisson=poisson) for thickness, young, poisson in stack),
        taxels=TaxelGrid(rows=9, columns=9, pitch=(1.2e-3, 1.2e-3)),
        depths=(1e-3, 3e-3),
        sampling_radius=0.5e-3,
    )
    influence = influence_matrices(pad, fidelity=Fidelity(mesh="draft"), progress=False)
    square = Footprint.from_outline(indenter_outline("square"), influence.surface)
    few, many = (
        influence.readings(
            contact_load(
                influence,
                square,
                (0.1, 0.05, -0.5),
                law="elastic",
                tangential=tangential,
                friction=friction,
                cells=cells,
            )
        )
        for cells in (60, 1000)
    )
    assert np.linalg.norm(few - many) <= 0.03 * np.linalg.norm(many)


def test_loads_add():
    first = contact_load(INFLUENCE, SQUARE, (0.01, 0, -0.1))
    circle = Footprint.from_outline(indenter_outline("circle", shift=(1e-3, 0), scale=0.5), INFLUENCE.surface)
    second = contact_load(INFLUENCE, circle, (0, 0.02, -0.2))
    both = first + second
    np.testing.assert_allclose(both.resultant(), np.add(first.resultant(), second.resultant()), atol=1e-16)
    assert both.contact.equals(first.contact.union(second.contact))
    stored = pickle.loads(pickle.dumps(first + second))  # before its contact was asked for
    assert stored.contact.equals(both.contact)
    np.testing.assert_array_equal(stored.forces, both.forces)


@pytest.mark.parametrize("traction", [None, 5.0])
def test_a_traction_is_a_function(traction):
    with pytest.raises(ContactError, match=r"traction is of type .*; expected a function of points and normals"):
        SurfaceLoad.from_tractions(INFLUENCE, SQUARE.outline, traction)


def test_what_is_left_over_adds_too():
    with pytest.warns(ContactWarning, match="pulls"):
        pulled = contact_load(INFLUENCE, SQUARE, (0.0, 0.0, 0.2))
    both = pulled + pulled + contact_load(INFLUENCE, SQUARE, (0, 0, -0.1))
    np.testing.assert_array_equal(both.residual_force, [0, 0, 0.4])


THICK = (Layer(thickness=6e-3, young=1e6, poisson=0.48),)
#: Another mesh; and pads of other sizes and shapes, whose grids have as many nodes.
OTHERS = {
    "mesh": InfluenceMatrices(Pad(), Fidelity(mesh="default"), {}),
    "width": InfluenceMatrices(
        Pad(size=(14.5e-3, 15e-3), taxels=TaxelGrid(pitch=(1.1e-3, 1.25e-3))), Fidelity(mesh="draft"), {}
    ),
    "length": InfluenceMatrices(
        Pad(size=(15e-3, 14.5e-3), taxels=TaxelGrid(pitch=(1.25e-3, 1.1e-3))), Fidelity(mesh="draft"), {}
    ),
    "thickness": InfluenceMatrices(Pad(layers=THICK), Fidelity(mesh="draft"), {}),
    "curvature": InfluenceMatrices(Pad(surface=SphereCap(20e-3)), Fidelity(mesh="draft"), {}),
}


@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_footprints_and_loads_of_another_surface_are_refused(other):
    assert (other.surface.node_shape == INFLUENCE.surface.node_shape) == (other is not OTHERS["mesh"])
    load = contact_load(INFLUENCE, SQUARE, (0, 0, -0.1))
    footprint = Footprint.from_outline(SQUARE.outline, other.surface)
    with pytest.raises(
        ContactError,
        match=r"the footprint was made on a .* mm .*but the pad's is a surface of 15 x 15 x 5 mm \(flat, 21",
    ):
        contact_load(INFLUENCE, footprint, (0, 0, -0.1))
    of_other = SurfaceLoad(np.zeros((*other.surface.node_shape, 3)), other.surface, SQUARE.outline)
    with pytest.raises(InfluenceError, match=r"the load .* made for another pad or mesh"):
        INFLUENCE.readings(of_other)
    for one, two in ((load, of_other), (of_other, load)):
        with pytest.raises(ContactError, match="same influence matrices"):
            one.__add__(two)


def test_a_surface_made_again_is_the_same():
    again = InfluenceMatrices(Pad(), INFLUENCE.fidelity, {}).surface
    assert again is not INFLUENCE.surface
    footprint = Footprint.from_outline(SQUARE.outline, again)
    found = contact_load(INFLUENCE, footprint, (0, 0, -0.1))
    np.testing.assert_array_equal(found.forces, contact_load(INFLUENCE, SQUARE, (0, 0, -0.1)).forces)


@pytest.mark.parametrize("other", [5, None, "load"])
def test_only_loads_add_to_loads(other):
    with pytest.raises(TypeError, match="unsupported operand"):
        _ = contact_load(INFLUENCE, SQUARE, (0, 0, -0.1)) + other


def test_no_load_has_no_resultant():
    load = SurfaceLoad.none(INFLUENCE.surface)
    np.testing.assert_array_equal(load.resultant(), np.zeros((2, 3)))
    assert load.contact.is_empty


def test_resultant_is_about_the_pads_origin():
    surface = SurfaceGrid(Line(np.array([0.0, 1.0])), Line(np.array([0.0, 2.0])), 1.0)
    forces = np.zeros((3, 3, 3))
    forces[2, 1] = (1.0, 2.0, 3.0)  # at (0.5, 2, 0)
    force, moment = SurfaceLoad(forces, surface, Polygon()).resultant()
    np.testing.assert_array_equal(force, [1, 2, 3])
    np.testing.assert_allclose(moment, np.cross([0.5, 2, 0], [1, 2, 3]))


def with_nan_at_the_third_corner(corners: np.ndarray) -> np.ndarray:
    return np.where(np.arange(len(corners))[:, None] == 2, math.nan, corners)


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (affinity.translate(SQUARE.outline, 1.0, 0), r"covers none of the pad: it spans x 0\.997.*Shift it"),
        (Polygon(), "covers none of the pad: it spans nothing"),
        (Polygon([(0, 0), (1e-3, 1e-3), (1e-3, 0), (0, 1e-3)]), r"not a valid area \(Self-intersection.*make_valid"),
        (LineString([(0, 0), (1e-3, 0)]), "LineString; expected a shapely Polygon"),
        (Point(0, 0), "Point; expected a shapely Polygon"),
        (shapely.transform(SQUARE.outline, lambda corners: corners * (math.inf, 1)), "NaN or infinite"),
        (shapely.transform(SQUARE.outline, with_nan_at_the_third_corner), "NaN or infinite"),
    ],
    ids=["off the sheet", "empty", "self-crossing", "a line", "a point", "infinite", "nan"],
)
def test_bad_outlines_are_refused_with_the_cure(outline, message):
    with pytest.raises(FootprintError, match=message):
        Footprint.from_outline(outline, INFLUENCE.surface)
