"""The command line as a user meets it: real processes, real files."""

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from typer.main import get_command

import mjtactile
from mjtactile.cli.main import _show_warning, app, main
from mjtactile.errors import MeshWarning
from mjtactile.pad import Pad
from mjtactile.units import GRAM_FORCE


def run(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "mjtactile", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )


@pytest.fixture(scope="module")
def pressed(tmp_path_factory, draft):
    folder = tmp_path_factory.mktemp("press")
    place = ("--shift", "1.25,0", "--rotate", "20")
    force = ("--force", "100gf", "--tilt", "15", "--azimuth", "90")
    done = run(
        "press",
        "star",
        *force,
        *place,
        "--fidelity",
        "fast",
        "--recognise",
        "--json",
        "--out",
        str(folder / "p.npz"),
        "--figure",
        str(folder / "p.png"),
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), folder


def test_press_reaches_the_commanded_force(pressed):
    report, _ = pressed
    assert report["force_reached_gf"] == pytest.approx(100.0, rel=1e-3)
    assert report["settle_time_s"] <= 0.05
    tilted = np.array([0.0, np.sin(np.radians(15)), -np.cos(np.radians(15))]) * 100 * GRAM_FORCE
    np.testing.assert_allclose(report["force_reached_N"], tilted, atol=1e-3)


def test_press_writes_the_readings_it_reports(pressed):
    report, folder = pressed
    with np.load(folder / "p.npz") as saved:
        assert saved["readings"].shape == Pad().reading_shape
        np.testing.assert_allclose(saved["readings"].max(axis=(1, 2)), report["peak_reading_Pa"])
        np.testing.assert_allclose(saved["depths"], Pad().depths)
    assert sorted(path.name for path in folder.iterdir()) == ["p.npz", "p.png"]


def test_press_draws_a_figure(pressed):
    _, folder = pressed
    content = (folder / "p.png").read_bytes()
    assert content.startswith(b"\x89PNG")
    assert len(content) > 20_000


def test_press_prints_what_people_want_to_know(draft):
    done = run("press", "circle", "--fidelity", "fast", "--force", "0.5N")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for text in ("circle", "gf reached", "peak, kPa", "time per update", "fidelity fast, law elastic"):
        assert text in done.stdout


def test_force_and_shape_are_recognised_from_the_readings(pressed):
    report, _ = pressed
    found = report["recognised"]
    assert found["familiar"]
    assert found["shape"] == "star"
    np.testing.assert_allclose(found["force_N"], report["force_reached_N"], atol=0.01)


@pytest.mark.parametrize(("shape", "doubts"), [("sphere", False), ("cylinder", True)])
def test_a_press_says_what_is_recognised_and_whether_to_rely_on_it(monkeypatch, capsys, draft, shape, doubts):
    monkeypatch.setattr("sys.argv", ["mjtactile", "press", shape, "--fidelity", "fast", "--recognise"])
    main()
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("recognised: "))
    assert "nan" not in line
    assert ("; sphere at " in line) == (not doubts)
    assert line.endswith("do not rely on it") == doubts


def test_a_face_that_covers_the_pad_is_recognised_as_one(monkeypatch, capsys, tmp_path, draft):
    trimesh.creation.box((0.03, 0.03, 0.004)).export(tmp_path / "plate.stl")
    press = ["mjtactile", "press", str(tmp_path / "plate.stl"), "--force", "1N", "--tilt", "20", "--fidelity", "fast"]
    monkeypatch.setattr("sys.argv", [*press, "--recognise", "--json"])
    main()
    report = json.loads(capsys.readouterr().out)
    assert report["recognised"]["shape"] == "a face that covers the pad"
    np.testing.assert_allclose(report["recognised"]["force_N"], report["force_reached_N"], atol=0.02)


