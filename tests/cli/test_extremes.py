"""The ends of what may be asked: right to a stated error, or a clear one. The table: `mjtactile bench extremes`."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import Phase, assume, example, given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Point, Polygon, affinity, box
from small_pads import COARSE
from threadpoolctl import threadpool_limits

from mjtactile.cli.benchmarks.extremes import WAYS, attempt, extremes_table, left_over, solution_error, wrong_inputs
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.wrench_basis import WrenchBasis
from mjtactile.dataset.shapes import sphere_height
from mjtactile.errors import ContactError, ContactWarning, MjTactileError, PadError
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad

#: What is wrong with an example is told, not how long its tables print.
quietly = pytest.mark.filterwarnings(
    "ignore::mjtactile.errors.ContactWarning", "ignore::hypothesis.errors.HypothesisWarning"
)
#: A failing load is told as it is: solving hundreds of smaller ones takes minutes.
NO_SHRINKING = (Phase.explicit, Phase.reuse, Phase.generate)
#: What is carried is the given wrench to this fraction of it.
CARRIED = 1e-9


def pad_of(*layers: tuple[float, float, float]) -> Pad:
    """The paper's pad with other layers: thickness [mm], modulus [Pa], Poisson ratio."""
    stack = tuple(Layer(thickness=t * 1e-3, young=e, poisson=nu) for t, e, nu in layers)
    return Pad(layers=stack)


@pytest.mark.parametrize(
    ("pad", "tolerance"),
    [
        (pad_of((5, 3e6, 0.0)), 1e-12),
        (pad_of((5, 3e6, 0.4999)), 1e-10),
        (pad_of((5, 3e6, 0.4999999)), 1e-7),  # products with inverses: 2e-3
        (pad_of((5, 1.0, 0.49)), 1e-12),
        (pad_of((5, 1e12, 0.49)), 1e-12),
        (pad_of((1, 3e12, 0.49), (4, 3e6, 0.49)), 1e-6),
        (pad_of((1, 3.0, 0.49), (4, 3e6, 0.49)), 1e-12),
        (pad_of((1e-3, 3e6, 0.49), (4.999, 3e6, 0.49)), 1e-9),
        (pad_of((1e-3, 3e12, 0.49), (4.999, 3e6, 0.49)), 1e-3),
    ],
    ids=["nu 0", "nu .4999", "nu .4999999", "1 Pa", "1e12 Pa", "stiff top", "soft top", "1 um", "1 um, stiff"],
)
def test_solution_is_that_of_refined_sparse_factors(pad, tolerance):
    assert solution_error(pad, COARSE) <= tolerance


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: pad_of((5, 3e6, 0.5)), r"poisson = 0\.5 is outside \[0, 0\.5\)\. .* use 0\.49"),
        (lambda: pad_of((0.9e-3, 3e6, 0.49)), "layer thickness = 9e-07 m; expected 1e-06 to 10 m"),
    ],
    ids=["incompressible", "thinner than 1 um"],
)
def test_pads_beyond_the_extremes_are_refused(make, message):
    with pytest.raises(PadError, match=message):
        make()


shapes = st.fixed_dictionaries(
    {
        "name": st.sampled_from(INDENTER_NAMES),
        "shift": st.tuples(st.floats(-8e-3, 8e-3), st.floats(-8e-3, 8e-3)),
        "rotate_deg": st.floats(0, 360),
        "scale": st.sampled_from([0.01, 0.1, 0.5, 1.0, 3.0]),
    }
)
directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1))
ways = st.sampled_from(list(WAYS))
tilts = st.sampled_from(["free", "fixed"])


def given_wrench(face: Footprint, decade: float, direction, lever, torsion: float) -> tuple[np.ndarray, np.ndarray]:
    """A force of a mean pressure 10^decade Pa through a point a lever [m] from the face's centroid, with a torsion."""
    size = 10.0**decade * face.area
    force = size * np.array([*direction, -1.0])
    through = np.append(np.add(face.centroid, lever), 0.0)
    return force, np.cross(through, force) + np.array([0.0, 0.0, size * torsion])


def check_load(influence, face: Footprint, force, moment, way: str, tilt: str, cells: int) -> SurfaceLoad:
    load = contact_load(influence, face, force, moment=moment, tilt=tilt, cells=cells, **WAYS[way])
    assert load.resultant()[0][2] == pytest.approx(force[2], rel=CARRIED), "what presses is carried"
    readings = influence.readings(load)
    assert np.isfinite(readings).all()
    assert readings.max() > 0.0
    return load


