"""Shear tractions under a contact: how the tangential force and the torsion spread over the pressed cells.

Friction bounds what a contact carries: over all cells, |t| <= mu F. The forces and torsions that obey this form a
convex set whose extent in any direction is known in closed form, so the nearest wrench within it is a small convex
problem (Goyal, Ruina, Papadopoulos, Wear 143, 1991: the limit surface).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from mjtactile.errors import ContactError
from mjtactile.interior import positive_definite
from mjtactile.pad import Array
from mjtactile.rigid import Motions

#: A wrench within this fraction of the limit counts as sliding.
_AT_LIMIT = 1e-9
_ITERATIONS = 60
#: Complementarity gap at which the interior-point method ends, over the energy scale.
_GAP = 1e-13
#: Gap and residuals that serve where it ends no earlier.
_SUFFICIENT = 1e-7
_STEP_SHARE = 0.995
#: From this share of the limit on, cells that still stick are few: all may as well slide.
_NEARLY_SLIDES = 0.999


@dataclass(frozen=True, eq=False)
class ShearGrip:
    """Pressed cells that carry shear, and the resultants of unit forces on them.

    Attributes:
        points: centroids of the cells (cells, 2) [m].
        normal: pressing force on each [N], (cells,).
        centre: torsion is counted about this point (x, y) [m].
        length: by which torsion is made comparable with forces [m].
    """

    points: Array
    normal: Array
    centre: Array
    length: float

    @property
    def modes(self) -> Array:
        """Displacement of each cell per rigid motion (x, y, turn times `length`), shape (2, cells, 3)."""
        x, y = (self.points - self.centre).T / self.length
        one, zero = np.ones_like(x), np.zeros_like(x)
        return np.stack([np.column_stack([one, zero, -y]), np.column_stack([zero, one, x])])

    def about_centre(self, force: Array, torsion: float) -> Array:
        """Resultants [N] of a force [N] and a torsion about the pad's origin [N m]; see `resultants`."""
        about = torsion - (self.centre[0] * force[1] - self.centre[1] * force[0])
        return np.array([force[0], force[1], about / self.length])

    def resultants(self, shear: Array) -> Array:
        """Force x, y and torsion about the centre over `length` [N], of shear forces (2, cells) [N]."""
        return np.einsum("aci,ac->i", self.modes, shear)

    def sliding(self, direction: Array, friction: float) -> Array:
        """Shear forces (2, cells) when all cells slide by one rigid motion, given by its direction (3,)."""
        motion = self.modes @ direction
        size = np.linalg.norm(motion, axis=0)
        return friction * self.normal * np.divide(motion, size, out=np.zeros_like(motion), where=size > 0.0)

    def sliding_with(self, wanted: Array, friction: float) -> Array:
        """Shear forces (2, cells) with these resultants, everywhere in the same proportion to what friction bears.

        Of all motions d with wanted.d = 1, sliding works least along the one whose resultants point the wanted way.
        """
        size = float(np.linalg.norm(wanted))
        unit = wanted / size
        aside = np.linalg.svd(unit[None, :])[2][1:].T

        def work(place: Array) -> tuple[float, Array]:
            shear = self.sliding(unit + aside @ place, friction)
            resultants = self.resultants(shear)
            return float(resultants @ (unit + aside @ place)) / size, aside.T @ resultants / size

        found = scipy.optimize.minimize(work, np.zeros(2), jac=True, method="BFGS", options={"gtol": 1e-12})
        return self.sliding(unit + aside @ found.x, friction) / max(found.fun, 1.0)

    def nearest(self, wanted: Array, friction: float) -> tuple[Array, Array | None]:
        """The nearest resultants friction can carry, and the shear of full sliding there; None within the limit."""
        size = float(np.linalg.norm(wanted))
        limit = friction * self.normal.sum()
        if size == 0.0:
            return wanted, None
        if limit == 0.0:
            return np.zeros(3), np.zeros((2, len(self.normal)))
        held = np.linalg.norm(proportional_shear(self, wanted), axis=0)
        if (held <= friction * self.normal).all():
            return wanted, None

        def shortfall(direction: Array) -> float:
            # How far the set lies behind the wanted wrench, seen along a direction: convex in it.
            reach = friction * (self.normal @ np.linalg.norm(self.modes @ direction, axis=0))
            return float(reach - wanted @ direction) / limit

        def slope(direction: Array) -> Array:
            return (self.resultants(self.sliding(direction, friction)) - wanted) / limit

        start = wanted / size
        found = scipy.optimize.minimize(
            shortfall,
            start,
            jac=slope,
            method="SLSQP",
            constraints={"type": "ineq", "fun": lambda d: 1.0 - d @ d, "jac": lambda d: -2 * d},
            options={"maxiter": 200, "ftol": 1e-15},
        )
        direction = found.x / max(float(np.linalg.norm(found.x)), 1e-300)
        if shortfall(direction) >= -_AT_LIMIT:
            return wanted, None
        shear = self.sliding(direction, friction)
        return self.resultants(shear), shear


