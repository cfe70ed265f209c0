"""Every environment: gymnasium's own checker, seeds, options, spaces, pictures."""

import copy
import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mjtactile  # noqa: F401  registers the environments
from mjtactile.envs import ENTRY_POINTS, EnvError, TactileEnv, make_vec
from mjtactile.errors import RenderError
from mjtactile.fidelity import Fidelity
from mjtactile.pad import Pad
from mjtactile.sim.render import working_backend

NAMES = tuple(ENTRY_POINTS)


def run(name, steps=6, seed=3, **options):
    """Observations and rewards under random actions, one list."""
    env = gymnasium.make(name, disable_env_checker=True, **options)
    seen, _ = env.reset(seed=seed)
    drawn, log = np.random.default_rng(0), [seen]
    for _ in range(steps):
        action = drawn.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        # Not an answer, which would end the episode at once; and press.
        action[3:5] = (1.0, -1.0)[: len(action) - 3]
        seen, reward, terminated, truncated, _ = env.step(action)
        log.append({**seen, "reward": reward})
        if terminated or truncated:
            break
    env.close()
    return log


def touch_space(name, **options) -> Any:
    space: Any = gymnasium.make(name, **options).observation_space
    return space["tactile"]


def same(one, other):
    return all(
        (a[key] == b[key]).all() if key != "reward" else a[key] == b[key]
        for a, b in zip(one, other, strict=True)
        for key in a
    )


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_finds_nothing_wrong(name):
    check_env(gymnasium.make(name, observation="wrench").unwrapped, skip_render_check=True)


@pytest.mark.parametrize("name", NAMES)
def test_a_seed_decides_everything(name):
    first = run(name, randomise=1.0)
    assert same(first, run(name, randomise=1.0))
    assert not same(first, run(name, randomise=1.0, seed=4))


@pytest.mark.parametrize("name", NAMES)
def test_what_is_seen_of_the_pads_does_not_change_what_happens(name):
    own = [[seen["proprioception"] for seen in run(name, observation=what)] for what in ("readings", "wrench", "none")]
    for other in own[1:]:
        assert (np.array(own[0]) == np.array(other)).all()
    assert all("tactile" not in seen for seen in run(name, observation="none"))


@pytest.mark.parametrize("name", NAMES)
def test_pads_feel_something(name):
    for what in ("readings", "wrench", "recognised"):
        assert run(name, observation=what)[-1]["tactile"].shape == touch_space(name, observation=what).shape
        assert any(np.abs(seen["tactile"]).max() > 0.01 for seen in run(name, observation=what))


def test_readings_are_of_every_pad_layer_row_and_column():
    space = touch_space("mjtactile/GraspLift-v0")
    assert space.shape == (2, 4, 13, 13)
    assert space.dtype == np.float32
    pad = Pad(depths=(1e-3,))
    assert touch_space("mjtactile/PressIdentify-v0", pad=pad, fidelity="fast").shape == (1, 1, 13, 13)


def test_randomisation_changes_the_body():
    fixed, loose = (run("mjtactile/PressIdentify-v0", observation="none", randomise=how) for how in (0.0, 1.0))
    assert same(fixed[:1], loose[:1])
    assert not same(fixed, loose)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"observation": "pictures"}, "readings, pascals, wrench, recognised, none"),
        ({"observation": np.array(["wrench", "none"])}, "readings, pascals, wrench, recognised, none"),
        ({"transducer": np.array(["a", "b"])}, "capacitive, piezoresistive"),
        ({"render_mode": np.array(["a", "b"])}, "rgb_array"),
        ({"fidelity": "slow"}, "fast, balanced"),
        ({"transducer": "optical"}, "capacitive, piezoresistive"),
        ({"transducer": "capacitive", "observation": "wrench"}, "'pascals' or 'recognised'"),
        ({"weights": "mine"}, "weights = 'mine' are for observation 'recognised'"),
        ({"noise": -1.0}, "at least 0"),
        ({"randomise": 2.0}, "0 .none. to 1"),
        ({"render_mode": "ascii"}, "rgb_array"),
    ],
)
def test_wrong_options_are_refused(options, told):
    with pytest.raises(EnvError, match=told):
        TactileEnv("mjtactile/PressIdentify-v0", **options)


