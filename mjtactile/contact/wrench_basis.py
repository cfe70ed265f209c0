"""Readings of one footprint under changing wrenches, without solving the contact each time.

While the same contact cells of a flat face are under pressure, the stress at the sample points is linear in the wrench:
a combination of a few responses, the wrench basis. The basis is computed after a few readings in a row with the same
cells. When a wrench changes the cells under pressure, the contact is solved again and a new basis follows. Curved
bodies, shear limited by friction and shear that sticks are solved each time.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.contact.contact_load import reported, solved_loads, warn_beyond_linear_range
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import Wrench, contact_options, wanted_wrench
from mjtactile.contact.press import Press
from mjtactile.contact.ready import new_press
from mjtactile.errors import ContactError, of_type
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import ContactState, SurfaceLoad

#: Number of readings in a row with the same cells under pressure after which a basis is computed.
_STEADY_READINGS = 2


class WrenchBasis:
    """A footprint at a fixed position under a sequence of wrenches.

    Readings equal those of `contact_load` to single precision.

    Args:
        influence: of the pad.
        footprint: made with the same influence matrices.
        law: as in `contact_load`, like the following options.
        tangential: how shear is distributed.
        friction: coefficient that bounds shear [-].
        tilt: "free" or "fixed".
        cells: number of contact cells.

    Raises:
        ContactError: an option is unknown or out of range, options cannot be combined, or `influence` or `footprint` is
            of another type.
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
        self.footprint = of_type(Footprint, "footprint", footprint, ContactError, "Footprint.from_gap(...) makes one")
        self.options = contact_options(
            influence, law=law, tangential=tangential, friction=friction, tilt=tilt, cells=cells
        ).with_friction()
        self._parts: _Parts | None = None
        self._steady = 0

    @property
    def active(self) -> bool:
        """Whether readings come from a wrench basis at present."""
        return self._parts is not None

    def readings(self, force: npt.ArrayLike, moment: npt.ArrayLike | None = None) -> Array:
        """Readings under a wrench on the footprint.

        Args:
            force: on the pad [N], pad frame, shape (3,); it presses if it points into the surface.
            moment: about the pad's origin [N m], shape (3,); by default the force acts at the footprint's centroid.

        Returns:
            (layers, rows, columns) [Pa], or (taxels,) for free taxels.

        Raises:
            ContactError: as `contact_load`.

        Warns:
            ContactWarning: as `contact_load`.
        """
        return self.influence.readings_of(self.response(force, moment))

    def response(self, force: npt.ArrayLike, moment: npt.ArrayLike | None = None) -> Array:
        """Deviatoric stress at the sample points under a wrench [Pa], (points, 5); responses of bodies add up.

        Arguments, errors and warnings are those of `readings`.
        """
        wrench = wanted_wrench(self.footprint, force, moment)
        if self._parts is not None:
            response = self._parts.response(self.influence, wrench)
            if response is not None:
                return response
            self._parts, self._steady = None, 0
        load = self._pressed(wrench)
        if wrench.normal > 0.0 and self.footprint.gap is None:
            self._steady += 1
            if self._steady >= _STEADY_READINGS:
                self._parts = _Parts.of(self, wrench, load.state)
                self._steady = 0
        return self.influence.point_response(load)

    def load(self, force: npt.ArrayLike, moment: npt.ArrayLike | None = None) -> SurfaceLoad:
        """The load under a wrench; arguments, errors and warnings are those of `readings`."""
        return self._pressed(wanted_wrench(self.footprint, force, moment))

    def _pressed(self, wrench: Wrench) -> SurfaceLoad:
        (load,) = solved_loads(self.influence, [self.footprint], [wrench], self.options)
        return reported(self.influence, self.footprint, load, wrench, self.options)


class _Parts:
    """Responses at the sample points to the linear parts of a load."""

    def __init__(self, influence: InfluenceMatrices, press: Press, forces: Array, state: ContactState) -> None:
        self._used = np.flatnonzero(forces.reshape(len(forces), -1).any(axis=1))
        surface = influence.surface
        loads = [SurfaceLoad(forces[k], surface, surface.sheet) for k in self._used]
        response = influence.point_response(loads)
        # Parts differ much in size; each is scaled to 1 before it is rounded to single precision.
        self._scale = np.maximum(np.abs(response).max(axis=(1, 2)), np.finfo(float).tiny)
        self._shape = response.shape[1:]
        self._response = (response / self._scale[:, None, None]).astype(np.float32).reshape(len(response), -1)
        self._count, self._press, self._state = len(forces), press, state

    @classmethod
    def of(cls, basis: WrenchBasis, wrench: Wrench, state: ContactState) -> _Parts | None:
        """Linear parts of the contact under a wrench; None if its load is not linear in the wrench."""
        press = new_press(basis.influence, basis.options)
        press.loads([basis.footprint], [wrench])
        forces = press.parts()
        return None if forces is None else cls(basis.influence, press, forces, state)

    def response(self, influence: InfluenceMatrices, wrench: Wrench) -> Array | None:
        """Response to a wrench; None if other cells are under pressure, so that the parts do not apply."""
        weights = self._press.weights(wrench, self._count) if wrench.normal > 0.0 else None
        if weights is None:
            return None
        warn_beyond_linear_range(influence, np.asarray(wrench.force), wrench.outward, self._state)
        shares = weights[self._used] * self._scale
        size = float(np.abs(shares).max()) or 1.0
        combined = (shares / size).astype(np.float32) @ self._response
        return size * combined.reshape(self._shape)
