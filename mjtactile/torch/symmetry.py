"""Mirror symmetry of the pad in PyTorch, as in fem/symmetry.py: it saves three quarters of memory and time.

A curved pad has the mirrors of its surface: with two, one or no mirrors there are four, two or one symmetry classes.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from mjtactile.fem.corner_loads import corner_weights
from mjtactile.fem.symmetry import Parity
from mjtactile.influence.matrices import ODD, InfluenceMatrices
from mjtactile.influence.stress_matrix import read_matrix
from mjtactile.influence.table import table_name

#: Integrals of a quadratic element's three shape functions over its length.
_SIMPSON = (1 / 6, 4 / 6, 1 / 6)


def as_buffer(module: nn.Module, name: str, values: np.ndarray) -> None:
    """Register an array as a buffer of a module; state dictionaries leave it out, since the pad's table has it."""
    copied = np.array(values)  # PyTorch warns about read-only arrays, such as memory-mapped ones
    module.register_buffer(name, torch.from_numpy(copied), persistent=False)


class Folded(nn.Module):
    """Splits nodal forces into symmetry classes, on the degrees of freedom that have columns."""

    def __init__(self, influence: InfluenceMatrices) -> None:
        super().__init__()
        self.on_corners = influence.fidelity.loads == "corners"
        self.mirrors, quarter = influence.mirrors, influence.mesh.quarter()
        shape = (3, quarter.y.node_count, quarter.x.node_count)
        if self.on_corners:
            as_buffer(self, "corners_x", corner_weights(influence.surface.x))
            as_buffer(self, "corners_y", corner_weights(influence.surface.y))
        for number, columns in enumerate(influence.columns):
            place = np.array(np.unravel_index(columns, shape))
            if self.on_corners:  # every other node of the quarter
                place[1:] //= 2
                reduced = (3, (shape[1] + 1) // 2, (shape[2] + 1) // 2)
            else:
                reduced = shape
            as_buffer(self, f"columns_{number}", np.asarray(np.ravel_multi_index(tuple(place), reduced)))

    def forward(self, forces: Tensor) -> list[Tensor]:
        """Forces (batch, nodes y, nodes x, 3) [N] as one array (batch, columns) [N] for each class."""
        if self.on_corners:
            spread = torch.einsum("vj,bjic->bvic", self.get_buffer("corners_y"), forces)
            forces = torch.einsum("wi,bvic->bvwc", self.get_buffer("corners_x"), spread)
        along_x = {sign: _mirrored(forces, 2, sign) for sign in _signs(self.mirrors.x)}
        both = {(x, y): _mirrored(along_x[x], 1, y) for x in along_x for y in _signs(self.mirrors.y)}
        return [self._of_class(both, number, parity) for number, parity in enumerate(self.mirrors.classes)]

    def _of_class(self, both: dict[tuple[int, int], Tensor], number: int, parity: Parity) -> Tensor:
        components = [both[parity.component_signs(component)][..., component] for component in range(3)]
        return torch.stack(components, dim=1).flatten(1)[:, self.get_buffer(f"columns_{number}")]


def _signs(mirrored: bool) -> tuple[int, ...]:
    """Signs with which mirror images of forces are added, one for each class; 0 without a mirror."""
    return (1, -1) if mirrored else (0,)


def _mirrored(forces: Tensor, axis: int, sign: int) -> Tensor:
    """Forces on the nonnegative half of an axis plus `sign` times the mirror image of the others; all for sign 0."""
    if sign == 0:
        return forces
    middle = forces.shape[axis] // 2
    negative, zero, positive = forces.split([middle, 1, middle], dim=axis)
    return torch.cat([zero, positive + sign * negative.flip(axis)], dim=axis)


class LayerStress(nn.Module):
    """One sensing layer's matrices of one kind, "deviatoric" or "mean"."""

    def __init__(self, influence: InfluenceMatrices, sensing_layer: int, kind: str) -> None:
        super().__init__()
        self.factors = []
        for number, parity in enumerate(influence.mirrors.classes):
            factors = read_matrix(influence.tables, table_name(kind, parity, sensing_layer)).factors
            names = [f"class_{number}_factor_{place}" for place in range(len(factors))]
            for name, factor in zip(names, factors, strict=True):
                as_buffer(self, name, factor)
            self.factors.append(names)
        (odd_in_x, odd_in_y), mirrors = ODD[kind], influence.mirrors
        flips = np.array([np.where(odd_in_x, x, 1.0) * np.where(odd_in_y, y, 1.0) for x, y in mirrors.images])
        as_buffer(self, "signs", mirrors.signs.astype(np.float64))
        as_buffer(self, "flips", flips[:, None, :])

    def forward(self, classes: list[Tensor]) -> Tensor:
        """Stress (batch, points, coordinates) [Pa] in all images, from forces of each class (batch, columns) [N]."""
        responses = []
        for names, of_class in zip(self.factors, classes, strict=True):
            for name in names:
                of_class = of_class @ self.get_buffer(name)
            responses.append(of_class)
        flips = self.get_buffer("flips")
        whole = self.get_buffer("signs") @ torch.stack(responses, dim=1)
        return (whole.unflatten(2, (-1, flips.shape[-1])) * flips).flatten(1, 2)


def element_integrals(sizes: np.ndarray) -> np.ndarray:
    """Integrals of a line's shape functions over each of its elements [m], shape (nodes, elements)."""
    integrals = np.zeros((2 * len(sizes) + 1, len(sizes)))
    for element, size in enumerate(sizes):
        integrals[2 * element : 2 * element + 3, element] = np.multiply(_SIMPSON, size)
    return integrals
