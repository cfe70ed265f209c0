"""Results of the study as Markdown: tables, variants, and differences from the paper in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mjtactile.experiments.markdown import markdown_table
from mjtactile.experiments.study.plan import STUDIED_LAWS
from mjtactile.experiments.study.protocol import DIRECTIONS, LAYERS, PAPER_SHAPES_RIGHT
from mjtactile.experiments.study.tables import (
    PRINTED_DIRECTION,
    SENSOR,
    direction_errors,
    direction_table,
    force_result,
    magnitude_table,
    our_columns,
    outputs_table,
    paper_direction_error,
    presented_table,
    shape_result,
    shapes_right_table,
)
from mjtactile.geometry.outlines import INDENTER_NAMES


def study_report(found: dict[str, Any]) -> str:
    """All results of `reproduce` as Markdown."""
    settings = found["settings"]
    parts = [
        f"{settings['seeds']} initialisations of each network, magnitude networks trained for "
        f"{settings['magnitude_iterations']:,} iterations, readings at fidelity {settings['fidelity']}. Ours: mean and "
        f"standard deviation over initialisations; in brackets the one with the least training error, which is the one "
        f"the paper tests. Training and testing took {found['seconds'] / 60:.0f} minutes of one process in all.",
        'Contact laws "uniform" and "elastic" give readings that differ by up to '
        f'{found["elastic_difference"]:.0%}. Law "foundation" presses a flat punch as "uniform" does: its readings '
        f"differ by {found['foundation_difference']:.1g} at most, so it has no columns of its own.",
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
                f'Outputs for punches shifted to {PRINTED_DIRECTION}, {SENSOR[layers]}, law "uniform", mean over '
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
    """Number of recognised punches, of 7, by variant."""

    def cell(unit: dict[str, Any]) -> str:
        right = np.array([unit["result"]["right"][direction] for direction in DIRECTIONS])
        by_direction = right.mean(axis=1)
        perfect = int((right == len(INDENTER_NAMES)).any(axis=0).sum())
        return f"{right.mean():.1f} ({by_direction.max():.1f}, {by_direction.min():.1f}); {perfect} of {right.shape[1]}"

    return _variants_table([u for u in found["units"] if u["study"] == "shape"], cell)


def differences(found: dict[str, Any]) -> list[str]:
    """Differences from the paper, a line for each table."""
    lines = []
    paper = {n: paper_direction_error(n) for n in LAYERS}
    for law in STUDIED_LAWS:
        forces = {layers: force_result(found, law, layers) for layers in LAYERS}
        shapes = {layers: shape_result(found, law, layers) for layers in LAYERS}
        direction = {n: float(np.mean(direction_errors(forces[n]["direction"]))) for n in LAYERS}
        magnitude = {n: float(np.mean(forces[n]["magnitude"]["unknown_gf"])) for n in LAYERS}
        right = {n: np.array([shapes[n]["right"][d] for d in DIRECTIONS]) for n in LAYERS}
        perfect = {n: int((right[n] == len(INDENTER_NAMES)).any(axis=0).sum()) for n in LAYERS}
        lines.append(
            f'- Law "{law}". Direction: {direction[1]:.2f} deg off on the mean with one layer, {direction[4]:.2f} with '
            f"four (the paper: {paper[1]:.2f} and {paper[4]:.2f}). "
            f"Magnitude: {magnitude[1]:.2f} gf with one layer (the paper: 0.53), "
            f"{magnitude[4]:.2f} with four (0.23): {_layers_help(magnitude[4], magnitude[1])}. Shapes: "
            f"{right[1].mean():.1f} of 7 with one layer (the paper: 4), {right[4].mean():.1f} with four (7): "
            f"{_layers_help(-right[4].mean(), -right[1].mean())}. All 7 in some direction: {perfect[1]} of "
            f"{right[1].shape[1]} networks with one layer, {perfect[4]} with four."
        )
    return lines


def _layers_help(four: float, one: float) -> str:
    """Whether four layers do better than one; both smaller is better."""
    if abs(four - one) <= 0.1 * max(abs(four), abs(one)):
        return "four layers as good as one"
    return "four layers better" if four < one else "four layers worse"


def _variants_table(units: Sequence[dict[str, Any]], cell: Callable[[dict[str, Any]], str]) -> str:
    """Variants as rows, laws and layers as columns."""
    found = {(u["variant"], u["law"], u["layers"]): cell(u) for u in units}
    rows = [
        [variant, *(found.get((variant, law, layers), "-") for law in STUDIED_LAWS for layers in LAYERS)]
        for variant in dict.fromkeys(u["variant"] for u in units)
    ]
    return markdown_table(["", *our_columns()], rows)
