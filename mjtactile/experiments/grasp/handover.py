"""The handover experiment: a held object is put down on a shelf of unknown height, without dropping or pushing it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import mujoco
import numpy as np

from mjtactile.experiments.grasp.control import GripLaw, Ride, close, hold, let_go, lower, raise_object, rub
from mjtactile.experiments.grasp.judge import CRUSHING
from mjtactile.experiments.grasp.lift import LiftTask, lift_task
from mjtactile.experiments.grasp.statistics import Bound, Report, median, share
from mjtactile.experiments.grasp.touch import TouchSense, grasp_recogniser, make_touch
from mjtactile.experiments.grasp.trials import Experiment, Result, TrialSettings

#: Range of the distance from the held object down to the shelf [m].
DEPTHS = (5e-3, 35e-3)
#: Largest force on the shelf in excess of the weight [N], drop height [m], and tilt of the object [deg].
MOST_FORCE, MOST_DROP, MOST_TILT = 6.0, 1e-3, 5.0
#: Lifting height [m], speeds of lifting and lowering [m/s], and holding time before lowering [s].
_RISE, _SPEED, _LOWERING, _SETTLE = 0.045, 0.08, 0.012, 0.2
#: Distance below the lowest shelf at which lowering is given up [m].
_BEYOND = 4e-3
_SHELF = (0.04, 0.04, 2e-3)


@dataclass(frozen=True, kw_only=True)
class HandoverTask:
    """One trial: an object, and the distance down to the shelf."""

    lift: LiftTask  #: the object and its pose
    depth: float  #: distance from the held object down to the shelf [m]


def handover_task(drawn: np.random.Generator) -> HandoverTask:
    """A random trial, uniform over the ranges."""
    return HandoverTask(lift=lift_task(drawn), depth=float(drawn.uniform(*DEPTHS)))


def hand_over(task: HandoverTask, touch: TouchSense, *, fidelity: str, blind: bool = False) -> dict[str, Any]:
    """Lift the object, put it down on the shelf, release it, and return the judge's results.

    If `blind`, touch is ignored: the wrist is lowered by the mean distance.

    Returns:
        The task's values; "success"; "force", the largest force on the shelf in excess of the weight [N], and "drop",
        the height from which the object was dropped [m], both None if it was not gripped. If it was, also "stands",
        whether it stands on the shelf; "tilt" [deg]; and "peak", the largest force on a pad [N].
    """
    robot, judge = task.lift.robot(touch, fidelity, furnish=_add_shelf, support="shelf")
    result = {**asdict(task.lift), "depth": task.depth, "success": False, "force": None, "drop": None}
    if not close(robot):
        return result
    law = GripLaw(friction=rub(robot))
    raise_object(robot, law, _RISE, speed=_SPEED)
    hold(robot, law, _SETTLE)
    top = judge.height(robot) - task.lift.size[2] / 2 - task.depth
    robot.data.mocap_pos[0] = (robot.data.body("object").xpos[0], robot.data.body("object").xpos[1], top - _SHELF[2])
    judge.begin(robot)
    robot.grip *= 1.1
    if blind:
        Ride(robot, "z", robot.place["z"] - sum(DEPTHS) / 2, speed=_LOWERING).finish()
    else:
        lower(robot, robot.place["z"] - DEPTHS[1] - _BEYOND, speed=_LOWERING)
    drop = judge.height(robot) - task.lift.size[2] / 2 - top
    force = judge.table - task.lift.mass * 9.81
    let_go(robot)
    stands = abs(judge.height(robot) - task.lift.size[2] / 2 - top) < 1e-3
    gentle = force < MOST_FORCE and drop < MOST_DROP and judge.peak <= CRUSHING
    return {
        **result,
        "force": force,
        "drop": drop,
        "stands": stands,
        "tilt": judge.tilt,
        "peak": judge.peak,
        "success": bool(stands and gentle and judge.tilt < MOST_TILT),
    }


def _add_shelf(spec: mujoco.MjSpec) -> None:
    """Add a shelf, out of the robot's way."""
    shelf = spec.worldbody.add_body(name="shelf", mocap=True, pos=[0.0, 0.25, 0.02])
    shelf.add_geom(name="shelf", type=mujoco.mjtGeom.mjGEOM_BOX, size=list(_SHELF), rgba=[0.5, 0.6, 0.7, 1.0], condim=4)


def trial(settings: TrialSettings, condition: str, number: int) -> Result:
    """Run one trial of the experiment.

    Under condition "blind", the object is lifted with true forces, so that it is held when the handover begins.
    """
    task = handover_task(np.random.default_rng([settings.seed, number, 5]))
    seed = (settings.seed, number, 6)
    blind = condition == "blind"
    touch = make_touch("true" if blind else condition, noise=settings.noise, seed=seed, weights=settings.weights)
    return hand_over(task, touch, fidelity=settings.fidelity, blind=blind)


def report(results: dict[str, list[Result]]) -> Report:
    """The table of the experiment and its bound, from trials by condition."""
    rows = []
    for condition, trials in results.items():
        held = [one for one in trials if one["force"] is not None]
        rows.append(
            (
                condition,
                share([one["success"] for one in trials]).percent,
                median([one["force"] for one in held]).text(" N", digits=2),
                f"{np.quantile([one['force'] for one in held], 0.95):.1f} N" if held else "-",
                median([1e3 * one["drop"] for one in held]).text(" mm", digits=2),
                f"{np.quantile([1e3 * one['drop'] for one in held], 0.95):.1f} mm" if held else "-",
            )
        )
    felt = share([one["success"] for one in results["recognised"]])
    return Report(
        title=f"Handover: {len(results['true'])} objects put down on shelves {1e3 * DEPTHS[0]:g} to {1e3 * DEPTHS[1]:g}"
        f" mm below; 95 % confidence intervals.",
        head=(
            "touch",
            "put down gently",
            "force beyond the weight, median",
            "95 %",
            "left above the shelf, median",
            "95 %",
        ),
        rows=rows,
        bounds=[Bound(what="put down, recognised", bound=">= 95 %", found=felt.percent, met=felt.value >= 0.95)],
        figures={"success": asdict(felt)},
    )


HANDOVER = Experiment(
    name="handover",
    conditions=("recognised", "true", "blind"),
    trial=trial,
    report=report,
    recognisers=grasp_recogniser,
)
