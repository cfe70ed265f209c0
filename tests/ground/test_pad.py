"""The pad's values: the paper's by default, refused with the cure where no such sheet exists."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest

from mjtactile.errors import PadError
from mjtactile.pad import Layer, Pad, TaxelGrid, force_vector

PDMS = Layer(thickness=5e-3, young=3e6, poisson=0.49)
FLEXIBLE = {"thickness": 5e-3, "young": 3e6, "poisson": 0.0}
NAN, INFINITE = math.nan, math.inf

#: (what is asked for, the value and the cure that the message names)
REFUSALS = [
    (lambda: Layer(thickness=0.0, young=3e6, poisson=0.49), "0.0 m", "5 mm is 5e-3"),
    (lambda: Layer(thickness=-1e-3, young=3e6, poisson=0.49), "-0.001 m", "5 mm is 5e-3"),
    (lambda: Layer(thickness=1e-8, young=3e6, poisson=0.49), "1e-08 m", "neighbouring layer"),
    (lambda: Layer(thickness=NAN, young=3e6, poisson=0.49), "nan", "metres"),
    (lambda: Layer(thickness=1e-3, young=0.0, poisson=0.49), "0.0 Pa", "3 MPa is 3e6"),
    (lambda: Layer(thickness=np.complex128(1e-3 + 1j), young=3e6, poisson=0.0), "1j", "in metres"),  # type: ignore[arg-type]
    (lambda: Layer(thickness=np.array("1e-3"), young=3e6, poisson=0.0), "1e-3", "a number in metres"),  # type: ignore[arg-type]
    (lambda: Layer(thickness=1e-3, young=-3e6, poisson=0.49), "-3000000.0 Pa", "3 MPa is 3e6"),
    (lambda: Layer(thickness=1e-3, young=INFINITE, poisson=0.49), "inf Pa", "3 MPa is 3e6"),
    (lambda: Layer(thickness=1e-3, young=3e6, poisson=0.5), "0.5", "use 0.49"),
    (lambda: Layer(thickness=1e-3, young=3e6, poisson=-0.1), "-0.1", "[0, 0.5)"),
    (lambda: Layer(thickness=1e-3, young=3e6, poisson=NAN), "nan", "use 0.49"),
    (lambda: TaxelGrid(rows=0), "rows = 0", "at least 1"),
    (lambda: TaxelGrid(columns=2.5), "columns = 2.5", "whole number"),  # type: ignore[arg-type]
    (lambda: TaxelGrid(rows=True), "rows = True", "whole number"),
    (lambda: TaxelGrid(pitch=(0.0, 1e-3)), "(0.0, 0.001) m", "1.25e-3"),
    (lambda: TaxelGrid(pitch=1e-3), "pitch = 0.001", "two numbers"),  # type: ignore[arg-type]
    (lambda: TaxelGrid(centre=(NAN, 0.0)), "(nan, 0.0) m", "finite coordinates"),
    (lambda: Pad(size=(15e-3, -15e-3)), "(0.015, -0.015) m", "15 mm is 15e-3"),
    (lambda: Pad(size=(15e-3, INFINITE)), "inf", "15 mm is 15e-3"),
    (lambda: Pad(size=15e-3), "size = 0.015", "two numbers"),  # type: ignore[arg-type]
    (lambda: Pad(layers=()), "at least one Layer", "top first"),
    (lambda: Pad(layers=(5e-3,)), "at least one Layer", "top first"),  # type: ignore[arg-type]
    (lambda: Pad(taxels=(13, 13)), "(13, 13)", "TaxelGrid(rows=13, columns=13)"),  # type: ignore[arg-type]
    (lambda: Pad(depths=()), "empty", "(1e-3,)"),
    (lambda: Pad(depths=(1e-3, NAN)), "nan", "finite numbers"),
    (lambda: Pad(depths=("deep",)), "deep", "numbers in metres"),  # type: ignore[arg-type]
    (lambda: Pad(depths=(2e-3, 1e-3)), "(0.002, 0.001)", "increase"),
    (lambda: Pad(depths=(1e-3, 1e-3)), "(0.001, 0.001)", "without repeats"),
    (lambda: Pad(depths=(1e-3, 6e-3)), "0.006 m", "between 0 and 0.005 m"),
    (lambda: Pad(depths=(-1e-3,)), "-0.001 m", "between 0 and 0.005 m"),
    (lambda: Pad(sampling_radius=0.0), "0.0 m", "0.625e-3"),
    (lambda: Pad(sampling_radius=NAN), "nan", "0.625e-3"),
    (lambda: Pad(taxels=TaxelGrid(columns=14)), "columns stand 0.008125 m", "smaller pitch"),
    (lambda: Pad(taxels=TaxelGrid(centre=(0.0, 1e-3))), "rows stand 0.0085 m", "larger size"),
    (lambda: Pad(size=(10e-3, 15e-3)), "ends at 0.005 m", "Use fewer taxels"),
]


@pytest.mark.parametrize(("make", "value", "cure"), REFUSALS, ids=[f"{v} {c}" for _, v, c in REFUSALS])
def test_refusal_names_the_value_and_the_cure(make, value, cure):
    with pytest.raises(PadError) as refusal:
        make()
    assert value in str(refusal.value)
    assert cure in str(refusal.value)


def test_defaults_are_the_papers():
    pad = Pad()
    assert pad.size == (15e-3, 15e-3)
    assert pad.thickness == pytest.approx(5e-3, rel=1e-15)
    assert [(layer.young, layer.poisson) for layer in pad.layers] == [(3e6, 0.49)]
    assert pad.depths == (1e-3, 2e-3, 3e-3, 4e-3)
    assert pad.sampling_radius == 0.625e-3
    assert pad.reading_shape == (4, 13, 13)
    assert math.prod(pad.reading_shape) == 676
    expected = np.arange(-6, 7) * 1.25e-3
    np.testing.assert_allclose(pad.grid.x, expected, atol=1e-18)
    np.testing.assert_allclose(pad.grid.y, expected, atol=1e-18)


def test_one_layer_sensor_is_one_depth():
    assert Pad(depths=(1e-3,)).reading_shape == (1, 13, 13)
    assert Pad(depths=1e-3) == Pad(depths=(1e-3,))  # type: ignore[arg-type]


def test_one_layer_may_stand_for_itself():
    assert Pad(layers=PDMS) == Pad()  # type: ignore[arg-type]


def test_lists_and_numpy_numbers_make_the_same_pad():
    same = Pad(
        size=np.array([15e-3, 15e-3]),  # type: ignore[arg-type]
        layers=[PDMS],  # type: ignore[arg-type]
        taxels=TaxelGrid(rows=np.int64(13), columns=np.int64(13), pitch=[1.25e-3, 1.25e-3]),  # type: ignore[arg-type]
        depths=np.array([1e-3, 2e-3, 3e-3, 4e-3]),  # type: ignore[arg-type]
        sampling_radius=np.float64(0.625e-3),
    )
    assert same == Pad()
    assert hash(same) == hash(Pad())
    assert same.fingerprint == Pad().fingerprint


@pytest.mark.parametrize(
    "change",
    [
        {"size": (15e-3, 16e-3)},
        {"layers": (dataclasses.replace(PDMS, thickness=5.000001e-3),)},
        {"layers": (dataclasses.replace(PDMS, young=3.000001e6),)},
        {"layers": (dataclasses.replace(PDMS, poisson=0.490001),)},
        {"layers": (dataclasses.replace(PDMS, thickness=2.5e-3),) * 2},
        {"taxels": TaxelGrid(rows=12)},
        {"taxels": TaxelGrid(columns=12)},
        {"taxels": TaxelGrid(pitch=(1.2e-3, 1.25e-3))},
        {"taxels": TaxelGrid(pitch=(1.25e-3, 1.2e-3))},
        {"taxels": TaxelGrid(rows=11, columns=11, centre=(1e-4, 0.0))},
        {"taxels": TaxelGrid(rows=11, columns=11, centre=(0.0, 1e-4))},
        {"depths": (1e-3, 2e-3, 3e-3)},
        {"depths": (1e-3, 2e-3, 3e-3, 4.000001e-3)},
        {"sampling_radius": 0.62e-3},
    ],
    ids=str,
)
def test_every_number_changes_the_fingerprint(change):
    assert dataclasses.replace(Pad(), **change).fingerprint != Pad().fingerprint


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({"taxels": TaxelGrid(centre=(-0.0, 0.0))}, {}),
        ({"layers": Layer(thickness=5e-3, young=3e6, poisson=-0.0)}, {"layers": Layer(**FLEXIBLE)}),
        ({"depths": (-0.0, 1e-3)}, {"depths": (0.0, 1e-3)}),
        ({"taxels": -np.array([[0.0, 0.0, 1e-3]])}, {"taxels": [[0.0, 0.0, -1e-3]]}),
    ],
    ids=["a grid", "a layer", "a depth", "free taxels"],
)
def test_a_zero_has_no_sign(change, same):
    """Equal pads with different fingerprints would be refused each other's tables."""
    assert Pad(**change) == Pad(**same)
    assert Pad(**change).fingerprint == Pad(**same).fingerprint


