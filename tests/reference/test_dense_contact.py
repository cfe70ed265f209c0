"""The dense contact against closed forms, against its own conditions, and against the package's contact laws."""

from dataclasses import replace

import dense_contact
import numpy as np
import pytest
import shapely
from dense_contact import Body, DenseContactError, dense_readings
from dense_surface import mean_inverse_distance
from shapely import affinity

import mjtactile
from mjtactile.contact.cells.compliance import surface_compliance

FORCE = 0.5
DOWN = np.array([0.0, 0.0, -FORCE])
NOTHING = np.zeros(3)


def ball(radius: float, x0: float = 0.0, y0: float = 0.0):
    def heights(x, y):
        square = radius**2 - (x - x0) ** 2 - (y - y0) ** 2
        return np.where(square >= 0.0, radius - np.sqrt(np.maximum(square, 0.0)), np.inf)

    return heights


def face(outline: shapely.Polygon):
    shapely.prepare(outline)
    return lambda x, y: np.where(shapely.intersects_xy(outline, x, y), 0.0, np.inf)


def through(x: float, y: float) -> np.ndarray:
    """Moment of the force DOWN that passes through a point."""
    return FORCE * np.array([-y, x, 0.0])


def difference(readings, expected) -> float:
    return float(np.linalg.norm(readings - expected) / np.linalg.norm(expected))


def test_mean_inverse_distance_of_a_square_to_itself():
    side = np.array([2e-3, 2e-3])
    expected = (4 * np.log(1 + np.sqrt(2)) + 4 * (1 - np.sqrt(2)) / 3) / 2e-3
    assert mean_inverse_distance(np.zeros(1), np.zeros(1), side, side)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("offset", [(3e-4, 1e-4), (6e-4, 2e-4), (1e-3, -2e-3), (3.9e-3, 1e-3), (4.1e-3, 1e-3)])
def test_mean_inverse_distance_of_rectangles_apart(offset):
    first, second = np.array([1e-4, 2e-4]), np.array([2e-4, 5e-5])
    nodes, weights = np.polynomial.legendre.leggauss(12)
    x1, y1, x2, y2 = np.meshgrid(*(side / 2 * nodes for side in (*first, *second)), indexing="ij")
    weight = np.einsum("a,b,c,d->abcd", weights, weights, weights, weights) / 16
    expected = (weight / np.hypot(offset[0] + x1 - x2, offset[1] + y1 - y2)).sum()
    found = mean_inverse_distance(np.array(offset[:1]), np.array(offset[1:]), first, second)
    assert found[0] == pytest.approx(expected, rel=1e-6)


def test_ball_on_a_half_space_is_hertz(draft, monkeypatch):
    surface = surface_compliance(draft)
    half_space = replace(surface, remainder=np.zeros_like(surface.remainder))
    monkeypatch.setattr(dense_contact, "surface_compliance", lambda _: half_space)
    radius, top = 5e-3, draft.pad.layers[0]
    modulus = top.young / (1 - top.poisson**2)
    contact = (3 * FORCE * radius / (4 * modulus)) ** (1 / 3)
    dense = dense_readings(draft, [Body(ball(radius, 1e-3, -2e-3), DOWN, through(1e-3, -2e-3))])
    part = dense.bodies[0]
    assert dense.pressed_area == pytest.approx(np.pi * contact**2, rel=0.02)
    assert part.pressures.max() == pytest.approx(1.5 * FORCE / (np.pi * contact**2), rel=0.01)
    sunk = part.motion[0] + part.motion[1:] @ (1e-3, -2e-3)
    # The parabola of Hertz is a little less steep than the ball.
    assert sunk == pytest.approx(contact**2 / radius, rel=0.01)


@pytest.mark.parametrize(
    "outline",
    [
        shapely.box(-5e-3, -5e-3, 5e-3, 5e-3),
        shapely.box(-1e-3, -6e-3, 3e-3, 2e-3),
        affinity.rotate(shapely.box(-3e-3, -3e-3, 3e-3, 3e-3), 30.0),
        shapely.Point(0.0, 0.0).buffer(4e-3, quad_segs=64),
    ],
    ids=["square", "beside the middle", "turned", "disc"],
)
def test_flat_punch_reads_as_with_many_cells_of_the_package(draft, outline):
    x, y = outline.centroid.coords[0]
    dense = dense_readings(draft, [Body(face(outline), DOWN, through(x, y))])
    footprint = mjtactile.Footprint.from_outline(outline, draft.surface)
    load = mjtactile.contact_load(draft, footprint, DOWN, moment=through(x, y), law="elastic", cells=800)
    assert difference(dense.readings, draft.readings(load)) < 0.01


