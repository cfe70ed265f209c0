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
from mjtactile.pad_shape.taxels import FreeTaxels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PatchCollection
    from matplotlib.figure import Figure

_MILLI = 1e3
_KILO = 1e-3
_COLOURS = "magma"
#: Number of points of a line along a pad's surface.
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
        pad: the pad.
        readings: (layers, rows, columns) [Pa]; or (taxels,) for free taxels, which are drawn by bands of depth.
        outline: of the contact in the pad frame [m].
        title: title of the figure.
        picture: RGB image (height, width, 3) of the scene; without it that panel is omitted.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("figures")
    from matplotlib.figure import Figure

    layers = len(pad.layers_drawn)
    map_columns = int(np.ceil(np.sqrt(layers)))
    rows = max(int(np.ceil(layers / map_columns)), 2)
    figure = Figure(figsize=(3.6 * map_columns + 5.0, 3.5 * rows), layout="constrained")
    figure.suptitle(title)
    maps, side = np.ravel(np.asarray(figure.subfigures(1, 2, width_ratios=(3.6 * map_columns, 5.0))))
    for k, axes in enumerate(np.ravel(maps.subplots(rows, map_columns, squeeze=False))):
        if k < layers:
            _draw_map(axes, pad, readings, k, outline)
        else:
            axes.set_axis_off()
    panels = side.subplots(1 if picture is None else 2, 1, squeeze=False)[:, 0]
    section = _free_section if isinstance(pad.taxels, FreeTaxels) else _grid_section
    section(panels[0], pad, readings, outline)
    if picture is not None:
        panels[1].imshow(picture)
        panels[1].set_title("scene")
        panels[1].set_axis_off()
    return figure


def _draw_map(axes: Axes, pad: Pad, readings: Array, layer: int, outline: Polygon | MultiPolygon) -> None:
    values = readings.ravel()[pad.layers_drawn[layer]] * _KILO
    if isinstance(pad.taxels, FreeTaxels):
        extent = np.repeat(pad.size, 2) / 2 * (-1.0, 1.0, -1.0, 1.0)
        taxels = pad.layers_drawn[layer]
        image = _discs(pad.taxel_feet(0)[taxels], np.array(pad.sensed_radii)[taxels], values)
        axes.add_collection(image)
        axes.set(facecolor="0.85", aspect="equal")
    else:
        (west, south), (east, north) = pad.grid.corners.tolist()
        extent = west, east, south, north
        shown = values.reshape(pad.grid_shape[1:])
        image = axes.imshow(shown, origin="lower", extent=tuple(_MILLI * e for e in extent), cmap=_COLOURS, vmin=0.0)
    for polygon in polygons_of(outline):
        for ring in rings_of(polygon):
            closed = np.concatenate([ring, ring[:1]]) * _MILLI
            axes.plot(closed[:, 0], closed[:, 1], color="white", linewidth=1.2)
    axes.set(title=f"{pad.depth_said(layer)} deep", xlabel="x [mm]", ylabel="y [mm]")
    axes.set(xlim=tuple(_MILLI * e for e in extent[:2]), ylim=tuple(_MILLI * e for e in extent[2:]))
    colourbar = axes.figure.colorbar(image, ax=axes, shrink=0.85)
    colourbar.set_label("von Mises [kPa]")


def _discs(feet: Array, radii: Array, values: Array) -> PatchCollection:
    """Taxels seen from above, as discs with the radii of their balls [mm]; upper taxels cover lower ones."""
    require("figures")
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    order = np.argsort(-feet[:, 2], kind="stable")
    circles = [Circle(tuple(feet[k, :2] * _MILLI), float(radii[k]) * _MILLI) for k in order.tolist()]
    discs = PatchCollection(circles, cmap=_COLOURS)
    discs.set_array(values[order])
    discs.set_clim(vmin=0.0)
    return discs


