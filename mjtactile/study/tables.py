"""The study's results as Markdown: the paper's tables 2 to 6 beside ours, and what was tried where they differ."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mjtactile.outlines import INDENTER_NAMES
from mjtactile.study.plan import STUDIED_LAWS
from mjtactile.study.protocol import (
    DIRECTIONS,
    LAYERS,
    PAPER_DIRECTION,
    PAPER_FOUR_LAYER_DIAGONAL,
    PAPER_MAGNITUDE,
    PAPER_ONE_LAYER_SHAPES,
    PAPER_RATES,
    PAPER_SHAPES_RIGHT,
    PRESENTED,
    UNKNOWN_ANGLES,
)

_SENSOR = {1: "one layer", 4: "four layers"}
#: Direction in which outputs are printed in full.
_PRINTED_DIRECTION = "+x"


def study_report(found: dict[str, Any]) -> str:
    """Everything `reproduce` found, as Markdown."""
    settings = found["settings"]
    parts = [
        f"{settings['seeds']} initialisations of each network, magnitude networks trained for "
        f"{settings['magnitude_iterations']:,} iterations, readings of preset {settings['preset']}. Ours: mean and "
        f"standard deviation over initialisations; in brackets the one with the least training error, which is the one "
        f"the paper tests. Training took {found['seconds'] / 60:.1f} minutes of one core in all.",
        'Contact laws "uniform" and "elastic" give readings that differ by up to '
        f'{found["elastic_difference"]:.0%}. Law "foundation" presses a flat punch as "uniform" does: its readings '
        f"differ by {found['foundation_difference']:.0e} at most, so it has no columns of its own.",
        "### Table 2: direction of force [deg]",
        direction_table(found),
        "### Table 3: magnitude of force [gf]",
        magnitude_table(found),
        "### Tables 4 and 5: shifted punches",
        f"Punches recognised of 7, by the direction of the shift of 1.25 mm. The paper, in one direction it does not "
        f"name: {PAPER_SHAPES_RIGHT[1]} with one layer, {PAPER_SHAPES_RIGHT[4]} with four.",
        shapes_right_table(found),
        *[
            part
            for layers in LAYERS
            for part in (
                f'Outputs for punches shifted to {_PRINTED_DIRECTION}, {_SENSOR[layers]}, law "uniform", mean over '
                "initialisations / the paper's; rows are true.",
                outputs_table(found, layers),
            )
        ],
        "### Table 6: circle, triangle, square in random order [%]",
        presented_table(found),
    ]
    if any(unit["variant"] != "as studied" for unit in found["units"]):
        parts += [
            "### Likely reasons, one at a time",
            "Force networks: mean absolute error over the unknown samples, mean over initialisations, after "
            f"{settings['variant_iterations']:,} iterations of the magnitude network.",
            force_variants_table(found),
            "Shape networks: punches recognised of 7, mean over the eight directions and initialisations (in the best "
            "and the worst direction); how many of all networks recognised all 7 in some direction.",
            shape_variants_table(found),
        ]
    return "\n\n".join([*parts, "### In words", *differences(found)])


def direction_table(found: dict[str, Any]) -> str:
    """Table 2: mean training error, and the angle recognised for each unknown one [deg]."""
    paper = [PAPER_DIRECTION[layers] for layers in LAYERS]
    columns = [_force(found, law, layers)["direction"] for law in STUDIED_LAWS for layers in LAYERS]
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
            *(f"{np.abs(np.subtract(p['unknown'], UNKNOWN_ANGLES)).mean():.2f}" for p in paper),
            *(_spread(e, c["best"], 3) for e, c in zip(errors, columns, strict=True)),
        ]
    )
    return _markdown(["", *_paper_columns(), *_our_columns()], rows)


def magnitude_table(found: dict[str, Any]) -> str:
    """Table 3: training error, errors of the 76 unknown samples [gf]."""
    paper = [PAPER_MAGNITUDE[layers] for layers in LAYERS]
    columns = [_force(found, law, layers)["magnitude"] for law in STUDIED_LAWS for layers in LAYERS]

    def row(label: str, name: str, printed: Sequence[str]) -> list[str]:
        return [label, *printed, *(_spread(c[name], c["best"], 3) for c in columns)]

    return _markdown(
        ["", *_paper_columns(), *_our_columns()],
        [
            row("training error (ours: root mean square)", "training_gf", [f"{p['training']:g}" for p in paper]),
            row("mean absolute error, 76 unknown", "unknown_gf", [f"{p['unknown']:g}" for p in paper]),
            row("its standard deviation", "deviation_gf", [f"{p['deviation']:g}" for p in paper]),
            row("worst of the 76", "worst_gf", ["-", "-"]),
            row("mean absolute error, true direction given", "with_true_direction_gf", ["-", "-"]),
        ],
    )


def shapes_right_table(found: dict[str, Any]) -> str:
    """How many of the seven shifted punches were recognised, by direction."""
    rows = []
    for law in STUDIED_LAWS:
        for layers in LAYERS:
            right = _shape(found, law, layers)["right"]
            counts = [_plain_spread(right[direction]) for direction in DIRECTIONS]
            rows.append([law, _SENSOR[layers], *counts, f"{np.mean([right[d] for d in DIRECTIONS]):.2f}"])
    return _markdown(["law", "", *DIRECTIONS, "all"], rows)


def outputs_table(found: dict[str, Any], layers: int) -> str:
    """Mean outputs for the shifted punches, ours / the paper's; rows are true, columns recognised."""
    outputs = np.array(_shape(found, "uniform", layers)["outputs"][_PRINTED_DIRECTION])
    rows = []
    for k, name in enumerate(INDENTER_NAMES):
        printed = [f"{value:g}" for value in PAPER_ONE_LAYER_SHAPES[k]] if layers == 1 else _four_layer_row(k)
        rows.append([name, *(f"{ours:.2f} / {paper}" for ours, paper in zip(outputs[k], printed, strict=True))])
    return _markdown(["", *INDENTER_NAMES], rows)


