"""The table that comes with the package: what a build gives, and no build for a first reading."""

from __future__ import annotations

import numpy as np
import pytest

import mjtactile.influence.cache
from mjtactile import Footprint, Pad, contact_load, indenter_outline
from mjtactile.errors import InfluenceWarning
from mjtactile.influence.cache import CACHE_VARIABLE, SHIPPED, build_influence, cached_path, influence_matrices


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_only_the_default_pads_fast_table_is_shipped():
    # `make shipped-table` makes it anew.
    assert [path.name for path in SHIPPED.iterdir()] == [cached_path(Pad(), "fast").name]


def test_a_first_reading_builds_nothing(monkeypatch, empty_cache):
    def no_build(*_, **__):
        raise AssertionError("a table was built")

    monkeypatch.setattr(mjtactile.influence.cache, "build_influence", no_build)
    assert influence_matrices(fidelity="fast").nbytes > 1e6
    assert not empty_cache.exists()


def test_the_shipped_table_reads_as_one_built_here():
    shipped, built = influence_matrices(fidelity="fast"), build_influence(Pad(), "fast", progress=False)
    for name in ("star", "circle", "doughnut"):
        readings = []
        for influence in (shipped, built):
            footprint = Footprint.from_outline(indenter_outline(name), influence.surface)
            readings.append(influence.readings(contact_load(influence, footprint, force=(0.1, 0.0, -1.0))))
        # Where another BLAS rounds otherwise, a value may be stored one step of int8 off: 1/254 of its row's largest.
        np.testing.assert_allclose(readings[0], readings[1], atol=4e-3 * readings[1].max())


def test_a_damaged_copy_in_the_cache_gives_way_to_the_shipped_table(empty_cache):
    (table,) = SHIPPED.iterdir()
    empty_cache.mkdir()
    (empty_cache / table.name).write_bytes(table.read_bytes()[:-1])
    with pytest.warns(InfluenceWarning, match="that of the package is read instead"):
        influence_matrices(fidelity="fast", progress=False)


def test_a_damaged_shipped_table_is_built_anew(tmp_path, monkeypatch, empty_cache):
    damaged = tmp_path / "shipped"
    damaged.mkdir()
    (table,) = SHIPPED.iterdir()
    (damaged / table.name).write_bytes(table.read_bytes()[:-1])
    monkeypatch.setattr(mjtactile.influence.cache, "SHIPPED", damaged)
    with pytest.warns(InfluenceWarning, match="built anew"):
        influence_matrices(fidelity="fast", progress=False)
    assert (empty_cache / table.name).exists()
