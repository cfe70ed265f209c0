"""Contact laws on given cells, each as the few lines that define it: what the compiled core is measured with.

Cells are polygons under one constant traction each, by their edges, each edge once with the cells to its left and
right. Pressing forces F count positive; rigid motions of the body have displacements B (cells, motions) down.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from core_cells import FaceCells
from half_space import HalfSpaceIntegrals, half_space_compliance

from mjtactile._types import Array
from mjtactile.contact.cells.compliance import SurfaceCompliance

_EXCHANGES = 100


class Cells(NamedTuple):
    """Contact cells where they stand on a pad, pad frame; see FaceCells."""

    centroids: Array
    areas: Array
    edges: Array
    sides: npt.NDArray[np.int32]
    quadrature: Array

    @property
    def length(self) -> float:
        """Root of the area, by which tilts and torsion compare with forces [m]."""
        return float(np.sqrt(self.areas.sum()))

    @property
    def modes(self) -> Array:
        """Indentation, and tilts about the cells' middle times their length, (cells, 3)."""
        offset = (self.centroids - self.centroids.mean(axis=0)) / self.length
        return np.column_stack([np.ones(len(offset)), offset])


def placed(cells: FaceCells, place: Array) -> Cells:
    """Cells of an outline turned by place[2] [rad], then shifted by place[:2] [m]."""
    cosine, sine = np.cos(place[2]), np.sin(place[2])
    turn = np.array([[cosine, sine], [-sine, cosine]])
    moved = [points @ turn + place[:2] for points in (cells.centroids, cells.edges, cells.quadrature)]
    return Cells(moved[0], cells.areas, moved[1], cells.sides, moved[2])


def patch_weights(surface: SurfaceCompliance, points: Array) -> Array:
    """Share of each patch in the sheet's smooth remainder at points (n, 2), (n, patches)."""
    along_x, along_y = (spline(points[:, axis]) for axis, spline in enumerate(surface.splines))
    return (along_y[:, :, None] * along_x[:, None, :]).reshape(len(points), -1)


def mean_weights(surface: SurfaceCompliance, cells: Cells) -> Array:
    """Mean of `patch_weights` over each cell, (cells, patches)."""
    return np.mean([patch_weights(surface, points) for points in cells.quadrature.swapaxes(0, 1)], axis=0)


def full_compliance(surface: SurfaceCompliance, cells: Cells) -> Array:
    """Mean displacement per force, (3, cells, 3, cells) [m/N]: a half space, and the remainder's mean over cells."""
    integrals = HalfSpaceIntegrals(cells.edges, cells.sides)
    weights = mean_weights(surface, cells)
    smooth = np.einsum("ap,ipjq,bq->iajb", weights, surface.remainder, weights, optimize=True)
    return half_space_compliance(surface.normal_factor, surface.poisson, integrals, cells.areas) + smooth


def normal_compliance(surface: SurfaceCompliance, cells: Cells) -> Array:
    """The same of pressing alone, (cells, cells) [m/N]."""
    weights = mean_weights(surface, cells)
    distance = HalfSpaceIntegrals(cells.edges, cells.sides).inverse_distance
    half_space = surface.normal_factor * distance / np.outer(cells.areas, cells.areas)
    return half_space + weights @ surface.remainder[2, :, 2, :] @ weights.T


def pressing(compliance: Array, modes: Array, heights: Array, resultants: Array) -> Array:
    """Forces F of a rigid body that does not pull, (cells,) [N].

    The minimum of  1/2 F.C F + h.F  under  B'F = q  and  F >= 0:  C F + h - B d >= 0  is the gap that is left, and no
    cell has both. Cells change sides until none is on the wrong one (Murty's principal pivoting, in blocks).

    Args:
        compliance: C, symmetric [m/N]; of springs, diagonal.
        modes: B.
        heights: of the body above the cells before it moves [m].
        resultants: q, the forces times each mode.
    """
    pressed = heights <= heights.min() + np.ptp(heights) / 2
    for _ in range(_EXCHANGES):
        own = np.flatnonzero(pressed)
        free, zero = len(own), np.zeros((modes.shape[1],) * 2)
        system = np.block([[compliance[np.ix_(own, own)], -modes[own]], [modes[own].T, zero]])
        answer = np.linalg.lstsq(system, np.concatenate([-heights[own], resultants]), rcond=None)[0]
        forces = np.zeros(len(modes))
        forces[own] = answer[:free]
        gaps = compliance @ forces + heights - modes @ answer[free:]
        wrong = np.where(pressed, forces < 0.0, gaps < -1e-12 * np.abs(gaps).max())
        if not wrong.any():
            return forces
        pressed ^= wrong
    raise ArithmeticError("no contact was found")