def faced(name: str, shift: tuple[float, float], rotate_deg: float, scale: float) -> dict[str, object]:
    return {"name": name, "shift": shift, "rotate_deg": rotate_deg, "scale": scale}


@quietly
@settings(max_examples=40, deadline=None, phases=NO_SHRINKING)
# Two cells with one middle hold much torsion; readings beyond single precision; a cell as large as the sheet beside a
# splinter; corners that rounding left apart.
@example(
    shape=faced("ellipse", (0.0, -8e-3), 90.0, 3.0),
    way="elastic, stick",
    tilt="fixed",
    cells=3,
    decade=4.2,
    direction=(0.05, 1.0),
    lever=(-0.023, -8e-4),
    torsion=1.2e-4,
)
@example(
    shape=faced("ellipse", (2.5e-3, 0.0), 45.0, 0.5),
    way="elastic, stick",
    tilt="fixed",
    cells=2,
    decade=5.0,
    direction=(-0.9, -0.8),
    lever=(-3e-6, 0.047),
    torsion=-4e-5,
)
@example(
    shape=faced("star", (-8e-3, 1e-9), 1e-9, 3.0),
    way="elastic",
    tilt="free",
    cells=2,
    decade=-4.2,
    direction=(1.0, -0.15),
    lever=(0.52, -1e-7),
    torsion=-3.5e-4,
)
@example(
    shape=faced("triangle", (0.0, 2.5e-3), 61.70680727898751, 0.01),
    way="elastic, stick",
    tilt="free",
    cells=20,
    decade=-2.75,
    direction=(1.0, 0.0),
    lever=(0.0, 0.0),
    torsion=7.8e-4,
)
# A second look at the contact finds nothing under the body's new tilt.
@example(
    shape=faced("doughnut", (0.0, 0.0), 104.00568053444088, 3.0),
    way="elastic, coulomb",
    tilt="free",
    cells=60,
    decade=-5.5569694575570185,
    direction=(-0.2014287606988463, -0.8084706988701642),
    lever=(-0.00023597024310976223, -0.09719259248310903),
    torsion=-0.0008124062339466067,
)
@given(
    shape=shapes,
    way=ways,
    tilt=tilts,
    cells=st.sampled_from([1, 2, 3, 20, 60]),
    decade=st.floats(-9, 5),
    direction=directions,
    lever=st.just((0.0, 0.0)) | st.tuples(st.floats(-1, 1), st.floats(-1, 1)).map(lambda p: (p[0] ** 7, p[1] ** 7)),
    torsion=st.floats(-1e-3, 1e-3),
)
def test_any_flat_face_under_any_wrench(draft, shape, way, tilt, cells, decade, direction, lever, torsion):
    """Pressed through any point up to a metre away."""
    outline = indenter_outline(**shape)
    assume(outline.intersection(box(-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)).area > 1e-10)
    face = Footprint.from_outline(outline, draft.surface)
    force, moment = given_wrench(face, decade, direction, lever, torsion)
    load = check_load(draft, face, force, moment, way, tilt, cells)
    # A torsion with a longer lever shears a face with more than the pad bears.
    held = "friction" not in WAYS[way] and abs(torsion) <= np.sqrt(face.area)
    if held and cells >= 20 and tilt == "free" and np.hypot(*lever) == 0.0:
        assert left_over(load, force, moment, 1e-2) <= CARRIED


def sphere(radius, x, y):
    return sphere_height(radius, np.array([x, y, radius]))


BODIES = {
    "sphere": lambda a, x, y: sphere(10 ** (-2 + a), x, y),
    "cone": lambda a, x, y: lambda u, v: (0.01 + abs(a)) * np.hypot(u - x, v - y),
    "tilted plane": lambda a, x, y: lambda u, v: a * u + (x + y) * 10 * v,
    "edge": lambda a, x, y: lambda u, v: np.abs(a * (u - x) + 0.1 * (v - y)),
    "two spheres": lambda a, x, y: lambda u, v: np.minimum(sphere(1e-3, x, y)(u, v), sphere(1e-3, -x, -y)(u, v) + 1e-6),
    "steps": lambda a, x, y: lambda u, v: np.floor((u - x) / 1e-3) * 1e-5 + 0.0 * v,
    "far away": lambda a, x, y: lambda u, v: 7.0 + 0.0 * u,
}


