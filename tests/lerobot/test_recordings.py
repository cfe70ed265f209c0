from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gymnasium.wrappers import FlattenObservation, RescaleAction, TimeLimit
from typer.testing import CliRunner
from written_sets import info, needs_lerobot, read, read_with_lerobot

from mjtactile.cli.main import app
from mjtactile.dataset.files import make_dataset, read_dataset
from mjtactile.dataset.spec import ContactSpec, DatasetSpec, spec_from
from mjtactile.envs.single import TactileEnv
from mjtactile.errors import DatasetError, EnvError
from mjtactile.experiments.grasp.trials import TrialSettings
from mjtactile.experiments.hands.gripper import GRIPPER_PADS
from mjtactile.lerobot.environment import LeRobotRecorder
from mjtactile.lerobot.grasp import TOUCH_RATE, record_lifts
from mjtactile.lerobot.presses import presses_to_lerobot

SPEC = DatasetSpec(contacts=(ContactSpec(shapes=("star", "circle")),), presses=60, presets=("fast",))


@pytest.fixture(scope="module")
def presses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("presses")
    make_dataset(SPEC, folder, progress=False)
    return folder


def test_presses_are_the_same_in_both_formats(presses: Path, tmp_path: Path):
    episodes = presses_to_lerobot(presses, tmp_path / "set", progress=False)
    parquet, found = read_dataset(presses), read(tmp_path / "set")
    assert episodes == 3  # outlines of 24, 24 and 12 presses
    assert np.array_equal(found["observation.tactile.pad"], parquet.readings)
    assert np.array_equal(found["label.force"], parquet.forces.astype(np.float32))
    assert np.array_equal(found["label.position"], parquet.positions.astype(np.float32))


def test_presses_of_a_specification_that_is_refused_by_now_are_converted(tmp_path: Path, monkeypatch):
    spec = replace(SPEC, presses=30, poses=3, forces=4)
    delayed = spec.description | {"transducer": {"name": "capacitive", "imperfections": {"delay": 2}}}
    with pytest.raises(DatasetError, match="delay"):
        spec_from(delayed)
    monkeypatch.setattr(DatasetSpec, "description", delayed)
    make_dataset(spec, tmp_path / "presses", progress=False)
    assert presses_to_lerobot(tmp_path / "presses", tmp_path / "set", progress=False) == 3
    assert np.array_equal(
        read(tmp_path / "set")["observation.tactile.pad"], read_dataset(tmp_path / "presses").readings
    )


@needs_lerobot
@pytest.mark.slow
def test_lerobot_reads_presses(presses: Path, tmp_path: Path):
    presses_to_lerobot(presses, tmp_path / "set", progress=False)
    found, parquet = read_with_lerobot(tmp_path / "set", tmp_path / "found.npz"), read_dataset(presses)
    assert np.array_equal(found["observation.tactile.pad"], parquet.readings)
    assert {str(task) for task in found["task"]} == {
        f"press the {shape} onto the pad" for shape in set(parquet.labels["shape"])
    }


def test_the_command_writes_either_format(tmp_path: Path):
    spec = tmp_path / "few.toml"
    spec.write_text('presses = 24\nfidelity = "fast"\n[[contact]]\nshapes = ["square"]\n')
    command = ["dataset", "--spec", str(spec), "--workers", "1", "--out"]
    runner = CliRunner()
    assert runner.invoke(app, [*command, str(tmp_path / "a")]).exit_code == 0
    assert runner.invoke(app, [*command, str(tmp_path / "b"), "--format", "lerobot", "--flat"]).exit_code == 0
    readings = read_dataset(tmp_path / "a").readings
    assert np.array_equal(read(tmp_path / "b")["observation.tactile.pad"], readings.reshape(24, -1))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "few.toml"]
    again = runner.invoke(app, [*command, str(tmp_path / "b"), "--format", "lerobot"])
    assert isinstance(again.exception, DatasetError)
    assert isinstance(runner.invoke(app, [*command, str(tmp_path / "c"), "--format", "zarr"]).exception, DatasetError)


def test_an_environment_is_recorded_as_it_was_seen(tmp_path: Path):
    env = TactileEnv("mjtactile/GraspLift-v0", observation="readings", noise=0.05)
    env.action_space.seed(0)
    recorder = LeRobotRecorder(env, str(tmp_path / "set"))
    seen, acted, rewards = [], [], []
    for episode in range(2):
        observation, _ = recorder.reset(seed=episode)
        ended = False
        while not ended:
            action = env.action_space.sample()
            seen.append(observation)
            acted.append(action)
            observation, reward, terminated, truncated, _ = recorder.step(action)
            rewards.append(reward)
            ended = terminated or truncated
    recorder.reset(seed=3)
    recorder.step(env.action_space.sample())  # an episode that does not end is left out
    recorder.close()
    recorder.close()
    found = read(tmp_path / "set")
    assert info(tmp_path / "set")["total_episodes"] == 2
    assert np.array_equal(found["action"], np.array(acted, np.float32))
    assert np.array_equal(found["next.reward"], np.array(rewards, np.float32))
    assert np.array_equal(found["observation.state"], [one["proprioception"] for one in seen])
    for number, name in enumerate(GRIPPER_PADS):
        pascals = np.array([one["tactile"][number] * 10e3 for one in seen], np.float32)
        assert np.array_equal(found[f"observation.tactile.{name}"], pascals)
    assert found["next.done"].sum() == 2


