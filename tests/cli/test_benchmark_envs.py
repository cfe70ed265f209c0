"""The benchmark of environments: figures that hang together, and a table of them."""

import pytest

from mjtactile.cli.benchmarks.envs import envs_benchmark, envs_table


def test_pads_and_environments_cost_something_and_the_table_tells():
    result = envs_benchmark(quick=True)
    rows = result["rows"]
    assert [row["pads"] for row in rows] == ["without", "wrench, fast", "readings, fast", "readings, balanced"]
    for row in rows:
        assert 0.0 < row["plain_s"] < 2.0 * row["one_s"] / row["substeps"]
        assert 0.0 < row["plain_many_s"] < 2.0 * row["many_s"] / row["substeps"]
        assert 0.0 < row["many_s"] < 10.0 * row["one_s"]
        assert 0.0 < row["many_share"] < 2.0
        assert row["plain_s"] * row["substeps"] / row["one_s"] == pytest.approx(row["one_share"], rel=0.5)
    table = envs_table(result)
    assert "4: steps/s" in table
    assert f"{1.0 / rows[-1]['one_s']:,.0f}" in table.splitlines()[-1]
