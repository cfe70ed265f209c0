"""A whole run of the loop, and its evaluation with commanded, recognised and true values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.loop.clock import Log, Loop, LoopSettings
from mjtactile.experiments.loop.known import bin_place
from mjtactile.experiments.loop.scene import LoopScene, loop_scene
from mjtactile.experiments.loop.tasks import HeldForce, Sorted, commanded_forces, press_forces, sort_punches
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.pad import Pad
from mjtactile.recognition import ForceRecogniser, ShapeRecogniser, load
from mjtactile.sensor import TactileSensor
from mjtactile.transducer.array import Transducer
from mjtactile.units import GRAM_FORCE

#: A press is evaluated over this time at its end [s].
JUDGED_TIME = 0.1
#: A commanded force is reached when the difference from the true force stays below this fraction of its magnitude [-].
REACHED_WITHIN = 0.05


@dataclass(frozen=True, eq=False)
class LoopResult:
    """Result of a run, and its evaluation."""

    settings: LoopSettings  #: settings of the run
    scene: LoopScene  #: the scene, with the true shapes and poses
    log: Log  #: record of all ticks
    held: list[HeldForce]  #: commanded forces that arm 0 held
    sorted: list[Sorted]  #: punches that were put into bins
    judged: dict[str, Any]  #: results of `judge` as plain numbers


def run_loop(
    settings: LoopSettings,
    *,
    folder: Path | None,
    transducer: Transducer | None,
    watch: Callable[[Loop], None],
) -> LoopResult:
    """Press with commanded forces, using the unknown punch of arm 0, then sort the seven punches.

    Args:
        settings: settings of the run.
        folder: folder of the recognisers' weights; None: those of the package.
        transducer: transducers that report the readings, before noise is added; None for ideal readings.
        watch: function that is called with the loop after each tick.

    Raises:
        RecognitionError: there are no weights, or they are for another pad.
        MjTactileError: the rate does not divide 1000 Hz.
    """
    scene = loop_scene(settings.seed)
    sensor = TactileSensor(scene.model, fidelity=settings.fidelity)
    loop = Loop(
        scene,
        sensor,
        loop_recognisers(settings.layers, folder, sensor.pad),
        settings,
        transducer=transducer,
        watch=watch,
    )
    held = press_forces(loop, 0, commanded_forces(settings.presses, settings.seed)) if settings.presses else []
    put_away = sort_punches(loop) if settings.sort else []
    return LoopResult(settings, scene, loop.log, held, put_away, judge(settings, loop, held, put_away))


def loop_recognisers(
    layers: str, folder: Path | None, pad: Pad | None = None
) -> tuple[ForceRecogniser, ShapeRecogniser]:
    """Recognisers of force and shape for the loop; arguments and errors as in `recognition.load`."""
    return load("force", layers=layers, pad=pad, folder=folder), load("shape", layers=layers, pad=pad, folder=folder)


def judge(settings: LoopSettings, loop: Loop, held: list[HeldForce], put_away: list[Sorted]) -> dict[str, Any]:
    """Evaluate a run after its end: errors of the presses, bins of the sorted punches, and rates of the loop."""
    judged = [_sort_judged(loop, each) for each in put_away]
    return {
        "settings": asdict(settings),
        "presses": [_press_judged(loop.log, each, loop.period) for each in held],
        "sorted": judged,
        "sorted_right": sum(each["right"] for each in judged),
        "rates": _rates(loop.log, loop.period),
    }


def _press_judged(log: Log, held: HeldForce, period: float) -> dict[str, Any]:
    """Errors of the true force at the end of a press, and the time until the commanded force was reached."""
    true = np.array(log.true[held.start : held.stop])
    off = np.linalg.norm(true - held.commanded, axis=1) / np.linalg.norm(held.commanded)
    late = np.flatnonzero(off > REACHED_WITHIN)
    reached = 0 if not len(late) else int(late[-1]) + 1
    last = slice(-max(1, round(JUDGED_TIME / period)), None)
    mean = true[last].mean(axis=0)
    recognised = np.array(log.recognised[held.start : held.stop])[last].mean(axis=0)
    return {
        "commanded_gf": (held.commanded / GRAM_FORCE).tolist(),
        "true_gf": (mean / GRAM_FORCE).tolist(),
        "recognised_gf": (recognised / GRAM_FORCE).tolist(),
        "magnitude_error_gf": float(np.linalg.norm(mean) - np.linalg.norm(held.commanded)) / GRAM_FORCE,
        "direction_error_deg": _angle(mean, held.commanded),
        "reached_s": reached * period if reached < len(true) else None,
    }


def _sort_judged(loop: Loop, put_away: Sorted) -> dict[str, Any]:
    """The bin that a punch ended in, from MuJoCo's state, and the error of its recognised position."""
    place = loop.data.body(f"arm_{put_away.arm}").xpos
    ends = [float(np.hypot(*(bin_place(k) - place)[:2])) for k in range(len(INDENTER_NAMES))]
    nearest = int(np.argmin(ends))
    ended = INDENTER_NAMES[nearest] if ends[nearest] < 1e-3 else None
    true = loop.scene.truth[put_away.arm]
    off = np.array(put_away.position) - loop.scene.shifts[put_away.arm]
    return {
        **asdict(put_away),
        "true": true,
        "bin": ended,
        "right": ended == true,
        "position_error_mm": None if np.isnan(off).any() else float(np.hypot(*off)) * 1e3,
    }


def _rates(log: Log, period: float) -> dict[str, Any]:
    """Durations and rates over the ticks with contact."""
    felt = ~np.isnan(np.array(log.force_time))
    times = {name: np.array(getattr(log, f"{name}_time"))[felt] * 1e3 for name in ("step", "read", "force", "shape")}
    if not felt.any():
        return {"ticks_felt": 0}
    touch = times["read"] + times["force"] + times["shape"]
    whole = float(sum(map(np.nansum, (log.step_time, log.read_time, log.force_time, log.shape_time))))
    return {
        "ticks_felt": int(felt.sum()),
        "simulated_steps_hz": 1e3,
        "simulated_ticks_hz": 1.0 / period,
        **{
            f"{name}_ms": {
                "median": float(np.median(of)),
                "mean": float(of.mean()),
                "p99": float(np.percentile(of, 99)),
            }
            for name, of in (*times.items(), ("read_and_recognise", touch))
        },
        "ticks_per_second_median": 1e3 / float(np.median(touch)),
        "ticks_per_second_sustained": 1e3 / float(touch.mean()),
        "ticks_in_time": float((touch + times["step"] <= period * 1e3).mean()),
        "faster_than_real_time": log.time[-1] / whole,
    }


def _angle(a: Array, b: Array) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
