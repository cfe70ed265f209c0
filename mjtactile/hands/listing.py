"""The catalogue of hands as Markdown tables, for docs/hands.md."""

from __future__ import annotations

from collections import Counter

import numpy as np

from mjtactile.hands.catalogue import HANDS, Hand, hand


def catalogue_table() -> str:
    """Table of all hands: numbers of pads and taxels, source of the model, and tests."""
    rows = [
        "| `attach_hand(spec, ...)` | hand | pads | taxels | model | source | tested |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in HANDS:
        one = hand(name)
        source = f"<{one.source}>" if one.source.startswith("http") else f"`{one.source}`"
        rows.append(
            f'| `"{name}"` | {one.title} | {len(one.pads)} | {one.taxels} | {one.model} | {source} | {one.tested} |'
        )
    return "\n".join(rows)


def shapes_table() -> str:
    """Table of all pad shapes of all hands: size, surface, thickness, taxels, and height above the collision geoms."""
    rows = [
        "| hand | pads | size, mm | surface, mm | thickness, mm | taxels | depth, mm | above collision geoms, mm |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in HANDS:
        one = hand(name)
        for shape, count in Counter(pad.shape for pad in one.pads).items():
            rows.append(f"| {name} | {count} x {shape.replace('_', ' ')} | {_shape(one, shape)} |")
    return "\n".join(rows)


def _shape(one: Hand, shape: str) -> str:
    pad = next(found.pad for found in one.pads if found.shape == shape)
    low, high = (f"{1e3 * end:.2g}" for end in one.proud[shape])
    rows, columns = pad.grid.rows, pad.grid.columns
    lengths = [
        value for values in pad.surface.numbers.values() for value in (values if isinstance(values, list) else [values])
    ]
    surface = " ".join([pad.surface.kind, ", ".join(_millimetres(np.array(lengths)))]).strip()
    return " | ".join(
        [
            " x ".join(_millimetres(np.array(pad.size))),
            surface,
            *_millimetres(np.array([pad.thickness])),
            f"{rows} x {columns}",
            ", ".join(_millimetres(np.array(pad.depths))),
            low if low == high else f"{low} to {high}",
        ]
    )


def _millimetres(lengths: np.ndarray) -> list[str]:
    return [f"{1e3 * length:.4g}" for length in lengths.tolist()]
