"""The benchmark of fidelities as a figure: error against time, with the Pareto front."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

from mjtactile._installed import require
from mjtactile.cli.benchmarks.front import error, front, update_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MILLI = 1e3
_PERCENT = 1e2
_MESH_COLOURS = ("tab:orange", "tab:blue", "tab:green", "tab:purple")
_LAW_MARKERS = {"uniform": "s", "foundation": "^", "elastic": "o"}
_OTHER_MARKER = "D"


def trade_figure(result: dict[str, Any]) -> Figure:
    """Plot the error of every fidelity of a `trade_benchmark` against its time per update, on logarithmic axes.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("figures")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    meshes = list(dict.fromkeys(row["mesh"] for row in result["rows"]))
    laws = dict.fromkeys([*_LAW_MARKERS, *(row["law"] for row in result["rows"])])
    for mesh, colour in zip(meshes, cycle(_MESH_COLOURS), strict=False):
        for law in laws:
            rows = [row for row in result["rows"] if (row["mesh"], row["law"]) == (mesh, law)]
            if rows:
                marker = _LAW_MARKERS.get(law, _OTHER_MARKER)
                axes.plot(*_places(rows), marker, color=colour, alpha=0.7, label=f"{mesh}, {law}")
    axes.plot(*_places(front(result["rows"])), color="0.3", linewidth=1.0, zorder=0, label="nothing beats these")
    _name_presets(axes, result["rows"])
    _mark_yardsticks(axes, result)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="time per update of a moved footprint, one core, mean over the cases [ms]",
        ylabel="relative L2 error against the finest, median [%]",
    )
    axes.grid(which="both", alpha=0.2)
    axes.legend(fontsize="small", ncols=2)
    return figure


def _places(rows: list[dict[str, Any]]) -> tuple[list[float], list[float]]:
    return [update_time(row) * _MILLI for row in rows], [error(row) * _PERCENT for row in rows]


def _name_presets(axes: Axes, rows: list[dict[str, Any]]) -> None:
    for row in rows:
        if row["preset"] is not None:
            place = (update_time(row) * _MILLI, error(row) * _PERCENT)
            axes.plot(*place, "o", markersize=14, markerfacecolor="none", color="black")
            axes.annotate(row["preset"], place, xytext=(10, 10), textcoords="offset points", weight="bold")


def _mark_yardsticks(axes: Axes, result: dict[str, Any]) -> None:
    """Mark times that have no such error: a direct solution on each mesh, and MuJoCo's own sensor."""
    times = {f"direct FEM, {mesh}": seconds for mesh, seconds in result["direct_s"].items()}
    times["<tactile>: depth, no stress"] = result["mujoco_tactile_s"]
    for name, seconds in times.items():
        axes.axvline(seconds * _MILLI, color="0.6", linestyle=":", linewidth=1.0)
        axes.annotate(
            name,
            (seconds * _MILLI, 0.02),
            xycoords=("data", "axes fraction"),
            xytext=(-9, 0),
            textcoords="offset points",
            rotation=90,
            fontsize="x-small",
            color="0.4",
        )
