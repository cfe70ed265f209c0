"""Convex quadratic programmes with non-negative unknowns, by an interior-point method.

    minimise  1/2 x.A x + g.x   under  C^T x = q,  x >= 0 on some of the unknowns.

Active sets find a contact faster, but they cycle on hard ones: a force that passes just inside the cells' hull, a
body far above most of them. This method does not. It ends near the solution, which tells the active set.
Source: Nocedal, Wright, Numerical Optimization (2006), section 16.6: Mehrotra's predictor and corrector.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.optimize

from mjtactile.pad import Array

_ITERATIONS = 100
#: Complementarity and residuals at which it ends, over the scale of the data.
_TOLERANCE = 1e-13
#: Share of the way to the nearest bound that a step may take.
_STEP_SHARE = 0.995
#: Constraints this small beside the largest say nothing.
_DEPENDENT = 1e-10
#: A curvature found indefinite is raised by this fraction of its largest eigenvalue above zero.
_FLOOR = 1e-8


def interior_point(
    quadratic: Array, linear: Array, constraints: Array, wanted: Array, bounded: npt.NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Solve the programme as far as the arithmetic goes.

    Args:
        quadratic: A, (n, n), or (n,) where it is diagonal.
        linear: g, (n,).
        constraints: C, (n, m).
        wanted: q, (m,); what dependent columns of C make unattainable of it is left out.
        bounded: which unknowns are not negative, (n,).
    Returns: x, and the multipliers of its bounds (n,), zero for free unknowns: an unknown is at its bound where x is
        the smaller of the two.
    """
    constraints, wanted = _independent(constraints, wanted)
    count = max(int(bounded.sum()), 1)
    x = np.where(bounded, 1.0 / count, 0.0)
    slope = np.abs(_times(quadratic, x) + linear)
    z = np.where(bounded, max(1.0, float(slope.max())), 0.0)
    y = np.zeros(constraints.shape[1])
    scale = max(1.0, float(np.abs(linear).max()))
    for _ in range(_ITERATIONS):
        dual = _times(quadratic, x) + linear - constraints @ y - z
        primal = constraints.T @ x - wanted
        gap = float(x[bounded] @ z[bounded]) / count
        if gap <= _TOLERANCE and max(np.abs(dual).max() / scale, np.abs(primal).max()) <= _TOLERANCE:
            break
        step = _linear_step(quadratic, constraints, x, z, bounded, (dual, primal))
        aimed = step(np.where(bounded, -x * z, 0.0))
        reach_x, reach_z = _reach(x, aimed[0], bounded), _reach(z, aimed[2], bounded)
        ahead = float(((x + reach_x * aimed[0]) * (z + reach_z * aimed[2]))[bounded].sum()) / count
        centred = gap * (max(ahead, 0.0) / gap) ** 3 if gap > 0.0 else 0.0
        dx, dy, dz = step(np.where(bounded, centred - x * z - aimed[0] * aimed[2], 0.0))
        share = _STEP_SHARE * min(_reach(x, dx, bounded, 2.0), _reach(z, dz, bounded, 2.0))
        share = min(1.0, share)
        if not np.isfinite(dx).all() or not np.isfinite(dy).all() or share < 1e-12:
            break
        x, y, z = x + share * dx, y + share * dy, z + share * dz
    return x, z


_Step = tuple[Array, Array, Array]


def _linear_step(
    quadratic: Array,
    constraints: Array,
    x: Array,
    z: Array,
    bounded: npt.NDArray[np.bool_],
    residuals: tuple[Array, Array],
) -> Callable[[Array], _Step]:
    """What steps in x, y and z solve the linearised conditions, for any wanted change of the products x z."""
    dual, primal = residuals
    safe = np.where(bounded, x, 1.0)
    solve = _solver(quadratic, np.where(bounded, z / safe, 0.0))
    per_motion = solve(constraints)
    stiffness = constraints.T @ per_motion

    def step(products: Array) -> _Step:
        free = solve(-dual + products / safe)
        dy = np.linalg.lstsq(stiffness, -primal - constraints.T @ free, rcond=None)[0]
        dx: Array = free + per_motion @ dy
        return dx, np.asarray(dy, dtype=float), np.where(bounded, (products - z * dx) / safe, 0.0)

    return step


def _solver(quadratic: Array, barrier: Array) -> Callable[[Array], Array]:
    """Product with the inverse of A plus a diagonal."""
    if quadratic.ndim == 1:
        diagonal = quadratic + barrier
        return lambda right: (right.T / diagonal).T
    # Scaled to a unit diagonal: the barrier's entries differ by many decades.
    root = 1.0 / np.sqrt(np.diagonal(quadratic) + barrier)
    scaled = quadratic * np.outer(root, root)
    np.fill_diagonal(scaled, 1.0)
    factor = scipy.linalg.cho_factor(scaled, lower=True, check_finite=False)
    return lambda right: (root * scipy.linalg.cho_solve(factor, (root * right.T).T, check_finite=False).T).T


def _times(quadratic: Array, x: Array) -> Array:
    return quadratic * x if quadratic.ndim == 1 else quadratic @ x


def _reach(values: Array, steps: Array, bounded: npt.NDArray[np.bool_], most: float = 1.0) -> float:
    """Largest share of a step, up to `most`, at which no bounded value is negative."""
    falling = bounded & (steps < 0.0)
    return min(most, float((-values[falling] / steps[falling]).min())) if falling.any() else most


def _independent(constraints: Array, wanted: Array) -> tuple[Array, Array]:
    """Orthonormal constraints that say the same."""
    basis, sizes, mixed = np.linalg.svd(constraints, full_matrices=False)
    kept = sizes > _DEPENDENT * sizes[0]
    return basis[:, kept], (mixed @ wanted)[kept] / sizes[kept]


def resting_cells(heights: Array, modes: Array, wanted: Array) -> npt.NDArray[np.bool_]:
    """Cells on which a rigid body comes to rest on a rigid surface under given resultants: a linear programme."""
    modes, wanted = _independent(modes, wanted)
    scale = max(float(np.abs(heights).max()), np.finfo(float).tiny)
    found = scipy.optimize.linprog(heights / scale, A_eq=modes.T, b_eq=wanted, bounds=(0.0, None), method="highs-ds")
    if found.x is None:
        return np.ones(len(heights), dtype=bool)
    return np.asarray(found.x) > 0.0


def positive_definite(quadratic: Array) -> Array:
    """The matrix, or where rounding or interpolation made it indefinite, that plus what makes it definite."""
    if quadratic.ndim == 1 or scipy.linalg.lapack.dpotrf(quadratic, lower=1)[1] == 0:  # type: ignore[attr-defined]
        return quadratic
    eigenvalues = scipy.linalg.eigvalsh(quadratic)
    return quadratic + (_FLOOR * eigenvalues[-1] - eigenvalues[0]) * np.eye(len(quadratic))
