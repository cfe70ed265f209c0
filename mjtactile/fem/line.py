"""Lines of quadratic (three-node) elements, along each axis of a tensor-product mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjtactile._types import Array, Indices


@dataclass(frozen=True, eq=False)
class Line:
    """A line of three-node (quadratic) elements."""

    vertices: Array  #: element ends [m], ascending, shape (elements + 1,)

    @property
    def element_count(self) -> int:
        """Number of elements."""
        return len(self.vertices) - 1

    @property
    def node_count(self) -> int:
        """Number of nodes: ends and middles of all elements."""
        return 2 * self.element_count + 1

    @cached_property
    def sizes(self) -> Array:
        """Element lengths [m], shape (elements,)."""
        return np.diff(self.vertices)

    @cached_property
    def middles(self) -> Array:
        """Middles of the elements [m], shape (elements,)."""
        return (self.vertices[:-1] + self.vertices[1:]) / 2

    @cached_property
    def nodes(self) -> Array:
        """Node positions [m], ascending: vertices at even indices, middles of elements at odd ones."""
        nodes = np.empty(self.node_count)
        nodes[::2] = self.vertices
        nodes[1::2] = self.middles
        return nodes

    def locate(self, positions: Array) -> tuple[Indices, Array]:
        """Element index and local coordinate in [-1, 1] of each position; ends belong to the inner element."""
        element = np.searchsorted(self.vertices, positions, side="right") - 1
        element = np.clip(element, 0, self.element_count - 1)
        local = 2 * (positions - self.vertices[element]) / self.sizes[element] - 1
        return element, np.clip(local, -1.0, 1.0)


def quadratic_shapes(local: Array) -> tuple[Array, Array]:
    """Values [-] of the three shape functions at local coordinates in [-1, 1], and their slopes; each (..., 3).

    Slopes are derivatives with respect to the local coordinate [-].
    """
    values = np.stack([local * (local - 1) / 2, 1 - local**2, local * (local + 1) / 2], axis=-1)
    slopes = np.stack([local - 0.5, -2 * local, local + 0.5], axis=-1)
    return values, slopes
