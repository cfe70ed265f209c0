from __future__ import annotations

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from mjtactile.cli import app
from mjtactile.cli_evaluate import tables
from mjtactile.evaluation import angles_between, evaluate, noisy


def test_small_angles_are_exact():
    turned = np.array([[math.sin(1e-6), 0.0, -math.cos(1e-6)]])
    assert angles_between(3.0 * turned, np.array([[0.0, 0.0, -1.0]]))[0] == pytest.approx(1e-6, rel=1e-6)


def test_noise_is_relative_to_each_presss_largest_reading_and_seeded():
    readings = np.random.default_rng(0).random((50, 4, 13, 13)) * np.geomspace(1, 1e4, 50)[:, None, None, None]
    change = noisy(readings, 0.02, seed=1) - readings
    relative = change.reshape(50, -1).std(axis=1) / readings.max(axis=(1, 2, 3))
    np.testing.assert_allclose(relative, 0.02, rtol=0.15)
    np.testing.assert_array_equal(noisy(readings, 0.02, seed=1), noisy(readings, 0.02, seed=1))


@pytest.mark.slow
def test_bounds_hold_on_fresh_presses():
    """Bounds of the issue, on presses from a seed of this test's own; twice the bound where a small sample decides."""
    result = evaluate(7321, presses=160, workers=1, progress=False)
    protocol, fresh = result["protocol"]["all"], result["mujoco"]["all"]
    assert protocol["direction_deg"] <= 0.05
    assert protocol["magnitude_gf"] <= 0.05
    assert protocol["shapes_right"] == protocol["shapes_asked"] == 56
    assert set(protocol["three_rate"].values()) == {1.0}
    assert fresh["direction_median_deg"] <= 0.5
    assert fresh["magnitude_of_200gf"] <= 0.005
    assert fresh["position_mean_mm"] <= 0.1
    assert fresh["shape_rate"] >= 0.98
    assert set(fresh["three_rate"].values()) == {1.0}
    # Four layers tell direction better than one where there is noise.
    assert fresh["direction_median_deg"] < result["mujoco"]["top"]["direction_median_deg"]
    assert "<= 0.05" in tables(result)


@pytest.mark.slow
def test_the_command_prints_json_and_rewrites_its_tables(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench evaluate -->\nold\n<!-- end -->\nafter\n")
    done = CliRunner().invoke(
        app, ["evaluate", "--presses", "20", "--workers", "1", "--preset", "fast", "--json", "--readme", str(page)]
    )
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["presses"] == 20
    assert "old" not in page.read_text()
    assert page.read_text().startswith("before\n")
    assert page.read_text().endswith("after\n")
