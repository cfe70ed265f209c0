"""Controllers: a servo that reaches the commanded force on any arm it half knows, and a belief that weighs looks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjtactile.errors import ControlError
from mjtactile.experiments.control import ForceServo, ShapeBelief

COMMANDED = np.array([0.2, -0.1, -0.8])


def pressed(servo, stiffness, calls, noise=0.0, start=0.0):
    """Forces on a rigid surface at z = 0 by an arm of this stiffness, whose target begins `start` above it."""
    target = np.array([0.0, 0.0, start])
    drawn = np.random.default_rng(0)
    forces = []
    for _ in range(calls):
        force = stiffness * target if target[2] < 0.0 else None
        seen = None if force is None else force + noise * drawn.standard_normal(3)
        target = target + servo.step(seen, COMMANDED, 5e-3)
        forces.append(np.zeros(3) if force is None else force)
    return np.array(forces)


def test_the_error_falls_by_the_gain_at_each_call():
    servo = ForceServo(stiffness=400.0, gain=0.2, largest_step=1.0)
    forces = pressed(servo, 400.0, 20, start=-1e-9)
    errors = np.linalg.norm(forces - COMMANDED, axis=1)
    np.testing.assert_allclose(errors[1:] / errors[:-1], 0.8, rtol=1e-6)


@given(gain=st.floats(0.05, 0.5), ratio=st.floats(0.2, 3.0))
def test_the_commanded_force_is_reached_on_an_arm_that_is_half_known(gain, ratio):
    forces = pressed(ForceServo(stiffness=400.0, gain=gain), 400.0 * ratio, 2000, start=1e-3)
    np.testing.assert_allclose(forces[-1], COMMANDED, rtol=1e-6)


def test_noise_in_what_is_recognised_is_averaged():
    forces = pressed(ForceServo(stiffness=400.0, gain=0.15), 400.0, 3000, noise=0.02)[500:]
    # An integrator with gain g passes sqrt(g / (2 - g)) of white noise: 0.28 of it.
    assert forces.std(axis=0).max() == pytest.approx(0.02 * np.sqrt(0.15 / 1.85), rel=0.15)
    np.testing.assert_allclose(forces.mean(axis=0), COMMANDED, atol=1.5e-3)


def test_the_surface_is_looked_for_straight_down_at_the_approach_speed():
    servo = ForceServo(stiffness=400.0, approach_speed=0.03)
    np.testing.assert_allclose(servo.step(None, COMMANDED, 5e-3), [0.0, 0.0, -1.5e-4])


def test_no_step_is_larger_than_allowed():
    servo = ForceServo(stiffness=1.0, gain=0.9, largest_step=1e-4)
    step = servo.step([0.0, 0.0, -0.1], COMMANDED, 5e-3)
    assert np.linalg.norm(step) == pytest.approx(1e-4)
    np.testing.assert_allclose(np.cross(step, COMMANDED - [0.0, 0.0, -0.1]), 0.0, atol=1e-18)


@pytest.mark.parametrize(
    "values", [{"stiffness": 0.0}, {"stiffness": 1.0, "gain": 1.0}, {"stiffness": 1.0, "approach_speed": 0.0}]
)
def test_a_servo_that_would_run_away_is_refused(values):
    with pytest.raises(ControlError, match="gain between 0 and 1"):
        ForceServo(**values)


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.1), (0.0, 0.0), (np.nan, 0.0, -1.0)])
def test_a_force_that_does_not_press_is_refused(force):
    with pytest.raises(ControlError, match="force\\[2\\] < 0"):
        ForceServo(stiffness=400.0).step(None, force, 5e-3)


def test_a_belief_is_the_mean_of_its_looks():
    belief = ShapeBelief(enough=0.7, least=2, most=5)
    assert belief.shape is None
    assert belief.confidence == 0.0
    belief.look(("circle", "star"), [0.9, 0.1])
    assert not belief.settled  # sure enough, but too soon
    belief.look(("circle", "star"), [0.2, 0.8])
    assert belief.shape == "circle"
    assert belief.confidence == pytest.approx(0.55)
    assert not belief.settled
    for _ in range(2):
        belief.look(("circle", "star"), [1.0, 0.0])
    assert belief.settled


def test_a_belief_that_never_gets_sure_settles_for_the_likeliest():
    belief = ShapeBelief(enough=0.9, least=1, most=3)
    for _ in range(3):
        assert not belief.settled
        belief.look(("circle", "octagon"), [0.45, 0.55])
    assert belief.settled
    assert belief.shape == "octagon"


def test_a_belief_refuses_looks_at_something_else():
    belief = ShapeBelief()
    belief.look(("circle", "star"), [0.5, 0.5])
    with pytest.raises(ControlError, match="Begin with a new ShapeBelief"):
        belief.look(("circle", "square"), [0.5, 0.5])
    with pytest.raises(ControlError, match="least <= most"):
        ShapeBelief(least=5, most=4)
