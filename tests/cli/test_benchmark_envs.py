"""The benchmark of environments: figures that hang together, and a table of them."""

import itertools
import time
from types import SimpleNamespace

import pytest

from mjtactile.cli.benchmarks import envs
from mjtactile.cli.benchmarks.envs import envs_benchmark, envs_table


@pytest.fixture
def _ticking_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock goes on by one second with each look at it, so that figures do not depend on what else runs here."""
    seconds = itertools.count()
    monkeypatch.setattr(envs, "time", SimpleNamespace(perf_counter=lambda: float(next(seconds))))


@pytest.mark.usefixtures("_ticking_clock")
def test_times_and_shares_are_those_of_the_clock():
    result = envs_benchmark(quick=True)
    rows = result["rows"]
    assert [row["pads"] for row in rows] == ["without", "wrench, fast", "readings, fast", "readings, balanced"]
    for row in rows:
        # One second for 40 steps of one environment, and for 2 of four; one for each step of MuJoCo's part.
        assert row["one_s"] == pytest.approx(1.0 / 40.0)
        assert row["many_s"] == pytest.approx(1.0 / 2.0 / result["count"])
        assert row["plain_s"] == pytest.approx(1.0 / row["substeps"])
        assert row["plain_many_s"] == pytest.approx(1.0 / (row["substeps"] * result["count"]))
        assert row["one_share"] == pytest.approx(40.0)
        assert row["many_share"] == pytest.approx(2.0)
    table = envs_table(result)
    assert "4: steps/s" in table
    assert f"{1.0 / rows[-1]['one_s']:,.0f}" in table.splitlines()[-1]


def test_the_benchmark_reads_the_machines_clock():
    assert envs.time is time