def proportional_shear(grip: ShearGrip, wanted: Array) -> Array:
    """Shear everywhere proportional to the pressure, as in sliding, plus a turn about the centre of pressure.

    Args:
        grip: pressed cells.
        wanted: resultants [N], see `ShearGrip.resultants`.
    Returns: shear forces (2, cells) [N].
    """
    weighted = grip.modes * grip.normal[:, None]
    gram = np.einsum("aci,acj->ij", grip.modes, weighted)
    return weighted @ np.linalg.lstsq(gram, wanted, rcond=1e-13)[0]


def coulomb_shear(compliance: Array, grip: ShearGrip, slip: Array, wanted: Array, friction: float) -> Array:
    """Shear of a contact that sticks where it can and slips where |t| reaches mu F.

    Minimises  1/2 t.C t + slip.t  under the resultants and |t| <= mu F on each cell, by a primal-dual interior-point
    method (Nocedal, Wright, Numerical Optimization, 2006, chapter 19). The minimum is the law of a surface loaded
    once, without history.

    Args:
        compliance: tangential, (2, cells, 2, cells) [m/N].
        grip: pressed cells.
        slip: tangential displacement of the cells that the pressure alone brings, (2, cells) [m].
        wanted: resultants [N], within what friction can carry.
        friction: coefficient.
    Returns: shear forces (2, cells) [N].

    Raises:
        ContactError: when the iteration does not converge.
    """
    cells = len(grip.normal)
    bound = friction * grip.normal
    unit = float(bound.mean())
    give = float(np.einsum("acac->", compliance)) / (2 * cells)
    Q = positive_definite(compliance.reshape(2 * cells, 2 * cells) / give)
    load, motions = slip.reshape(-1) / (give * unit), Motions.of(grip.modes.reshape(2 * cells, 3))
    E, radius, mixed = motions.modes, bound / unit, motions.to_mixed @ wanted / unit
    t = _interior_shear(Q, load, E, radius, mixed, np.zeros(2 * cells))
    if t is None:
        # Close to sliding: begin with what slides, a little less of it.
        sliding = grip.sliding_with(wanted, friction) / unit
        t = _interior_shear(Q, load, E, radius, mixed, sliding.reshape(-1))
        if t is None and np.linalg.norm(sliding, axis=0).sum() >= _NEARLY_SLIDES * radius.sum():
            t = sliding.reshape(-1)
    if t is None:
        raise ContactError("the partial slip did not converge. Use tangential='proportional', or a larger friction.")
    return t.reshape(2, cells) * unit