def test_a_pad_that_recognisers_do_not_know_is_refused_before_its_table_is_built(monkeypatch, capsys, tmp_path):
    (tmp_path / "soft.toml").write_text("layers = [{thickness = 5e-3, young = 1e5, poisson = 0.4}]")
    monkeypatch.setattr("sys.argv", ["mjtactile", "press", "star", "--recognise", "--pad", str(tmp_path / "soft.toml")])
    monkeypatch.setattr("mjtactile.cli.press.influence_matrices", lambda *_: pytest.fail("a table is built"))
    with pytest.raises(SystemExit):
        main()
    assert "trained for" in capsys.readouterr().err


def test_the_contact_area_printed_is_the_one_in_the_json(monkeypatch, capsys, draft):
    said = []
    for how in ([], ["--json"]):
        monkeypatch.setattr("sys.argv", ["mjtactile", "press", "sphere", "--fidelity", "fast", *how])
        main()
        said.append(capsys.readouterr().out)
    area = json.loads(said[1])["contact_area_m2"]
    assert f"contact {area * 1e6:.4g} mm2" in said[0]


def test_numbers_that_are_not_finite_are_null_in_every_json(monkeypatch, capsys, tmp_path):
    """Readers other than Python's refuse NaN."""
    row = {"asked": "a tall sheet", "outcome": "read", "off": math.nan, "truth": "theory"}
    monkeypatch.setattr("mjtactile.cli.benchmarks.extremes.extremes_benchmark", lambda: [row])
    measured = {"rows": [row], "time": math.inf}
    monkeypatch.setattr("mjtactile.experiments.study.reproduce.reproduce", lambda *_, **__: measured)
    monkeypatch.setattr("mjtactile.experiments.study.report.study_report", lambda _: "")
    for line in (["bench", "extremes", "--json"], ["reproduce", "--json", str(tmp_path / "study.json")]):
        monkeypatch.setattr("sys.argv", ["mjtactile", *line])
        main()
    row["off"] = None
    assert json.loads(capsys.readouterr().out, parse_constant=pytest.fail) == [row]
    study = json.loads((tmp_path / "study.json").read_text(), parse_constant=pytest.fail)
    assert study == {"rows": [row], "time": None}


def test_a_figure_without_opengl_leaves_the_scene_out_and_says_what_to_install(tmp_path, draft):
    path = tmp_path / "p.pdf"
    done = run(
        "press",
        "circle",
        "--fidelity",
        "fast",
        "--figure",
        str(path),
        EGL_PLATFORM="none",
        MUJOCO_GL="egl",
        __EGL_VENDOR_LIBRARY_FILENAMES="/nowhere.json",
    )
    assert done.returncode == 0, done.stderr
    assert "libegl1" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert path.read_bytes().startswith(b"%PDF")


def test_wrong_input_is_one_clear_line_and_exit_code_2():
    """As a process; what all kinds of wrong input say: test_odd_command_lines.py."""
    done = run("press", "star", "--tilt", "60", "--fidelity", "fast")
    assert done.returncode == 2
    assert done.stdout == ""
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("mjtactile: error: ")
    assert "slides" in line


def test_a_figure_of_an_unknown_kind_is_refused_and_leaves_nothing(tmp_path, draft):
    done = run("press", "circle", "--fidelity", "fast", "--figure", str(tmp_path / "p.xyz"))
    assert done.returncode == 2
    assert "png" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_build_finds_what_is_there_and_builds_it_when_told_to(tmp_path):
    assert "mjtactile/influence/tables" in run("build", "--fidelity", "fast", MJTACTILE_CACHE=str(tmp_path)).stdout
    done = run("build", "--fidelity", "fast", "--force", MJTACTILE_CACHE=str(tmp_path))
    assert done.stdout.startswith("built 5 MB"), done.stderr
    done = run("build", "--fidelity", "fast", MJTACTILE_CACHE=str(tmp_path))
    assert done.stdout.startswith("found 5 MB")
    assert str(tmp_path) in done.stdout
    assert len(list(tmp_path.glob("*.safetensors"))) == 1
    assert "Available: fast, balanced, precise, accurate" in run("build", "--fidelity", "quick").stderr


