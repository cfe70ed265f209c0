"""The lift experiment: objects of unknown mass and friction are lifted with a small grip."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from mjtactile._installed import require
from mjtactile.experiments.grasp.control import CLOSING_GRIP, GripLaw, Ride, close, hold, raise_object, rub
from mjtactile.experiments.grasp.judge import CRUSHING, Judge
from mjtactile.experiments.grasp.robot import Robot
from mjtactile.experiments.grasp.scene import GraspObject, grasp_spec
from mjtactile.experiments.grasp.statistics import Bound, Report, median, share
from mjtactile.experiments.grasp.touch import TouchSense, grasp_recogniser, make_touch
from mjtactile.experiments.grasp.trials import Experiment, Result, TrialSettings
from mjtactile.experiments.hands.fingertip import FingertipPads

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Ranges of mass [kg] and friction [-]. All such objects can be lifted: 0.5 kg at friction 0.2 takes 12.3 N from each
#: finger.
MASSES, FRICTIONS = (0.02, 0.5), (0.2, 1.2)
#: Smallest and largest objects [m]: between the fingers, along the pads, upright.
SIZES = ((0.02, 0.024, 0.04), (0.06, 0.06, 0.09))
#: Largest offsets of an object between the fingers and along the pads [m], its rotation [rad], and the offset of the
#: grasp from its middle height [m].
OFFSETS, TURN, HEIGHT_OFFSET = (5e-3, 4e-3), math.radians(2.0), 8e-3
#: Rise of the wrist [m], its largest speed [m/s], and the holding time afterwards [s].
RISE, SPEED, HOLD_TIME = 0.05, 0.08, 0.4
#: Largest slip [m] and tilt [deg] of the object in the fingers from lifting to the end.
MOST_SLIDE, MOST_TILT = 3e-3, 10.0
#: Constant grips [N]. The first is that of the tactile controller for the object in the middle of both ranges; the last
#: holds nearly all objects.
BLIND_GRIPS = {"blind": 2.2, "blind, 5 N": 5.0, "blind, 15 N": 15.0}
#: Closing time of a gripper without touch [s].
_BLIND_TIME = 0.9


@dataclass(frozen=True, kw_only=True)
class LiftTask:
    """One trial: an object and its pose."""

    size: tuple[float, float, float]  #: size of the object: between the fingers, along the pads, upright [m]
    mass: float  #: mass of the object [kg]
    friction: float  #: friction of the object [-]
    pose: tuple[float, float, float]  #: (x, y) on the table [m] and rotation about the vertical [rad]
    grasp_height: float  #: height of the pads' centres above the table [m]

    @property
    def needed(self) -> float:
        """Least grip of each finger that holds the object [N]."""
        return self.mass * 9.81 / 2.0 / self.friction

    def robot(
        self,
        touch: TouchSense,
        fidelity: str,
        *,
        furnish: Callable[[mujoco.MjSpec], Any] = lambda _: None,
        support: str = "table",
    ) -> tuple[Robot, Judge]:
        """The robot in its scene, to which `furnish` adds things, and the judge; `support` as in `Judge`."""
        grasped = GraspObject(size=self.size, mass=self.mass, friction=self.friction)
        pads = FingertipPads(fidelity=fidelity)
        spec = grasp_spec(grasped, wrist="xz", pose=self.pose, grasp_height=self.grasp_height, pads=pads)
        furnish(spec)
        model = spec.compile()
        judge = Judge(model, support=support)
        opening = self.size[0] + 2.0 * OFFSETS[0] + 4e-3
        return Robot(model, touch, opening=opening, watch=judge), judge


def lift_task(drawn: np.random.Generator) -> LiftTask:
    """A random trial, uniform over the ranges."""
    size = drawn.uniform(*SIZES)
    x, y, turn = (float(drawn.uniform(-most, most)) for most in (*OFFSETS, TURN))
    return LiftTask(
        size=(float(size[0]), float(size[1]), float(size[2])),
        mass=float(drawn.uniform(*MASSES)),
        friction=float(drawn.uniform(*FRICTIONS)),
        pose=(x, y, turn),
        grasp_height=float(size[2] / 2 + drawn.uniform(-HEIGHT_OFFSET, HEIGHT_OFFSET)),
    )


def lift(task: LiftTask, touch: TouchSense, *, fidelity: str, blind_grip: float | None = None) -> dict[str, Any]:
    """Lift the object, with a constant `blind_grip` [N] or else by touch, and return the judge's results.

    Returns:
        The task's values; "needed", the least grip that holds the object [N]; "felt_friction", the estimated friction
        [-] or None; "peak", the largest force on a pad [N]; "grip", the grip at the end [N]; "lifted", the rise of the
        object [m]; "slid" [m] and "tilt" [deg], its largest displacement and tilt in the fingers; "crushed", "dropped"
        and "success"; "time" taken [s].
    """
    robot, judge = task.robot(touch, fidelity)
    before = judge.height(robot)
    felt_friction = None
    if blind_grip is not None:
        lift_blindly(robot, judge, blind_grip)
    elif close(robot):
        felt_friction = rub(robot)
        law = GripLaw(friction=felt_friction)
        judge.begin(robot)
        raise_object(robot, law, RISE, speed=SPEED)
        hold(robot, law, HOLD_TIME)
    lifted = judge.height(robot) - before
    held = lifted > RISE - MOST_SLIDE - 1e-3 and judge.slid < MOST_SLIDE and judge.tilt < MOST_TILT
    return {
        **asdict(task),
        "needed": task.needed,
        "felt_friction": felt_friction,
        "peak": judge.peak,
        "grip": robot.grip,
        "lifted": lifted,
        "slid": judge.slid,
        "tilt": judge.tilt,
        "crushed": judge.peak > CRUSHING,
        "dropped": not held,
        "success": held and judge.peak <= CRUSHING,
        "time": robot.time,
    }


def lift_blindly(robot: Robot, judge: Judge, grip: float) -> None:
    """Lift the object with a constant grip [N] by the same motion as the tactile controller."""
    for force, until in ((CLOSING_GRIP, _BLIND_TIME), (grip, _BLIND_TIME + 0.2)):
        robot.grip = force
        while robot.time < until:
            robot.tick()
    judge.begin(robot)
    Ride(robot, "z", RISE, speed=SPEED).finish()
    for _ in range(round(HOLD_TIME / robot.period)):
        robot.tick()


def trial(settings: TrialSettings, condition: str, number: int) -> Result:
    """Run one trial of the experiment."""
    task = lift_task(np.random.default_rng([settings.seed, number]))
    kind = "none" if condition in BLIND_GRIPS else condition
    touch = make_touch(kind, noise=settings.noise, seed=(settings.seed, number, 1), weights=settings.weights)
    return lift(task, touch, fidelity=settings.fidelity, blind_grip=BLIND_GRIPS.get(condition))


def report(results: dict[str, list[Result]]) -> Report:
    """The table of the experiment and its bounds, from trials by condition."""
    rows = []
    for condition, trials in results.items():
        excess = [one["grip"] / one["needed"] for one in trials if one["success"]]
        rows.append(
            (
                condition,
                share([one["success"] for one in trials]).percent,
                share([one["dropped"] for one in trials]).percent,
                share([one["crushed"] for one in trials]).percent,
                median([one["peak"] for one in trials]).text(" N", digits=2),
                median(excess).text(digits=2),
                median([1e3 * one["slid"] for one in trials if one["success"]]).text(" mm", digits=2),
            )
        )
    pairs = zip(results["recognised"], results["true"], strict=True)
    ratio = [felt["peak"] / true["peak"] for felt, true in pairs if felt["success"] and true["success"]]
    success = share([one["success"] for one in results["recognised"]])
    blind = share([not one["success"] for one in results["blind"]])
    peaks = median(ratio)
    within = share([one <= 1.25 for one in ratio])
    return Report(
        title=f"Lift: {len(results['true'])} objects of {1e3 * MASSES[0]:g} to {1e3 * MASSES[1]:g} g and friction "
        f"{FRICTIONS[0]:g} to {FRICTIONS[1]:g}; 95 % confidence intervals.",
        head=(
            "grip",
            "lifted",
            "dropped or slid",
            "crushed",
            "peak, median",
            "grip over least, median",
            "slid",
        ),
        rows=rows,
        bounds=[
            Bound(what="lifted, recognised", bound=">= 95 %", found=success.percent, met=success.value >= 0.95),
            Bound(what="failed, blind", bound=">= 30 %", found=blind.percent, met=blind.value >= 0.3),
            Bound(
                what="peak grip over that with true forces, median",
                bound="<= 1.25",
                found=f"{peaks.text(digits=3)}; at most 1.25 in {within.percent} of the trials" if ratio else "-",
                met=peaks.value <= 1.25,
            ),
        ],
        figures={"peak_ratios": ratio},
    )


_COLOURS = {"recognised": "tab:blue", "true": "tab:green"}
_OTHERS = ("tab:orange", "tab:red", "tab:purple")


def lift_figure(results: dict[str, list[Result]]) -> Figure:
    """Draw the grip at the end of each trial against the least grip that holds the object.

    Crosses are objects that were dropped or crushed.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("figures")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    others = iter(_OTHERS)
    for condition, trials in results.items():
        colour = _COLOURS.get(condition) or next(others)
        needed, grip, good = (np.array([one[key] for one in trials]) for key in ("needed", "grip", "success"))
        # Trials with true forces are rings, so that those with recognised forces are visible inside them.
        ring = (
            {"s": 40, "facecolors": "none", "edgecolors": colour} if condition == "true" else {"s": 8, "color": colour}
        )
        axes.scatter(needed[good], grip[good], label=condition, **ring)
        axes.scatter(needed[~good], grip[~good], s=22, color=colour, marker="x")
    line = np.array([0.05, 15.0])
    axes.plot(line, line, color="0.4", linewidth=1, label="least that holds")
    axes.set(xscale="log", yscale="log", xlabel="least grip that holds [N]", ylabel="grip at the end [N]")
    axes.legend(fontsize="small")
    return figure


LIFT = Experiment(
    name="lift",
    conditions=("recognised", "true", *BLIND_GRIPS),
    trial=trial,
    report=report,
    figure=lift_figure,
    recognisers=grasp_recogniser,
)
