"""A figure of a run of the loop: commanded, recognised and true forces, and true and recognised shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mjtactile._installed import require
from mjtactile.experiments.loop.run import LoopResult
from mjtactile.units import GRAM_FORCE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = ("tab:blue", "tab:orange", "tab:green")


def loop_figure(result: LoopResult) -> Figure:
    """Draw the result of `run_loop`.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("figures")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    forces, shapes, times = np.ravel(figure.subplots(3, 1, height_ratios=(3, 2, 1.5)))
    _draw_forces(forces, result)
    _draw_shapes(shapes, result)
    _draw_times(times, result)
    return figure


def _draw_forces(axes: Axes, result: LoopResult) -> None:
    log = result.log
    stop = result.held[-1].stop + 20 if result.held else len(log.time)
    time = np.array(log.time[:stop])
    for k, (axis, colour) in enumerate(zip("xyz", _COLOURS, strict=True)):
        true, seen, wanted = (
            np.array(values[:stop])[:, k] / GRAM_FORCE for values in (log.true, log.recognised, log.commanded)
        )
        axes.plot(time, wanted, color=colour, linestyle="--", linewidth=1)
        axes.plot(time, seen, ".", color=colour, markersize=2)
        axes.plot(time, true, color=colour, linewidth=1.2, label=axis)
    axes.plot([], [], "k--", linewidth=1, label="commanded")
    axes.plot([], [], "k.", markersize=3, label="recognised")
    axes.plot([], [], "k", linewidth=1.2, label="MuJoCo's")
    axes.set(title="force on the pad", ylabel="[gf]", xlabel="simulated time [s]")
    axes.legend(ncols=2, fontsize="small", loc="lower right")


def _draw_shapes(axes: Axes, result: LoopResult) -> None:
    """Draw the recognised shape at every tick with contact, and the true shape in grey."""
    log, names = result.log, sorted(result.scene.truth)
    seen = np.array([names.index(name) if name in names else -1 for name in log.seen])
    truth = np.array([names.index(result.scene.truth[arm]) for arm in log.arm])
    felt = np.flatnonzero(seen >= 0)
    time = np.array(log.time)
    axes.plot(time[felt], truth[felt], "s", color="0.8", markersize=8, label="true")
    axes.plot(time[felt], seen[felt], ".", color="tab:red", markersize=4, label="recognised")
    axes.set_yticks(range(len(names)), names)
    right = result.judged["sorted_right"]
    title = f"shape: {right} of {len(result.sorted)} in their bins" if result.sorted else "shape"
    axes.set(title=title, xlabel="simulated time [s]")
    axes.legend(fontsize="small", loc="lower left")


def _draw_times(axes: Axes, result: LoopResult) -> None:
    log = result.log
    for name, label in (("read", "reading"), ("force", "force recognised"), ("shape", "shape recognised")):
        axes.semilogy(log.time, 1e3 * np.array(getattr(log, f"{name}_time")), ".", markersize=2, label=label)
    axes.axhline(1e3 / result.settings.rate, color="0.5", linestyle="--", linewidth=1)
    axes.set(title="time taken in each tick", ylabel="[ms]", xlabel="simulated time [s]")
    axes.legend(fontsize="small", markerscale=4, ncols=3)
