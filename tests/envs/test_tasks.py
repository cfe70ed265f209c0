"""What each task rewards, and what ends it: policies that know the truth, and ones that do the wrong thing."""

import math
from typing import Any

import numpy as np
import pytest
import shapely

from mjtactile.envs import EnvError, TactileEnv
from mjtactile.envs.edge_follow import PLATES, SPEED, EdgeFollow, rim_points
from mjtactile.envs.grasp_lift import FRICTIONS, GRIP_FACTOR, MASSES, GraspLift, crushing_grip, least_grip
from mjtactile.envs.options import Bands
from mjtactile.envs.peg_insert import PegInsert
from mjtactile.envs.press_identify import PressIdentify
from mjtactile.geometry.outlines import INDENTER_NAMES


def repeated(env, action, most=1000) -> Any:
    """What the last of so many equal steps gives, or the one that ends the episode."""
    told: Any = None
    for _ in range(most):
        told = env.step(action)
        if told[2] or told[3]:
            break
    return told


def lift(env, grip):
    """Grip so hard [N], then lift; the last info and the sum of rewards."""
    total = 0.0
    while True:
        to_go = math.log(grip / env.task._grip[0]) / math.log(GRIP_FACTOR)
        there = abs(to_go) < 1e-9
        _, reward, terminated, truncated, info = env.step(np.array([np.clip(to_go, -1, 1), 1.0 if there else 0.0]))
        total += reward
        if terminated or truncated:
            return info, total


@pytest.mark.parametrize(("mass", "friction"), [(0.02, 0.3), (0.15, 1.1), (0.2, 0.6), (0.45, 0.25)])
def test_a_grip_a_little_over_the_least_lifts_less_drops_more_crushes(mass, friction):
    env = TactileEnv(GraspLift, observation="none")
    told = {}
    for share in (0.7, 1.6, 2.8):
        env.reset(seed=1, options={"mass": mass, "friction": friction})
        told[share] = lift(env, max(share * least_grip(mass, friction), 0.11))
    assert told[1.6][0]["success"]
    assert told[1.6][1] > 2.4
    assert told[0.7][0]["dropped"]
    assert not told[0.7][0]["success"]
    if 2.8 * least_grip(mass, friction) > crushing_grip(mass, friction):
        assert told[2.8][0]["crushed"]
        assert not told[2.8][0]["success"]
    assert told[0.7][1] < 1.5
    assert told[2.8][1] < 1.5 or not told[2.8][0]["crushed"]


def test_no_one_grip_does_for_all():
    drawn = np.random.default_rng(0)
    masses = np.exp(drawn.uniform(math.log(MASSES[0]), math.log(MASSES[1]), 2000))
    frictions = drawn.uniform(*FRICTIONS, 2000)
    least, most = least_grip(masses, frictions), crushing_grip(masses, frictions)
    for grip in np.geomspace(0.05, 20.0, 60):
        assert ((least < grip) & (grip < most)).mean() < 0.4


def test_nothing_is_tested_that_was_trained():
    drawn = np.random.default_rng(0)
    train, test, every = (Bands(0.0, 7.0, split=split) for split in ("train", "test", "all"))
    bands = [{int(one.draw(drawn)) for _ in range(300)} for one in (train, test, every)]
    assert bands == [{0, 2, 4, 6}, {1, 3, 5}, set(range(7))]
    with pytest.raises(EnvError, match="train, test"):
        Bands(0.0, 1.0, split="exam")


def test_splits_reach_the_environment():
    masses = {}
    for split in ("train", "test"):
        env = TactileEnv(GraspLift, observation="none", split=split)
        told = [env.reset(seed=seed)[1] for seed in range(40)]
        bands = [np.log(np.array([one["mass"] for one in told]) / MASSES[0]) / np.log(MASSES[1] / MASSES[0])]
        bands.append((np.array([one["friction"] for one in told]) - FRICTIONS[0]) / (FRICTIONS[1] - FRICTIONS[0]))
        masses[split] = {int(7 * share) % 2 for band in bands for share in band}
    assert masses == {"train": {0}, "test": {1}}


@pytest.mark.parametrize(("friction", "slides"), [(0.2, True), (1.2, False)])
def test_slip_changes_the_pattern_on_the_pads_and_holding_does_not(friction, slides):
    env = TactileEnv(GraspLift, noise=0.0)
    env.reset(seed=2, options={"mass": 0.15, "friction": friction})
    repeated(env, np.array([1.0, 0.0]), 8)
    patterns, slips = [], []
    for _ in range(16):
        seen, _, _, _, info = env.step(np.array([0.0, 0.2]))
        felt = seen["tactile"][:, 0]
        if felt.any():  # fingers that slide may hop for a moment
            patterns.append(felt / np.linalg.norm(felt))
        slips.append(info["slip"])
    assert len(patterns) >= 12
    assert (slips[-1] - slips[3] > 1e-3) == slides
    assert (np.linalg.norm(patterns[-1] - patterns[3]) > 0.15) == slides