@quietly
@settings(max_examples=25, deadline=None, phases=NO_SHRINKING)
# Shear that presses some cells with more than the pad bears.
@example(
    body="tilted plane",
    slope=-0.098,
    place=(3e-6, -5.13e-3),
    way="elastic, coulomb",
    tilt="free",
    decade=2.0,
    direction=(0.0, 0.0),
)
@given(
    body=st.sampled_from(list(BODIES)),
    slope=st.floats(-0.1, 0.1),
    place=st.tuples(st.floats(-7e-3, 7e-3), st.floats(-7e-3, 7e-3)),
    way=ways,
    tilt=tilts,
    decade=st.floats(-3, 4),
    direction=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
)
def test_any_body_is_carried_or_refused(draft, body, slope, place, way, tilt, decade, direction):
    footprint = Footprint.from_gap(BODIES[body](slope, *place), draft.surface)
    force, moment = given_wrench(footprint, decade, direction, (0.0, 0.0), 0.0)
    with contextlib.suppress(ContactError):
        check_load(draft, footprint, force, moment, way, tilt, 60)


@pytest.mark.parametrize("way", WAYS)
@quietly
def test_readings_of_flat_faces_scale_with_the_force(draft, way):
    face = Footprint.from_outline(indenter_outline("star", shift=(1e-3, 0.5e-3), rotate_deg=20), draft.surface)
    force, moment = np.array([0.02, 0.01, -0.2]), np.array([1e-4, 2e-4, 1e-5])
    unit = draft.readings(contact_load(draft, face, force, moment=moment, cells=60, **WAYS[way]))
    for scale in (1e-9, 1e-3, 10.0):
        readings = draft.readings(
            contact_load(draft, face, scale * force, moment=scale * moment, cells=60, **WAYS[way])
        )
        np.testing.assert_allclose(readings, scale * unit, rtol=0, atol=1e-6 * scale * unit.max())


@pytest.mark.parametrize("way", WAYS)
def test_mirrored_load_has_mirrored_readings(draft, way):
    """Cells follow the outline's first edge, and a mirrored outline's is cut otherwise: 2 % on coarse cells."""
    outline = indenter_outline("triangle", shift=(1.2e-3, 0.5e-3), rotate_deg=20, scale=0.7)
    mirrored = affinity.scale(outline, -1, 1, origin=(0, 0))
    force = np.array([0.02, 0.01, -0.2])
    pair = [
        draft.readings(contact_load(draft, Footprint.from_outline(shape, draft.surface), one, cells=150, **WAYS[way]))
        for shape, one in ((outline, force), (mirrored, force * [-1, 1, 1]))
    ]
    tolerance = 1e-6 if way in ("uniform", "foundation") else 0.02
    np.testing.assert_allclose(pair[1][:, :, ::-1], pair[0], rtol=0, atol=tolerance * pair[0].max())


def rewritten(outline: Polygon, how: str) -> Polygon:
    """The same area, written otherwise."""
    ring = np.array(outline.exterior.coords)[:-1]
    if how == "start":
        ring = np.roll(ring, 7, axis=0)
    elif how == "reversed":
        ring = ring[::-1]
    elif how == "duplicates":
        ring = np.repeat(ring, 2, axis=0)
    elif how == "thousands of points":
        steps = np.linspace(0, 1, 80, endpoint=False)[:, None]
        ring = np.concatenate([a + steps * (b - a) for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)])
    return Polygon(ring)


@pytest.mark.parametrize("how", ["start", "reversed", "duplicates", "thousands of points"])
@pytest.mark.parametrize("law", ["uniform", "foundation", "elastic"])
def test_answer_does_not_depend_on_how_the_outline_is_written(draft, law, how):
    """Laws on cells: to what other cells of the same number make of it."""
    outline = indenter_outline("ellipse", shift=(1e-3, 0.5e-3), rotate_deg=20, scale=0.6)
    force = np.array([0.02, 0.01, -0.2])
    readings = [
        draft.readings(contact_load(draft, Footprint.from_outline(one, draft.surface), force, law=law, cells=150))
        for one in (outline, rewritten(outline, how))
    ]
    tolerance = 0.02 if law == "elastic" else 1e-6
    np.testing.assert_allclose(readings[1], readings[0], rtol=0, atol=tolerance * readings[0].max())


