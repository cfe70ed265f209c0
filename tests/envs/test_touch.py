"""What is made of the pads' readings before an agent sees them."""

from typing import Any

import numpy as np
import pytest

from mjtactile.envs import EnvError, TactileEnv, TouchOptions
from mjtactile.envs.press_identify import FORCE, PressIdentify
from mjtactile.envs.touch import READING_SCALE, moments
from mjtactile.pad import Layer, Pad
from mjtactile.recognition import RecognitionError
from mjtactile.recognition.registry import register
from mjtactile.recognition.weight_files import SHIPPED, read_weights, write_weights

PRESS = np.array([0.0, 0.0, 0.0, 1.0, -1.0, *[0.0] * 7])


def pressed(**options):
    """What is seen of a star pressed with the most force, at rest."""
    env = TactileEnv(PressIdentify, **options)
    env.reset(seed=2, options={"shape": "star"})
    return [env.step(PRESS)[0] for _ in range(10)][-1]["tactile"][0]


@pytest.fixture(scope="module")
def ideal():
    return pressed(noise=0.0)


def test_noise_is_a_share_of_the_largest_reading(ideal):
    noisy = pressed(noise=0.05)
    assert (noisy - ideal).std() == pytest.approx(0.05 * ideal.max(), rel=0.1)


def test_readings_are_scaled_unless_pascals_are_asked_for(ideal):
    assert 0.3 < ideal.max() < 10.0
    assert pressed(noise=0.0, observation="pascals") == pytest.approx(READING_SCALE * ideal, rel=1e-6)
    spaces: Any = [TactileEnv(PressIdentify, observation=one).observation_space for one in ("readings", "pascals")]
    assert spaces[1]["tactile"].high.max() == pytest.approx(READING_SCALE * spaces[0]["tactile"].high.max())


@pytest.mark.parametrize("observation", ["readings", "pascals"])
def test_readings_stay_within_their_space_whatever_is_felt(observation):
    task: Any = TactileEnv(PressIdentify, noise=0.0, observation=observation).task
    felt = np.full_like(task.simulation.sensordata, 1e9)
    assert (task.touch.observe(felt, np.array([0]))[0] == task.observation_space["tactile"].high).all()
    assert (task.touch.observe(-felt, np.array([0]))[0] == task.observation_space["tactile"].low).all()


def test_a_wrench_is_the_force_pressed_with():
    assert pressed(observation="wrench", noise=0.0)[:3] == pytest.approx([0.0, 0.0, -FORCE], abs=0.03)
    assert pressed(observation="wrench", noise=0.1)[0] != 0.0


def test_the_force_is_recognised():
    found = pressed(observation="recognised", noise=0.0)
    assert found[2] == pytest.approx(-FORCE, rel=0.1)
    assert found[5] > 0.5


@pytest.mark.parametrize(("what", "count"), [("known", 0), ("unknown", 1)])
def test_infos_say_how_many_pads_feel_what_was_not_taught(what, count, monkeypatch):
    env = TactileEnv(PressIdentify, observation="recognised", noise=0.01)
    assert env.reset(seed=2, options={"shape": "star"})[1]["unfamiliar"] == 0  # nothing is felt yet
    if what == "unknown":
        half = np.r_[np.ones(7), np.zeros(6)]
        observed = env.task.touch._readings
        monkeypatch.setattr(env.task.touch, "_readings", lambda *given: observed(*given) * half)
    steps = [env.step(PRESS) for _ in range(10)]
    assert steps[-1][4]["unfamiliar"] == count
    assert "unfamiliar" not in TactileEnv(PressIdentify, observation="wrench").reset(seed=0)[1]


def test_the_force_is_recognised_on_a_pad_of_ones_own_by_weights_for_it(tmp_path):
    """The shipped weights under another pad's name: in one material, force makes the same stress in a stiffer pad."""
    stiff = Pad(layers=(Layer(thickness=5e-3, young=6e6, poisson=0.49),))
    for name in ("view", "force"):
        stored = read_weights(SHIPPED / "all" / f"{name}.safetensors")
        about = {key: stored.metadata[key] for key in ("kind", "layers")}
        write_weights(tmp_path / stored.path.name, stored.arrays, about, stiff)
        register(tmp_path, stored.path.name)
    found = pressed(observation="recognised", noise=0.0, pad=stiff, weights=tmp_path, fidelity="fast")
    assert found[2] == pytest.approx(-FORCE, rel=0.1)
    with pytest.raises(RecognitionError, match=r"E 6 MPa.*but the pad is a .*E 3 MPa"):
        pressed(observation="recognised", weights=str(tmp_path), fidelity="fast")
    told = TactileEnv(PressIdentify, observation="recognised", pad=stiff, weights=tmp_path, fidelity="fast").reset(
        seed=0
    )[1]
    assert "unfamiliar" not in told  # these weights do not say


@pytest.mark.parametrize("kind", ["capacitive", "piezoresistive"])
def test_transducers_report_what_they_can(ideal, kind):
    reported = pressed(noise=0.0, transducer=kind)
    assert reported.shape == ideal.shape
    off = np.abs(reported - ideal) / ideal.max()
    assert 1e-3 < np.median(off) < 0.1


def test_pads_differ_in_sensitivity_under_randomisation(ideal):
    env = TactileEnv(PressIdentify, noise=0.0, randomise=1.0)
    gains = []
    for seed in range(4):
        env.reset(seed=seed, options={"shape": "star"})
        gains.append(float(env.task.touch._gains[0, 0]))
    assert len(set(gains)) == 4
    assert all(0.9 <= gain <= 1.1 for gain in gains)
    felt = [env.step(PRESS)[0] for _ in range(10)][-1]["tactile"]
    env.task.touch._gains[:] = 1.0
    assert felt == pytest.approx(gains[-1] * env.task.observe(np.array([0]))["tactile"][0], rel=1e-5)


def test_nothing_is_felt_above_the_punch():
    seen = TactileEnv(PressIdentify).reset(seed=0)[0]
    assert (seen["tactile"] == 0.0).all()
    assert (TactileEnv(PressIdentify, observation="recognised").reset(seed=0)[0]["tactile"] == 0.0).all()


def test_moments_say_how_much_where_how_wide_and_how_lopsided():
    readings = np.zeros((1, 13, 13), np.float32)
    readings[0, 8:11, 4:9] = 5e3
    mean, centroid, spread, lopsided = moments(readings)[0]
    assert mean == pytest.approx(np.log1p(5e3 * 15 / 169 / 1e3), rel=1e-5)
    assert centroid == pytest.approx(3 / 6.5, rel=1e-5)
    assert spread == pytest.approx(np.sqrt(2 / 3) / 6.5, rel=1e-5)
    assert lopsided == pytest.approx(0.0, abs=1e-3)
    readings[0, 10] *= 3.0
    assert moments(readings)[0, 3] < -0.01
    assert (moments(np.zeros((2, 4, 13, 13), np.float32)) == 0.0).all()


@pytest.mark.parametrize("pad", [__file__, "no such pad", 3])
def test_a_pad_that_is_none_is_an_error_of_the_environments(pad):
    with pytest.raises(EnvError, match="pad"):
        TouchOptions(pad=pad)