@pytest.mark.parametrize("yaw", [0.0, 30.0])
def test_lying_cylinder_reads_as_with_many_cells_of_the_package(draft, yaw):
    along, radius = np.deg2rad(yaw), 3e-3

    def heights(x, y):
        u, v = x * np.cos(along) + y * np.sin(along), y * np.cos(along) - x * np.sin(along)
        inside = (np.abs(u) <= 4e-3) & (np.abs(v) <= radius)
        return np.where(inside, radius - np.sqrt(np.maximum(radius**2 - v**2, 0.0)), np.inf)

    dense = dense_readings(draft, [Body(heights, DOWN, NOTHING)])
    footprint = mjtactile.Footprint.from_gap(heights, draft.surface)
    load = mjtactile.contact_load(draft, footprint, DOWN, moment=NOTHING, law="elastic", cells=800)
    assert difference(dense.readings, draft.readings(load)) < 0.02


@pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")  # strains are large under so narrow a ring
@pytest.mark.parametrize("off_middle", [0.0, 1.3e-4])
def test_a_ring_reads_as_with_few_and_with_many_cells_of_the_package(draft, off_middle):
    """Cells that were narrower than the pressed strip once missed most of it: 800 were 65 % off."""
    tube, ring, force = 0.78e-3, 3.7e-3, 3.0 * DOWN

    def heights(x, y):
        away = np.hypot(x - 0.4e-3, y + 0.3e-3) - ring
        return np.where(np.abs(away) < tube, tube - np.sqrt(np.maximum(tube**2 - away**2, 0.0)), np.inf)

    moment = 3.0 * through(0.4e-3, off_middle - 0.3e-3)
    dense = dense_readings(draft, [Body(heights, force, moment)])
    footprint = mjtactile.Footprint.from_height(heights, draft.surface)
    # Measured: at most 1.1, .7, .07 and .05 %.
    for cells, bound in ((20, 0.015), (60, 0.01), (800, 0.002), (2500, 0.002)):
        load = mjtactile.contact_load(draft, footprint, force, moment=moment, law="elastic", cells=cells)
        assert difference(dense.readings, draft.readings(load)) < bound, cells


def test_slanted_edge_is_pressed_along_its_whole_length(draft):
    slant = np.deg2rad(20.0)

    def heights(x, y):
        return np.where(np.hypot(x, y) < 5e-3, np.abs(x * np.sin(slant) - y * np.cos(slant)), np.inf)

    dense = dense_readings(draft, [Body(heights, 0.03 * DOWN, NOTHING)], cells=1000, cap=3e6)
    part = dense.bodies[0]
    pressed = part.centroids[part.pressures > 0.0]
    along = pressed @ (np.cos(slant), np.sin(slant))
    assert np.abs(pressed @ (-np.sin(slant), np.cos(slant))).max() < 2e-6
    carried, _ = np.histogram(along, np.linspace(-4e-3, 4e-3, 9), weights=part.pressures[part.pressures > 0.0])
    assert np.ptp(carried) < 0.1 * carried.mean()


def test_two_balls_of_one_body_read_symmetrically(draft):
    def heights(x, y):
        return np.minimum(ball(2e-3, -4e-3)(x, y), ball(2e-3, 4e-3)(x, y))

    readings = dense_readings(draft, [Body(heights, DOWN, NOTHING)]).readings
    assert difference(readings[:, :, ::-1], readings) < 1e-9
    assert difference(readings[:, ::-1], readings) < 1e-9


def test_third_ball_that_hangs_lower_is_found_wherever_it_is(draft):
    def heights(x, y):
        feet = [ball(1e-3, -4e-3, -3e-3)(x, y), ball(1e-3, 4e-3, -3e-3)(x, y), ball(0.5e-3, 0.13e-3, 5.21e-3)(x, y)]
        return np.minimum.reduce(feet)

    dense = dense_readings(draft, [Body(heights, DOWN, NOTHING)], cells=800)
    part = dense.bodies[0]
    near = np.hypot(*(part.centroids - (0.13e-3, 5.21e-3)).T) < 0.5e-3
    # Its share of a force through the origin: 3 / (3 + 5.21).
    assert -part.forces[near, 2].sum() == pytest.approx(FORCE * 3.0 / 8.21, rel=0.01)


def test_resultants_are_the_wrench(draft):
    force, moment = np.array([0.1, -0.2, -FORCE]), np.array([2e-4, -3e-4, 5e-4])
    dense = dense_readings(draft, [Body(face(shapely.box(-4e-3, -4e-3, 4e-3, 4e-3)), force, moment)], cells=800)
    assert np.abs(dense.wrench[:3] - force).max() < 1e-9 * FORCE
    assert np.abs(dense.wrench[3:] - moment).max() < 1e-9 * FORCE * 4e-3
    assert np.abs(dense.left).max() < 1e-9