def test_arrays_that_the_caller_writes_into_again_are_recorded_as_they_were(tmp_path: Path):
    env = TactileEnv("mjtactile/GraspLift-v0", observation="pascals")
    env.action_space.seed(0)
    recorder = LeRobotRecorder(env, tmp_path / "set")
    buffer, acted, states, touched = np.zeros(2, np.float32), [], [], []
    observation, _ = recorder.reset(seed=0)
    ended = False
    while not ended:
        buffer[:] = env.action_space.sample()
        acted.append(buffer.copy())
        states.append(observation["proprioception"].copy())
        touched.append(observation["tactile"].copy())
        for array in observation.values():
            array[:] = -1.0
        observation, _, terminated, truncated, _ = recorder.step(buffer)
        ended = terminated or truncated
    recorder.close()
    found = read(tmp_path / "set")
    assert np.array_equal(found["action"], acted)
    assert np.array_equal(found["observation.state"], states)
    for number, name in enumerate(GRIPPER_PADS):
        assert np.array_equal(found[f"observation.tactile.{name}"], [one[number] for one in touched])


@pytest.mark.parametrize(
    ("wrapped", "said"),
    [
        (FlattenObservation, r"FlattenObservation.* changes the observation_space"),
        (
            lambda env: RescaleAction(env, np.float32(-2.0), np.float32(2.0)),
            r"RescaleAction.* changes the action_space",
        ),
    ],
)
def test_wrappers_that_change_the_spaces_are_refused(tmp_path: Path, wrapped, said):
    env = TactileEnv("mjtactile/GraspLift-v0", observation="pascals")
    with pytest.raises(DatasetError, match=said + r".*Wrap the recorder instead"):
        LeRobotRecorder(wrapped(TimeLimit(env, 3)), tmp_path / "set")
    assert list(tmp_path.iterdir()) == []


def test_actions_are_recorded_as_executed_and_wrappers_that_keep_the_spaces_are_accepted(tmp_path: Path):
    env = TimeLimit(TactileEnv("mjtactile/GraspLift-v0", observation="pascals"), 2)
    recorder = LeRobotRecorder(env, tmp_path / "set")
    recorder.reset(seed=0)
    recorder.step(np.array([3.0, -0.5], np.float32))
    recorder.step(np.array([-1.5, 1.0], np.float32))
    recorder.close()
    assert read(tmp_path / "set")["action"].tolist() == [[1.0, -0.5], [-1.0, 1.0]]


def test_an_episode_whose_reset_was_refused_is_not_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    env = TimeLimit(TactileEnv("mjtactile/GraspLift-v0", observation="pascals"), 3)
    recorder, still = LeRobotRecorder(env, tmp_path / "set"), np.zeros(2, np.float32)
    recorder.reset(seed=0)
    recorder.step(still)
    with monkeypatch.context() as refusing:
        refusing.setattr(env, "reset", _refuse)  # a wrapper; the environment goes on after it
        with pytest.raises(EnvError):
            recorder.reset()
    recorder.step(still)
    recorder.step(still)
    recorder.reset(seed=1)
    for _ in range(3):
        recorder.step(still)
    recorder.close()
    assert info(tmp_path / "set")["total_episodes"] == 1
    assert info(tmp_path / "set")["total_frames"] == 3


def _refuse(**_options):
    raise EnvError("refused")


def test_a_recorder_without_a_finished_episode_closes_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    env, closed = TactileEnv("mjtactile/GraspLift-v0", observation="pascals"), []
    recorder = LeRobotRecorder(env, tmp_path / "set")
    monkeypatch.setattr(env, "close", lambda: closed.append(True))
    with pytest.raises(DatasetError, match="no episodes"):
        recorder.close()
    assert closed == [True]
    assert list(tmp_path.iterdir()) == []


def test_environments_without_readings_are_refused(tmp_path: Path):
    with pytest.raises(DatasetError, match="observe readings"):
        LeRobotRecorder(TactileEnv("mjtactile/GraspLift-v0", observation="wrench"), tmp_path / "set")


@pytest.mark.slow
def test_a_lift_is_recorded_with_touch_at_its_own_rate(tmp_path: Path):
    results = record_lifts(tmp_path / "set", episodes=1, settings=TrialSettings(), fps=50)
    found, said = read(tmp_path / "set"), info(tmp_path / "set")
    frames = len(found["action"])
    assert said["fps"] == 50
    assert TOUCH_RATE == 250
    assert found["observation.tactile_between.left"].shape == (frames, 5, 4, 13, 13)
    assert abs(frames / 50 - results[0]["time"]) < 0.05
    assert found["next.success"][-1] == results[0]["success"]
    # What is felt grows as the grip does: the recording is of the pads, not of nothing.
    assert found["observation.tactile.left"][0].max() < 1.0
    assert found["observation.tactile.left"][-1].max() > 1e3
    assert found["action"][-1, 0] == pytest.approx(results[0]["grip"], rel=0.2)
    with pytest.raises(DatasetError, match="divide"):
        record_lifts(tmp_path / "other", episodes=1, settings=TrialSettings(), fps=60)