@pytest.mark.parametrize("make", [gymnasium.make, make_vec])
@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"width": 0}, "width = 0; expected a whole number of pixels"),
        ({"height": -5}, "height = -5; expected"),
        ({"width": 1.5}, r"width = 1\.5; expected"),
        ({"width": 100_000}, "from 1 to 16384"),
        ({"pad": 3}, "type int; expected a mjtactile.Pad"),
        ({"pad": "none.toml"}, "there is no such file"),
        ({"observe": "wrench"}, "no option .observe.\\. Available: observation, fidelity"),
    ],
)
def test_wrong_pictures_pads_and_names_are_refused(make, options, told):
    with pytest.raises(EnvError, match=told):
        make("mjtactile/GraspLift-v0", **options)


def test_splits_are_of_one_task_alone():
    with pytest.raises(EnvError, match=r"PressIdentify has no option 'split'.*split for GraspLift only"):
        gymnasium.make("mjtactile/PressIdentify-v0", split="train")


@pytest.mark.parametrize("name", ["PressIdentify", "EdgeFollow"])
def test_a_pad_may_be_a_file(name, tmp_path):
    (tmp_path / "pad.toml").write_text("taxels = { rows = 5, columns = 5, pitch = [2e-3, 2e-3] }\n")
    env = gymnasium.make(f"mjtactile/{name}-v0", pad=str(tmp_path / "pad.toml"), fidelity=Fidelity(mesh="draft"))
    assert env.reset(seed=0)[0]["tactile"].shape == (1, 4, 5, 5)


@pytest.mark.parametrize("options", ["mass", ["mass"], 3])
def test_reset_options_are_values_by_name(options):
    for env in (gymnasium.make("mjtactile/GraspLift-v0"), make_vec("mjtactile/GraspLift-v0", 2)):
        env.reset(seed=0)
        with pytest.raises(EnvError, match="expected values by name"):
            env.reset(options=options)
        env.step(np.zeros(env.action_space.shape or (), np.float32))  # the episode goes on


@pytest.mark.parametrize(
    "options",
    [
        {"mass": True},
        {"mass": 11.0},
        {"mass": 0.0},
        {"mass": 1e-12},
        {"mass": "0.1"},
        {"friction": 1e300},
        {"friction": 1e-9},
        {"friction": True},
        {"friction": [0.5]},
    ],
    ids=str,
)
def test_a_mass_and_a_friction_are_those_of_an_object(options):
    env = gymnasium.make("mjtactile/GraspLift-v0", observation="none")
    with pytest.raises(EnvError, match=r"numbers from 0\.001 to 10 and from 0\.001 to 10"):
        env.reset(options=options)


@pytest.mark.parametrize(("mass", "friction"), [(np.float32(10.0), 10), (1e-3, 10), (1e-3, 1e-3), (10.0, 1e-3)])
def test_extreme_masses_and_frictions_are_simulated(mass, friction):
    env: Any = gymnasium.make("mjtactile/GraspLift-v0", observation="none").unwrapped
    env.reset(seed=0, options={"mass": mass, "friction": friction})
    for _ in range(10):
        assert np.isfinite(env.step(np.ones(2, np.float32))[0]["proprioception"]).all()
    assert not any(one.number for one in env.task.simulation.state(0)[1].warning)


@pytest.mark.parametrize("batched", [True, False])
def test_after_a_reset_that_was_refused_no_step_is_taken(batched):
    if batched:
        pytest.importorskip("mujoco.batch")
    name = "mjtactile/GraspLift-v0"
    env: Any = make_vec(name, 2, observation="none") if batched else TactileEnv(name, observation="none")
    action = np.zeros(env.action_space.shape, np.float32)
    env.reset(seed=0)
    env.step(action)
    for options in ({"mass": -1.0}, {"weight": 1.0}):
        with pytest.raises(EnvError, match="expected only"):
            env.reset(options=options)
        with pytest.raises(EnvError, match="the last reset was refused: reset first"):
            env.step(action)
        env.reset()
        env.step(action)


@pytest.mark.parametrize(("name", "option"), [("EdgeFollow", "plate"), ("PressIdentify", "shape")])
@pytest.mark.parametrize("wrong", [[], {}, 3, np.array(["star", "disc"])], ids=str)
def test_a_body_is_chosen_by_its_name(name, option, wrong):
    env = gymnasium.make(f"mjtactile/{name}-v0", observation="none")
    with pytest.raises(EnvError, match=f"expected only {option}, one of "):
        env.reset(options={option: wrong})


@pytest.mark.parametrize("task", [None, 3, ["mjtactile/GraspLift-v0"], TactileEnv], ids=str)
@pytest.mark.parametrize("make", [TactileEnv, make_vec])
def test_what_is_no_task_is_refused(make, task):
    with pytest.raises(
        EnvError, match=r"^task = .*; expected the id of an environment, one of mjtactile/PressIdentify"
    ):
        make(task)


