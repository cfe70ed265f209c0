"""What faces the pad: the covered part of its surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from mjtactile.errors import FootprintError
from mjtactile.pad import Array
from mjtactile.planar import areal
from mjtactile.surface import SurfaceGrid

if TYPE_CHECKING:
    from mjtactile.influence import InfluenceMatrices


@dataclass(frozen=True, eq=False)
class Footprint:
    """A covered area of one pad's surface; make it with `Footprint.from_outline`.

    Attributes:
        outline: the covered area in the pad frame [m], cut at the sheet's edge.
        surface: the grid it is integrated on.
    """

    outline: Polygon | MultiPolygon
    surface: SurfaceGrid

    @classmethod
    def from_outline(cls, outline: BaseGeometry, influence: InfluenceMatrices) -> Footprint:
        """Footprint of a flat face.

        Args:
            outline: polygon or multipolygon in the pad frame [m], holes allowed. What overhangs the sheet carries
                nothing.
            influence: the pad's influence matrices, whose surface grid integrates loads.

        Raises:
            FootprintError: when the outline is not a valid area, or covers none of the sheet.
        """
        covered = _area_on_sheet(outline, influence.surface.sheet)
        return cls(covered, influence.surface)

    @property
    def area(self) -> float:
        """Covered area [m^2]."""
        return self.outline.area

    @property
    def centroid(self) -> tuple[float, float]:
        """Middle of the covered area (x, y) [m]."""
        centre = self.outline.centroid
        return centre.x, centre.y

    @cached_property
    def integrals(self) -> Array:
        """Integrals of each node's shape function times 1, x and y over the area, see SurfaceGrid."""
        return self.surface.nodal_integrals(self.outline)


def _area_on_sheet(outline: BaseGeometry, sheet: Polygon) -> Polygon | MultiPolygon:
    if not isinstance(outline, Polygon | MultiPolygon):
        raise FootprintError(
            f"the outline is a {type(outline).__name__}; expected a shapely Polygon or MultiPolygon in metres."
        )
    if not np.isfinite(shapely.get_coordinates(outline)).all():
        raise FootprintError("the outline has NaN or infinite coordinates; check the pose it was made from.")
    if not outline.is_valid:
        raise FootprintError(
            f"the outline is not a valid area ({shapely.is_valid_reason(outline)}). "
            "shapely.make_valid mends self-crossing polygons."
        )
    covered = areal(outline.intersection(sheet))
    if covered.area == 0.0:
        bounds = "nothing" if outline.is_empty else "x {0:.4g}..{2:.4g} m, y {1:.4g}..{3:.4g} m".format(*outline.bounds)
        raise FootprintError(
            f"the outline covers none of the pad: it spans {bounds}, and the sheet "
            "x {:.4g}..{:.4g} m, y {:.4g}..{:.4g} m. Shift it onto the sheet; lengths are metres.".format(
                *(sheet.bounds[i] for i in (0, 2, 1, 3))
            )
        )
    return covered
