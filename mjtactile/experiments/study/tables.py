"""The study's results as Markdown: the paper's tables 2 to 6 beside ours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mjtactile.experiments.markdown import markdown_table
from mjtactile.experiments.study.plan import STUDIED_LAWS
from mjtactile.experiments.study.protocol import (
    DIRECTIONS,
    LAYERS,
    PAPER_DIRECTION,
    PAPER_FOUR_LAYER_DIAGONAL,
    PAPER_MAGNITUDE,
    PAPER_ONE_LAYER_SHAPES,
    PAPER_RATES,
    PRESENTED,
    UNKNOWN_ANGLES,
)
from mjtactile.geometry.outlines import INDENTER_NAMES

SENSOR = {1: "one layer", 4: "four layers"}
#: Direction in which outputs are printed in full.
PRINTED_DIRECTION = "+x"


def direction_table(found: dict[str, Any]) -> str:
    """Table 2: mean training error, and the angle recognised for each unknown one [deg]."""
    paper = [PAPER_DIRECTION[layers] for layers in LAYERS]
    columns = [force_result(found, law, layers)["direction"] for law in STUDIED_LAWS for layers in LAYERS]
    rows = [
        [
            "mean training error",
            *(f"{p['training']:g}" for p in paper),
            *(_spread(c["training_deg"], c["best"], 3) for c in columns),
        ]
    ]
    for k, angle in enumerate(UNKNOWN_ANGLES):
        angles = [np.array(c["recognised_deg"])[:, k] for c in columns]
        ours = [_spread(a, c["best"], 2) for a, c in zip(angles, columns, strict=True)]
        rows.append([f"{angle} ->", *(f"{p['unknown'][k]:g}" for p in paper), *ours])
    errors = [direction_errors(c) for c in columns]
    rows.append(
        [
            "mean absolute error of the four",
            *(f"{paper_direction_error(layers):.3f}" for layers in LAYERS),
            *(_spread(e, c["best"], 3) for e, c in zip(errors, columns, strict=True)),
        ]
    )
    return markdown_table(["", *_paper_columns(), *our_columns()], rows)


def magnitude_table(found: dict[str, Any]) -> str:
    """Table 3: training error, errors of the 76 unknown samples [gf]."""
    paper = [PAPER_MAGNITUDE[layers] for layers in LAYERS]
    columns = [force_result(found, law, layers)["magnitude"] for law in STUDIED_LAWS for layers in LAYERS]

    def row(label: str, name: str, printed: Sequence[str]) -> list[str]:
        return [label, *printed, *(_spread(c[name], c["best"], 3) for c in columns)]

    return markdown_table(
        ["", *_paper_columns(), *our_columns()],
        [
            row("training error (ours: root mean square)", "training_gf", [f"{p['training']:g}" for p in paper]),
            row("mean absolute error, 76 unknown", "unknown_gf", [f"{p['unknown']:g}" for p in paper]),
            row("its standard deviation", "deviation_gf", [f"{p['deviation']:g}" for p in paper]),
            row("worst of the 76", "worst_gf", ["-", "-"]),
            row("mean absolute error, true direction given", "with_true_direction_gf", ["-", "-"]),
        ],
    )


def shapes_right_table(found: dict[str, Any]) -> str:
    """Number of the seven shifted punches that were recognised, by direction of the shift."""
    rows = []
    for law in STUDIED_LAWS:
        for layers in LAYERS:
            right = shape_result(found, law, layers)["right"]
            counts = [_plain_spread(right[direction]) for direction in DIRECTIONS]
            rows.append([law, SENSOR[layers], *counts, f"{np.mean([right[d] for d in DIRECTIONS]):.2f}"])
    return markdown_table(["law", "", *DIRECTIONS, "all"], rows)


def outputs_table(found: dict[str, Any], layers: int) -> str:
    """Mean outputs for the shifted punches, ours / the paper's; rows are true, columns recognised."""
    outputs = np.array(shape_result(found, "uniform", layers)["outputs"][PRINTED_DIRECTION])
    rows = []
    for k, name in enumerate(INDENTER_NAMES):
        printed = [f"{value:g}" for value in PAPER_ONE_LAYER_SHAPES[k]] if layers == 1 else _four_layer_row(k)
        rows.append([name, *(f"{ours:.2f} / {paper}" for ours, paper in zip(outputs[k], printed, strict=True))])
    return markdown_table(["", *INDENTER_NAMES], rows)


def _four_layer_row(row: int) -> list[str]:
    """A row of table 5: its entry on the diagonal, and the paper's bound of the others."""
    printed = ["<= .01"] * len(INDENTER_NAMES)
    printed[row] = f"{PAPER_FOUR_LAYER_DIAGONAL[row]:g}"
    return printed


def presented_table(found: dict[str, Any]) -> str:
    """Table 6: recognition rates over thirty presentations [%], beside those of people and of the paper's network."""
    rows = [
        ["people, eyes covered", *(f"{rate:g}" for rate in PAPER_RATES["people"])],
        ["the paper's network", *(f"{rate:g}" for rate in PAPER_RATES["network"])],
    ]
    for law in STUDIED_LAWS:
        for layers in LAYERS:
            shown = shape_result(found, law, layers)["presented"]
            rates = [_plain_spread(100.0 * np.array(shown[name]["rate"]), 0) for name in PRESENTED]
            rows.append([f"ours, {law}, {SENSOR[layers]}", *rates])
    return markdown_table(["", *PRESENTED], rows)


def paper_direction_error(layers: int) -> float:
    """Mean absolute error of the paper's network over the four unknown angles [deg]."""
    return float(np.abs(np.subtract(PAPER_DIRECTION[layers]["unknown"], UNKNOWN_ANGLES)).mean())


def direction_errors(direction: dict[str, Any]) -> list[float]:
    """Mean absolute error over the unknown angles, one for each initialisation [deg]."""
    return np.abs(np.array(direction["recognised_deg"]) - UNKNOWN_ANGLES).mean(axis=1).tolist()


def force_result(found: dict[str, Any], law: str, layers: int) -> dict[str, Any]:
    """Result of the force networks for a law and a number of layers, without variants."""
    iterations = found["settings"]["magnitude_iterations"]
    return _result(found, study="force", law=law, layers=layers, iterations=iterations)


def shape_result(found: dict[str, Any], law: str, layers: int) -> dict[str, Any]:
    """Result of the shape networks for a law and a number of layers, without variants."""
    return _result(found, study="shape", law=law, layers=layers)


def _result(found: dict[str, Any], **wanted: Any) -> dict[str, Any]:
    wanted = {"variant": "as studied", **wanted}
    return next(u["result"] for u in found["units"] if all(u[name] == value for name, value in wanted.items()))


def _paper_columns() -> list[str]:
    return [f"paper, {SENSOR[layers]}" for layers in LAYERS]


def our_columns() -> list[str]:
    """Heads of our columns: laws and sensing layers."""
    return [f"{law}, {SENSOR[layers]}" for law in STUDIED_LAWS for layers in LAYERS]


def _spread(values: Iterable[float], best: int, digits: int) -> str:
    numbers = np.array(list(values))
    return f"{numbers.mean():.{digits}f} ± {numbers.std():.{digits}f} [{numbers[best]:.{digits}f}]"


def _plain_spread(values: Iterable[float], digits: int = 1) -> str:
    numbers = np.array(list(values), dtype=float)
    return f"{numbers.mean():.{digits}f} ± {numbers.std():.{digits}f}"
