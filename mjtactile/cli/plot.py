"""Figures of one press: the layer maps, a section through the pad, and the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon, Polygon

from mjtactile._installed import require
from mjtactile._types import Array
from mjtactile.geometry.planar import polygons_of, rings_of
from mjtactile.pad import Pad

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MILLI = 1e3
_KILO = 1e-3
_COLOURS = "magma"
#: Of a line along a pad's surface.
_CURVE_POINTS = 121


def press_figure(
    pad: Pad,
    readings: Array,
    outline: Polygon | MultiPolygon,
    *,
    title: str = "",
    picture: npt.NDArray[np.uint8] | None = None,
) -> Figure:
    """Layer maps with the outline drawn on them, a section through the pad, and the rendered scene.

    Args:
        pad: what was pressed.
        readings: (layers, rows, columns) [Pa].
        outline: what pressed, in the pad frame [m].
        title: of the figure.
        picture: RGB (height, width, 3) of the scene; without it that panel is left out.
    """
    require("figures")
    from matplotlib.figure import Figure

    layers = len(pad.depths)
    map_columns = int(np.ceil(np.sqrt(layers)))
    rows = max(int(np.ceil(layers / map_columns)), 2)
    figure = Figure(figsize=(3.6 * map_columns + 5.0, 3.5 * rows), layout="constrained")
    figure.suptitle(title)
    maps, side = np.ravel(np.asarray(figure.subfigures(1, 2, width_ratios=(3.6 * map_columns, 5.0))))
    for k, axes in enumerate(np.ravel(maps.subplots(rows, map_columns, squeeze=False))):
        if k < layers:
            _draw_map(axes, pad, readings[k], pad.depths[k], outline)
        else:
            axes.set_axis_off()
    panels = side.subplots(1 if picture is None else 2, 1, squeeze=False)[:, 0]
    _draw_section(panels[0], pad, readings, outline)
    if picture is not None:
        panels[1].imshow(picture)
        panels[1].set_title("scene")
        panels[1].set_axis_off()
    return figure


def _draw_map(axes: Axes, pad: Pad, reading: Array, depth: float, outline: Polygon | MultiPolygon) -> None:
    half_pitch = np.array(pad.grid.pitch) / 2
    extent = (
        pad.grid.x[0] - half_pitch[0],
        pad.grid.x[-1] + half_pitch[0],
        pad.grid.y[0] - half_pitch[1],
        pad.grid.y[-1] + half_pitch[1],
    )
    image = axes.imshow(
        reading * _KILO, origin="lower", extent=tuple(_MILLI * e for e in extent), cmap=_COLOURS, vmin=0.0
    )
    for polygon in polygons_of(outline):
        for ring in rings_of(polygon):
            closed = np.concatenate([ring, ring[:1]]) * _MILLI
            axes.plot(closed[:, 0], closed[:, 1], color="white", linewidth=1.2)
    axes.set(title=f"{depth * _MILLI:g} mm deep", xlabel="x [mm]", ylabel="y [mm]")
    axes.set(xlim=tuple(_MILLI * e for e in extent[:2]), ylim=tuple(_MILLI * e for e in extent[2:]))
    colourbar = axes.figure.colorbar(image, ax=axes, shrink=0.85)
    colourbar.set_label("von Mises [kPa]")


def _draw_section(axes: Axes, pad: Pad, readings: Array, outline: Polygon | MultiPolygon) -> None:
    """Readings of the row with the highest one, where they are taken; the contact is drawn on top of the pad."""
    row = int(np.unravel_index(np.argmax(readings), readings.shape)[1])
    y, half_width = float(pad.grid.y[row]), pad.size[0] / 2
    across = np.linspace(-half_width, half_width, _CURVE_POINTS)
    top, base = _curve(pad, across, y, 0.0), _curve(pad, across, y, pad.thickness)
    axes.add_patch(_area(np.concatenate([top.T, base.T[::-1]])))
    for height in pad.interfaces:
        axes.plot(*_curve(pad, across, y, -height), color="0.5", linewidth=0.8, linestyle="--")
    x, z = np.stack([_curve(pad, pad.grid.x, y, depth) for depth in pad.depths], axis=1)
    values = readings[:, row] * _KILO
    if min(x.shape) > 1:
        shading = axes.pcolormesh(x, z, values, shading="gouraud", cmap=_COLOURS, vmin=0.0)
    else:
        shading = axes.scatter(x.ravel(), z.ravel(), c=values.ravel(), cmap=_COLOURS, vmin=0.0)
    axes.plot(x.ravel(), z.ravel(), ".", color="white", markersize=2)
    cut = outline.intersection(_line_at(pad, y))
    for part in getattr(cut, "geoms", [cut]):
        if not part.is_empty:
            left, _, right, _ = part.bounds
            pressed = _curve(pad, np.linspace(left, right, _CURVE_POINTS), y, 0.0)
            axes.plot(*pressed, color="tab:orange", linewidth=4, solid_capstyle="butt")
    low, high = float(base[1].min()), float(top[1].max())
    axes.set(
        title=f"section at y = {y * _MILLI:g} mm",
        xlabel="x [mm]",
        ylabel="z [mm]",
        xlim=(-half_width * _MILLI, half_width * _MILLI),
        ylim=(low, high + 0.08 * (high - low)),
        aspect="equal",
    )
    axes.figure.colorbar(shading, ax=axes, shrink=0.6, orientation="horizontal").set_label("von Mises [kPa]")


def _curve(pad: Pad, x: Array, y: float, depth: float) -> Array:
    """A line along x at a depth below the outer surface, seen along y: x and z [mm], (2, n)."""
    return pad.surface.positions(x, np.full_like(x, y), depth).T[[0, 2]] * _MILLI


def _area(corners: Array):
    require("figures")
    from matplotlib.patches import Polygon as Patch

    return Patch(corners, facecolor="0.92", edgecolor="0.3")


def _line_at(pad: Pad, y: float):
    from shapely import LineString

    return LineString([(-pad.size[0], y), (pad.size[0], y)])