def _grid_section(axes: Axes, pad: Pad, readings: Array, outline: Polygon | MultiPolygon) -> None:
    """Draw the readings of the taxel row with the largest reading, at the taxels' positions."""
    row = int(np.unravel_index(np.argmax(readings), readings.shape)[1])
    y = float(pad.grid.y[row])
    _draw_stack(axes, pad, y)
    x, z = np.stack([_curve(pad, pad.grid.x, y, depth) for depth in pad.depths], axis=1)
    values = readings[:, row] * _KILO
    if min(x.shape) > 1:
        shading = axes.pcolormesh(x, z, values, shading="gouraud", cmap=_COLOURS, vmin=0.0)
    else:
        shading = axes.scatter(x.ravel(), z.ravel(), c=values.ravel(), cmap=_COLOURS, vmin=0.0)
    axes.plot(x.ravel(), z.ravel(), ".", color="white", markersize=2)
    _finish_section(axes, pad, y, outline, shading)


def _free_section(axes: Axes, pad: Pad, readings: Array, outline: Polygon | MultiPolygon) -> None:
    """Draw the free taxels whose balls intersect the plane y = const. through the taxel with the largest reading."""
    assert isinstance(pad.taxels, FreeTaxels)
    feet, radii = pad.taxel_feet(0), np.array(pad.sensed_radii)
    y = float(feet[np.argmax(readings), 1])
    _draw_stack(axes, pad, y)
    cut = np.abs(feet[:, 1] - y) <= radii
    x, _, z = pad.taxels.positions[cut].T * _MILLI
    shading = axes.scatter(x, z, c=readings[cut] * _KILO, cmap=_COLOURS, vmin=0.0, edgecolors="0.4", linewidths=0.5)
    _finish_section(axes, pad, y, outline, shading)


def _draw_stack(axes: Axes, pad: Pad, y: float) -> None:
    """Draw surface, base and layers of the pad in the plane at y [m]."""
    require("figures")
    from matplotlib.patches import Polygon as Patch

    half_width = pad.size[0] / 2
    across = np.linspace(-half_width, half_width, _CURVE_POINTS)
    top, base = _curve(pad, across, y, 0.0), _curve(pad, across, y, pad.thickness)
    axes.add_patch(Patch(np.concatenate([top.T, base.T[::-1]]), facecolor="0.92", edgecolor="0.3"))
    for height in pad.interfaces:
        axes.plot(*_curve(pad, across, y, -height), color="0.5", linewidth=0.8, linestyle="--")
    low, high = float(base[1].min()), float(top[1].max())
    axes.set(
        title=f"section at y = {y * _MILLI:.3g} mm",
        xlabel="x [mm]",
        ylabel="z [mm]",
        xlim=(-half_width * _MILLI, half_width * _MILLI),
        ylim=(low, high + 0.08 * (high - low)),
        aspect="equal",
    )


def _finish_section(axes: Axes, pad: Pad, y: float, outline: Polygon | MultiPolygon, shading: ScalarMappable) -> None:
    """Draw the contact as a line on the surface, and the colour scale."""
    from shapely import LineString

    cut = outline.intersection(LineString([(-pad.size[0], y), (pad.size[0], y)]))
    for part in getattr(cut, "geoms", [cut]):
        if not part.is_empty:
            left, _, right, _ = part.bounds
            pressed = _curve(pad, np.linspace(left, right, _CURVE_POINTS), y, 0.0)
            axes.plot(*pressed, color="tab:orange", linewidth=4, solid_capstyle="butt")
    axes.figure.colorbar(shading, ax=axes, shrink=0.6, orientation="horizontal").set_label("von Mises [kPa]")


def _curve(pad: Pad, x: Array, y: float, depth: float) -> Array:
    """A line along x at a depth below the outer surface, seen along y: x and z [mm], (2, n)."""
    return pad.surface.positions(x, np.full_like(x, y), depth).T[[0, 2]] * _MILLI
