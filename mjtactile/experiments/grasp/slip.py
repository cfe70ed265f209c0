"""The slip experiment: an object is held with a small margin and disturbed, so that it slips or just does not."""

from __future__ import annotations

import copy
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mjtactile.experiments.grasp.control import GripLaw, SlipReflex, close, hold, raise_object, rub
from mjtactile.experiments.grasp.disturbances import Disturbance, disturbance
from mjtactile.experiments.grasp.judge import CRUSHING
from mjtactile.experiments.grasp.lift import LiftTask, lift_task
from mjtactile.experiments.grasp.robot import Robot
from mjtactile.experiments.grasp.statistics import Bound, Report, median, share
from mjtactile.experiments.grasp.touch import TouchSense, TrueTouch, grasp_recogniser, make_touch
from mjtactile.experiments.grasp.trials import Experiment, Result, TrialSettings

#: Ratio of the grip before the disturbance to the least grip that holds the object [-].
MARGIN = 1.3
#: Largest allowed slip [m].
MOST_SLIP = 2e-3
#: Largest grip that an object may need when overloaded [N], so that the crushing force is not reached. Trials with
#: heavier objects are drawn anew.
_MOST_NEEDED = 14.0
#: Height to which the object is lifted [m] and speed [m/s]; time that it is held before the disturbance [s] and watched
#: afterwards [s].
_RISE, _SPEED, _SETTLE, _WATCH = 0.02, 0.06, 0.3, 1.0
#: Simulation steps between ticks while the object is held: 500 Hz.
_STEPS = 2


@dataclass(frozen=True, kw_only=True)
class SlipTask:
    """One trial: an object, a disturbance that makes it slip, and one that does not."""

    lift: LiftTask  #: the object
    slip: Disturbance  #: makes the object slip
    quiet: Disturbance  #: does not make it slip


def slip_task(drawn: np.random.Generator) -> SlipTask:
    """A random trial. Objects that need too strong a grip when overloaded are drawn anew."""
    slip, quiet = disturbance(drawn, slips=True), disturbance(drawn, slips=False)
    while (task := lift_task(drawn)).needed * MARGIN * slip.amount > _MOST_NEEDED:
        pass
    return SlipTask(lift=task, slip=slip, quiet=quiet)


class HeldObject:
    """A lifted object that is subjected to several disturbances, each from the same initial state.

    The slip reflex changes the grip only if `reacts`.
    """

    def __init__(self, task: LiftTask, touch: TouchSense, *, fidelity: str, reacts: bool = True) -> None:
        self._task, self._reacts = task, reacts
        self._robot, self._judge = task.robot(touch, fidelity)
        self._law: GripLaw | None = None
        if close(self._robot):
            self._law = GripLaw(friction=rub(self._robot), margin=MARGIN)
            raise_object(self._robot, self._law, _RISE, speed=_SPEED)
            hold(self._robot, self._law, _SETTLE)
        self._start = copy.copy(self._robot.data), self._robot.grip, dict(self._robot.place)

    def through(self, happens: Disturbance) -> dict[str, Any]:
        """Apply a disturbance to the object in its initial state.

        Returns:
            "kind" of the disturbance and "held", whether the object was lifted. If it was, also "alarm", the time from
            the disturbance to the alarm [s], None without alarm; "slid", how far the object slid [m], and
            "slid_at_alarm", how far it had slid at the alarm [m]; "peak", the largest grip [N]; "felt_friction", the
            estimated coefficient [-]; "amount" and "rise" of the disturbance.
        """
        if self._law is None:
            return {"kind": happens.kind, "held": False}
        robot, judge, law = self._robot, self._judge, self._law
        data, robot.grip, place = self._start
        robot.data, robot.place = copy.copy(data), dict(place)
        robot.model.geom("object").friction[0] = self._task.friction
        judge.begin(robot)
        judge.peak = 0.0
        robot.steps_per_tick = _STEPS
        alarm, slid = self._watch(happens, SlipReflex(law, robot.grip, robot.period))
        return {
            "kind": happens.kind,
            "held": True,
            "alarm": alarm,
            "slid": judge.slid,
            "slid_at_alarm": slid,
            "peak": judge.peak,
            "felt_friction": law.friction,
            "amount": happens.amount,
            "rise": happens.rise,
        }

    def _watch(self, happens: Disturbance, reflex: SlipReflex) -> tuple[float | None, float | None]:
        """Run the simulation until the disturbance is over.

        Returns:
            Time of the alarm after the beginning of the disturbance [s] and the distance that the object had slid by
            then [m]; both None without an alarm.
        """
        robot, friction = self._robot, self._task.friction
        begun, height, holds = robot.time, robot.place["z"], _holds(robot, friction)
        alarm = slid = None
        while robot.time - begun < happens.start + _WATCH:
            happens.apply(robot, begun, holds, friction)
            robot.place["z"] = height + happens.shaken(robot.time - begun)
            grip = reflex.step(robot.tick())
            if self._reacts:
                robot.grip = grip
            if alarm is None and reflex.alarmed:
                alarm, slid = robot.time - begun - happens.start, self._judge.slid
        return alarm, slid


