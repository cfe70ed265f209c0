"""Many environments are so many single ones, bit by bit, however they are run."""

import json
import warnings
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

import mjtactile
from mjtactile.envs import ENTRY_POINTS, EnvError, TactileEnv, make_vec
from mjtactile.envs.grasp_lift import GraspLift
from mjtactile.envs.many import TactileVectorEnv
from mjtactile.envs.press_identify import PressIdentify
from mjtactile.envs.simulation import BatchSimulations, SingleSimulation
from mjtactile.errors import RenderError
from mjtactile.sim.render import working_backend

COUNT = 3
#: Actions under which episodes end soon: an answer now and then, a grip that crushes, away from the edge, a peg pulled
#: off its way; and where noise is added to them.
ENDING = {
    "mjtactile/PressIdentify-v0": ([0.0, 0.0, 0.0, 0.5, -0.5, *[0.0] * 7], 1.0),
    "mjtactile/GraspLift-v0": ([0.9, 0.3], 0.3),
    "mjtactile/EdgeFollow-v0": ([0.2, -0.8, 0.0, 1.0], 0.3),
    "mjtactile/PegInsert-v0": ([0.8, 0.5, -0.9, 0.0], 0.3),
}


def actions(envs, steps):
    """Random, with an answer now and then where one can be given, so that episodes end."""
    drawn = np.random.default_rng(1)
    for step in range(steps):
        action = drawn.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        if action.shape[1] > 4:
            action[:, 4] = -1.0 if step % 4 else action[:, 4]
        yield action


def log(envs, steps):
    """All that a vector environment says, step by step; those that ended are reset where that is not done for them."""
    told = [envs.reset(seed=7)]
    for action in actions(envs, steps):
        told.append(envs.step(action))
        ended = told[-1][2] | told[-1][3]
        if envs.metadata["autoreset_mode"] == AutoresetMode.DISABLED and ended.any():
            told.append(envs.reset(options={"reset_mask": ended}))
    envs.close()
    return told


def assert_same(one, other, where=""):
    """Equal to the bit, in numbers, types and names."""
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key in one:
            assert_same(one[key], other[key], f"{where} {key}")
    elif isinstance(one, list | tuple):
        assert len(one) == len(other), where
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            assert_same(a, b, f"{where} {k}")
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), where
        if one.dtype == object:
            assert_same(list(one), list(other), where)
        else:
            assert np.array_equal(one, other), where
    else:
        assert one == other, where


def one_by_one(name, seeds, steps, **options):
    """What single environments say, each on its own, reset in the step after one that ended it."""
    for k, seed in enumerate(seeds):
        env: Any = TactileEnv(name, **options)
        told, over = [env.reset(seed=seed)], False
        for action in steps:
            told.append((env.reset()[0], 0.0, False, False, {}) if over else env.step(action[k]))
            over = told[-1][2] or told[-1][3]
        yield told


@pytest.mark.parametrize("name", ENTRY_POINTS)
@pytest.mark.parametrize("observation", ["readings", "wrench"])
def test_each_of_many_is_the_one_of_its_seed_to_the_bit(name, observation):
    pytest.importorskip("mujoco.batch")
    middle, spread = ENDING[name]
    drawn = np.random.default_rng(3)
    steps = (middle + spread * drawn.uniform(-1.0, 1.0, (24, 5, len(middle)))).astype(np.float32)
    envs = make_vec(name, 5, observation=observation, randomise=1.0)
    many: list[Any] = [envs.reset(seed=11), *(envs.step(action) for action in steps)]
    alone = list(one_by_one(name, range(11, 16), steps, observation=observation, randomise=1.0))
    assert sum(int(told[2].sum()) for told in many[1:]) >= 2
    for k, told in enumerate(alone):
        for step, (a, b) in enumerate(zip(many, told, strict=True)):
            for seen in a[0]:
                assert np.array_equal(a[0][seen][k], b[0][seen]), f"{seen} of {k} at step {step}"
            for of_many, of_one in zip(a[1:4], b[1:4] if step else (), strict=False):
                assert of_many[k] == of_one, f"{k} at step {step}"
            for key, value in b[-1].items():
                assert a[-1][f"_{key}"][k], f"{key} of {k} at step {step}"
                assert a[-1][key][k] == value, f"{key} of {k} at step {step}"


