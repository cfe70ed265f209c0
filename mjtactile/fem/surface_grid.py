"""The sensing surface as a grid of quadratic elements, and exact integrals over any polygon on it.

A traction enters the finite elements as consistent nodal forces, the integrals of the traction times the surface's
shape functions. Both are polynomials on each grid cell, so the integrals over a polygon that cuts the cells anywhere
are exact: Green's theorem turns them into sums over the polygon's edges, split at the grid lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile._native import contiguous, library, pointer, sized
from mjtactile._types import Array
from mjtactile.fem.line import Line
from mjtactile.geometry.planar import Bounds, polygons_of, rings_of
from mjtactile.pad_shape.surfaces import FLAT, Surface


@dataclass(frozen=True, eq=False)
class SurfaceGrid:
    """Grid of quadratic elements on the sheet's surface, in the pad frame; on the projection of a curved surface."""

    x: Line  #: elements along x over the whole sheet [m]
    y: Line  #: elements along y over the whole sheet [m]
    thickness: float  #: of the sheet [m]
    outer: Surface = FLAT  #: the outer surface; nodal integrals are those over its projection

    @cached_property
    def node_shape(self) -> tuple[int, int]:
        """Nodes (along y, along x)."""
        return self.y.node_count, self.x.node_count

    @cached_property
    def node_heights(self) -> Array:
        """Heights z of the nodes [m], shape (nodes y, nodes x)."""
        return self.outer.height(*np.meshgrid(self.x.nodes, self.y.nodes))

    @cached_property
    def sheet(self) -> Polygon:
        """The surface as a rectangle [m]."""
        return shapely.box(*self.bounds)

    @cached_property
    def bounds(self) -> Bounds:
        """Limits of the surface: west, south, east and north [m]."""
        x, y = self.x.vertices, self.y.vertices
        return float(x[0]), float(y[0]), float(x[-1]), float(y[-1])

    @property
    def summary(self) -> str:
        """Size, kind and nodes, for messages."""
        west, south, east, north = self.bounds
        sides = " x ".join(f"{side * 1e3:.6g}" for side in (east - west, north - south, self.thickness))
        return f"a surface of {sides} mm ({self.outer.kind}, {self.x.node_count} x {self.y.node_count} nodes)"

    def matches(self, other: SurfaceGrid) -> bool:
        """Whether loads and footprints on another grid are also those on this one: grid, thickness and shape agree."""
        return self is other or (
            np.array_equal(self.x.vertices, other.x.vertices)
            and np.array_equal(self.y.vertices, other.y.vertices)
            and self.thickness == other.thickness
            and self.outer == other.outer
        )

    def nodal_integrals(self, region: Polygon | MultiPolygon) -> Array:
        """Integrals of phi, x phi and y phi over a region, for the shape function phi of every node.

        Args:
            region: polygon or multipolygon in the pad frame [m], holes allowed; parts off the sheet are ignored.

        Returns:
            shape (3, nodes along y, nodes along x) [m^2, m^3, m^3]. The first array holds the consistent nodal
            forces of a unit traction; all three sums over nodes are the region's area and first moments.
        """
        edges = contiguous(oriented_edges(region))
        x, y = contiguous(self.x.vertices), contiguous(self.y.vertices)
        integrals = np.empty((*self.node_shape, 3))
        library().mjt_nodal_integrals(*sized(x), *sized(y), *sized(edges), pointer(integrals))
        return np.moveaxis(integrals, -1, 0)

    def traction_forces(self, edges: Array, tractions: Array) -> Array:
        """Consistent nodal forces (nodes y, nodes x, 3) [N] of tractions that are constant on polygons.

        Args:
            edges: of all polygons, each with its polygon on the left, pad frame [m], shape (edges, 2 ends, 2).
            tractions: for each edge, the traction on its polygon, pad frame [Pa], shape (edges, 3).
        """
        forces = np.empty((*self.node_shape, 3))
        edges, tractions = contiguous(edges), contiguous(tractions)
        x, y = contiguous(self.x.vertices), contiguous(self.y.vertices)
        library().mjt_traction_forces(*sized(x), *sized(y), *sized(edges), pointer(tractions), pointer(forces))
        return forces


def oriented_edges(region: Polygon | MultiPolygon) -> Array:
    """Edges of all rings of an area [m], with the area on their left, shape (edges, 2 ends, 2)."""
    rings = [ring for polygon in polygons_of(region) for ring in rings_of(polygon)]
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    return np.concatenate(edges) if edges else np.zeros((0, 2, 2))