@pytest.mark.parametrize("shape", ["star", "circle"])
def test_a_right_answer_earns_and_a_wrong_one_costs(shape):
    env = TactileEnv(PressIdentify, observation="none")
    for answer in ("star", "circle"):
        env.reset(seed=0, options={"shape": shape})
        action = np.full(12, -1.0)
        assert env.step(action)[1:3] == (-0.01, False)
        action[4], action[5 + INDENTER_NAMES.index(answer)] = 1.0, 1.0
        _, reward, terminated, _, info = env.step(action)
        assert terminated
        assert info["success"] is (answer == shape)
        assert reward == pytest.approx((1.0 if answer == shape else -1.0) - 0.01)


def test_wherever_the_finger_goes_the_whole_punch_presses():
    from mjtactile import recognition

    recognise = recognition.load("shape")
    for corner in ((1, 1), (-1, 1)):
        env = TactileEnv(PressIdentify, observation="pascals", noise=0.0)
        env.reset(seed=5, options={"shape": "square"})
        for _ in range(4):
            env.step(np.array([*corner, 1.0, -1.0, -1.0, *[0.0] * 7]))
        seen = repeated(env, np.array([0.0, 0.0, 0.0, 0.8, -1.0, *[0.0] * 7]), 8)[0]
        assert recognise(seen["tactile"][0], among=INDENTER_NAMES).shape == "square"


def follow(env, ahead=1.5e-3, turn=0.0):
    """Go towards a point a little ahead on the rim; a policy that knows where the rim is."""
    task = env.task
    here = task.simulation.qpos[0, :2] - np.array([0.15 * task._plate[0], 0.0])
    arc = rim(env).project(shapely.Point(here))
    aim = rim_points(task._plate, np.array([arc + ahead]))[0] - here
    angle = math.atan2(aim[1], aim[0]) + turn - task._target[0, 2]
    return np.array([math.cos(angle), math.sin(angle), np.clip(angle, -1, 1), -1.0])


def rim(env):
    return list(PLATES.values())[env.task._plate[0]].exterior


@pytest.mark.parametrize("plate", PLATES)
def test_a_lap_around_the_rim_is_success(plate):
    env = TactileEnv(EdgeFollow, observation="none")
    env.reset(seed=1, options={"plate": plate})
    total, over, info = 0.0, False, {}
    while not over:
        _, reward, over, truncated, info = env.step(follow(env))
        total += reward
        assert not truncated
    assert info["success"]
    assert total > 10.5
    assert env.task.steps[0] * env.task.period * SPEED == pytest.approx(rim(env).length, rel=0.15)


def test_backwards_earns_nothing_and_losing_the_edge_ends_it():
    env = TactileEnv(EdgeFollow, observation="none")
    env.reset(seed=1)
    rewards = [env.step(follow(env, ahead=-1.5e-3))[1] for _ in range(20)]
    assert max(rewards[2:]) <= 0.0
    env.reset(seed=1)
    _, reward, over, _, info = repeated(env, np.array([0.0, 1.0, 0.0, -1.0]), 12)
    assert over
    assert info["lost"]
    assert reward < -0.9


def test_a_peg_over_its_hole_goes_in_and_one_beside_it_does_not():
    told = {}
    for hole in ((0.0, 0.0), (1.5e-3, 0.0)):
        env = TactileEnv(PegInsert, observation="none")
        env.reset(seed=1, options={"hole": hole})
        _, reward, _, _, info = repeated(env, np.array([0.0, 0.0, -0.4, 0.0]))
        told[hole] = info, reward
    assert told[0.0, 0.0][0]["success"]
    assert told[0.0, 0.0][1] > 1.0
    assert told[1.5e-3, 0.0][0]["lost"]
    assert told[1.5e-3, 0.0][0]["depth"] < 1e-3
    assert told[1.5e-3, 0.0][1] < -0.4


def test_options_of_a_reset_are_checked():
    for env, options in (
        (TactileEnv(GraspLift, observation="none"), {"mass": -1.0}),
        (TactileEnv(PressIdentify, observation="none"), {"shape": "cube"}),
        (TactileEnv(PegInsert, observation="none"), {"hole": (1.0, 0.0)}),
        (TactileEnv(GraspLift, observation="none"), {"weight": 1.0}),
    ):
        with pytest.raises(EnvError, match="expected only"):
            env.reset(seed=0, options=options)


def test_an_option_that_a_task_leaves_over_is_refused():
    class Forgetful(PressIdentify):
        def _draw(self, rows, drawn, options):
            super()._draw(rows, drawn, {})

    env = TactileEnv(Forgetful, observation="none")
    with pytest.raises(EnvError, match="Forgetful knows no reset option 'weight'"):
        env.reset(seed=0, options={"weight": 1.0})
    with pytest.raises(EnvError, match="the last reset was refused"):
        env.step(np.zeros(env.action_space.shape or (), np.float32))