@pytest.mark.parametrize("way", WAYS)
def test_face_of_several_parts_and_slivers(draft, way):
    parts = [Point(-4e-3, 1e-3).buffer(1e-3), Point(3e-3, -2e-3).buffer(5e-6), box(0, 3e-3, 5e-3, 3.002e-3)]
    face = Footprint.from_outline(MultiPolygon(parts), draft.surface)
    force, moment = given_wrench(face, 3, (0.1, 0.05), (0.0, 0.0), 1e-5)
    load = contact_load(draft, face, force, moment=moment, cells=60, **WAYS[way])
    assert left_over(load, force, moment, 1e-2) <= CARRIED
    assert np.isfinite(draft.readings(load)).all()


@pytest.mark.parametrize("way", WAYS)
def test_force_far_outside_warns_and_the_nearest_is_used(draft, way):
    face = Footprint.from_outline(box(-2e-3, -2e-3, 2e-3, 2e-3), draft.surface)
    force, moment = np.array([0.0, 0.0, -0.01]), np.array([0.0, 10.0, 0.0])
    with pytest.warns(ContactWarning, match="outside its contact cells"):
        load = contact_load(draft, face, force, moment=moment, cells=60, **WAYS[way])
    carried = load.resultant()[1][1] / 0.01
    assert 1.2e-3 < carried < 2e-3, "near the face's edge"
    np.testing.assert_allclose(load.resultant()[1] + load.residual_moment, moment, atol=1e-9)


@pytest.mark.parametrize("law", ["uniform", "foundation", "elastic"])
def test_a_contact_that_stays_does_not_drift(draft, law):
    """A million updates: `mjtactile bench extremes`."""
    face = Footprint.from_outline(indenter_outline("circle"), draft.surface)
    basis, force = WrenchBasis(draft, face, law=law, cells=60), np.array([0.02, 0.01, -0.2])
    first = [basis.readings(force, np.zeros(3)) for _ in range(3)][-1]
    last = first
    for _ in range(1000):
        last = basis.readings(force, np.zeros(3))
    np.testing.assert_array_equal(last, first)
    np.testing.assert_allclose(
        first,
        draft.readings(contact_load(draft, face, force, moment=np.zeros(3), law=law, cells=60)),
        rtol=0,
        atol=1e-5 * first.max(),
    )


@pytest.mark.parametrize("way", WAYS)
def test_repeated_contacts_are_the_same_bits(draft, way):
    face = Footprint.from_outline(indenter_outline("square", shift=(1e-3, 0)), draft.surface)
    with threadpool_limits(limits=1, user_api="blas"):
        first, second = (contact_load(draft, face, (0.02, 0.01, -0.2), cells=60, **WAYS[way]).forces for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_wrong_inputs_end_in_an_error_that_says_what_was_expected(draft):
    calls = wrong_inputs(draft, Footprint.from_outline(box(-1e-3, -1e-3, 1e-3, 1e-3), draft.surface))
    for name, call in calls.items():
        with pytest.raises(MjTactileError) as caught:
            call()
        assert len(str(caught.value)) > 20, name


def test_a_body_smaller_than_the_search_cells_is_found(draft):
    """Two small spheres far apart: cells of the first lattice are wider than either."""
    left, right = sphere(0.3e-3, -5.05e-3, -5.05e-3), sphere(0.3e-3, 5e-3, 5e-3)

    def body(x, y):
        return np.minimum(left(x, y), right(x, y))

    load = contact_load(
        draft, Footprint.from_gap(body, draft.surface), (0, 0, -0.001), law="elastic", tilt="fixed", cells=200
    )
    assert load.resultant()[0][2] == pytest.approx(-0.001, rel=CARRIED)


def test_table_shows_errors_and_distances():
    rows = [attempt("a", "b", lambda: ("c", 1.5e-3)), attempt("d", "e", lambda: (pad_of((5, -1, 0.3)).summary, None))]
    table = extremes_table([row._asdict() for row in rows])
    assert "| a | c | 1.5e-03 | b |" in table
    assert "| d | PadError: young = -1.0 Pa; expected" in table
