"""The catalogue of hands as Markdown tables, which docs/hands.md contains."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from mjtactile.experiments.markdown import markdown_table
from mjtactile.hands.catalogue import HANDS, Hand, hand


def hands_tables() -> str:
    """Tables of all hands, with their model and tests, and of all shapes of their pads."""
    hands = [hand(name) for name in HANDS]
    titles = ["`attach_hand(spec, ...)`", "hand", "pads", "taxels", "model", "source", "tested"]
    shapes = ["hand", "pads", "size, mm", "surface, mm", "thickness, mm", "taxels", "depth, mm"]
    return "\n\n".join(
        [
            markdown_table(titles, map(_hand_cells, hands)),
            markdown_table([*shapes, "above collision geoms, mm"], (row for one in hands for row in _shape_rows(one))),
        ]
    )


def _hand_cells(one: Hand) -> list[str]:
    return [f'`"{one.name}"`', one.title, str(len(one.pads)), str(one.taxels), one.model, f"`{one.source}`", one.tested]


def _shape_rows(one: Hand) -> Iterator[list[str]]:
    for shape, count in Counter(pad.shape for pad in one.pads).items():
        pad = next(found.pad for found in one.pads if found.shape == shape)
        low, high = (f"{1e3 * end:.2g}" for end in one.proud[shape])
        lengths = np.concatenate([np.ravel(values) for values in pad.surface.numbers.values()] or [()])
        yield [
            one.name,
            f"{count} x {shape.replace('_', ' ')}",
            " x ".join(_millimetres(pad.size)),
            f"{pad.surface.kind} {', '.join(_millimetres(lengths.tolist()))}".strip(),
            *_millimetres([pad.thickness]),
            f"{pad.grid.rows} x {pad.grid.columns}",
            ", ".join(_millimetres(pad.depths)),
            low if low == high else f"{low} to {high}",
        ]


def _millimetres(lengths: Sequence[float]) -> list[str]:
    return [f"{1e3 * length:.4g}" for length in lengths]
