"""Readings as images in a page: one tile per layer, side by side, top layer first; rows run upwards, as y does.

A tile has one pixel per taxel, more for free taxels, and is enlarged by the browser, so that little data is sent. The
contact outline is drawn on it as lines.
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

#: Least upper end of a colour scale [Pa].
LEAST_SCALE = 1e3
#: Upper ends of colour scales are these numbers times powers of ten, so that they change seldom.
_ENDS = np.array([1.0, 2.0, 5.0, 10.0])
#: Factor per frame by which the scale decreases towards the present readings [-].
_DECAY = 0.97
_COLOURS = 256
#: Grey value of pixels without a taxel.
_NOTHING = 70
#: Width of lines over that of a tile [-].
_LINE = 0.0115


class Scale:
    """Upper end of the colour scale, the same for all pads: a round number above the largest recent reading."""

    def __init__(self) -> None:
        self._lately = LEAST_SCALE

    def follow(self, readings: Sequence[npt.NDArray[np.float32]]) -> float:
        """Update the scale with the readings of each pad in a frame [Pa], and return its new upper end [Pa]."""
        now = max((float(one.max()) for one in readings), default=0.0)
        self._lately = max(_DECAY * self._lately, now, LEAST_SCALE)
        power = 10.0 ** np.floor(np.log10(self._lately))
        return float(power * _ENDS[np.searchsorted(_ENDS * (1 + 1e-9), self._lately / power)])


def heat_map(readings: npt.NDArray[np.float32], peak: float) -> Picture:
    """RGB image of shape (rows, tiles * (columns + 1) - 1, 3): tiles side by side with a white line between them.

    Args:
        readings: readings from `Tiles.laid_out`, (tiles, rows, columns) [Pa]; NaN where there is no taxel.
        peak: upper end of the colour scale [Pa].
    """
    nothing = np.isnan(readings)
    level = np.clip(np.where(nothing, 0.0, readings) / peak * (_COLOURS - 1), 0, _COLOURS - 1).astype(np.intp)
    colours = np.where(nothing[..., None], np.uint8(_NOTHING), palette()[level])
    tiles = np.pad(colours[:, ::-1], ((0, 0), (0, 0), (0, 1), (0, 0)), constant_values=255)
    return np.concatenate(list(tiles), axis=1)[:, :-1]


def heat_map_html(name: str, said: str, picture: Picture, outline: Array, tiles: Tiles) -> str:
    """HTML of a heat map with the contact outline on every layer.

    Args:
        name: name of the pad, for the attribute `data-pad`.
        said: text above the image.
        picture: the image, from `heat_map`.
        outline: line segments in the pad frame [m], (segments, 2, 2).
        tiles: layout of the image.
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
    """The image as a data URL."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", compress_level=1)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


def _path(segments: Array, tiles: Tiles) -> str:
    """Line segments (segments, 2, 2) in the pad frame [m] as an SVG path in a tile's pixels."""
    _, rows, columns = tiles.taxel.shape
    places = (segments - tiles.low) / (tiles.high - tiles.low) * (columns, rows)
    places[..., 1] = rows - places[..., 1]
    return "".join(f"M{a:.2f} {b:.2f}L{c:.2f} {d:.2f}" for (a, b), (c, d) in places.tolist())


@cache
def palette() -> Picture:
    """RGB colours from zero to the upper end of the scale, (256, 3)."""
    from matplotlib import colormaps

    return (colormaps["magma"](np.arange(_COLOURS))[:, :3] * 255).astype(np.uint8)