def test_info_lists_punches_meshes_and_cache(tmp_path):
    done = run("info", "--json", MJTACTILE_CACHE=str(tmp_path))
    facts = json.loads(done.stdout)
    assert "star" in facts["punches"]
    assert facts["meshes"] == {"draft": None, "default": None, "even": None, "fine": None}
    assert facts["presets"].keys() == {"fast", "balanced", "precise", "accurate"}
    # That of "fast" comes with the package.
    assert [name for name, size in facts["presets"].items() if size is not None] == ["fast"]
    assert facts["cache"] == str(tmp_path)
    assert "not built" in run("info", MJTACTILE_CACHE=str(tmp_path)).stdout


def test_the_same_warning_from_several_places_is_one_line(capsys):
    """A wide pad's mesh is made more than once, and each time warns from another place."""
    shown = set()
    for text, line in (("wide", 1), ("wide", 2), ("thin", 1)):
        _show_warning(shown, text, MeshWarning, "mesh.py", line)
    assert capsys.readouterr().err.splitlines() == ["mjtactile: MeshWarning: wide", "mjtactile: MeshWarning: thin"]


def test_the_version_is_shown():
    done = run("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"mjtactile {mjtactile.__version__}\n", "")


def test_a_mesh_drawn_in_millimetres_presses_like_one_in_metres(tmp_path, monkeypatch, capsys, draft):
    said = []
    for name, radius, scale in (("m", 6e-3, ()), ("mm", 6.0, ("--scale", "1e-3"))):
        # Unit size first: trimesh drops small triangles.
        trimesh.creation.icosphere(radius=1.0).apply_scale(radius).export(tmp_path / f"{name}.stl")
        line = ["mjtactile", "press", str(tmp_path / f"{name}.stl"), "--fidelity", "fast", "--json", *scale]
        monkeypatch.setattr("sys.argv", line)
        main()
        said.append(json.loads(capsys.readouterr().out))
    # STL files have single precision, 6e-8 of a vertex's coordinates.
    assert said[1]["peak_reading_Pa"] == pytest.approx(said[0]["peak_reading_Pa"], rel=1e-4)
    assert said[1]["contact_area_m2"] == pytest.approx(said[0]["contact_area_m2"], rel=1e-4)


def test_help_says_the_largest_force_that_a_scene_applies():
    model = mjtactile.press_scene("circle")
    most = model.actuator_ctrlrange[:, 1].min()
    done = run("press", "--help", COLUMNS="200")
    assert f"at most {most:g} N along each axis" in done.stdout


def test_the_numbers_of_a_press_come_before_its_figure_is_drawn(monkeypatch, capsys, tmp_path, draft):
    """Drawing takes a second or two, in which people have something to read."""
    seen = []
    monkeypatch.setattr("mjtactile.cli.main._draw_press", lambda *_: seen.append(capsys.readouterr().out))
    monkeypatch.setattr("sys.argv", ["mjtactile", "press", "circle", "--fidelity", "fast", "--figure"])
    sys.argv.append(str(tmp_path / "c.png"))
    main()
    assert "time per update" in seen[0]
    assert capsys.readouterr().out.startswith("wrote ")


def test_every_option_stands_on_a_page():
    root = Path(__file__).parents[2]
    text = "\n".join(path.read_text() for path in [root / "README.md", *(root / "docs").rglob("*.md")])

    def options(command: Any) -> set[str]:
        below = [options(one) for one in getattr(command, "commands", {}).values()]
        own = {name for one in command.params for name in one.opts if name.startswith("--")}
        return own.union(*below)

    # These are in every command line.
    known = {"--help", "--version", "--install-completion", "--show-completion"}
    asked = options(get_command(app)) - known
    assert {"--azimuth", "--unusable"} <= asked
    assert {name for name in asked if not re.search(rf"{re.escape(name)}(?![\w-])", text)} == set()
