"""Sample points of a reading: cubature of a ball, cut by the sheet's faces and by layer interfaces.

A reading is the mean von Mises stress over a ball around the taxel, clipped to the sheet. The stress jumps at
interfaces between layers of different stiffness, so the ball is cut there and each piece has its own rule.

Each piece is integrated one coordinate after the other. For example, along z the weight is the area of the slice, along
y the length of the chord, along x it is constant. The Gauss rule of each weight function is computed, so that n points
per axis integrate polynomials of degree 2n - 1 exactly over whole balls, and over balls cut along one axis, which is
then integrated last so that all slices are whole discs. Over other pieces the rule is nearly exact. Two points per axis
on a whole ball are the corners of a cube at the radius sqrt(3/5) R.

Under a curved surface a ball's axes are those of the offset surface at its centre. The faces that cut it are offset
surfaces: the rule for planes is mapped onto them, to the first order of the ball's radius over that of curvature.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.sparse as sparse

from mjtactile._types import Array, Indices, Tables
from mjtactile.errors import CorruptInfluenceError
from mjtactile.fem.symmetry import FoldedPoints, MirrorPlanes, fold_points
from mjtactile.pad import LENGTH_TOLERANCE, Pad
from mjtactile.pad_shape.taxels import FreeTaxels

#: Nodes of the auxiliary rules for slices and chords; more than double precision needs.
_FINE_ORDER = 96
#: Tolerance on the sum of a taxel's weights, which is 1 [-].
_MEAN_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Sampling:
    """The sample points of one sensing layer, folded onto a quarter of the sheet."""

    positions: Array  #: distinct folded positions in the pad frame [m], x and y not negative, shape (folded points, 3)
    #: Matrix (taxels, images * folded points) whose rows average a taxel's points; each row sums to 1.
    average: sparse.csr_array


@lru_cache(maxsize=64)
def layer_sampling(pad: Pad, sensing_layer: int, points_per_axis: int) -> Sampling:
    """Sample points of all taxels of one sensing layer; cached, since every step of a build needs them.

    Args:
        pad: the sheet, its taxels and their sampling radius.
        sensing_layer: counted from the top.
        points_per_axis: Gauss points along each axis of each piece of a taxel's ball; 1 is the piece's centroid.
    """
    positions, weights, taxels = [], [], []
    rule = _taxel_rule if pad.surface.is_flat else _curved_taxel_rule
    feet, centres = pad.taxel_feet(sensing_layer), pad.taxel_points(sensing_layer)
    for taxel, (foot, centre, radius) in enumerate(zip(feet, centres, ball_radii(pad, len(feet)), strict=True)):
        offsets, volumes = rule(pad, foot, float(radius), points_per_axis)
        positions.append(offsets + centre)
        weights.append(volumes / volumes.sum())
        taxels.append(np.full(len(volumes), taxel))
    return folded_sampling(pad, np.concatenate(positions), np.concatenate(weights), np.concatenate(taxels))[0]


def folded_sampling(pad: Pad, positions: Array, weights: Array, taxels: Indices) -> tuple[Sampling, FoldedPoints]:
    """Sampling of one sensing layer from its sample points, and these points folded by the pad's mirrors.

    Args:
        pad: the sheet.
        positions: of the points in the pad frame [m], (points, 3).
        weights: of each point in its taxel's mean [-], (points,); those of a taxel sum to 1.
        taxels: index of each point's taxel, (points,); every taxel has at least one point.
    """
    mirrors = MirrorPlanes(*pad.surface.mirrors)
    folded = fold_points(positions, LENGTH_TOLERANCE * pad.sampling_radius, mirrors)
    columns = folded.image * len(folded.positions) + folded.index
    shape = (int(taxels.max(initial=-1)) + 1, len(mirrors.images) * len(folded.positions))
    return Sampling(folded.positions, sparse.csr_array((weights, (taxels, columns)), shape=shape)), folded


def sampling_tables(sampling: Sampling, sensing_layer: int) -> Tables:
    """Sample points and averaging matrix of a sensing layer as named arrays, stored with the influence matrices."""
    average = sampling.average
    arrays = {"data": average.data, "indices": average.indices, "indptr": average.indptr, "points": sampling.positions}
    return {f"sampling {name} {sensing_layer}": array for name, array in arrays.items()}


def stored_average(tables: Tables, sensing_layer: int, mirrors: MirrorPlanes) -> sparse.csr_array:
    """The averaging matrix of a sensing layer from `sampling_tables`, see `Sampling.average`.

    Raises:
        CorruptInfluenceError: an index is out of range, or the weights of a taxel do not sum to 1.
    """
    data, indices, starts, points = (
        tables[f"sampling {name} {sensing_layer}"] for name in ("data", "indices", "indptr", "points")
    )
    columns = len(mirrors.images) * len(points)
    # The compiled core does not check these indices.
    if not (
        starts[0] == 0
        and starts[-1] == len(indices) == len(data)
        and (np.diff(starts) > 0).all()
        and indices.min() >= 0
        and indices.max() < columns
    ):
        raise CorruptInfluenceError(
            f"the sample points of sensing layer {sensing_layer} are damaged: expected at least one of the {columns} "
            "stored points for every taxel, and no others. Build the table anew: mjtactile build"
        )
    average = sparse.csr_array((data, indices, starts), shape=(len(starts) - 1, columns))
    if not np.allclose(average.sum(axis=1), 1.0, rtol=0.0, atol=_MEAN_TOLERANCE):
        raise CorruptInfluenceError(
            f"the weights of the sample points of sensing layer {sensing_layer} do not sum to 1 in every taxel. Build "
            "the table anew: mjtactile build"
        )
    return average


def ball_radii(pad: Pad, taxels: int) -> Array:
    """Radii of the balls of the taxels of a sensing layer [m], (taxels,)."""
    if isinstance(pad.taxels, FreeTaxels):
        return np.array(pad.sensed_radii)
    return np.full(taxels, pad.sampling_radius)


def _taxel_rule(pad: Pad, foot: Array, radius: float, points_per_axis: int) -> tuple[Array, Array]:
    """Offsets from a taxel at (x, y, depth) [m], and volumes [m^3], of its sample points."""
    half_size, height = np.array(pad.size) / 2, -foot[2]
    lower = np.maximum(-half_size - foot[:2], -radius)
    upper = np.minimum(half_size - foot[:2], radius)
    pieces = []
    for bottom, top in _slabs(pad, height, radius):
        box = (*lower, bottom - height, *upper, top - height)
        # Rounding lets mirror images of a taxel, and other equal taxels, share one cached rule.
        pieces.append(_ball_rule(points_per_axis, tuple(round(bound / radius, 12) for bound in box)))
    offsets, volumes = zip(*pieces, strict=True)
    return np.concatenate(offsets) * radius, np.concatenate(volumes) * radius**3


def _curved_taxel_rule(pad: Pad, foot: Array, radius: float, points_per_axis: int) -> tuple[Array, Array]:
    """Offsets [m] and volumes [m^3] as in `_taxel_rule`, for a taxel under a curved surface."""
    height = -foot[2]
    slabs = _slabs(pad, height, radius)
    axes, bending, lower, upper = _local_frame(pad, foot, radius)
    cut = len(slabs) > 1 or slabs[0][1] - slabs[0][0] < 2 * radius or max(*lower, *-upper) > -radius
    points, volumes = [], []
    for bottom, top in slabs:
        box = (*lower, bottom - height, *upper, top - height)
        local, shares = _ball_rule(points_per_axis, tuple(round(float(bound) / radius, 12) for bound in box))
        local, shares = local * radius, shares * radius**3
        if cut:
            local, shares = _bent(local, shares, bending)
        offsets = local @ axes
        points.append(_kept_inside(pad, foot, offsets, (bottom, top)) if cut else offsets)
        volumes.append(shares)
    return np.concatenate(points), np.concatenate(volumes)


def _local_frame(pad: Pad, foot: Array, radius: float) -> tuple[Array, Array, Array, Array]:
    """Axes and bounds of a ball under a curved surface.

    Returns:
        Axes as rows (3, 3): two tangents and the normal; derivative of the normal along the tangents (2, 2) [1/m]; and
        lower and upper bounds along the tangents (2,) [m], set by the pad's sides or the ball.
    """
    along = pad.surface.derivatives(*foot)
    turning = pad.surface.derivatives(foot[0], foot[1], 0.0) - pad.surface.derivatives(foot[0], foot[1], 1.0)
    normal = -along[:, 2]
    # Gradients of x and of y in the tangent plane: unit vectors and magnitudes.
    tangential = along[:, :2]
    rates = np.linalg.solve(tangential.T @ tangential, tangential.T).astype(np.float64)
    speeds = np.sqrt(np.einsum("ij,ij->i", rates, rates))
    half_size = np.array(pad.size) / 2
    lower = np.maximum((-half_size - foot[:2]) / speeds, -radius)
    upper = np.minimum((half_size - foot[:2]) / speeds, radius)
    cut = np.maximum(lower, -upper) > -radius  # by the sides that bound the pad along x, and along y
    if cut[1] and not cut[0]:
        second = rates[1] / speeds[1]
        first = np.asarray(np.cross(second, normal), dtype=np.float64)
    else:
        first = rates[0] / speeds[0]
        second = np.asarray(np.cross(normal, first), dtype=np.float64)
    if cut[0] == cut[1]:  # neither side or both: a taxel turned with the surface gets axes turned with it
        axis = pad.surface.frames(foot[0], foot[1])[0]
        cosine, sine = np.array([first @ axis, second @ axis]) / np.hypot(first @ axis, second @ axis)
        first, second = cosine * first + sine * second, cosine * second - sine * first
    tangents = np.stack([first, second])
    bending = tangents @ turning[:, :2] @ rates @ tangents.T
    return np.stack([first, second, normal]), (bending + bending.T) / 2, lower, upper


def _bent(local: Array, shares: Array, bending: Array) -> tuple[Array, Array]:
    """Map a rule for a ball cut by planes to a ball cut by offset surfaces.

    In coordinates in which offset surfaces are planes, c' = c + a S a / 2, the ball a^2 + c^2 <= R^2 becomes, to the
    first order, a (1 - c' S) a + c'^2 <= R^2: its slices are ellipses.
    """
    height = local[:, 2]
    stretch = np.eye(2) + height[:, None, None] / 2 * bending
    flat = np.einsum("pij,pj->pi", stretch, local[:, :2])
    sunk = height - np.einsum("pi,ij,pj->p", flat, bending, flat) / 2
    return np.column_stack([flat, sunk]), shares * np.linalg.det(stretch)


def _kept_inside(pad: Pad, foot: Array, offsets: Array, slab: tuple[float, float]) -> Array:
    """Offsets with points moved back into their layer and the pad where the first-order map left them outside."""
    centre = pad.surface.positions(*foot)
    feet, _ = pad.feet(offsets + centre)
    half_size, margin = np.array(pad.size) / 2, 10 * LENGTH_TOLERANCE * pad.thickness
    feet[:, :2] = np.clip(feet[:, :2], -half_size, half_size)
    feet[:, 2] = np.clip(feet[:, 2], -slab[1] + margin, -slab[0] - margin)
    return pad.surface.positions(*feet.T) - centre


def _slabs(pad: Pad, height: float, radius: float) -> list[tuple[float, float]]:
    """Parts (bottom, top) [m] of a ball's vertical extent, one for each layer that it overlaps."""
    bottom, top = max(height - radius, -pad.thickness), min(height + radius, 0.0)
    tolerance = LENGTH_TOLERANCE * pad.thickness
    cuts = [z for z in pad.interfaces if bottom + tolerance < z < top - tolerance]
    edges = [bottom, *reversed(cuts), top]
    return list(itertools.pairwise(edges))


@lru_cache(maxsize=512)
def _ball_rule(count: int, box: tuple[float, ...]) -> tuple[Array, Array]:
    """Gauss points (points, 3) and volumes (points,) of the unit ball cut by a box, `count` points per axis.

    The box is (least x, y, z, largest x, y, z).

    Axes along which the ball is cut are integrated last. A ball cut along both x and y gets the mean of the rules of
    both orders, so that swapping x and y maps rules onto rules.
    """
    low, high = np.array(box[:3]), np.array(box[3:])
    cut = (low > -1.0) | (high < 1.0)
    order = sorted((2, 1, 0), key=lambda axis: not cut[axis])
    orders = [order, [(1, 0, 2)[axis] for axis in order]] if cut[0] and cut[1] else [order]
    points, volumes = [], []
    for outer_first in orders:
        axes = outer_first[::-1]
        ordered, shares = _ordered_ball_rule(count, low[axes], high[axes])
        points.append(ordered[:, np.argsort(axes)])
        volumes.append(shares / len(orders))
    return np.concatenate(points), np.concatenate(volumes)


def _ordered_ball_rule(count: int, low: Array, high: Array) -> tuple[Array, Array]:
    """The rule that slices across z, then y, of the ball cut by a box between two corners, (3,) each."""
    (x_low, y_low, z_low), (x_high, y_high, z_high) = low, high

    def chord(half_length: Array) -> Array:
        return np.clip(np.minimum(half_length, x_high) - np.maximum(-half_length, x_low), 0.0, None)

    def slice_area(z: Array) -> Array:
        return np.array([_slice_measure(float(r)) for r in np.sqrt(np.clip(1 - z**2, 0.0, None))])

    def _slice_measure(r: float) -> float:
        y, weights = _fine_rule(max(-r, y_low), min(r, y_high), r)
        return float(weights @ chord(np.sqrt(np.clip(r**2 - y**2, 0.0, None))))

    points, volumes = [], []
    legendre, legendre_weights = _legendre_rule(count)
    for z, area in zip(*_gauss_rule(slice_area, max(-1.0, z_low), min(1.0, z_high), 1.0, count), strict=True):
        r = float(np.sqrt(1 - z**2))
        length_at = lambda y, r=r: chord(np.sqrt(np.clip(r**2 - y**2, 0.0, None)))  # noqa: E731
        y_nodes, y_weights = _gauss_rule(length_at, max(-r, y_low), min(r, y_high), r, count)
        for y, share in zip(y_nodes, y_weights / y_weights.sum(), strict=True):
            q = np.sqrt(r**2 - y**2)
            start, end = max(-q, x_low), min(q, x_high)
            for x, x_share in zip(legendre, legendre_weights / 2, strict=True):
                points.append(((start + end) / 2 + (end - start) / 2 * x, y, z))
                volumes.append(area * share * x_share)
    return np.array(points), np.array(volumes)


@lru_cache(maxsize=16)
def _legendre_rule(order: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(order)


def _fine_rule(low: float, high: float, radius: float) -> tuple[Array, Array]:
    """Nodes and weights on [low, high] for functions like sqrt(radius^2 - y^2): a Gauss rule in the angle."""
    if high <= low or radius == 0.0:
        return np.zeros(1), np.zeros(1)
    nodes, weights = _legendre_rule(_FINE_ORDER)
    start, end = np.arcsin(np.clip([low / radius, high / radius], -1.0, 1.0))
    angle = (start + end) / 2 + (end - start) / 2 * nodes
    return radius * np.sin(angle), (end - start) / 2 * weights * radius * np.cos(angle)


def _gauss_rule(
    density: Callable[[Array], Array], low: float, high: float, radius: float, count: int
) -> tuple[Array, Array]:
    """Gauss rule of a weight function on [low, high], by Stieltjes' procedure and the Jacobi matrix.

    Source: Golub and Welsch, Calculation of Gauss quadrature rules, Math. Comp. 23 (1969).
    """
    x, weights = _fine_rule(low, high, radius)
    weights = weights * density(x)
    diagonal, off_diagonal = [], []
    previous, current, last_norm = np.zeros_like(x), np.ones_like(x), 0.0
    for k in range(count):
        norm = float(weights @ current**2)
        diagonal.append(float(weights @ (x * current**2)) / norm)
        beta = norm / last_norm if k else 0.0
        off_diagonal.append(np.sqrt(beta))
        previous, current, last_norm = current, (x - diagonal[-1]) * current - beta * previous, norm
    jacobi = np.diag(diagonal) + np.diag(off_diagonal[1:], 1) + np.diag(off_diagonal[1:], -1)
    nodes, vectors = np.linalg.eigh(jacobi)
    return nodes, vectors[0] ** 2 * weights.sum()