def _four_layer_row(row: int) -> list[str]:
    """A row of table 5, of which the paper's facts say the diagonal and a bound."""
    printed = ["<= .01"] * len(INDENTER_NAMES)
    printed[row] = f"{PAPER_FOUR_LAYER_DIAGONAL[row]:g}"
    return printed


def presented_table(found: dict[str, Any]) -> str:
    """Recognition rates over thirty presentations [%], beside people's and the paper's network's."""
    rows = [
        ["people, eyes covered", *(f"{rate:g}" for rate in PAPER_RATES["people"])],
        ["the paper's network", *(f"{rate:g}" for rate in PAPER_RATES["network"])],
    ]
    for law in STUDIED_LAWS:
        for layers in LAYERS:
            shown = _shape(found, law, layers)["presented"]
            rates = [_plain_spread(100.0 * np.array(shown[name]["rate"]), 0) for name in PRESENTED]
            rows.append([f"ours, {law}, {_SENSOR[layers]}", *rates])
    return _markdown(["", *PRESENTED], rows)


def force_variants_table(found: dict[str, Any]) -> str:
    """Errors of the force networks by variant: magnitude [gf], direction [deg]."""
    iterations = found["settings"]["variant_iterations"]
    units = [u for u in found["units"] if u["study"] == "force" and u["iterations"] == iterations]

    def cell(unit: dict[str, Any]) -> str:
        result = unit["result"]
        direction = np.mean(direction_errors(result["direction"]))
        return f"{np.mean(result['magnitude']['unknown_gf']):.2f} gf, {direction:.2f} deg"

    return _variants_table(units, cell)


def shape_variants_table(found: dict[str, Any]) -> str:
    """Punches recognised of 7 by variant."""

    def cell(unit: dict[str, Any]) -> str:
        right = np.array([unit["result"]["right"][direction] for direction in DIRECTIONS])
        by_direction = right.mean(axis=1)
        perfect = int((right == len(INDENTER_NAMES)).any(axis=0).sum())
        return f"{right.mean():.1f} ({by_direction.max():.1f}, {by_direction.min():.1f}); {perfect} of {right.shape[1]}"

    return _variants_table([u for u in found["units"] if u["study"] == "shape"], cell)


