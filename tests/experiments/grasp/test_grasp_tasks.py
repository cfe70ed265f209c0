"""The experiments' tasks: they work with true forces, and fail when what is told to the controller is wrong."""

import dataclasses

import numpy as np
import pytest

from mjtactile.errors import RecognitionError
from mjtactile.experiments.grasp.handover import hand_over, handover_task
from mjtactile.experiments.grasp.lift import LIFT, lift, lift_task, report, trial
from mjtactile.experiments.grasp.punch_touch import PunchTouch
from mjtactile.experiments.grasp.slip import HeldObject, caught, slip_task
from mjtactile.experiments.grasp.sort import SIZE, SortTask, sort_block, sort_task
from mjtactile.experiments.grasp.touch import TrueTouch, make_touch
from mjtactile.experiments.grasp.trials import TrialSettings


def task_of(draw, seed, number, *more):
    return draw(np.random.default_rng([seed, number, *more]))


class Exaggerating(TrueTouch):
    """Feels three times the pressing force that there is: friction seems a third, and grips three times too hard."""

    def __call__(self, model, data):
        felt = super().__call__(model, data)
        return dataclasses.replace(felt, pressing=3.0 * felt.pressing)


def test_an_unknown_sense_of_touch_is_refused():
    with pytest.raises(RecognitionError, match=r"'recognized' does not exist\. Available: recognised, true, none\."):
        make_touch("recognized", noise=0.0, seed=(1,))


def test_true_forces_lift_with_little_more_than_it_takes():
    for number in range(2):
        done = lift(task_of(lift_task, 50, number), TrueTouch(), fidelity="fast")
        assert done["success"]
        assert done["felt_friction"] == pytest.approx(done["friction"], rel=0.02)
        assert 1.1 < done["grip"] / done["needed"] < 1.7 or done["grip"] < 0.5


def test_wrong_forces_grip_wrongly():
    task = dataclasses.replace(task_of(lift_task, 50, 0), mass=0.2, friction=0.6)
    done = lift(task, Exaggerating(), fidelity="fast")
    assert done["felt_friction"] == pytest.approx(0.2, rel=0.03)
    assert done["grip"] > 3.0 * done["needed"]


def test_a_blind_grip_below_what_it_takes_drops():
    task = dataclasses.replace(task_of(lift_task, 50, 0), mass=0.4, friction=0.3)
    assert task.needed > 6.0
    done = lift(task, TrueTouch(), fidelity="fast", blind_grip=2.2)
    assert done["dropped"]
    assert not done["success"]


def test_slips_are_caught_only_by_those_who_react():
    task = task_of(slip_task, 50, 1, 2)
    held = HeldObject(task.lift, TrueTouch(), fidelity="fast")
    assert held.through(task.quiet)["alarm"] is None
    done = held.through(task.slip)
    assert caught(done)
    assert held.through(task.slip) == done
    blind = HeldObject(task.lift, TrueTouch(), fidelity="fast", reacts=False).through(task.slip)
    assert blind["slid"] > 5e-3


def test_objects_are_put_down_on_what_they_meet():
    task = dataclasses.replace(task_of(handover_task, 50, 0), depth=0.03)
    done = hand_over(task, TrueTouch(), fidelity="fast")
    assert done["success"]
    assert abs(done["drop"]) < 1e-3
    blind = hand_over(task, TrueTouch(), fidelity="fast", blind=True)
    assert not blind["success"]
    assert blind["drop"] == pytest.approx(0.01, abs=1.5e-3)


def test_blocks_go_where_they_are_said_to_belong():
    task = task_of(sort_task, 50, 0, 7)
    assert sort_block(task, TrueTouch(), fidelity="fast", told=task.shape)["success"]
    other = "star" if task.shape != "star" else "square"
    wrong = sort_block(task, TrueTouch(), fidelity="fast", told=other)
    assert not wrong["right"]
    assert not wrong["success"]


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["octagon", "doughnut"])
def test_a_shape_beside_the_pads_middle_is_brought_there_and_recognised(shape):
    task = SortTask(shape=shape, mass=0.06, friction=0.6, pose=(1e-3, -1e-3, 0.0), grasp_height=SIZE[2] / 2 - 1e-3)
    done = sort_block(task, PunchTouch(noise=0.01, seed=(51,)), fidelity="precise")
    assert done["taken_for"] == shape
    assert done["success"]


def test_tasks_are_drawn_from_seed_and_number_alone():
    assert task_of(lift_task, 3, 5) == task_of(lift_task, 3, 5)
    assert task_of(lift_task, 3, 5) != task_of(lift_task, 3, 6)
    drawn = [task_of(lift_task, 3, k) for k in range(400)]
    assert min(one.mass for one in drawn) < 0.03
    assert max(one.mass for one in drawn) > 0.49
    assert max(one.needed for one in drawn) < 12.3


@pytest.mark.slow
def test_recognised_forces_lift_as_true_ones_do():
    settings = TrialSettings(seed=50, trials=3)
    conditions = ("recognised", "true", "blind")
    results = {name: [trial(settings, name, k) for k in range(3)] for name in conditions}
    assert all(one["success"] for one in results["recognised"])
    for felt, true in zip(results["recognised"], results["true"], strict=True):
        assert felt["peak"] < 1.25 * true["peak"]
        assert felt["felt_friction"] == pytest.approx(true["felt_friction"], rel=0.1)
    assert "lifted, recognised | >= 95 % | 100.0 %" in report(results).markdown()
    assert LIFT.conditions[:3] == conditions