def _holds(robot: Robot, friction: float) -> float:
    """Largest weight that the present grip holds, from MuJoCo's true contact forces [N]."""
    felt = TrueTouch()(robot.model, robot.data)
    pull = float(np.hypot(*felt.pull)) / 2.0
    turning = GripLaw(friction=friction).load(felt) / pull
    return 2.0 * friction * float(felt.pressing.mean()) / turning


def trial(settings: TrialSettings, condition: str, number: int) -> Result:
    """Run one trial of the experiment, once with a slip and once without.

    In condition "recognised" the controller recognises forces from readings. In condition "true" it has true forces. In
    condition "blind" it holds with true forces and does not react.
    """
    task = slip_task(np.random.default_rng([settings.seed, number, 2]))
    # A blind hand grips like one with true forces, so that the conditions differ in their reaction alone.
    blind = condition == "blind"
    touch = make_touch(
        "true" if blind else condition, noise=settings.noise, seed=(settings.seed, number, 3), weights=settings.weights
    )
    held = HeldObject(task.lift, touch, fidelity=settings.fidelity, reacts=not blind)
    return {**asdict(task.lift), "quiet": held.through(task.quiet), "slip": held.through(task.slip)}


def caught(one: dict[str, Any]) -> bool:
    """Whether a slip (`HeldObject.through`) was detected and stopped within `MOST_SLIP`, without crushing."""
    return one["held"] and one["alarm"] is not None and one["slid"] < MOST_SLIP and one["peak"] <= CRUSHING


def report(results: dict[str, list[Result]]) -> Report:
    """The table of the experiment and its bounds, from trials by condition."""
    rows = []
    for condition, trials in results.items():
        slips, quiet = ([one[kind] for one in trials] for kind in ("slip", "quiet"))
        kinds = {kind: [one for one in slips if one["kind"] == kind] for kind in sorted({one["kind"] for one in slips})}
        for kind, ones in (kinds | {"all slips": slips}).items():
            rows.append(_row(condition, kind, share([caught(one) for one in ones]).percent, ones))
        rows.append(_row(condition, "no slip", "-", quiet))
    felt = results["recognised"]
    rate = share([caught(one["slip"]) for one in felt])
    alarms = share([one["quiet"].get("alarm") is not None for one in felt])
    return Report(
        title=f"Slip: {len(felt)} objects held with a margin of {MARGIN:g}, each once with a slip and once without; "
        "95 % confidence intervals.",
        head=("grip", "what happens", "caught before 2 mm", "alarms", "slid, median", "slid, 95 %"),
        rows=rows,
        bounds=[
            Bound(what="slips caught, recognised", bound=">= 95 %", found=rate.percent, met=rate.value >= 0.95),
            Bound(what="false alarms, recognised", bound="<= 1 %", found=alarms.percent, met=alarms.value <= 0.01),
        ],
        figures={"caught": asdict(rate), "false_alarms": asdict(alarms)},
    )


def _row(condition: str, kind: str, stopped: str, trials: list[dict[str, Any]]) -> tuple[str, ...]:
    held = [1e3 * one["slid"] for one in trials if one["held"]]
    return (
        condition,
        kind,
        stopped,
        share([one.get("alarm") is not None for one in trials]).percent,
        median(held).text(" mm", digits=2),
        f"{np.quantile(held, 0.95):.2f} mm" if held else "-",
    )


SLIP = Experiment(
    name="slip", conditions=("recognised", "true", "blind"), trial=trial, report=report, recognisers=grasp_recogniser
)
