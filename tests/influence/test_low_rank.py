"""Reduced matrices: smaller, and within their tolerance for loads they were not made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Point
from small_pads import COARSE, LAYERED_PAD

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.fidelity import Fidelity
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.cache import build_influence
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.storage import in_storage
from mjtactile.influence.surface_load import SurfaceLoad


def stress_bytes(influence: InfluenceMatrices) -> int:
    return sum(t.nbytes for name, t in influence.tables.items() if name.startswith(("deviatoric", "mean")))


def unseen_loads(influence: InfluenceMatrices) -> list[SurfaceLoad]:
    """Punches in odd places, 2 mm discs anywhere, at the rim and half off it, pressed obliquely."""
    random = np.random.default_rng(20)
    places = [tuple(random.uniform(-4e-3, 4e-3, 2)) for _ in range(14)]
    outlines = [
        indenter_outline(name, shift=place, rotate_deg=random.uniform(0, 360), scale=random.uniform(0.4, 1.0))
        for name, place in zip(INDENTER_NAMES * 2, places, strict=True)
    ]
    inside = random.uniform(-6e-3, 6e-3, (8, 2))
    rim = np.stack([random.uniform(-7e-3, 7e-3, 8), random.choice([-1, 1], 8) * random.uniform(6.4e-3, 7.5e-3, 8)])
    corner = [(6.8e-3, -7.1e-3), (-7.4e-3, -7.4e-3)]
    outlines += [Point(*place).buffer(1e-3) for place in (*inside, *rim.T, *rim[::-1].T, *corner)]
    return [
        contact_load(influence, Footprint.from_outline(outline, influence.surface), (*shear, -0.1))
        for outline, shear in zip(outlines, random.normal(0, 0.03, (len(outlines), 2)), strict=True)
    ]


def layer_errors(readings: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Relative L2 of each load's and layer's readings, shape (loads, layers)."""
    return np.linalg.norm(readings - exact, axis=(2, 3)) / np.linalg.norm(exact, axis=(2, 3))


@pytest.fixture(scope="module")
def coarsely(draft) -> InfluenceMatrices:
    """Reduced until up to 3 % is lost."""
    return in_storage(draft, Fidelity(mesh="draft", reduction=0.03))


@pytest.mark.parametrize(("tolerance", "precision"), [(0.03, "float32"), (0.003, "float16")])
def test_error_stays_within_the_tolerance_for_unseen_loads(tolerance, precision, draft, coarsely):
    chosen = Fidelity(mesh="draft", precision=precision, reduction=tolerance)
    reduced = coarsely if chosen == coarsely.fidelity else in_storage(draft, chosen)
    loads = unseen_loads(draft)
    errors = layer_errors(reduced.readings(loads), draft.readings(loads))
    assert errors.max() <= tolerance
    assert errors.max() > 0.02 * tolerance  # not far better either: that would be paid for in time
    exact, stress = draft.stress(loads), reduced.stress(loads)
    assert layer_errors(*(s.swapaxes(1, 2).reshape(len(loads), 4, 6, -1) for s in (stress, exact))).max() <= tolerance
    assert stress_bytes(reduced) < (0.7 if precision == "float32" else 0.35) * stress_bytes(draft)


def test_deep_layers_are_reduced_most_and_the_shallow_one_stays_whole(draft, coarsely):
    np.testing.assert_array_equal(coarsely.tables["deviatoric ++ 0"], draft.tables["deviatoric ++ 0"])
    ranks = [coarsely.tables[f"deviatoric ++ {k} left"].shape[1] for k in (1, 2, 3)]
    assert ranks == sorted(ranks, reverse=True)
    assert ranks[2] < 0.5 * ranks[0]
    for k, rank in zip((1, 2, 3), ranks, strict=True):
        assert coarsely.tables[f"deviatoric ++ {k} right"].shape == (rank, draft.tables["deviatoric ++ 0"].shape[1])


def test_everything_else_is_kept(draft, coarsely):
    for name, table in draft.tables.items():
        if not name.startswith(("deviatoric", "mean")):
            assert coarsely.tables[name] is table
    load = unseen_loads(draft)[0]
    np.testing.assert_array_equal(coarsely.surface_displacement(load), draft.surface_displacement(load))


def test_a_tolerance_that_nothing_meets_changes_nothing(layered):
    """A coarse mesh of an oblong layered sheet: its few columns need as many patterns."""
    reduced = in_storage(layered, replace(layered.fidelity, reduction=1e-12))
    assert set(reduced.tables) == set(layered.tables)


def test_an_oblong_layered_sheet_is_reduced_too():
    """In double precision, with taxels that the mirrors do not map onto each other."""
    plain = build_influence(LAYERED_PAD, Fidelity(mesh=COARSE, precision="float64"), progress=False)
    reduced = in_storage(plain, Fidelity(mesh=COARSE, precision="float64", reduction=0.1))
    assert stress_bytes(reduced) < stress_bytes(plain)
    random = np.random.default_rng(3)
    outlines = [Point(*random.uniform((-4e-3, -2.5e-3), (4e-3, 2.5e-3))).buffer(2e-3) for _ in range(12)]
    loads = [contact_load(plain, Footprint.from_outline(o, plain.surface), (0.02, 0.01, -0.1)) for o in outlines]
    errors = layer_errors(reduced.readings(loads), plain.readings(loads))
    assert 1e-6 < errors.max() <= 0.1
