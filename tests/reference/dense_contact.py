"""Contacts of rigid bodies of any shape on a pad, solved on some 2,500 equal rectangles: slow, plain, and independent.

This is what the package's contact laws are measured against, so nothing of their search, cells or solvers is used here.
The physics is law "elastic" with shear "proportional", and pressure along the body's normals. With forces F on the
cells, pressing counted positive, the cells sink by A F and the body moves down by M d, one motion (or with tilt three)
per body. The contact is the minimum of

    1/2 F.A F + h.F    with  0 <= F <= capacity  and  M^T F = the bodies' forces and first moments,

where h are the heights of the bodies over the cells. Where the contact lies is found by levels: a coarse lattice over
all that a body covers, then again and again a finer one over the cells that are pressed and their neighbours.

SI units; pad frame: z out of the pad, pressing is force z < 0.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dense_cells import SIEVE, Cells, Heights, Lattice, among, cells_over, covered_box, division, rotation
from dense_minimum import ROUNDING, Problem, active_set, conditions, interior_point
from dense_surface import compliance, nodal_forces, sinking
from shapely import Polygon

from mjtactile._types import Array, Indices, Mask
from mjtactile.contact.cells.compliance import SurfaceCompliance, surface_compliance
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad

#: Cells of the first lattice of a body.
FIRST_CELLS = 625
#: Levels, and rounds in which cells are added to one because the contact reaches further.
LEVELS, ROUNDS = 16, 8
#: Narrowest cell that is cut, over the root of the sheet's area.
NARROWEST = 3e-5
#: Contacts this many times as long as wide have cells along them, after at most so many looks at which way they lie.
ELONGATED, TURNS = 4.0, 4
#: The line of the force passes at least this far inside of what can carry it, over the root of the covered area.
INSIDE = 1e-3
#: Steepest lean [-].
MOST_LEAN = 0.5
#: With a bound on pressure, shear from torsion is at most the pressure, or this many times the shear from sliding if
#: that is more. What exceeds this is not carried.
TWIST_OVER_SLIDING = 1.5
#: Conditions of the solution hold to this, over the largest force and the deepest sinking.
ACCEPTED = 1e-7


class DenseContactError(RuntimeError):
    """No contact was found that meets its conditions, or the bodies do not fit the pad."""


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body that presses on the pad.

    Attributes:
        heights: of its lower surface.
        force: on the pad [N], shape (3,), force[2] < 0.
        moment: about the pad's origin [N m], shape (3,).
        name: for messages.
    """

    heights: Heights
    force: Array
    moment: Array
    name: str = "body"


@dataclass(frozen=True, eq=False)
class BodyContact:
    """What one body does to the pad.

    Attributes:
        cells: that it may press on.
        forces: of the body on each cell, pad frame, (n, 3) [N].
        leaning: forces along the surface because the body presses along its own normals, without resultant, (n, 2) [N].
        gaps: between body and surface [m], (n,); 0 where it presses, negative where pressure is at its bound.
        motion: down at the pad's origin [m], and its slopes along x and y [-], (3,).
        through: point (x, y) the pressing force passes through [m].
    """

    cells: Cells
    forces: Array
    leaning: Array
    gaps: Array
    motion: Array
    through: Array

    @property
    def pressures(self) -> Array:
        """On each cell [Pa], (n,)."""
        return -self.forces[:, 2] / self.cells.area

    @property
    def centroids(self) -> Array:
        """Middles of the cells (n, 2) [m]."""
        return self.cells.centres

    @property
    def pressed_area(self) -> float:
        """[m^2]."""
        return self.cells.area * int((self.forces[:, 2] < 0.0).sum())


