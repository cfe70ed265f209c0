"""Control laws on made-up touch: how hard to grip, and when to be alarmed."""

import numpy as np
import pytest

from mjtactile.experiments.grasp.control import _LEFT, GripLaw, SlipReflex
from mjtactile.experiments.grasp.known import PadLoads

PERIOD = 2e-3


def felt(pull, grip, turn=0.0, internal=0.0):
    """Both pads pressed with a grip, holding a pull down and a turn, and pushed against each other sideways."""
    tangential = np.array([[internal, -pull / 2], [internal, -pull / 2]])
    return PadLoads(np.full(2, float(grip)), tangential, np.zeros((2, 2)), np.array([turn / 2, -turn / 2]))


def test_grip_is_half_the_pull_over_friction_with_the_margin():
    law = GripLaw(friction=0.5, margin=1.2)
    assert law.wanted(felt(4.0, 3.0)) == pytest.approx(1.2 * 2.0 / 0.5)
    assert law.wanted(felt(0.0, 3.0)) == law.least
    assert law.wanted(felt(100.0, 3.0)) == law.most


def test_turns_ask_for_grip_and_inner_forces_do_not():
    law = GripLaw(friction=0.5)
    assert law.wanted(felt(4.0, 3.0, turn=0.02)) > 1.1 * law.wanted(felt(4.0, 3.0))
    assert law.wanted(felt(4.0, 3.0, internal=1.0)) == pytest.approx(law.wanted(felt(4.0, 3.0)))


def test_grip_rises_fast_and_falls_slowly():
    law = GripLaw(friction=0.5)
    wanted = law.wanted(felt(4.0, 3.0))
    assert law.step(wanted - 1.0, felt(4.0, 3.0)) > wanted - 0.6
    assert law.step(wanted + 1.0, felt(4.0, 3.0)) > wanted + 0.9


def held(law, grip, pulls, friction):
    """Grips that a reflex commands while pulls come one after the other; what slides pulls with friction x grip."""
    guard = SlipReflex(law, grip, PERIOD)
    grips = []
    for pull in pulls:
        now = guard.grip
        grips.append(guard.step(felt(min(pull, 2.0 * friction * now), now)))
    return guard, grips


def test_an_overload_alarms_and_is_gripped():
    law = GripLaw(friction=0.5, margin=1.3)
    pulls = [*[2.0] * 50, *[5.0] * 50]
    guard, grips = held(law, 2.6, pulls, 0.5)
    assert guard.alarmed
    assert grips[52] > 3.5
    assert grips[-1] == pytest.approx(1.3 * 5.0 / 2.0 / 0.5, rel=0.05)


def test_loads_within_what_friction_holds_do_not_alarm():
    law = GripLaw(friction=0.5, margin=1.3)
    pulls = [*[2.0] * 50, *np.linspace(2.0, 2.45, 50), *[2.45] * 50]
    guard, grips = held(law, 2.6, pulls, 0.5)
    assert not guard.alarmed
    assert set(grips) == {2.6}


def test_a_load_that_goes_away_is_squeezed_and_let_be():
    law = GripLaw(friction=0.5, margin=1.3)
    guard, grips = held(law, 2.6, [*[2.0] * 50, *[1.0] * 100], 0.5)
    assert not guard.alarmed
    assert max(grips) > 3.0
    assert grips[-1] == 2.6


def test_friction_that_goes_away_is_noticed_and_found_anew():
    law = GripLaw(friction=0.5, margin=1.3)
    guard = SlipReflex(law, 2.6, PERIOD)
    for step in range(120):
        friction = 0.5 if step < 50 else 0.28
        guard.step(felt(min(2.0, 2.0 * friction * guard.grip), guard.grip))
    assert guard.alarmed
    assert guard.law.friction == pytest.approx(_LEFT * 0.28, rel=0.05)
    assert guard.grip > 2.0 / 2.0 / 0.28
