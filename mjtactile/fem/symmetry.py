"""Mirror symmetry: loads are split into four symmetry classes, and responses are recombined from them.

Every table covers a quarter of the sheet for each class. A load is folded by summing its mirror images with the signs
of the class. The response at a mirrored point is the sum over classes with the same signs. A curved pad has the mirrors
of its surface: with one mirror there are two classes on a half, with none one class on the whole sheet.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.fem.mesh import SheetMesh


@dataclass(frozen=True)
class Parity:
    """Symmetry class of a deformation under the sheet's two mirrors.

    +1: the deformation is symmetric (equal to its mirror image); -1: antisymmetric; 0: the body has no such mirror. The
    mirror x -> -x changes the sign of u_x, so in the class x = +1 u_x is odd in x, while u_y and u_z are even.
    """

    x: int
    y: int

    def component_signs(self, component: int) -> tuple[int, int]:
        """Parities of displacement component 0, 1 or 2 (x, y, z) in x and in y: +1 even, -1 odd."""
        return (-self.x if component == 0 else self.x, -self.y if component == 1 else self.y)


@dataclass(frozen=True)
class MirrorPlanes:
    """Which of the mirrors x -> -x and y -> -y a body has."""

    x: bool = True
    y: bool = True

    @cached_property
    def classes(self) -> tuple[Parity, ...]:
        """Symmetry classes of the body's deformations: four for both mirrors."""
        signs = ((1, -1) if mirrored else (0,) for mirrored in (self.x, self.y))
        return tuple(Parity(x, y) for x, y in itertools.product(*signs))

    @cached_property
    def images(self) -> tuple[tuple[int, int], ...]:
        """Mirror images of a point as signs of (x, y), the point itself first."""
        along_x, along_y = ((1, -1) if mirrored else (1,) for mirrored in (self.x, self.y))
        return tuple((x, y) for y in along_y for x in along_x)

    @cached_property
    def signs(self) -> Array:
        """Sign of each class in each mirror image, shape (images, classes)."""
        return np.array(
            [[(p.x if sx < 0 else 1) * (p.y if sy < 0 else 1) for p in self.classes] for sx, sy in self.images]
        )


#: MirrorPlanes of a flat sheet.
BOTH = MirrorPlanes()


def free_in_plane(mesh: SheetMesh, parity: Parity | None) -> Mask:
    """Mask over a plane's degrees of freedom: False where a mirror plane holds a component of a class at zero.

    Without a class, the mesh is that of the whole sheet.
    """
    free = np.ones((3, mesh.y.node_count, mesh.x.node_count), dtype=bool)
    if parity is not None:
        for component in range(3):
            sign_x, sign_y = parity.component_signs(component)
            if sign_x < 0:
                free[component, :, 0] = False
            if sign_y < 0:
                free[component, 0, :] = False
    return free.ravel()


def fold_forces(forces: Array, parity: Parity) -> Array:
    """Nodal forces on the whole surface as forces on the quarter x >= 0, y >= 0 in one symmetry class.

    Args:
        forces: (..., nodes y, nodes x, 3) [N], nodes of a mirror-symmetric grid.
        parity: the class.

    Returns:
        (..., 3, quarter nodes y, quarter nodes x) [N]: the sums of each node's forces and those of its mirror images
        with the class's signs.
    """
    signs = np.array([parity.component_signs(component) for component in range(3)])
    folded = np.moveaxis(forces, -1, -3)
    for axis, of_component, mirrored in ((-1, signs[:, 0], parity.x), (-2, signs[:, 1], parity.y)):
        if not mirrored:
            continue
        folded = np.moveaxis(folded, axis, -1)
        middle = folded.shape[-1] // 2
        mirrored = folded[..., middle - 1 :: -1]
        folded = folded[..., middle:].copy()
        folded[..., 1:] += of_component[:, None, None] * mirrored
        folded = np.moveaxis(folded, -1, axis)
    return folded


def unfold_field(classes: list[Array], mirrors: MirrorPlanes) -> Array:
    """A vector field (..., nodes y, nodes x, 3) on the whole surface from its symmetry classes on the quarter.

    Args:
        classes: one array (..., 3, quarter nodes y, quarter nodes x) per class, in the order of the mirrors' classes.
        mirrors: of the body.
    """
    whole = 0.0
    for parity, quarter in zip(mirrors.classes, classes, strict=True):
        components = []
        for component in range(3):
            field = quarter[..., component, :, :]
            sign_x, sign_y = parity.component_signs(component)
            if sign_x:
                field = np.concatenate([sign_x * field[..., :, :0:-1], field], axis=-1)
            if sign_y:
                field = np.concatenate([sign_y * field[..., :0:-1, :], field], axis=-2)
            components.append(field)
        whole = whole + np.stack(components, axis=-1)
    return np.asarray(whole)


def unfold_points(classes: Array, odd_in_x: Mask, odd_in_y: Mask, mirrors: MirrorPlanes) -> Array:
    """Stress coordinates at points in all mirror images of the quarter, from those of each class at the folded points.

    Args:
        classes: (batch, classes, folded points * coordinates).
        odd_in_x: which coordinates change their sign under x -> -x, shape (coordinates,).
        odd_in_y: the same under y -> -y.
        mirrors: of the body.

    Returns:
        (batch, images * folded points, coordinates), image by image.
    """
    batch = len(classes)
    signs = [np.where(odd_in_x, x, 1) * np.where(odd_in_y, y, 1) for x, y in mirrors.images]
    whole = np.matmul(mirrors.signs.astype(classes.dtype), classes).reshape(batch, len(signs), -1, len(odd_in_x))
    whole *= np.array(signs)[:, None, :]
    return whole.reshape(batch, -1, len(odd_in_x))


@dataclass(frozen=True, eq=False)
class FoldedPoints:
    """Points folded onto the quarter x >= 0, y >= 0, or as much of the plane as the mirrors leave."""

    positions: Array  #: distinct folded positions [m], shape (folded points, 3)
    index: np.ndarray  #: for each original point, its folded point, shape (points,)
    #: For each original point, the index of its mirror image in `MirrorPlanes.images`, shape (points,).
    image: np.ndarray


def fold_points(positions: Array, resolution: float, mirrors: MirrorPlanes) -> FoldedPoints:
    """Fold points (points, 3) [m]; mirror images within `resolution` [m] of each other become one."""
    mirrored = np.array([mirrors.x, mirrors.y, False])
    folded = np.where(mirrored, np.abs(positions), positions)
    # Rounding makes equal coordinates exactly equal, which the sampler exploits.
    folded = np.round(folded / resolution) * resolution
    distinct, index = np.unique(folded, axis=0, return_inverse=True)
    beyond = (positions < -resolution) & mirrored
    image = beyond[:, 0].astype(int) + (2 if mirrors.x else 1) * beyond[:, 1]
    return FoldedPoints(distinct, index.ravel(), image)
