"""Pads nobody planned for: each is made and built, or refused with an error of ours that says what was expected."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

import mjtactile.fem.solution
from mjtactile.errors import MeshError, MeshWarning, PadError
from mjtactile.fem.mesh import sheet_mesh, warn_if_coarser
from mjtactile.fidelity import MESHES, Fidelity, MeshDensity
from mjtactile.influence.build import build_tables
from mjtactile.influence.cache import build_influence
from mjtactile.pad import Layer, Pad, TaxelGrid

#: The smallest mesh there is; most_elements keeps wide sheets small too.
TINY = MeshDensity(
    in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(1,), most_elements=16
)
NUMBERS = st.one_of(
    st.sampled_from([0.0, -0.0, 1e-300, 5e-324, 1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e12, 1e300, -1e-3, math.nan, math.inf]),
    st.floats(),
    st.floats(1e-7, 20.0),
    st.integers(-3, 3),
    st.sampled_from([10**400, -(10**400), np.float32(1e-3), np.int64(1), np.bool_(True), np.array(1e-3)]),
)
ODD = st.one_of(NUMBERS, st.sampled_from([None, "", "5 mm", b"1", True, 1j, (), [], {}, object(), np.zeros(3), Pad]))
SIZES, RATIOS = st.floats(1e-4, 1e-1), st.floats(1e-3, 0.5)


def made(make: Callable[[], Any]) -> Any:
    """What is made; None where it is refused as it should be."""
    try:
        return make()
    except PadError as refusal:
        message = str(refusal)
        if len(message) > 1000 or not any(
            word in message for word in ("expected", "se ", "ive ", "must hold", "merge")
        ):
            raise AssertionError(f"not a message that helps: {message}") from refusal
        return None


@settings(max_examples=300, deadline=None, derandomize=True)
@given(thickness=ODD, young=ODD, poisson=ODD)
def test_any_layer_is_made_or_refused(thickness, young, poisson):
    for values in ((thickness, 3e6, 0.4), (5e-3, young, 0.4), (5e-3, 3e6, poisson), (thickness, young, poisson)):
        layer = made(lambda values=values: Layer(**dict(zip(("thickness", "young", "poisson"), values, strict=True))))
        if layer is not None:
            numbers = (layer.thickness, layer.young, layer.poisson, layer.shear_modulus, layer.lame_lambda)
            assert all(type(number) is float and math.isfinite(number) for number in numbers)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(rows=ODD, columns=ODD, pitch=st.one_of(ODD, st.tuples(ODD, ODD)), centre=st.one_of(ODD, st.tuples(ODD, ODD)))
def test_any_grid_of_taxels_is_made_or_refused(rows, columns, pitch, centre):
    for arguments in (
        {"rows": rows},
        {"columns": columns},
        {"pitch": pitch},
        {"centre": centre},
        {"rows": rows, "columns": columns, "pitch": pitch, "centre": centre},
    ):
        grid = made(lambda arguments=arguments: TaxelGrid(**arguments))
        if grid is not None:
            assert np.isfinite(grid.x).all()
            assert np.isfinite(grid.y).all()


@settings(max_examples=300, deadline=None, derandomize=True)
@given(
    size=st.one_of(ODD, st.tuples(ODD, ODD)),
    layers=st.one_of(ODD, st.lists(ODD, max_size=3)),
    depths=st.one_of(ODD, st.lists(ODD, max_size=3)),
    radius=ODD,
    taxels=ODD,
)
def test_any_pad_is_made_or_refused(size, layers, depths, radius, taxels):
    for arguments in (
        {"size": size},
        {"layers": layers},
        {"depths": depths},
        {"sampling_radius": radius},
        {"taxels": taxels},
        {"size": size, "depths": depths, "sampling_radius": radius, "taxels": TaxelGrid(rows=1, columns=1)},
    ):
        pad = made(lambda arguments=arguments: Pad(**arguments))
        if pad is not None:
            assert len(pad.fingerprint) == 64
            assert pad.summary


@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(
    size=st.tuples(SIZES, SIZES),
    thicknesses=st.lists(st.floats(1e-6, 0.2), min_size=1, max_size=3),
    young=st.sampled_from([1.0, 1e3, 3e6, 1e11, 1e15]),
    poisson=st.sampled_from([0.0, 0.3, 0.49, 0.4999999]),
    depth=st.floats(0.0, 1.0),
    radius=RATIOS,
    rows=st.integers(1, 3),
)
def test_any_pad_that_is_made_is_built_or_refused(size, thicknesses, young, poisson, depth, radius, rows):
    layers = [Layer(thickness=t, young=young if k % 2 else 3e6, poisson=poisson) for k, t in enumerate(thicknesses)]
    total = math.fsum(thicknesses)
    pad = made(
        lambda: Pad(
            size=size,
            layers=tuple(layers),
            taxels=TaxelGrid(rows=rows, columns=2, pitch=(size[0] / 4, size[1] / 4)),
            depths=(depth * total,),
            sampling_radius=radius * min(*size, total),
        )
    )
    if pad is None:
        return
    with contextlib.suppress(MeshError):
        built = build_influence(pad, Fidelity(mesh=TINY, precision="float16", averaging="mean"), progress=False)
        event("built")
        built.check()
        assert all(np.isfinite(table).all() for table in built.tables.values())


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: TaxelGrid(rows=10**9), "expected at most 100000"),
        (lambda: TaxelGrid(columns=10**5000), "expected at most 100000"),
        (lambda: Pad(taxels=TaxelGrid(rows=1000, columns=1000, pitch=(1e-5, 1e-5))), "4000000 readings"),
        (lambda: Pad(layers=(Layer(thickness=1e-6, young=1e6, poisson=0.4),) * 100_000), "more than 64 layers"),
        (lambda: Pad(depths=tuple(np.linspace(0.0, 5e-3, 100_000))), "more than 64 sensing depths"),
        (lambda: Pad(size=(9.0, 5e-3), taxels=TaxelGrid(rows=1, columns=1)), "1000 times as long as wide"),
        (lambda: Pad(sampling_radius=1.0), "the sheet's largest dimension, 0.015 m"),
        (lambda: Pad(layers=(Layer(thickness=6.0, young=1e6, poisson=0.4),) * 2), "12 m thick"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_absurd_pads_are_refused_at_once(make, said):
    with pytest.raises(PadError, match=said):
        make()


def test_a_tall_column_is_built():
    """2 x 2 x 50 mm, with taxels near its top and near its foot."""
    pad = Pad(
        size=(2e-3, 2e-3),
        layers=(Layer(thickness=50e-3, young=3e6, poisson=0.49),),
        taxels=TaxelGrid(rows=2, columns=2, pitch=(0.5e-3, 0.5e-3)),
        depths=(1e-3, 45e-3),
    )
    assert all(
        np.isfinite(table).all()
        for table in build_influence(pad, Fidelity(mesh="draft"), progress=False).tables.values()
    )


def test_scales_too_far_apart_for_a_mesh_are_refused_before_it_is_made():
    pad = Pad(depths=(2e-6, 4e-3), sampling_radius=1e-6)
    with pytest.raises(MeshError, match=r"element layers of 2e-06 m.*expected at most 400"):
        sheet_mesh(pad, MESHES["draft"])


def test_narrow_strips_keep_to_the_elements_they_are_allowed():
    pad = Pad(size=(2.0, 2e-3), taxels=TaxelGrid(rows=1, columns=1), depths=(1e-3,))
    with pytest.warns(MeshWarning):
        warn_if_coarser(pad, MESHES["draft"])
    mesh = sheet_mesh(pad, MESHES["draft"])
    assert mesh.x.element_count * mesh.y.element_count <= 2.5 * MESHES["draft"].most_elements


def test_equations_larger_than_memory_are_refused(monkeypatch):
    monkeypatch.setattr(mjtactile.influence.build, "_memory", lambda: 1e8)
    with pytest.raises(MeshError, match=r"takes .* GB of memory to solve; this machine has 0.1 GB. Use a coarser mesh"):
        next(iter(build_tables(Pad(), MESHES["default"])))


def test_blocks_of_columns_make_the_same_tables(monkeypatch):
    """One column at a time, or all at once: the same but for the rounding of the products."""
    for chosen in (
        Fidelity(mesh=TINY),
        Fidelity(mesh=TINY, precision="float64", averaging="quarters", loads="corners"),
    ):
        whole = build_influence(Pad(), chosen, progress=False)
        with monkeypatch.context() as patch:
            patch.setattr(mjtactile.fem.solution, "_STRESS_BYTES", 1)
            parts = build_influence(Pad(), chosen, progress=False)
        for name, table in whole.tables.items():
            tolerance = 1e-6 if table.dtype == np.float32 else 1e-11
            np.testing.assert_allclose(parts.tables[name], table, rtol=0, atol=tolerance * np.abs(table).max())


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="tells its peak memory another way")
def test_seventy_by_seventy_taxels_are_built_in_bounded_memory():
    """In a process of its own, on a coarse mesh; all stresses at once would take 1.5 GB, and 5 GB on "draft"."""
    code = """
from pathlib import Path
from mjtactile.influence.cache import build_influence
from mjtactile.fem.mesh import MeshDensity
from mjtactile.pad import Pad, TaxelGrid
from mjtactile.fidelity import Fidelity
mesh = MeshDensity(
    in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(2,), most_elements=16
)
pad = Pad(taxels=TaxelGrid(rows=70, columns=70, pitch=(2e-4, 2e-4)), sampling_radius=1e-4)
found = build_influence(pad, Fidelity(mesh=mesh, precision="int8", averaging="mean"), progress=False)
assert found.pad.reading_shape == (4, 70, 70)
# The peak that `resource` tells begins with that of the process this one was forked from.
print(next(line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")))
"""
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=True)
    assert int(run.stdout) * 1024 < 1.1e9