@dataclass(frozen=True, eq=False)
class DenseContact:
    """A solved contact.

    Attributes:
        readings: (layers, rows, columns) [Pa].
        nodal: forces on the surface's nodes, (nodes y, nodes x, 3) [N].
        wrench: that they carry: force [N] and moment about the pad's origin [N m], (6,).
        left: the bodies' wrenches minus that [N, N m], (6,).
        bodies: in the order given.
        violations: of pressure >= 0, gap >= 0, one of them 0, and of the resultants, each over its scale.
    """

    readings: Array
    nodal: Array
    wrench: Array
    left: Array
    bodies: list[BodyContact]
    violations: dict[str, float]

    @property
    def pressed_area(self) -> float:
        """[m^2]."""
        return sum(body.pressed_area for body in self.bodies)


def dense_readings(
    influence: InfluenceMatrices,
    bodies: Sequence[Body],
    *,
    cells: int = 2500,
    tilting: bool = True,
    cap: float | None = None,
) -> DenseContact:
    """Press bodies on a pad, all at once, and read it.

    Args:
        influence: of the pad.
        bodies: at least one.
        cells: that lie near each body's contact; with many bodies fewer, 5,000 in all.
        tilting: whether the bodies tilt until their moments are the given ones; else they keep their orientation.
        cap: largest pressure of what does not slide [Pa], which bounds shear from torsion as well; None for no bound.

    Raises:
        DenseContactError: a body does not press or is not over the sheet, its force is more than `cap` times what it
            covers, or the conditions of the contact are not met.
    """
    for body in bodies:
        if not body.force[2] < 0.0:
            raise DenseContactError(f"{body.name} does not press: its force z is {body.force[2]} N. Leave it out.")
    surface = surface_compliance(influence)
    near = [_Near(body, influence.surface) for body in bodies]
    wanted = min(cells, 2 * cells // max(len(bodies), 1))
    pressing = Pressing(surface, bodies, tilting, np.inf if cap is None else cap)
    solved = pressing.solve([one.cells() for one in near], None)
    for _ in range(LEVELS):
        turned = [one.turned(part) for one, part in zip(near, solved, strict=True)]
        if any(turned):
            solved = pressing.solve([one.cells() for one in near], None)
            continue
        finer = [one.finer(part, wanted) for one, part in zip(near, solved, strict=True)]
        if not any(finer):
            break
        solved = _complete(pressing, near, solved)
    sheet = influence.surface.sheet.bounds
    kept = [_counted(part.cells, np.array(sheet)) for part in solved]
    if not all(one is part.cells for one, part in zip(kept, solved, strict=True)):
        solved = pressing.solve(kept, solved)
    return _read(influence, pressing, solved)


def _counted(cells: Cells, sheet: Array) -> Cells:
    """The cells of which a body covers the half and that lie on the sheet; all of them if there are none."""
    corners = cells.lattice.points(cells.index[:, None], np.array([[0, 0], [1, 0], [1, 1], [0, 1]]))
    slack = 1e-9 * cells.lattice.size.min()
    inside = ((corners >= sheet[:2] - slack) & (corners <= sheet[2:] + slack)).all(axis=(1, 2))
    chosen = (cells.share >= 0.5) & inside
    return cells if chosen.all() or not chosen.any() else cells.chosen(chosen)


def _complete(pressing: Pressing, near: list[_Near], solved: list[BodyContact]) -> list[BodyContact]:
    """Solve on the bodies' cells, and on more of them until the contact is surely within."""
    for _ in range(ROUNDS):
        solved = pressing.solve([one.cells() for one in near], solved)
        grown = []
        for one, part in zip(near, solved, strict=True):
            points = one.suspects(part)
            sunk = sum(sinking(pressing.surface, other.cells, -other.forces[:, 2], points) for other in solved)
            grown.append(one.grown(part, points, np.asarray(sunk)))
        if not any(grown):
            return solved
    raise DenseContactError("the contact kept growing beyond its cells. Does a body's height jump everywhere?")


class _Near:
    """Where one body may touch: the cells of its present lattice, and points that tell where it would cut in besides.

    Args:
        body: pressed.
        sheet: its surface.
    """

    def __init__(self, body: Body, sheet: SurfaceGrid) -> None:
        self.body, self._turns = body, TURNS
        self._sheet = np.array(sheet.sheet.bounds)
        low, high = self._sheet[:2], self._sheet[2:]
        self._narrowest = NARROWEST * float(np.sqrt((high - low).prod()))
        places = (np.arange(SIEVE) + 0.5) / SIEVE
        x, y = np.meshgrid(*(low[axis] + places * (high - low)[axis] for axis in (0, 1)))
        heights = body.heights(x.ravel(), y.ravel())
        found = np.isfinite(heights)
        if not found.any():
            raise DenseContactError(f"{body.name} is not over the sheet, or too small to be seen at {SIEVE} points.")
        self.points, self.heights = np.column_stack([x.ravel(), y.ravel()])[found], heights[found]
        self._begin(*covered_box(body.heights, self.points, low, high), 0.0)

    def _begin(self, low: Array, high: Array, angle: float) -> None:
        """Cover a box, given by its corners along turned axes, with the first lattice."""
        width, height = high - low
        columns = max(1, round(float(np.sqrt(FIRST_CELLS * width / height))))
        rows = max(1, round(FIRST_CELLS / columns))
        self.lattice = Lattice(low, (high - low) / (columns, rows), (columns, rows), angle)
        across, along = np.meshgrid(np.arange(columns), np.arange(rows))
        #: Cells of the level before, each cut into `parts`.
        self.coarse: Indices = np.column_stack([across.ravel(), along.ravel()])
        self.parts = (1, 1)
        self._cells: Cells | None = None

    def turned(self, part: BodyContact) -> bool:
        """Begin anew with a lattice along the contact, if that is long and lies otherwise than the present one."""
        lattice, pressed = self.lattice, part.forces[:, 2] < 0.0
        if self._turns == 0 or pressed.sum() < 6:
            return False
        places = lattice.turned(part.centroids[pressed])
        values, vectors = np.linalg.eigh(np.cov(places.T) + np.diag(lattice.size**2 / 12))
        along = vectors[:, 1] if abs(vectors[0, 1]) >= abs(vectors[1, 1]) else np.array([vectors[1, 1], -vectors[0, 1]])
        turn, length = float(np.arctan(along[1] / along[0])), float(np.sqrt(12 * values[1]))
        if values[1] < ELONGATED**2 * values[0] or abs(turn) * length < lattice.size.min() / 2:
            return False
        self._turns -= 1
        angle = lattice.angle + turn
        spread = self.points @ rotation(angle)
        step = np.ptp(self._sheet.reshape(2, 2), axis=0).max() / SIEVE
        self._begin(spread.min(axis=0) - step, spread.max(axis=0) + step, angle)
        return True

    def _heights(self, x: Array, y: Array) -> Array:
        """Of the body over the sheet."""
        west, south, east, north = self._sheet
        heights, edge = np.full(len(x), np.inf), 1e-9 * (east - west)
        on = (x >= west - edge) & (x <= east + edge) & (y >= south - edge) & (y <= north + edge)
        if on.any():
            heights[on] = self.body.heights(x[on], y[on])
        return heights

    def cells(self) -> Cells:
        """The present cells, those that the body does not cover left out."""
        if self._cells is None:
            offsets = np.stack(np.meshgrid(*(np.arange(count) for count in self.parts)), axis=-1).reshape(-1, 2)
            index = (self.coarse[:, None] * self.parts + offsets).reshape(-1, 2)
            self._cells = cells_over(self._heights, self.lattice, index)
        if not len(self._cells.index):
            raise DenseContactError(f"{self.body.name} covers no cell. Its heights are infinite nearly everywhere.")
        return self._cells

    def finer(self, part: BodyContact, wanted: int) -> bool:
        """Go on to a finer lattice round what is pressed; False where it is as fine as it will be."""
        pressed = part.cells.index[part.forces[:, 2] < 0.0]
        region = self.lattice.around(pressed)
        most = min(1.6 * wanted / len(region), 1.1 * wanted / len(pressed))
        parts = division(region, self.lattice.size, wanted, max(1, int(most)), self._narrowest)
        if parts == (1, 1):
            return False
        self.coarse, self.parts, self._cells = region, parts, None
        self.lattice = self.lattice.divided(parts)
        return True

    def suspects(self, part: BodyContact) -> Array:
        """Points off the cells where the body is below, or hardly above, the surface as it was, (n, 2) [m]."""
        depth = self._depth(part, self.points) - self.heights
        deepest = max(float(depth.max()), 0.0)
        near = depth > -0.05 * deepest
        return self.points[near][~among(self.lattice.holding(self.points[near]), part.cells.index)]

    def grown(self, part: BodyContact, points: Array, sunk: Array) -> bool:
        """Add cells where the body would cut in, and beside pressed ones at the rim; False where there are none.

        Args:
            part: the contact.
            points: suspects, (n, 2) [m].
            sunk: how far the surface sinks there [m], (n,).
        """
        overlap = self._depth(part, points) - self.body.heights(points[:, 0], points[:, 1]) - sunk
        pressed = part.forces[:, 2] < 0.0
        deepest = float((self._depth(part, part.centroids) - part.cells.heights)[pressed].max())
        # Points are looked at, but cells are solved for: what their heights differ by is no cut.
        missing = self.lattice.holding(points[overlap > max(1e-2 * deepest, part.cells.rough[pressed].max())])
        rim = self.lattice.around(part.cells.index[pressed])
        rim = rim[~among(rim, part.cells.index)]
        rim = cells_over(self._heights, self.lattice, rim).index if len(rim) else rim
        fresh = np.concatenate([missing, rim]) // np.array(self.parts)
        fresh = fresh[~among(fresh, self.coarse)] if len(fresh) else fresh
        if not len(fresh):
            return False
        before = self.lattice.shape[0] // self.parts[0], self.lattice.shape[1] // self.parts[1]
        wider = self.lattice._replace(size=self.lattice.size * self.parts, shape=before).around(fresh)
        self.coarse, self._cells = np.unique(np.concatenate([self.coarse, wider]), axis=0), None
        return True

    @staticmethod
    def _depth(part: BodyContact, points: Array) -> Array:
        """How far the body has moved down at points [m]."""
        return part.motion[0] + points @ part.motion[1:]


class Pressing:
    """Bodies, and the surface they press on.

    Args:
        surface: how it gives.
        bodies: that press.
        tilting: whether they tilt.
        cap: largest pressure [Pa], may be infinite.
    """

    def __init__(self, surface: SurfaceCompliance, bodies: Sequence[Body], tilting: bool, cap: float) -> None:
        self.surface, self.bodies, self.tilting, self.cap = surface, bodies, tilting, cap
        #: What the last solution leaves of its conditions.
        self.violations: dict[str, float] = {}

    def solve(self, cells: Sequence[Cells], known: Sequence[BodyContact] | None) -> list[BodyContact]:
        """Press on given cells.

        Args:
            cells: of each body.
            known: a contact on coarser cells, which tells where to begin.
        """
        ends = np.cumsum([0, *(len(one.index) for one in cells)])
        spans = [slice(start, end) for start, end in itertools.pairwise(ends)]
        motions = 3 if self.tilting else 1
        modes, resultants = np.zeros((ends[-1], motions * len(cells))), np.zeros(motions * len(cells))
        heights, most = np.zeros(ends[-1]), np.zeros(ends[-1])
        frames = []
        for k, (body, one, span) in enumerate(zip(self.bodies, cells, spans, strict=True)):
            middle, length = one.centres.mean(axis=0), float(np.sqrt(one.area * len(one.index)))
            most[span] = self.bound(body) * one.area * one.share
            through = self._carried(body, one.centres, most[span], length)
            offset = np.column_stack([np.ones(len(one.index)), (one.centres - middle) / length])
            modes[span, motions * k : motions * (k + 1)] = offset[:, :motions]
            wanted = np.array([1.0, *((through - middle) / length)])
            resultants[motions * k : motions * (k + 1)] = -body.force[2] * wanted[:motions]
            heights[span] = one.heights - one.heights.min()
            frames.append((middle, length))
        matrix = compliance(self.surface, cells)
        force = float(sum(-body.force[2] for body in self.bodies)) / len(heights)
        give = float(matrix.mean()) * len(heights) * force
        problem = Problem(matrix * (force / give), heights / give, modes, resultants / force, most / force)
        forces, motion = self._solved(problem, None if known is None else _likely(self, cells, known))
        gaps = problem.gaps(forces, motion) * give
        forces, motion = forces * force, motion * give
        solved = []
        for k, (body, one, span, (middle, length)) in enumerate(zip(self.bodies, cells, spans, frames, strict=True)):
            own = np.zeros(3)
            own[:motions] = motion[motions * k : motions * (k + 1)]
            slopes = own[1:] / length
            moved = np.array([own[0] - slopes @ middle + one.heights.min(), *slopes])
            pressing = forces[span]
            through = pressing @ one.centres / pressing.sum()
            along = _along_normals(one.slopes - slopes, pressing)
            leaning = along - _proportional_shear(_resultant(one.centres, along), one.centres, pressing, through)
            wanted = np.array([*body.force[:2], body.moment[2]])
            bounded = math.isfinite(self.cap)
            shear = leaning + _proportional_shear(wanted, one.centres, pressing, through, bounded=bounded)
            solved.append(BodyContact(one, np.column_stack([shear, -pressing]), leaning, gaps[span], moved, through))
        return solved

    def _solved(self, problem: Problem, start: tuple[Mask, Mask] | None) -> tuple[Array, Array]:
        """Forces and motion, by the active set from where the contact was, or else from the interior."""
        try:
            found = None if start is None else active_set(problem, *start)
            if found is None:
                found = active_set(problem, *interior_point(problem))
        except np.linalg.LinAlgError as error:
            raise DenseContactError("the surface's compliance between these cells is not positive definite.") from error
        if found is None:
            raise DenseContactError("the cells in contact kept changing sides. Is a body's surface full of steps?")
        forces, motion = found
        self.violations = conditions(problem, forces, motion)
        wrong = {name: value for name, value in self.violations.items() if not value <= ACCEPTED}
        if wrong:
            raise DenseContactError(f"the contact does not meet its conditions: {wrong}, more than {ACCEPTED}.")
        # What is pulled by no more than rounding is not pressed.
        return np.where(forces < ROUNDING * forces.max(), 0.0, forces), motion

    def bound(self, body: Body) -> float:
        """Largest pressure of a body [Pa]: shear takes a part of it, so that von Mises stress stays within the cap."""
        sliding = min(float(np.hypot(*body.force[:2])) / -float(body.force[2]), 1.0)
        return self.cap / math.sqrt(1.0 + 3.0 * sliding**2)

    def _carried(self, body: Body, points: Array, most: Array, length: float) -> Array:
        """The point (x, y) [m] a body's pressing force passes through, or the nearest that its cells can carry.

        What pressures within their bound can carry is a convex set. Seen along a direction it ends where the cells
        that lie furthest that way carry all they can.
        """
        total = -float(body.force[2])
        if most.sum() <= total * (1 + INSIDE):
            raise DenseContactError(
                f"{body.name} presses with {total:.4g} N, but at {self.bound(body):.4g} Pa what it covers carries "
                f"{most.sum():.4g} N at most."
            )
        wanted = np.array([body.moment[1], -body.moment[0]]) / total
        if not self.tilting:
            return wanted
        angles = np.linspace(0.0, 2 * np.pi, 180, endpoint=False)
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        ends = np.array([_furthest(points @ one, most, total) for one in directions]) - INSIDE * length
        for _ in range(1000):
            beyond = directions @ wanted - ends
            worst = int(beyond.argmax())
            if beyond[worst] <= 1e-9 * length:
                break
            wanted = wanted - beyond[worst] * directions[worst]
        return wanted


def _furthest(along: Array, most: Array, total: float) -> float:
    """How far along a direction the middle of a total force may lie, given the cells' places along it [m]."""
    if np.isinf(most[0]):
        return float(along.max())
    order = np.argsort(-along)
    before = np.concatenate([[0.0], np.cumsum(most[order])[:-1]])
    forces = np.clip(total - before, 0.0, most[order])
    return float(forces @ along[order] / total)


def _likely(pressing: Pressing, cells: Sequence[Cells], known: Sequence[BodyContact]) -> tuple[Mask, Mask]:
    """Cells that lie in pressed ones of a coarser contact, and those that lie in ones at their bound."""
    pressed, full = [], []
    for body, one, part in zip(pressing.bodies, cells, known, strict=True):
        lattice = part.cells.lattice
        within = lattice.holding(one.centres)
        loaded = part.forces[:, 2] < 0.0
        at_bound = part.pressures >= pressing.bound(body) * part.cells.share * (1 - 1e-9)
        full.append(among(within, part.cells.index[at_bound]))
        pressed.append(among(within, part.cells.index[loaded]) & ~full[-1])
    return np.concatenate(pressed), np.concatenate(full)


def _along_normals(slopes: Array, pressing: Array) -> Array:
    """Forces along the surface, (n, 2) [N], of a body that presses along its own normals.

    Args:
        slopes: of the body where it came to rest [-], (n, 2).
        pressing: forces on the cells (n,) [N].
    """
    steep = np.maximum(np.linalg.norm(slopes, axis=1), MOST_LEAN)
    return (pressing * MOST_LEAN / steep)[:, None] * slopes


def _resultant(points: Array, along: Array) -> Array:
    """Forces x and y [N], and torsion about the pad's origin [N m], of forces along the surface (n, 2)."""
    return np.array([*along.sum(axis=0), (points[:, 0] * along[:, 1] - points[:, 1] * along[:, 0]).sum()])


def _proportional_shear(
    wanted: Array, points: Array, pressing: Array, through: Array, *, bounded: bool = False
) -> Array:
    """Shear proportional to the pressure, plus a turn about the centre of pressure, (n, 2) [N].

    Args:
        wanted: its resultant: forces x and y [N], and torsion about the pad's origin [N m].
        points: middles of the cells, (n, 2) [m].
        pressing: forces on them, (n,) [N].
        through: centre of pressure (x, y) [m].
        bounded: whether the turn is bounded, see `TWIST_OVER_SLIDING`.
    """
    offset = points - through
    fx, fy, torsion = wanted
    torsion = torsion - (through[0] * fy - through[1] * fx)
    polar = float(pressing @ (offset**2).sum(axis=1))
    turn = torsion / polar if polar > 0.0 else 0.0
    slide = np.array([fx, fy]) / pressing.sum()
    turned = turn * np.column_stack([-offset[:, 1], offset[:, 0]])
    share = _bounded_share(slide, turned[pressing > 0.0]) if bounded else 1.0
    return pressing[:, None] * (slide + share * turned)


def _bounded_share(slide: Array, turned: Array) -> float:
    """Share of a turn (n, 2) that joins a slide (2,) within the bound; both are shear over pressure [-]."""
    most = max(1.0, TWIST_OVER_SLIDING * float(np.hypot(*slide)))
    square, along = (turned**2).sum(axis=1), turned @ slide
    left = most**2 - slide @ slide
    # The positive root of square share^2 + 2 along share = left, where there is a turn.
    some = square > 0.0
    roots = (np.sqrt(along[some] ** 2 + square[some] * left) - along[some]) / square[some]
    return float(np.min(roots, initial=1.0))


def _read(influence: InfluenceMatrices, pressing: Pressing, solved: list[BodyContact]) -> DenseContact:
    nodal = np.zeros((*influence.surface.node_shape, 3))
    for part in solved:
        nodal += nodal_forces(influence.surface, part.cells, part.forces)
    load = SurfaceLoad(nodal, influence.surface, Polygon())
    wrench = np.concatenate(load.resultant())
    wanted = sum(np.concatenate([body.force, body.moment]) for body in pressing.bodies)
    return DenseContact(influence.readings(load), nodal, wrench, wanted - wrench, solved, pressing.violations)