def differences(found: dict[str, Any]) -> list[str]:
    """Where ours differs from the paper, said plainly: a line for each table."""
    lines = []
    for law in STUDIED_LAWS:
        forces = {layers: _force(found, law, layers) for layers in LAYERS}
        shapes = {layers: _shape(found, law, layers) for layers in LAYERS}
        direction = {n: float(np.mean(direction_errors(forces[n]["direction"]))) for n in LAYERS}
        magnitude = {n: float(np.mean(forces[n]["magnitude"]["unknown_gf"])) for n in LAYERS}
        right = {n: np.array([shapes[n]["right"][d] for d in DIRECTIONS]) for n in LAYERS}
        perfect = {n: int((right[n] == len(INDENTER_NAMES)).any(axis=0).sum()) for n in LAYERS}
        lines.append(
            f'- Law "{law}". Direction: {direction[1]:.2f} deg off on the mean with one layer, {direction[4]:.2f} with '
            f"four (the paper: 0.10 and 0.08). Magnitude: {magnitude[1]:.2f} gf with one layer (the paper: 0.53), "
            f"{magnitude[4]:.2f} with four (0.23): {_layers_help(magnitude[4], magnitude[1])}. Shapes: "
            f"{right[1].mean():.1f} of 7 with one layer (the paper: 4), {right[4].mean():.1f} with four (7): "
            f"{_layers_help(-right[4].mean(), -right[1].mean())}. All 7 in some direction: {perfect[1]} of "
            f"{right[1].shape[1]} networks with one layer, {perfect[4]} with four."
        )
    return lines


def direction_errors(direction: dict[str, Any]) -> list[float]:
    """By initialisation, the mean absolute error over the unknown angles [deg]."""
    return np.abs(np.array(direction["recognised_deg"]) - UNKNOWN_ANGLES).mean(axis=1).tolist()


def _layers_help(four: float, one: float) -> str:
    """Whether four layers do better than one; both smaller is better."""
    if abs(four - one) <= 0.1 * max(abs(four), abs(one)):
        return "four layers as good as one"
    return "four layers better" if four < one else "four layers worse"


def _force(found: dict[str, Any], law: str, layers: int) -> dict[str, Any]:
    iterations = found["settings"]["magnitude_iterations"]
    return _result(found, study="force", law=law, layers=layers, iterations=iterations)


def _shape(found: dict[str, Any], law: str, layers: int) -> dict[str, Any]:
    return _result(found, study="shape", law=law, layers=layers)


def _result(found: dict[str, Any], **wanted: Any) -> dict[str, Any]:
    wanted = {"variant": "as studied", **wanted}
    return next(u["result"] for u in found["units"] if all(u[name] == value for name, value in wanted.items()))


def _variants_table(units: Sequence[dict[str, Any]], cell: Any) -> str:
    """Variants as rows, laws and layers as columns."""
    found = {(u["variant"], u["law"], u["layers"]): cell(u) for u in units}
    rows = [
        [variant, *(found.get((variant, law, layers), "-") for law in STUDIED_LAWS for layers in LAYERS)]
        for variant in dict.fromkeys(u["variant"] for u in units)
    ]
    return _markdown(["", *_our_columns()], rows)


def _paper_columns() -> list[str]:
    return [f"paper, {_SENSOR[layers]}" for layers in LAYERS]


def _our_columns() -> list[str]:
    return [f"{law}, {_SENSOR[layers]}" for law in STUDIED_LAWS for layers in LAYERS]


def _spread(values: Iterable[float], best: int, digits: int) -> str:
    numbers = np.array(list(values))
    return f"{numbers.mean():.{digits}f} ± {numbers.std():.{digits}f} [{numbers[best]:.{digits}f}]"


def _plain_spread(values: Iterable[float], digits: int = 1) -> str:
    numbers = np.array(list(values), dtype=float)
    return f"{numbers.mean():.{digits}f} ± {numbers.std():.{digits}f}"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
