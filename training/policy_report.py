"""What train_policy.py found: learning curves, and a table of final success."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Episodes over which a curve is averaged.
_WINDOW = 200


def success_table(results: list[dict[str, Any]]) -> str:
    """Success of each seed on unseen masses and frictions, as a Markdown table."""
    seeds = sorted({result["seed"] for result in results})
    lines = [
        f"| | {' | '.join(f'seed {seed}' for seed in seeds)} | mean | dropped | crushed | processor time of a run |",
        f"|{' --- |' * (len(seeds) + 5)}",
    ]
    for arm in dict.fromkeys(result["arm"] for result in results):
        runs = {result["seed"]: result for result in results if result["arm"] == arm}
        each = [runs[seed]["test"] for seed in seeds]
        mean = {name: np.mean([one[name] for one in each]) for name in ("success", "dropped", "crushed")}
        time = np.mean([one["processor_s_with_test"] for one in runs.values()])
        cells = [f"{one['success']:.1%}" for one in each] + [f"**{mean['success']:.1%}**"]
        cells += [f"{mean['dropped']:.1%}", f"{mean['crushed']:.1%}", f"{time:.0f} s"]
        lines.append(f"| {arm} | {' | '.join(cells)} |")
    return "\n".join(lines)


def draw_curves(results: list[dict[str, Any]]) -> Figure:
    """Success while training, a thin line for each seed and a thick one for their mean; squares are the final test."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 4.2), layout="constrained")
    axes = figure.subplots()
    for arm, colour in zip(
        dict.fromkeys(result["arm"] for result in results), ("tab:blue", "tab:orange"), strict=False
    ):
        runs = [result for result in results if result["arm"] == arm]
        last = min(run["curve"][-1]["steps"] if run["curve"] else 0 for run in runs)  # 0: no episode ended
        grid = np.linspace(0.0, last, 200)
        curves = [_smooth(run["curve"], grid) for run in runs]
        for curve in curves:
            axes.plot(grid, curve, color=colour, linewidth=0.6, alpha=0.6)
        axes.plot(grid, np.mean(curves, axis=0), color=colour, linewidth=2.0, label=f"{arm}, training objects")
        finals = [100.0 * run["test"]["success"] for run in runs]
        axes.plot([last * 1.02] * len(finals), finals, "s", color=colour, label=f"{arm}, unseen objects")
    axes.set(xlabel="steps of the environment", ylabel="lifted, neither dropped nor crushed [%]", ylim=(0.0, 100.0))
    axes.legend(fontsize="small")
    return figure


def _smooth(curve: list[dict[str, Any]], grid: np.ndarray) -> np.ndarray:
    """Success of the latest episodes [%] at each of the grid's steps."""
    steps = np.array([one["steps"] for one in curve])
    success = 100.0 * np.array([one["success"] for one in curve], dtype=float)
    sums = np.concatenate([[0.0], np.cumsum(success)])
    ends = np.searchsorted(steps, grid, side="right")
    starts = np.maximum(ends - _WINDOW, 0)
    return (sums[ends] - sums[starts]) / np.maximum(ends - starts, 1)
