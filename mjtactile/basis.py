"""Readings of one footprint under changing wrenches, without pressing anew each time.

While the same contact cells are pressed, the stress at the sample points is a fixed combination of a few responses,
the wrench basis; it is made once a few readings in a row pressed the same cells. A wrench that presses other cells,
or lets some slip, ends it: the contact is solved anew, from the cells that were pressed, and a new basis begins.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from mjtactile.cell_basis import CellBasis
from mjtactile.cell_laws import CellLoad
from mjtactile.contact import reported, solved_load, warn_beyond_linear_range
from mjtactile.footprint import Footprint
from mjtactile.influence import InfluenceMatrices
from mjtactile.load import SurfaceLoad
from mjtactile.options import Wrench, contact_options, wanted_wrench
from mjtactile.pad import Array
from mjtactile.uniform import UniformBasis

#: Readings in a row with the same cells pressed before a basis is worth its making.
_STEADY_READINGS = 2


class WrenchBasis:
    """One footprint that does not move, pressed by one wrench after another.

    Readings equal those of `contact_load` on the same cells to the rounding of single precision. On a curved body the
    cells stay those chosen for an earlier force while the contact area stays within a quarter of it.

    Args:
        influence: of the pad.
        footprint: made with the same influence matrices.
        law, tangential, friction, tilt, cells: as in `contact_load`.

    Raises:
        ContactError: for options that make no sense.
    """

    def __init__(
        self,
        influence: InfluenceMatrices,
        footprint: Footprint,
        *,
        law: str | None = None,
        tangential: str = "proportional",
        friction: float | None = None,
        tilt: str = "free",
        cells: int | None = None,
    ) -> None:
        self.influence = influence
        self.footprint = footprint
        self.options = contact_options(
            influence, law=law, tangential=tangential, friction=friction, tilt=tilt, cells=cells
        )
        self._solved: CellLoad | None = None
        self._parts: _Parts | None = None
        self._steady = 0

    @property
    def active(self) -> bool:
        """Whether a basis is at hand."""
        return self._parts is not None

    def readings(self, force: npt.ArrayLike, moment: npt.ArrayLike | None = None) -> Array:
        """Readings (layers, rows, columns) [Pa] under a wrench, as `contact_load` takes it.

        Raises:
            ContactError: as `contact_load`.

        Warns:
            ContactWarning: as `contact_load`.
        """
        return self.influence.readings_of(self.response(force, moment))

    def response(self, force: npt.ArrayLike, moment: npt.ArrayLike | None = None) -> Array:
        """Deviatoric stress at the sample points (points, 5) [Pa], which adds up over bodies; see `readings`."""
        wrench = wanted_wrench(self.footprint, force, moment)
        if self._parts is None and self._steady >= _STEADY_READINGS:
            self._parts = self._linear_parts()
        if self._parts is not None:
            response = self._parts.response(self.influence, wrench)
            if response is not None:
                return response
        return self.influence.point_response(self._pressed(wrench))

    def load(self, force: npt.ArrayLike, moment: npt.ArrayLike | None = None) -> SurfaceLoad:
        """The load under a wrench, solved from what is known of the last one."""
        return self._pressed(wanted_wrench(self.footprint, force, moment))

    def _pressed(self, wrench: Wrench) -> SurfaceLoad:
        """Solve the contact; whatever basis there was belonged to another."""
        before, self._parts = self._solved, None
        load, solved = solved_load(self.influence, self.footprint, wrench, self.options, before)
        self._solved = before if solved is None else solved
        self._steady = self._steady + 1 if self._solved is before or _same_cells(self._solved, before) else 1
        return reported(self.influence, self.footprint, load, wrench, self.options)

    def _linear_parts(self) -> _Parts | None:
        if self.options.law == "uniform":
            if self.options.friction is not None:
                return None
            basis = UniformBasis.of(self.footprint.facing)
            return _Parts(self.influence, basis.forces, basis.weights, None)
        if self._solved is None or self.options.tangential == "coulomb":
            return None
        if self.options.tangential == "stick" and self._solved.bonded is None:
            return None
        parts = CellBasis.of(self._solved, self.options)
        surface = self.influence.surface
        forces = np.stack([self._solved.cells.nodal_forces(surface, part) for part in parts.forces])
        return _Parts(self.influence, forces, parts.weights, self._solved)


def _same_cells(solved: CellLoad | None, before: CellLoad | None) -> bool:
    """Whether two contacts press the same cells."""
    if solved is None or before is None or solved.cells is not before.cells:
        return False
    return bool((solved.pressed.contact.pressed == before.pressed.contact.pressed).all())


class _Parts:
    """Responses at the sample points to the linear parts of a load."""

    def __init__(
        self,
        influence: InfluenceMatrices,
        forces: Array,
        weights: Callable[[Wrench], Array | None],
        solved: CellLoad | None,
    ) -> None:
        self._used = np.flatnonzero(forces.reshape(len(forces), -1).any(axis=1))
        surface = influence.surface
        loads = [SurfaceLoad(forces[k], surface, surface.sheet) for k in self._used]
        response = influence.point_response(loads)
        # Parts of very different size are scaled to one before they are rounded.
        self._scale = np.maximum(np.abs(response).max(axis=(1, 2)), np.finfo(float).tiny)
        self._shape = response.shape[1:]
        self._response = (response / self._scale[:, None, None]).astype(np.float32).reshape(len(response), -1)
        self._weights = weights
        self._solved = solved

    def response(self, influence: InfluenceMatrices, wrench: Wrench) -> Array | None:
        """Response to a wrench; None where the parts do not make up its load."""
        weights = self._weights(wrench)
        if weights is None:
            return None
        if self._solved is not None:
            warn_beyond_linear_range(influence, wrench, self._solved.state)
        shares = weights[self._used] * self._scale
        size = float(np.abs(shares).max()) or 1.0
        combined = (shares / size).astype(np.float32) @ self._response
        return size * combined.reshape(self._shape)
