import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjtactile.cli.benchmarks.plugin import FingersScene, PluginScene, mujoco_tactile_time, plugin_table
from mjtactile.cli.benchmarks.small_contacts import small_contacts_benchmark, small_contacts_table
from mjtactile.cli.benchmarks.tables import mesh_table, stored_runs, table_on_page, today_table
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
    path = tmp_path / "page.md"
    path.write_text(
        "before\n<!-- bench mesh -->\nold\n<!-- end -->\nbetween\n<!-- bench other -->\nkept\n<!-- end -->\n"
    )
    table_on_page(path, "mesh")("new")
    assert path.read_text() == (
        "before\n<!-- bench mesh -->\nnew\n<!-- end -->\nbetween\n<!-- bench other -->\nkept\n<!-- end -->\n"
    )
    with pytest.raises(MjTactileError, match="nothing"):
        table_on_page(path, "nothing")


def test_mujocos_own_tactile_sensor_is_timed_while_it_feels_the_punch():
    # Measured at 20 to 40 us; it raises where no point lights up.
    assert 1e-6 < mujoco_tactile_time() < 1e-2


def table_on(page, name):
    text = (Path(__file__).resolve().parents[2] / page).read_text()
    (table,) = re.findall(rf"<!-- bench {name} -->\n(.*?)\n<!-- end -->", text, flags=re.DOTALL)
    return table


def test_the_readme_shows_the_stored_runs_in_ten_rows_at_most():
    table = table_on("README.md", "today")
    assert table == today_table(**stored_runs()), "run: mjtactile bench today --page README.md"
    assert len(table.splitlines()) <= 2 + 10


def test_the_stored_run_of_the_plugin_is_the_one_on_the_page():
    """Its times; ratios were rounded from more digits than are stored."""
    stored = plugin_table(stored_runs()["plugin"]).splitlines()
    shown = table_on("docs/benchmarks.md", "plugin").splitlines()
    assert [line.split("|")[1:3] for line in stored] == [line.split("|")[1:3] for line in shown]


def test_meshes_and_mujocos_own_sensor_are_in_the_table_of_meshes():
    for name in ("draft", "default", "fine", "<tactile>"):
        assert name in table_on("docs/benchmarks.md", "mesh")


def test_small_contacts_are_read_as_the_page_says():
    rows = small_contacts_table(small_contacts_benchmark(["fast", "balanced"])).splitlines()[2:]
    shown = table_on("docs/benchmarks.md", "small-contacts").splitlines()[2:4]
    for row, line in zip(rows, shown, strict=True):
        assert row.split("|")[1] == line.split("|")[1]
        found, expected = (np.array(re.findall(r"[\d.]+(?=%)", text), dtype=float) for text in (row, line))
        np.testing.assert_allclose(found, expected, atol=0.11)


def test_stick_and_coulomb_stand_beside_proportional_in_the_same_scene():
    times = {
        "MuJoCo `<tactile>`, box": 1e-4,
        "MuJoCo `<tactile>`, star": 2e-4,
        "moving ball, fast": 3e-4,
        "moving ball, stick, fast": 4.5e-4,
    }
    rows = [{"name": name, "added_s": added} for name, added in times.items()]
    lines = plugin_table({"rows": rows, "batch": {"available": False}}).splitlines()
    assert [line.split("|")[5].strip() for line in lines[2:]] == ["-", "-", "-", "1.50 x"]


@pytest.mark.parametrize("shape", ["lying cylinder", "standing cylinder at the rim"])
def test_cylinders_press_the_pad_they_move_on(shape):
    assert is_felt(PluginScene(shape=shape, moving=True, sensor="ours", fidelity="fast"))


@pytest.mark.parametrize("curved", [False, True])
def test_every_finger_around_the_ball_feels_it(curved):
    assert is_felt(FingersScene(pads=5, touched=5, sensor="ours", fidelity="fast", curved=curved))


def test_a_dome_feels_the_ball_that_moves_on_it():
    assert is_felt(PluginScene(shape="ball", moving=True, sensor="ours", fidelity="fast", curved=True))


def is_felt(scene: PluginScene) -> bool:
    """Whether every pad of a scene reads something after a while."""
    model = scene.spec().compile()
    data = mujoco.MjData(model)
    for step in range(60):
        data.ctrl[:] = scene.controls(step)
        mujoco.mj_step(model, data)
    return all(data.sensor(f"touch{pad}").data.any() for pad in range(scene.pads))
