"""The compiled core answers as NumPy does, step by step, with every instruction set."""

import laws_on_cells
import numpy as np
import pytest
from core_calls import rigid_contact
from hypothesis import given, settings
from hypothesis import strategies as st
from nodal_integrals import nodal_integrals
from shapely import Point, affinity, box

import mjtactile
from mjtactile import _native as native
from mjtactile.fem.line import Line
from mjtactile.fem.surface_grid import SurfaceGrid, oriented_edges
from mjtactile.geometry.planar import areal
from mjtactile.influence.surface_load import SurfaceLoad

PAD = mjtactile.Pad()
#: Largest difference over the largest reading, by storage precision. Half precision is widened to single.
TOLERANCE = {"int8": 1e-6, "float16": 1e-6, "float32": 1e-6, "float64": 1e-12}
#: What tables may hold: every precision, every averaging, and loads on corners.
STORAGES = [
    *({"precision": precision, "reduction": 0.01} for precision in TOLERANCE),
    {"precision": "int8"},
    {"precision": ("float32", "float16", "int8"), "reduction": 0.01},
    {"averaging": "mean", "precision": "float16"},
    {"averaging": "quarters", "loads": "corners", "precision": "int8", "reduction": 0.01},
    {"loads": "corners", "precision": "float64"},
]


@pytest.fixture(scope="module", params=STORAGES, ids=str)
def influence(request):
    return mjtactile.influence_matrices(
        PAD, fidelity=mjtactile.Fidelity(mesh="draft", law="elastic", cells=60, **request.param)
    )


def random_forces(influence, seed):
    rng = np.random.default_rng(seed)
    forces = np.zeros((*influence.surface.node_shape, 3))
    rows, columns = (slice(*sorted(rng.choice(n + 1, 2, replace=False))) for n in influence.surface.node_shape)
    forces[rows, columns] = rng.normal(size=forces[rows, columns].shape)
    return forces * 10.0 ** rng.uniform(-9, 9)


def test_readings_of_random_forces(influence, instruction_set):
    tolerance = TOLERANCE[influence.fidelity.widest_precision]
    for seed in range(20):
        load = SurfaceLoad(random_forces(influence, seed), influence.surface, PAD_AREA)
        expected = influence.readings_of(influence.point_response(load))
        assert np.abs(influence.readings(load) - expected).max() <= tolerance * expected.max()


PAD_AREA = box(-1e-3, -1e-3, 1e-3, 1e-3)


def test_readings_of_no_force_are_zero(influence):
    assert not influence.readings(SurfaceLoad.none(influence.surface)).any()


def test_readings_do_not_depend_on_the_batch(influence):
    loads = [SurfaceLoad(random_forces(influence, s), influence.surface, PAD_AREA) for s in range(9)]
    together = influence.readings(loads)
    assert all((influence.readings(load) == one).all() for load, one in zip(loads, together, strict=True))


@pytest.mark.parametrize("tangential", ["proportional", "stick"])
def test_contact_load_of_every_shape_with_every_instruction_set(influence, tangential, instruction_set):
    options = {"moment": (1e-4, 3e-4, 1e-5), "tangential": tangential}
    for number, shape in enumerate(mjtactile.INDENTER_NAMES[:7]):
        outline = mjtactile.indenter_outline(shape, rotate_deg=40 * number, shift=(1e-3, -0.7e-3))
        footprint = mjtactile.Footprint.from_outline(outline, influence.surface)
        force = (0.02, -0.05, -0.5)
        ours = mjtactile.contact_load(influence, footprint, force, **options)
        native.use_instruction_set("plain")
        load = mjtactile.contact_load(influence, footprint, force, **options)
        native.use_instruction_set(instruction_set)
        assert np.abs(ours.forces - load.forces).max() <= 1e-11 * np.abs(load.forces).max()
        assert ours.indentation == pytest.approx(load.indentation, rel=1e-10)
        assert ours.tilts == pytest.approx(load.tilts, rel=1e-8, abs=1e-12)


numbers = st.floats(-1.2, 1.2)


@settings(max_examples=100, deadline=None)
@given(
    centre=st.tuples(numbers, numbers),
    size=st.floats(0.01, 1.5),
    angle=st.floats(0, 360),
    hole=st.booleans(),
    traction=st.tuples(numbers, numbers, numbers),
)
def test_nodal_forces_of_any_polygon(centre, size, angle, hole, traction):
    grid = SurfaceGrid(Line(np.array([-1.0, -0.7, -0.1, 0.1, 0.7, 1.0])), Line(np.array([-1.0, -0.5, 0.5, 1.0])), 1.0)
    region = Point(centre).buffer(size, quad_segs=3)
    if hole:
        region = region.difference(affinity.scale(region, 0.4, 0.4))
    region = areal(affinity.rotate(region, angle, origin=centre))
    edges = oriented_edges(region)
    tractions = np.broadcast_to(np.array(traction), (len(edges), 3))
    expected = nodal_integrals(grid, region)[0][..., None] * np.array(traction)
    assert np.abs(grid.traction_forces(edges, tractions) - expected).max() <= 1e-13


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), tilting=st.booleans())
def test_rigid_contact_of_random_gaps(seed, tilting):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (40, 2))
    distance = np.linalg.norm(points[:, None] - points, axis=-1)
    compliance = 1.0 / (distance + 0.05)
    compliance = compliance @ compliance.T
    gaps = rng.uniform(0, 1) * (points**2).sum(axis=1)
    modes = np.hstack([np.ones((40, 1)), points]) if tilting else np.ones((40, 1))
    resultants = np.array([1.0, *rng.uniform(-0.2, 0.2, 2)]) if tilting else np.ones(1)
    expected = laws_on_cells.pressing(compliance, modes, gaps, resultants)
    forces = rigid_contact(compliance, modes, gaps, resultants)
    assert ((forces > 0.0) == (expected > 0.0)).all()
    assert np.abs(forces - expected).max() <= 1e-9 * expected.max()


READ_ONLY = np.arange(6.0)
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    "array",
    [
        np.arange(6.0),
        np.arange(6.0)[2:],
        np.arange(6.0)[::-1],
        READ_ONLY,
        np.empty((0, 2)),
        np.arange(3, dtype=np.uintp),
    ],
    ids=["whole", "from the third on", "reversed", "read-only", "empty", "indices"],
)
def test_pointers_are_the_addresses_of_the_first_elements(array):
    assert native.pointer(array).value == array.ctypes.data


def test_no_array_is_a_null_pointer():
    assert native.pointer(None).value is None


def test_a_missing_library_says_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setenv("MJTACTILE_LIBRARY", str(tmp_path / "none.so"))
    with pytest.raises(mjtactile.NativeError, match="pip install"):
        native.library_path()


def test_a_library_that_cannot_be_loaded_says_what_to_do(monkeypatch, tmp_path):
    (tmp_path / "damaged.so").write_text("no library")
    monkeypatch.setenv("MJTACTILE_LIBRARY", str(tmp_path / "damaged.so"))
    with pytest.raises(mjtactile.NativeError, match=r"damaged\.so.*pip install"):
        native.library.__wrapped__()


def test_unknown_kernels_are_refused():
    with pytest.raises(mjtactile.NativeError, match="avx512"):
        native.use_instruction_set("sse9")