def test_order_of_layers_changes_the_fingerprint():
    soft, hard = Layer(thickness=1e-3, young=1e6, poisson=0.49), Layer(thickness=4e-3, young=5e6, poisson=0.49)
    assert Pad(layers=(soft, hard)).fingerprint != Pad(layers=(hard, soft)).fingerprint


def test_fingerprint_is_the_same_in_another_process():
    code = "from mjtactile import Pad; print(Pad().fingerprint)"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == Pad().fingerprint


def test_taxels_stand_on_rows_and_columns_about_their_centre():
    grid = TaxelGrid(rows=2, columns=3, pitch=(2.0, 0.5), centre=(10.0, -1.0))
    np.testing.assert_array_equal(grid.x, [8.0, 10.0, 12.0])
    np.testing.assert_array_equal(grid.y, [-1.25, -0.75])


def test_outer_taxels_may_stand_on_the_edge():
    assert np.max(Pad().grid.x) == pytest.approx(Pad().size[0] / 2, rel=1e-12)


def test_sensing_layers_may_lie_on_the_surface_and_the_base():
    assert Pad(depths=(0.0, 5e-3)).depths == (0.0, 5e-3)


def test_interfaces_are_heights_below_the_surface():
    layers = tuple(Layer(thickness=t, young=1e6, poisson=0.4) for t in (1e-3, 0.5e-3, 2e-3))
    np.testing.assert_allclose(Pad(layers=layers, depths=(1e-3,)).interfaces, [-1e-3, -1.5e-3], rtol=1e-15)
    assert Pad().interfaces == ()


def test_elastic_constants_are_consistent():
    layer = Layer(thickness=1e-3, young=3e6, poisson=0.3)
    mu, lame = layer.shear_modulus, layer.lame_lambda
    assert mu * (3 * lame + 2 * mu) / (lame + mu) == pytest.approx(layer.young)
    assert lame / (2 * (lame + mu)) == pytest.approx(layer.poisson)


def test_pad_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Pad().size = (1.0, 1.0)  # type: ignore[misc]


def test_summary_names_size_stack_and_taxels():
    summary = Pad(depths=(1e-3,)).summary
    for part in ("15 x 15 mm", "5 mm", "E 3 MPa", "nu 0.49", "13 x 13 taxels", "1 depth"):
        assert part in summary
    assert not summary.endswith("depths")


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (("1",), "magnitude = '1'"),
        ((math.nan,), "magnitude = nan"),
        ((1, "15"), "tilt_deg = '15'"),
        ((1, 0, None), "None"),
    ],
)
def test_a_force_is_of_finite_numbers(values, said):
    with pytest.raises(PadError, match=said):
        force_vector(*values)
