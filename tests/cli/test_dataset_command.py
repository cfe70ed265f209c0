from __future__ import annotations

from typer.testing import CliRunner

from mjtactile.cli.main import app
from mjtactile.dataset.files import read_dataset

SPEC = """
presses = 6
seed = 3
fidelity = "fast"
law = "uniform"
poses = 1
forces = 2
[[contact]]
shapes = ["square"]
force = 50
"""


def run(*arguments):
    return CliRunner().invoke(app, ["dataset", *arguments])


def test_a_dataset_is_made_once_and_continued_when_more_is_asked_for(tmp_path):
    file = tmp_path / "presses.toml"
    file.write_text(SPEC)
    first = run("--spec", str(file), "--workers", "1")
    assert first.exit_code == 0, first.output
    assert "made 6 of 6" in first.output
    assert "made 0 of 6" in run("--spec", str(file), "--workers", "1").output
    assert "made 8 of 8" in run("--spec", str(file), "--workers", "1", "--presses", "8").output
    assert len(read_dataset(tmp_path / "presses").readings) == 8


def test_another_seed_into_the_same_folder_is_refused(tmp_path):
    file = tmp_path / "presses.toml"
    file.write_text(SPEC)
    run("--spec", str(file), "--workers", "1")
    refused = run("--spec", str(file), "--workers", "1", "--seed", "9")
    assert "another specification or seed" in str(refused.exception)
