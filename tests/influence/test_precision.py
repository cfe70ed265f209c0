"""Half precision and single bytes: what a row keeps, at any magnitude."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.fidelity import Fidelity, MeshDensity
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.cache import build_influence
from mjtactile.influence.storage import in_storage
from mjtactile.influence.stress_matrix import narrow, narrow_to_bytes, widen
from mjtactile.pad import Layer, Pad, TaxelGrid

#: Half of float16's last bit.
_ROUNDING = 2.0**-11
TINY = MeshDensity(in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(1,))


@settings(max_examples=40, deadline=None)
@given(st.integers(-30, 37), st.integers(0, 12), st.integers(0, 2**32 - 1))
def test_rows_keep_eleven_bits_whatever_their_magnitude(decade, spread, seed):
    """Rows of very different magnitude beside each other; entries of a row over up to twelve decades."""
    random = np.random.default_rng(seed)
    rows = 10.0 ** random.uniform(-30, 37, (5, 1))
    rows[0] = 10.0**decade
    matrix = (rows * random.uniform(-1, 1, (5, 40)) * 10.0 ** -random.uniform(0, spread, (5, 40))).astype(np.float32)
    half, scale = narrow(matrix)
    assert half.dtype == np.float16
    assert np.isfinite(half).all()
    error = np.abs(widen(half, scale).astype(float) - matrix)
    largest = np.abs(matrix).max(axis=1, keepdims=True).astype(float)
    # Below 2^-28 of the row's largest, float16 is subnormal: a fixed error of 2^-25 where that is at least 2^14.
    assert (error <= np.maximum(_ROUNDING * np.abs(matrix.astype(float)), 2.0**-39 * largest)).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(-30, 37), st.integers(0, 2**32 - 1))
def test_bytes_keep_a_share_of_their_rows_largest(decade, seed):
    random = np.random.default_rng(seed)
    rows = 10.0 ** random.uniform(-30, 37, (5, 1))
    rows[0] = 10.0**decade
    matrix = (rows * random.uniform(-1, 1, (5, 40))).astype(np.float32)
    stored, scale = narrow_to_bytes(matrix)
    assert stored.dtype == np.int8
    assert (np.abs(stored).max(axis=1) == 127).all()
    largest = np.abs(matrix).max(axis=1, keepdims=True).astype(float)
    assert (np.abs(widen(stored, scale).astype(float) - matrix) <= largest / 253.9).all()


@pytest.mark.parametrize("to", [narrow, narrow_to_bytes])
def test_rows_of_zeros_stay_zeros(to):
    np.testing.assert_array_equal(widen(*to(np.zeros((2, 3), np.float32))), 0.0)
    assert to(np.zeros((2, 0)))[0].shape == (2, 0)


def test_bytes_read_punches_within_a_percent(draft):
    """The error of some hundred columns adds up like noise, and noise makes norms larger."""
    stored = in_storage(draft, Fidelity(mesh="draft", precision="int8"))
    for name in INDENTER_NAMES:
        footprint = Footprint.from_outline(indenter_outline(name, shift=(1e-3, 0)), draft.surface)
        load = contact_load(draft, footprint, (0.05, 0.0, -0.5))
        expected, readings = draft.readings(load), stored.readings(load)
        assert np.linalg.norm(readings - expected) <= 0.01 * np.linalg.norm(expected)


def test_what_float16_holds_comes_back_exactly():
    matrix = np.array([[1.0, -0.5, 0.25, 0.0], [3e4, 1024.0, 0.0, -1.0]], np.float32)
    np.testing.assert_array_equal(widen(*narrow(matrix)), matrix)


def pad_of(top: float, bottom: float, scale: float = 1.0) -> Pad:
    """The paper's pad of two layers, their moduli in Pa, and all lengths times `scale`."""
    layers = tuple(Layer(thickness=2.5e-3 * scale, young=young, poisson=0.45) for young in (top, bottom))
    plain = Pad()
    pitch = (plain.grid.pitch[0] * scale, plain.grid.pitch[1] * scale)
    return Pad(
        size=(plain.size[0] * scale, plain.size[1] * scale),
        layers=layers,
        taxels=TaxelGrid(rows=13, columns=13, pitch=pitch),
        depths=tuple(depth * scale for depth in plain.depths),
        sampling_radius=plain.sampling_radius * scale,
    )


@pytest.mark.parametrize(
    ("top", "bottom", "scale"),
    [(1.0, 1.0, 1.0), (1e15, 1e15, 1.0), (1.0, 1e6, 1.0), (1e12, 1e6, 1.0), (3e6, 3e6, 1e-2), (3e6, 3e6, 5e2)],
    ids=str,
)
@pytest.mark.filterwarnings("ignore::mjtactile.errors.ContactWarning")  # soft pads leave the linear range
def test_half_precision_reads_the_same_for_any_modulus_and_size(top, bottom, scale):
    from shapely import Point

    pad = pad_of(top, bottom, scale)
    single = build_influence(pad, Fidelity(mesh=TINY), progress=False)
    half = in_storage(single, Fidelity(mesh=TINY, precision="float16"))
    assert {table.dtype for name, table in half.tables.items() if name.startswith("deviatoric ++ 0")} == {
        np.dtype(np.float16),
        np.dtype(np.float32),
    }
    footprint = Footprint.from_outline(Point(1e-3 * scale, 2e-3 * scale).buffer(3e-3 * scale), single.surface)
    load = contact_load(single, footprint, (0.02, 0.01, -0.1))
    expected, readings = single.readings(load), half.readings(load)
    for layer, of_layer in zip(readings, expected, strict=True):
        # Rounding of some hundred products, each 5e-4 at most, of either sign.
        assert 0 < np.linalg.norm(layer - of_layer) <= 3e-4 * np.linalg.norm(of_layer)
    stress, plain_stress = half.stress(load), single.stress(load)
    np.testing.assert_allclose(stress, plain_stress, atol=5e-4 * np.abs(plain_stress).max())