@pytest.mark.parametrize(
    "hole", ["ab", ("0", "0"), np.array([0.0, 1j]), (1e-3,), 1e-3, [(0.0, 0.0)], (np.nan, 0.0), (1.0, 1.0)]
)
def test_a_hole_that_is_no_place_is_refused(hole):
    env = gymnasium.make("mjtactile/PegInsert-v0")
    with pytest.raises(EnvError, match=r"expected only hole, \(x, y\) within"):
        env.reset(options={"hole": hole})


@pytest.mark.parametrize(
    "arguments", [{"num_envs": 1.5}, {"num_envs": "2"}, {"threads": -1}, {"autoreset_mode": "no"}, {"copy": "no"}]
)
def test_wrong_arguments_of_many_are_refused(arguments):
    (name,) = arguments
    with pytest.raises(EnvError, match=f"^{name} = "):
        make_vec("mjtactile/GraspLift-v0", **arguments)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_is_a_new_environment_with_the_same_options(copied):
    env = gymnasium.make("mjtactile/GraspLift-v0", observation="wrench", noise=0.5).unwrapped
    expected, _ = env.reset(seed=3)
    other = copied(env)
    with pytest.raises(EnvError, match="reset first"):
        other.step(other.action_space.sample())
    found, _ = other.reset(seed=3)
    assert all((found[name] == expected[name]).all() for name in expected)


def test_wrong_actions_are_refused():
    env = gymnasium.make("mjtactile/EdgeFollow-v0", disable_env_checker=True).unwrapped
    env.reset(seed=0)
    for action in (np.zeros(3), np.full(4, np.nan), ["0", "0", "0", "0"], np.zeros(4, complex)):
        with pytest.raises(EnvError, match="4 finite numbers"):
            env.step(action)
    with pytest.raises(EnvError, match="triangle"):
        env.reset(options={"plate": "cube"})


@pytest.mark.parametrize("batched", [True, False])
def test_a_step_before_the_first_reset_is_refused(batched):
    if batched:
        pytest.importorskip("mujoco.batch")
    env: Any = make_vec(NAMES[0], 2, observation="none") if batched else TactileEnv(NAMES[0], observation="none")
    with pytest.raises(EnvError, match="reset first"):
        env.step(np.zeros(env.action_space.shape, np.float32))


def test_pictures_are_drawn():
    try:
        working_backend()
    except RenderError as error:
        pytest.skip(str(error))
    env = gymnasium.make("mjtactile/GraspLift-v0", render_mode="rgb_array", width=96, height=64)
    env.reset(seed=0)
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    assert (picture.shape, picture.dtype) == ((64, 96, 3), np.uint8)
    assert picture.std() > 5.0
    env.close()
    env.close()


@pytest.mark.parametrize("name", NAMES)
def test_every_environment_has_the_camera_that_draws_it(name):
    env = gymnasium.make(name, observation="none").unwrapped
    assert isinstance(env, TactileEnv)
    assert env.task.simulation.model.camera(env.task.CAMERA).id >= 0


def test_a_spec_makes_the_same_environment_again():
    name, options = "mjtactile/GraspLift-v0", {"observation": "wrench", "noise": 0.5, "split": "test"}
    env = gymnasium.make(name, **options)
    assert env.spec is not None
    (one, _), (other, _) = (made.reset(seed=3) for made in (env, gymnasium.make(env.spec)))
    assert same([one], [other])


@pytest.mark.parametrize(
    "order", ["import mjtactile, gymnasium", "import gymnasium, mjtactile", "import mjtactile.envs"]
)
def test_environments_are_registered_by_the_import_in_any_order(order):
    code = (
        f"{order}\nimport gymnasium, json, sys\nprint(json.dumps([n for n in gymnasium.registry if 'mjtactile' in n]))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert json.loads(told) == list(NAMES)


def test_registering_imports_no_environment():
    code = "import gymnasium, mjtactile, sys; print([n for n in ('mujoco', 'torch', 'scipy') if n in sys.modules])"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert told.strip() == "[]"


def test_the_page_has_the_tables_of_the_spaces():
    from mjtactile.cli.envs_tables import environment_tables

    page = (Path(__file__).parents[2] / "docs" / "environments.md").read_text()
    assert environment_tables() in page, "run: mjtactile envs --page docs/environments.md"
