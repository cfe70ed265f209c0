"""A figure of lifts: how hard each object was gripped, over what it takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mjtactile.experiments.grasp.trials import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = {"recognised": "tab:blue", "true": "tab:green"}
_OTHERS = ("tab:orange", "tab:red", "tab:purple")


def lift_figure(results: dict[str, list[Result]]) -> Figure:
    """Draw results of the lift experiment: grip at the end over the least that holds; crosses fell or were crushed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    others = iter(_OTHERS)
    for condition, trials in results.items():
        colour = _COLOURS.get(condition) or next(others)
        needed, grip, good = (np.array([one[key] for one in trials]) for key in ("needed", "grip", "success"))
        # Rings for true forces: what was recognised lies on top of them.
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