def _interior_shear(Q: Array, load: Array, E: Array, radius: Array, wanted: Array, start: Array) -> Array | None:
    """Shear of `coulomb_shear`, in units of a cell's own give and of the mean bound; None if it does not converge."""
    cells = len(radius)
    t, motion = start, np.zeros(E.shape[1])
    slack = 0.5 * (radius**2 - (t.reshape(2, cells) ** 2).sum(axis=0))
    multiplier = max(1.0, float(np.abs(load).max())) * 0.5 * radius / slack
    gap = error = np.inf
    for _ in range(_ITERATIONS):
        slack = 0.5 * (radius**2 - (t.reshape(2, cells) ** 2).sum(axis=0))
        dual = Q @ t + load + np.tile(multiplier, 2) * t - E @ motion
        primal = E.T @ t - wanted
        gap = float(multiplier @ slack) / cells
        if gap < _GAP and max(np.abs(dual).max(), np.abs(primal).max()) < 1e-10 * max(1.0, np.abs(load).max()):
            return t
        if slack.min() <= 0.0:
            break  # rounding
        centred = (0.1 if gap > 1e-6 else 0.01) * gap
        t, motion, multiplier = _newton_step(Q, E, (t, motion, multiplier), slack, (dual, primal), centred, radius)
        error = max(np.abs(dual).max(), np.abs(primal).max()) / max(1.0, np.abs(load).max())
    return t if gap < _SUFFICIENT and error < _SUFFICIENT else None


def bonded_shear(compliance: Array, grip: ShearGrip, slip: Array, wanted: Array) -> Array:
    """Shear of cells that do not slip at all, under a pressure that is known; arguments as in `coulomb_shear`."""
    cells = len(grip.normal)
    give = float(np.einsum("acac->", compliance)) / (2 * cells)
    factor = scipy.linalg.cho_factor(positive_definite(compliance.reshape(2 * cells, 2 * cells) / give), lower=True)
    motions = Motions.of(grip.modes.reshape(2 * cells, 3))
    held = scipy.linalg.cho_solve(factor, slip.reshape(-1) / give)
    per_motion = scipy.linalg.cho_solve(factor, motions.modes)
    stiffness = motions.modes.T @ per_motion
    motion = np.linalg.solve(stiffness, motions.to_mixed @ wanted + motions.modes.T @ held)
    return (per_motion @ motion - held).reshape(2, cells)


def _newton_step(
    Q: Array,
    E: Array,
    point: tuple[Array, Array, Array],
    slack: Array,
    residuals: tuple[Array, Array],
    target: float,
    radius: Array,
) -> tuple[Array, Array, Array]:
    """One damped step towards multiplier * slack = target, staying inside all discs."""
    t, motion, multiplier = point
    dual, primal = residuals
    cells = len(multiplier)
    tx, ty = t[:cells], t[cells:]
    ratio, push = multiplier / slack, (target - multiplier * slack) / slack
    H = Q.copy()
    places = np.arange(cells)
    H[places, places] += multiplier + ratio * tx**2
    H[cells + places, cells + places] += multiplier + ratio * ty**2
    H[places, cells + places] += ratio * tx * ty
    H[cells + places, places] += ratio * tx * ty
    factor = scipy.linalg.cho_factor(H, lower=True, check_finite=False)
    # slack falls by t.dt, so the multiplier changes by push + ratio t.dt
    right = -dual - t * np.tile(push, 2)
    free, per_motion = np.hsplit(scipy.linalg.cho_solve(factor, np.column_stack([right, E]), check_finite=False), [1])
    # Cells in one place, or very far apart in stiffness, leave a motion open.
    d_motion = np.linalg.lstsq(E.T @ per_motion, -primal - E.T @ free[:, 0], rcond=None)[0]
    dt = (free[:, 0] + per_motion @ d_motion).astype(np.float64)
    d_multiplier = push + ratio * (tx * dt[:cells] + ty * dt[cells:])
    share = _share_inside(tx, ty, dt[:cells], dt[cells:], radius)
    falling = d_multiplier < 0.0
    if falling.any():
        share = min(share, _STEP_SHARE * float((-multiplier[falling] / d_multiplier[falling]).min()))
    return t + share * dt, motion + share * d_motion, multiplier + share * d_multiplier


def _share_inside(tx: Array, ty: Array, dx: Array, dy: Array, radius: Array) -> float:
    """Largest share of a step, up to 1, that leaves every cell well inside its disc."""
    a, b, c = dx**2 + dy**2, tx * dx + ty * dy, tx**2 + ty**2 - radius**2
    moving = a > 0.0
    reach = (-b[moving] + np.sqrt(np.maximum(b[moving] ** 2 - a[moving] * c[moving], 0.0))) / a[moving]
    return min(1.0, _STEP_SHARE * float(reach.min())) if moving.any() else 1.0