def shear_modes(cells: Cells, about: Array) -> Array:
    """Displacements along x and y of sliding along x, along y, and turning about a point times the length."""
    x, y = ((cells.centroids - about) / cells.length).T
    one, zero = np.ones_like(x), np.zeros_like(x)
    return np.stack([np.column_stack([one, zero, -y]), np.column_stack([zero, one, x])])


def shear_resultants(cells: Cells, wrench: Array, about: Array) -> Array:
    """Force x, y and torsion about a point over the length [N] of a wrench about the pad's origin (6,)."""
    torsion = wrench[5] - (about[0] * wrench[1] - about[1] * wrench[0])
    return np.array([wrench[0], wrench[1], torsion / cells.length])


def proportional(cells: Cells, normal: Array, wrench: Array) -> Array:
    """Shear (2, cells) [N] in proportion to the pressure, and a turn about its centre for the torsion."""
    centre = normal @ cells.centroids / normal.sum()
    weighted = shear_modes(cells, centre) * normal[:, None]
    gram = np.einsum("aci,acj->ij", shear_modes(cells, centre), weighted)
    return np.matmul(weighted, np.linalg.solve(gram, shear_resultants(cells, wrench, centre)))


def leaning(cells: Cells, normal: Array, slopes: Array) -> Array:
    """Forces along the surface (2, cells) [N] of a body that presses along its own normals, without their resultant.

    Args:
        cells: that it presses.
        normal: forces on them, (cells,) [N].
        slopes: of the body over each cell, (cells, 2) [-].
    """
    along = normal * slopes.T
    x, y = cells.centroids.T
    torsion = float((x * along[1] - y * along[0]).sum())
    return along - proportional(cells, normal, np.array([*along.sum(axis=1), 0.0, 0.0, 0.0, torsion]))


def sticking(full: Array, cells: Cells, wrench: Array) -> Array:
    """Forces (cells, 3) [N] under a flat face that sticks everywhere: every cell moves with the body."""
    count, middle = len(cells.areas), cells.centroids.mean(axis=0)
    modes = np.zeros((3, count, 6))
    modes[:2, :, :3], modes[2, :, 3:] = shear_modes(cells, middle), -cells.modes
    tilting = np.array([wrench[4] + middle[0] * wrench[2], -wrench[3] + middle[1] * wrench[2]]) / cells.length
    resultants = np.concatenate([shear_resultants(cells, wrench, middle), [-wrench[2], *tilting]])
    flat = modes.reshape(3 * count, 6)
    system = np.block([[full.reshape(3 * count, -1), -flat], [flat.T, np.zeros((6, 6))]])
    answer: Array = np.linalg.solve(system, np.concatenate([np.zeros(3 * count), resultants])).astype(np.float64)
    return answer[: 3 * count].reshape(3, count).T


class Slip(NamedTuple):
    """How far forces are from Coulomb's law, each over the largest of its kind.

    Attributes:
        over: shear beyond friction times pressure.
        stuck: movement of cells that stick against the body.
        across: movement of cells that slip, across their shear, and along it where that would push.
        apart: movement of pressed cells against the body, normal to the surface.
    """

    over: float
    stuck: float
    across: float
    apart: float


def coulomb(
    full: Array, cells: Cells, forces: Array, heights: Array, friction: float, pressed_along: Array | None = None
) -> Slip:
    """What is left of the conditions of partial slip: |t| <= mu F, and slip only at the limit, against the shear.

    A contact that is loaded once, without history (Johnson, Contact Mechanics, 1985, section 7.2). `pressed_along`
    are the forces along the surface (2, cells) [N] that belong to the pressure; friction does not bear them.
    """
    kept = forces[:, 2] < 0.0
    moved = np.einsum("iajb,bj->ia", full, forces)
    scale = float(np.abs(moved).max())
    down = (-moved[2] + heights)[kept]
    motion = np.linalg.lstsq(cells.modes[kept], down, rcond=None)[0]
    apart = float(np.abs(cells.modes[kept] @ motion - down).max()) / scale
    shear, limit = forces[kept, :2].T, -friction * forces[kept, 2]
    if pressed_along is not None:
        shear = shear - pressed_along[:, kept]
    size = np.linalg.norm(shear, axis=0)
    holds = size < (1 - 1e-6) * limit
    modes = shear_modes(cells, cells.centroids.mean(axis=0))[:, kept]
    body = np.linalg.lstsq(modes[:, holds].reshape(-1, 3), moved[:2, kept][:, holds].ravel(), rcond=None)[0]
    slip = (modes @ body - moved[:2, kept]) / scale
    unit = shear / np.maximum(size, np.finfo(float).tiny)
    aside, along = slip[0] * unit[1] - slip[1] * unit[0], (slip * unit).sum(axis=0)
    across = np.where(holds, 0.0, np.maximum(np.abs(aside), -along))
    return Slip(
        over=float((size - limit).max() / limit.max()),
        stuck=float(np.abs(slip[:, holds]).max(initial=0.0)),
        across=float(across.max()),
        apart=apart,
    )
