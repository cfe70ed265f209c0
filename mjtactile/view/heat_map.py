"""Readings as pictures in a page: a tile per layer, side by side, the top layer first; rows run upwards, as y does.

A tile has a pixel per taxel and is drawn larger by the browser, with what presses as lines on it: little to send.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from functools import cache
from html import escape

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.pad import Pad

Picture = npt.NDArray[np.uint8]

#: No scale ends lower [Pa].
LEAST_SCALE = 1e3
#: Scales end at these numbers, times powers of ten: one that followed every reading would show all presses alike.
_ENDS = np.array([1.0, 2.0, 5.0, 10.0])
#: How fast the scale falls back to what is read now, per frame.
_DECAY = 0.97
_COLOURS = 256


class Scale:
    """The reading that is shown brightest, the same for all pads: a round number above the largest there was lately."""

    def __init__(self) -> None:
        self._lately = LEAST_SCALE

    def follow(self, readings: Sequence[npt.NDArray[np.float32]]) -> float:
        """Take in the readings of a frame.

        Args:
            readings: of each pad [Pa].

        Returns:
            The reading that is brightest now [Pa].
        """
        now = max((float(one.max()) for one in readings), default=0.0)
        self._lately = max(_DECAY * self._lately, now, LEAST_SCALE)
        power = 10.0 ** np.floor(np.log10(self._lately))
        return float(power * _ENDS[np.searchsorted(_ENDS * (1 + 1e-9), self._lately / power)])


def heat_map(readings: npt.NDArray[np.float32], peak: float) -> Picture:
    """RGB, a pixel per taxel, layers side by side and a white line between (rows, layers * (columns + 1) - 1, 3).

    Args:
        readings: (layers, rows, columns) [Pa].
        peak: the reading that is brightest [Pa].
    """
    level = np.clip(readings / peak * (_COLOURS - 1), 0, _COLOURS - 1).astype(np.intp)
    tiles = np.pad(palette()[level[:, ::-1]], ((0, 0), (0, 0), (0, 1), (0, 0)), constant_values=255)
    return np.concatenate(list(tiles), axis=1)[:, :-1]


def heat_map_html(name: str, said: str, picture: Picture, outline: Array, pad: Pad) -> str:
    """A heat map for a page, what presses drawn onto every layer.

    Args:
        name: of the pad, in the attribute `data-pad`.
        said: line above it.
        picture: of `heat_map`.
        outline: line segments in the pad frame [m], (segments, 2, 2).
        pad: whose taxels these are.
    """
    layers, rows, columns = pad.grid_shape
    width, path = picture.shape[1], _path(outline, pad)
    lines = "".join(f'<path d="{path}" transform="translate({layer * (columns + 1)})"/>' for layer in range(layers))
    return (
        f'<div data-pad="{escape(name, quote=True)}" style="margin: 0.3em 0.8em; font-size: 0.85em">{escape(said)}'
        f'<svg viewBox="0 0 {width} {rows}" style="display: block; width: 100%">'
        f'<image href="{_address(picture)}" width="{width}" height="{rows}" style="image-rendering: pixelated"/>'
        f'<g stroke="white" stroke-width="0.15">{lines}</g></svg></div>'
    )


def _address(picture: Picture) -> str:
    """The picture itself, as an address."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", compress_level=1)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


def _path(segments: Array, pad: Pad) -> str:
    """Line segments of the pad frame [m] on a tile, whose unit is a taxel, as a path of SVG."""
    _, rows, _ = pad.grid_shape
    taxels = pad.grid
    corner = np.array([taxels.x[0] - taxels.pitch[0] / 2, taxels.y[0] - taxels.pitch[1] / 2])
    places = (segments - corner) / np.array(taxels.pitch)
    places[..., 1] = rows - places[..., 1]
    return "".join(f"M{a:.2f} {b:.2f}L{c:.2f} {d:.2f}" for (a, b), (c, d) in places.tolist())


@cache
def palette() -> Picture:
    """Colours from nothing to the largest reading, (256, 3)."""
    from matplotlib import colormaps

    return (colormaps["magma"](np.arange(_COLOURS))[:, :3] * 255).astype(np.uint8)