@pytest.mark.parametrize("name", ENTRY_POINTS)
def test_a_batch_says_what_gymnasium_says_of_single_environments(name):
    pytest.importorskip("mujoco.batch")
    makers = [lambda: gymnasium.make(name, disable_env_checker=True, randomise=1.0)] * COUNT
    assert_same(log(make_vec(name, COUNT, threads=2, randomise=1.0), 12), log(SyncVectorEnv(makers), 12))


@pytest.mark.parametrize("batched", [True, False])
@pytest.mark.parametrize("make", [make_vec, gymnasium.make_vec])
def test_a_spec_makes_the_same_environments_again(make, batched):
    if batched:
        pytest.importorskip("mujoco.batch")
    options = {"observation": "wrench", "noise": 0.5, "autoreset_mode": "SameStep", "batched": batched}
    first = make("mjtactile/GraspLift-v0", 2, **options)
    assert first.spec.kwargs.items() >= options.items()
    assert json.loads(first.spec.to_json())["kwargs"]["noise"] == 0.5
    again = gymnasium.make_vec(first.spec)
    assert type(again) is type(first)
    assert_same(log(first, 8), log(again, 8))


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_mode_may_be_named(mode):
    pytest.importorskip("mujoco.batch")
    by_mode, by_name = (
        log(TactileVectorEnv(PressIdentify, 2, observation="none", autoreset_mode=one), 12)
        for one in (mode, mode.value)
    )
    assert_same(by_mode, by_name)
    with pytest.raises(EnvError, match=r"autoreset_mode = 'never' does not exist. Available: 'NextStep'"):
        TactileVectorEnv(PressIdentify, 2, autoreset_mode="never")


@pytest.mark.parametrize("mode", AutoresetMode)
def test_episodes_begin_anew_as_gymnasium_has_it(mode):
    pytest.importorskip("mujoco.batch")
    name = "mjtactile/PressIdentify-v0"
    batched, plain = (
        log(make_vec(name, COUNT, batched=batched, autoreset_mode=mode, observation="wrench"), 20)
        for batched in (True, False)
    )
    assert sum(told[2].sum() for told in batched if len(told) == 5) >= 3
    assert_same(batched, plain)


def test_what_was_given_stays_as_it_was():
    pytest.importorskip("mujoco.batch")
    envs: Any = make_vec("mjtactile/GraspLift-v0", 2, autoreset_mode="Disabled")
    envs.reset(seed=0)
    seen = envs.step(np.ones((2, 2), np.float32))[0]["proprioception"]
    kept = seen.copy()
    anew = envs.reset(options={"reset_mask": np.array([True, False])})[0]["proprioception"]
    assert np.array_equal(seen, kept)
    assert (anew[0] != kept[0]).any()
    anew[:] = 0.0
    again = envs.reset(options={"reset_mask": np.array([True, False])})[0]["proprioception"]
    assert np.array_equal(again[1], kept[1])


def test_what_waits_may_be_told_anything_and_what_runs_may_not():
    pytest.importorskip("mujoco.batch")
    envs = make_vec("mjtactile/PressIdentify-v0", 2, observation="none")
    envs.reset(seed=0)
    answer = np.zeros((2, 12), np.float32)
    answer[0, 4] = 1.0
    assert envs.step(answer)[2].tolist() == [True, False]
    answer[0] = np.nan
    _, rewards, terminated, _, _ = envs.step(answer)
    assert rewards[0] == 0.0
    assert not terminated.any()
    for wrong in (answer, np.zeros((2, 11)), np.zeros((3, 12))):
        with pytest.raises(EnvError, match="12 finite numbers"):
            envs.step(wrong)


def test_what_has_ended_is_reset_by_hand_where_nothing_else_does():
    pytest.importorskip("mujoco.batch")
    envs: Any = make_vec("mjtactile/PressIdentify-v0", 2, observation="none", autoreset_mode="Disabled")
    envs.reset(seed=0)
    answer = np.zeros((2, 12), np.float32)
    answer[0, 4] = 1.0
    envs.step(answer)
    with pytest.raises(EnvError, match=r"\[0\] have ended"):
        envs.step(answer)
    for mask in (np.zeros(2, bool), np.ones(3, bool), np.ones(2)):
        with pytest.raises(EnvError, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})
    with pytest.raises(EnvError, match="3 seeds"):
        envs.reset(seed=[1, 2, 3])
    envs.reset(options={"reset_mask": np.array([True, False])})
    assert envs.task.steps.tolist() == [0, 1]


