"""training/train_policy.py from runs to figure and table, in seconds, and what its environment shows a policy."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mjtactile.errors import TrialsError

TRAINING = Path(__file__).parents[2] / "training"
#: What is asked for, without the runs.
SMALL = {"steps": 128, "environments": 4, "test_episodes": 4, "rollout": 16, "batch": 32, "epochs": 1, "width": 8}


@pytest.fixture(scope="module")
def scripts():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TRAINING))
        yield {name: importlib.import_module(name) for name in ("train_policy", "policy_environment", "policy_report")}


def lifts(scripts, observation="none"):
    one = scripts["policy_environment"].StackedLifts(3, observation, "train")
    one.seed(4)
    return one, one.reset()


@pytest.mark.slow
def test_runs_are_made_once_and_end_in_a_figure_and_a_table(tmp_path, scripts, capsys, monkeypatch):
    train, temporary = scripts["train_policy"], tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))  # for processes that begin here
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    config = train.Config(out=tmp_path, seeds=1, workers=1, **SMALL)
    train.main(config)
    assert not list(temporary.glob("SB3-*"))  # folders of a log that nobody reads
    runs = {path.name: json.loads(path.read_text()) for path in tmp_path.glob("*.json")}
    assert set(runs) == {"touch-0.json", "no_touch-0.json"}
    for run in runs.values():
        told = run["test"]
        assert told["success"] + told["dropped"] + told["crushed"] <= 1.0
        assert len(run["curve"]) >= 1
    table = (tmp_path / "table.md").read_text()
    assert "| touch |" in table
    assert "| no touch |" in table
    assert (tmp_path / "curves.png").stat().st_size > 5000
    capsys.readouterr()
    before = (tmp_path / "touch-0.json").stat().st_mtime_ns
    train.main(config)
    assert (tmp_path / "touch-0.json").stat().st_mtime_ns == before
    assert "unseen objects" not in capsys.readouterr().out


def test_runs_of_other_settings_are_refused_and_what_changes_none_is_not(tmp_path, scripts):
    train = scripts["train_policy"]
    config = train.Config(out=tmp_path, **SMALL)
    path = tmp_path / "touch-0.json"
    stored = {name: str(value) for name, value in vars(config).items()}
    path.write_text(json.dumps({"config": stored}))
    train.check_run(path, replace(config, seeds=9, workers=1, out=tmp_path / "other", figure=Path("curves.png")))
    path.write_text(json.dumps({"config": {**stored, "rate": "1.0"}}))
    train.check_run(path, replace(config, rate=1))
    path.write_text(json.dumps({"config": stored}))
    with pytest.raises(TrialsError, match=r"other settings: steps 128, not 256; rate 0\.001, not 0\.01\. "):
        train.main(replace(config, steps=256, rate=0.01))
    for name in train.Config.__dataclass_fields__.keys() - train._OUTSIDE:
        path.write_text(json.dumps({"config": {**stored, name: "7.5"}}))
        with pytest.raises(TrialsError, match=f"{name} 7.5, not "):
            train.check_run(path, config)
    path.write_text("[]")
    with pytest.raises(TrialsError, match="holds no run"):
        train.check_run(path, config)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"steps": 0}, "steps = 0; expected a whole number of at least 1"),
        ({"seeds": 0}, "seeds = 0; expected"),
        ({"rate": 0.0}, r"rate = 0\.0; expected a positive"),
        ({"discount": 1.5}, r"discount = 1\.5; expected"),
    ],
)
def test_settings_of_which_nothing_comes_are_refused(scripts, wrong, said):
    with pytest.raises(TrialsError, match=said):
        scripts["train_policy"].Config(out=Path("out"), **wrong)


def test_the_policy_sees_what_is_and_how_it_changed(scripts):
    envs, first = lifts(scripts)
    assert first.shape == (3, 18)
    assert envs.observation_space.contains(first[0])
    for _ in range(3):
        before = envs._seen.copy()
        envs.step(np.full((3, 2), 0.5, np.float32))
        assert (envs._seen[:, 1] == envs._seen[:, 0] - before[:, 0]).all()
        assert (envs._seen[:, 2] == before[:, 1]).all()
    envs.close()


def test_touch_is_all_that_sets_the_arms_apart(scripts):
    (blind, _), (feeling, _) = lifts(scripts, "none"), lifts(scripts, "readings")
    for action in np.random.default_rng(0).uniform(-1, 1, (10, 3, 2)).astype(np.float32):
        told = [envs.step(action)[1:3] for envs in (blind, feeling)]
        assert (told[0][0] == told[1][0]).all()
        own = [envs._seen[:, :, :6] for envs in (blind, feeling)]
        assert (own[0] == own[1]).all()
    assert feeling._seen.shape[2] - blind._seen.shape[2] == 16


def test_an_episode_that_ends_is_told_whole_and_the_next_begins(scripts):
    envs, _ = lifts(scripts)
    crush = np.tile(np.array([1.0, -1.0], np.float32), (3, 1))
    done, infos = np.zeros(3, bool), []
    while not done.any():
        _, _, done, infos = envs.step(crush)
    k = int(np.flatnonzero(done)[0])
    assert envs.ended[0]["crushed"]
    assert infos[k]["terminal_observation"].shape == (18,)
    assert (envs._seen[k, 1:] == 0.0).all()
    assert not np.array_equal(infos[k]["terminal_observation"][:6], envs._shown(envs._seen)[k, :6])


def test_the_table_has_the_mean_of_the_seeds(scripts):
    results = [
        {
            "arm": arm,
            "seed": seed,
            "processor_s_with_test": 100.0,
            "test": {"success": success, "dropped": 0.1, "crushed": 0.2},
            "curve": [{"steps": 10 * k, "success": k % 2 == 0} for k in range(9)],
        }
        for arm, seed, success in (("touch", 0, 0.9), ("touch", 1, 0.7), ("no touch", 0, 0.2), ("no touch", 1, 0.1))
    ]
    lines = scripts["policy_report"].success_table(results).splitlines()
    assert lines[2] == "| touch | 90.0% | 70.0% | **80.0%** | 10.0% | 20.0% | 100 s |"
    assert "**15.0%**" in lines[3]
    assert scripts["policy_report"].draw_curves(results).axes[0].get_ylim() == (0.0, 100.0)
    results[0]["curve"] = []  # a run too short for an episode to end
    scripts["policy_report"].draw_curves(results)
