"""Many environments are so many single ones, bit by bit, however they are run."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from mjtactile.envs import ENTRY_POINTS, EnvError, make_vec

COUNT = 3


def actions(envs, steps):
    """Random, with an answer now and then where one can be given, so that episodes end."""
    drawn = np.random.default_rng(1)
    for step in range(steps):
        action = drawn.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        if action.shape[1] > 4:
            action[:, 4] = -1.0 if step % 4 else action[:, 4]
        yield action


def log(envs, steps):
    seen, _ = envs.reset(seed=7)
    out = [{**{key: value.copy() for key, value in seen.items()}}]
    for action in actions(envs, steps):
        seen, rewards, terminated, truncated, info = envs.step(action)
        values = {**seen, "rewards": rewards, "terminated": terminated, "truncated": truncated}
        if "success" in info:
            values["success"] = info["success"]
        out.append({key: np.array(value) for key, value in values.items()})
    envs.close()
    return out


def assert_same(one, other):
    for k, (a, b) in enumerate(zip(one, other, strict=True)):
        assert a.keys() == b.keys()
        for key in a:
            assert (a[key] == b[key]).all(), f"{key} at step {k}"


@pytest.mark.parametrize("name", ENTRY_POINTS)
def test_a_batch_gives_what_single_environments_give(name):
    pytest.importorskip("mujoco.batch")
    many = log(make_vec(name, COUNT, threads=2, randomise=1.0), 12)
    makers = [lambda: gymnasium.make(name, disable_env_checker=True, randomise=1.0)] * COUNT
    assert_same(many, log(SyncVectorEnv(makers), 12))


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_episodes_begin_anew_as_gymnasium_has_it(mode):
    pytest.importorskip("mujoco.batch")
    name = "mjtactile/PressIdentify-v0"
    batched, plain = (
        log(make_vec(name, COUNT, batched=batched, autoreset_mode=mode, observation="wrench"), 20)
        for batched in (True, False)
    )
    assert sum(step["terminated"].sum() for step in batched[1:]) >= 3
    assert_same(batched, plain)


def test_threads_change_nothing():
    pytest.importorskip("mujoco.batch")
    assert_same(*(log(make_vec("mjtactile/GraspLift-v0", 5, threads=n, observation="wrench"), 15) for n in (1, 2)))


def test_gymnasium_makes_them_too():
    envs = gymnasium.make_vec("mjtactile/GraspLift-v0", num_envs=2, observation="none")
    assert envs.num_envs == 2
    assert envs.spec is not None
    envs.close()


def test_without_a_batch_they_run_one_after_the_other(monkeypatch):
    monkeypatch.setattr("mjtactile.envs.many.find_spec", lambda name: None)
    envs = make_vec("mjtactile/GraspLift-v0", 2, observation="none")
    assert type(envs) is SyncVectorEnv
    envs.close()


def test_wrong_requests_are_refused():
    with pytest.raises(EnvError, match="GraspLift"):
        make_vec("mjtactile/GraspLift-v9", 2)
    with pytest.raises(EnvError, match="at least one"):
        make_vec("mjtactile/GraspLift-v0", 0)