def test_threads_change_nothing():
    pytest.importorskip("mujoco.batch")
    one, two = (log(make_vec("mjtactile/GraspLift-v0", 5, threads=n, observation="wrench"), 15) for n in (1, 2))
    assert_same(one, two)


def test_each_of_many_is_drawn():
    pytest.importorskip("mujoco.batch")
    try:
        working_backend()
    except RenderError as error:
        pytest.skip(str(error))
    envs: Any = make_vec(
        "mjtactile/PressIdentify-v0", 2, observation="none", render_mode="rgb_array", width=96, height=64
    )
    envs.reset(seed=0)
    first = envs.render()
    for _ in range(5):
        envs.step(np.array([[1.0, 1.0, 1.0, 1.0, -1.0, *[0.0] * 7], [0.0] * 12], np.float32))
    then = envs.render()
    assert [picture.shape for picture in then] == [(64, 96, 3)] * 2
    assert (first[0] != then[0]).any()
    envs.close()


def test_gymnasium_makes_them_too():
    envs: VectorEnv[Any, Any, Any] = gymnasium.make_vec("mjtactile/GraspLift-v0", num_envs=2, observation="none")
    assert envs.num_envs == 2
    assert envs.spec is not None
    envs.close()


def test_a_task_of_ones_own_is_made_like_those_here():
    envs: Any = make_vec(GraspLift, 2, observation="none", split="test")
    assert envs.spec is None
    assert envs.reset(seed=0)[0]["proprioception"].shape == (2, 6)


def test_without_a_batch_they_run_one_after_the_other(monkeypatch):
    monkeypatch.setattr("mjtactile.envs.many.find_spec", lambda name: None)
    envs = make_vec("mjtactile/GraspLift-v0", 2, observation="none")
    assert type(envs) is SyncVectorEnv
    envs.close()
    with pytest.raises(EnvError, match=r"no mujoco\.batch"):
        make_vec("mjtactile/GraspLift-v0", 2, batched=True)


@pytest.mark.parametrize("kind", [SingleSimulation, BatchSimulations])
def test_environments_tell_nothing_of_contacts_and_leave_filters_of_warnings_alone(kind):
    if kind is BatchSimulations:
        pytest.importorskip("mujoco.batch")
    body = '<body name="anvil" pos="0 0 0.005"><freejoint/><geom type="box" size="0.004 0.003 0.005" mass="95"/></body>'
    spec = mujoco.MjSpec.from_string(f'<mujoco><worldbody><body name="finger"/>{body}</worldbody></mujoco>')
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast")
    filters = []
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        # Which of its threads make a batch's data is a matter of chance.
        simulations = [kind(spec.compile(), *([] if kind is SingleSimulation else [3, 2])) for _ in range(20)]
        for simulation in simulations:
            rows = np.arange(simulation.count, dtype=np.int32)
            if kind is SingleSimulation:  # a batch calls no function of Python
                mujoco.set_mjcb_control(lambda model, data: filters.append(warnings.filters))
            try:
                for _ in range(5):
                    simulation.step(rows, 4)
            finally:
                mujoco.set_mjcb_control(None)
            simulation.forward(rows)
            simulation.state(int(rows[-1]))
            assert simulation.sensordata.max() > 1e6
        assert all(one is warnings.filters for one in filters)
    assert not told


def test_wrong_requests_are_refused():
    with pytest.raises(EnvError, match="GraspLift"):
        make_vec("mjtactile/GraspLift-v9", 2)
    with pytest.raises(EnvError, match="at least one"):
        make_vec("mjtactile/GraspLift-v0", 0)
    for batched in (True, False):
        with pytest.raises(EnvError, match="rgb_array"):
            make_vec("mjtactile/GraspLift-v0", 2, batched=batched, render_mode="ascii")


def test_seeds_are_whole_numbers_of_python_or_numpy():
    pytest.importorskip("mujoco.batch")
    many = TactileVectorEnv(GraspLift, 2)
    for wrong in ("12", 1.5, [1, 1.5], np.ones(2), -1):
        with pytest.raises(EnvError, match=r"seed = .*expected a whole number"):
            many.reset(seed=wrong)  # type: ignore[arg-type]
    with pytest.raises(EnvError, match="3 seeds"):
        many.reset(seed=[1, 2, 3])
    given: list[Any] = [4, np.int64(4), [4, 5], np.array([4, 5])]
    seen = [many.reset(seed=seeds)[0] for seeds in given]
    for other in seen[1:]:
        for name, values in seen[0].items():
            np.testing.assert_array_equal(other[name], values)
