import pytest

from mjtactile.cli.benchmarks.tables import mesh_table, rewrite_table
from mjtactile.cli.benchmarks.tactile import mujoco_tactile_time
from mjtactile.errors import MjTactileError


def figures(errors):
    times = dict.fromkeys(("build_s", "load_s", "new_footprint_s", "same_footprint_s"), 0.5)
    return {**times, "peak_memory_bytes": 2e9, "table_bytes": 3e6, "errors": errors}


RESULT = {
    "reference": "fine",
    "mujoco_version": "4.0.0",
    "mujoco_tactile_s": 3e-5,
    "meshes": {"draft": figures({"a": 0.01, "b": 0.03, "c": 0.02}), "fine": figures({"a": 0.0, "b": 0.0, "c": 0.0})},
}


def test_the_table_shows_median_and_worst_error_and_mujoco_beside():
    table = mesh_table(RESULT)
    assert "2.00% (3.00%)" in table
    assert "0.030 ms" in table
    widths = {line.count("|") for line in table.splitlines()}
    assert len(widths) == 1


def test_a_table_replaces_the_old_one_between_its_markers(tmp_path):
    path = tmp_path / "README.md"
    path.write_text(
        "before\n<!-- bench mesh -->\nold\n<!-- end -->\nbetween\n<!-- bench other -->\nkept\n<!-- end -->\n"
    )
    rewrite_table(path, "mesh", "new")
    assert path.read_text() == (
        "before\n<!-- bench mesh -->\nnew\n<!-- end -->\nbetween\n<!-- bench other -->\nkept\n<!-- end -->\n"
    )
    with pytest.raises(MjTactileError, match="nothing"):
        rewrite_table(path, "nothing", "new")


def test_mujocos_own_tactile_sensor_is_timed_while_it_feels_the_punch():
    # Measured at 20 to 40 us; it raises where no point lights up.
    assert 1e-6 < mujoco_tactile_time() < 1e-2