@pytest.mark.parametrize("sideways", [0.0, 0.2, 0.8])
def test_torsion_beyond_its_bound_is_left(draft, sideways):
    force, moment = np.array([sideways * FORCE, 0.0, -FORCE]), np.array([0.0, 0.0, 1e-3])
    dense = dense_readings(draft, [Body(ball(5e-3), force, moment)], cap=1e9)
    part = dense.bodies[0]
    pressing = -part.forces[:, 2]
    pressed = pressing > 0.0
    shear = (part.forces[:, :2] - part.leaning)[pressed] / pressing[pressed, None]
    assert np.hypot(*shear.T).max() == pytest.approx(max(1.0, 1.5 * sideways), rel=1e-9)
    if sideways == 0.0:
        # The mean square radius of Hertz's pressure is two fifths of the contact's. At the rim, shear is the pressure.
        radius = np.sqrt(dense.pressed_area / np.pi)
        assert moment[2] - dense.left[5] == pytest.approx(0.4 * FORCE * radius, rel=0.02)


def test_moment_that_nothing_carries_is_left(draft):
    dense = dense_readings(
        draft, [Body(face(shapely.box(-4e-3, -4e-3, 4e-3, 4e-3)), DOWN, through(6e-3, 0.0))], cells=1000, cap=3e6
    )
    assert dense.left[4] == pytest.approx(FORCE * 2e-3, rel=0.03)
    # The bound of pressure keeps the middle of the force off the rim.
    assert dense.bodies[0].through[0] == pytest.approx(4e-3 - FORCE / 3e6 / 8e-3 / 2, abs=1e-5)


@pytest.mark.parametrize("cap", [None, 1.5e5])
def test_conditions_of_contact_hold(draft, cap):
    def heights(x, y):
        return np.minimum(ball(3e-3, -3e-3)(x, y), 20e-6 + ball(2e-3, 3e-3, 1e-3)(x, y))

    dense = dense_readings(draft, [Body(heights, DOWN, NOTHING)], cells=1000, cap=cap)
    part = dense.bodies[0]
    pressures, pressed = part.pressures, part.pressures > 0.0
    deepest = (part.motion[0] + part.centroids @ part.motion[1:] - part.cells.heights).max()
    assert max(dense.violations.values()) < 1e-9
    assert pressures.min() >= 0.0
    most = np.inf if cap is None else cap * part.cells.share
    assert (pressures <= most * (1 + 1e-9)).all()
    full = pressures >= most * (1 - 1e-9)
    assert full.any() == (cap is not None)
    assert np.abs(part.gaps[pressed & ~full]).max() < 1e-9 * deepest
    assert part.gaps[~full].min() > -1e-9 * deepest
    assert part.gaps[full].max(initial=0.0) < 1e-9 * deepest


def test_more_than_the_bound_of_pressure_carries_is_refused(draft):
    with pytest.raises(DenseContactError, match="carries"):
        dense_readings(draft, [Body(face(shapely.box(-1e-3, -1e-3, 1e-3, 1e-3)), DOWN, NOTHING)], cap=1e5)


def test_body_that_pulls_is_refused(draft):
    with pytest.raises(DenseContactError, match="does not press"):
        dense_readings(draft, [Body(ball(1e-3), -DOWN, NOTHING)])


def test_body_that_keeps_its_orientation_presses_where_it_is_lowest(draft):
    wedge = shapely.box(-3e-3, -3e-3, 3e-3, 3e-3)

    def heights(x, y):
        return face(wedge)(x, y) + 0.05 * (x + 3e-3)

    fixed = dense_readings(draft, [Body(heights, 0.1 * DOWN, NOTHING)], cells=800, tilting=False).bodies[0]
    free = dense_readings(draft, [Body(heights, 0.1 * DOWN, NOTHING)], cells=800).bodies[0]
    assert fixed.through[0] < -2e-3
    assert np.abs(free.through).max() < 1e-9
    assert free.motion[1] == pytest.approx(0.05, rel=1e-6)


@pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")
def test_two_bodies_feel_each_other_as_in_the_package(draft):
    places, radius = (-1.3e-3, 1.3e-3), 3e-3
    bodies = [Body(ball(radius, x), DOWN, through(x, 0.0)) for x in places]
    dense = dense_readings(draft, bodies, cells=1000)
    footprints = [mjtactile.Footprint.from_gap(ball(radius, x), draft.surface) for x in places]
    moments = [through(x, 0.0) for x in places]
    loads = mjtactile.contact_loads(draft, footprints, [DOWN, DOWN], moments=moments, law="elastic", cells=800)
    assert difference(dense.readings, draft.readings(loads[0] + loads[1])) < 0.01
    alone = dense_readings(draft, bodies[:1], cells=500).bodies[0].motion
    # The other one has bent the surface on one side.
    together = dense.bodies[0].motion
    assert together[0] + places[0] * together[1] > 1.02 * (alone[0] + places[0] * alone[1])
