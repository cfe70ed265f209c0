"""Readings as pictures in a page: a tile per layer, side by side, the top layer first; rows run upwards, as y does.

A tile has a pixel per taxel, or some more of free ones, and is drawn larger by the browser, with what presses as lines
on it: little to send.
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
from mjtactile.view.tiles import Tiles

Picture = npt.NDArray[np.uint8]

#: No scale ends lower [Pa].
LEAST_SCALE = 1e3
#: Scales end at these numbers, times powers of ten: one that followed every reading would show all presses alike.
_ENDS = np.array([1.0, 2.0, 5.0, 10.0])
#: How fast the scale falls back to what is read now, per frame.
_DECAY = 0.97
_COLOURS = 256
#: Of a tile where there is no taxel.
_NOTHING = 70
#: Widths of lines over a tile's.
_LINE = 0.0115


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
    """RGB, tiles side by side and a white line between (rows, tiles * (columns + 1) - 1, 3).

    Args:
        readings: of `Tiles.laid_out`, (tiles, rows, columns) [Pa]; NaN where there is no taxel.
        peak: the reading that is brightest [Pa].
    """
    nothing = np.isnan(readings)
    level = np.clip(np.where(nothing, 0.0, readings) / peak * (_COLOURS - 1), 0, _COLOURS - 1).astype(np.intp)
    colours = np.where(nothing[..., None], np.uint8(_NOTHING), palette()[level])
    tiles = np.pad(colours[:, ::-1], ((0, 0), (0, 0), (0, 1), (0, 0)), constant_values=255)
    return np.concatenate(list(tiles), axis=1)[:, :-1]


def heat_map_html(name: str, said: str, picture: Picture, outline: Array, tiles: Tiles) -> str:
    """A heat map for a page, what presses drawn onto every layer.

    Args:
        name: of the pad, in the attribute `data-pad`.
        said: line above it.
        picture: of `heat_map`.
        outline: line segments in the pad frame [m], (segments, 2, 2).
        tiles: in which the picture is laid out.
    """
    count, rows, columns = tiles.taxel.shape
    width, path = picture.shape[1], _path(outline, tiles)
    lines = "".join(f'<path d="{path}" transform="translate({tile * (columns + 1)})"/>' for tile in range(count))
    return (
        f'<div data-pad="{escape(name, quote=True)}" style="margin: 0.3em 0.8em; font-size: 0.85em">{escape(said)}'
        f'<svg viewBox="0 0 {width} {rows}" style="display: block; width: 100%">'
        f'<image href="{_address(picture)}" width="{width}" height="{rows}" style="image-rendering: pixelated"/>'
        f'<g stroke="white" stroke-width="{_LINE * columns:.3g}">{lines}</g></svg></div>'
    )


def _address(picture: Picture) -> str:
    """The picture itself, as an address."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", compress_level=1)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


def _path(segments: Array, tiles: Tiles) -> str:
    """Line segments of the pad frame [m] on a tile, whose unit is a pixel, as a path of SVG."""
    _, rows, columns = tiles.taxel.shape
    places = (segments - tiles.low) / (tiles.high - tiles.low) * (columns, rows)
    places[..., 1] = rows - places[..., 1]
    return "".join(f"M{a:.2f} {b:.2f}L{c:.2f} {d:.2f}" for (a, b), (c, d) in places.tolist())


@cache
def palette() -> Picture:
    """Colours from nothing to the largest reading, (256, 3)."""
    from matplotlib import colormaps

    return (colormaps["magma"](np.arange(_COLOURS))[:, :3] * 255).astype(np.uint8)
