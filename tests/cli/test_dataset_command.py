from __future__ import annotations

from typer.testing import CliRunner

from mjtactile.cli.main import app
from mjtactile.dataset.files import read_dataset
from mjtactile.envs.grasp_lift import GraspLift
from mjtactile.envs.single import TactileEnv
from mjtactile.errors import DatasetError

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


def test_a_folder_that_was_not_made_for_the_moment_is_never_deleted(tmp_path):
    file, out = tmp_path / "few.toml", tmp_path / "set"
    file.write_text(SPEC)
    lerobot = ("--spec", str(file), "--workers", "1", "--out", str(out), "--format", "lerobot")
    for name in ("set.presses", ".set.presses"):
        assert run("--spec", str(file), "--workers", "1", "--out", str(tmp_path / name)).exit_code == 0
        (tmp_path / name / "notes.txt").write_text("mine")
    refused = run(*lerobot)
    assert isinstance(refused.exception, DatasetError)
    assert "not of this command" in str(refused.exception)
    (tmp_path / ".set.presses").rename(tmp_path / "moved")
    assert run(*lerobot).exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["few.toml", "moved", "set", "set.presses"]
    assert (tmp_path / "set.presses" / "notes.txt").read_text() == "mine"
    assert len(read_dataset(tmp_path / "set.presses").readings) == 6


def test_presses_for_another_format_go_on_after_an_interruption(tmp_path, monkeypatch):
    file, out = tmp_path / "few.toml", tmp_path / "set"
    file.write_text(SPEC)
    lerobot = ("--spec", str(file), "--workers", "1", "--out", str(out), "--format", "lerobot")
    with monkeypatch.context() as interrupted:
        interrupted.setattr("mjtactile.lerobot.presses.presses_to_lerobot", _stop)
        assert run(*lerobot).exit_code != 0
    assert "made 0 of 6" in run(*lerobot).output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["few.toml", "set"]


def test_recordings_of_different_seeds_share_no_episode(tmp_path, monkeypatch):
    seeds, begin = [], TactileEnv.reset
    monkeypatch.setattr(TactileEnv, "reset", lambda env, *, seed: seeds.append(seed) or begin(env, seed=seed))
    monkeypatch.setattr(GraspLift, "EPISODE_STEPS", 2)
    for seed in ("5", "6"):
        command = ["record", "mjtactile/GraspLift-v0", "--episodes", "3", "--seed", seed, "--out"]
        assert CliRunner().invoke(app, [*command, str(tmp_path / seed), "--fidelity", "fast"]).exit_code == 0
    assert len(set(seeds)) == 6


def _stop(*_arguments, **_options):
    raise KeyboardInterrupt
