"""Contact laws that solve for a traction on each contact cell: "elastic" and "foundation", with friction.

Pressing decides where and how hard the body touches; shear then spreads over what is pressed. Bonded contact solves
for both at once, and partial slip goes back and forth between the two until neither changes.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from mjtactile.cell_contact import CellContact, Pressed, Solver
from mjtactile.cells import Area, Cells
from mjtactile.complementarity import bonded_contact, rigid_contact
from mjtactile.compliance import SurfaceCompliance
from mjtactile.errors import ContactError, ContactWarning
from mjtactile.footprint import Footprint
from mjtactile.foundation import foundation_contact
from mjtactile.friction import ShearGrip, bonded_shear, coulomb_shear, proportional_shear
from mjtactile.load import ContactState
from mjtactile.options import ContactOptions, Wrench
from mjtactile.pad import Array
from mjtactile.pressing import press
from mjtactile.rigid import Mask, RigidContact

#: Rounds of pressing and shear, and the change of forces at which they agree.
_ROUNDS = 60
_AGREED = 1e-10
#: Rounds after which what the shear lifts is changed by a part only, and that part.
_UNDAMPED, _DAMPING = 12, 0.3
#: Shear within this fraction of mu F slips.
_SLIPS = 1e-6


@dataclass(frozen=True, eq=False)
class CellLoad:
    """Forces on contact cells.

    Attributes:
        pressed: the solved contact.
        forces: on each cell, pad frame, (cells, 3) [N].
        state: what is known of the contact.
        bonded: of a contact that does not slip at all, the contact with its shear, on the cells reached.
    """

    pressed: Pressed
    forces: Array
    state: ContactState
    bonded: RigidContact | None = None

    @property
    def cells(self) -> Cells:
        """The contact cells."""
        return self.pressed.at.cells

    def touching(self) -> Area:
        """The part of the surface under pressure [m]."""
        return self.cells.outline(self.forces[:, 2] < 0.0)

    def held(self, wrench: Wrench, friction: float) -> bool:
        """Whether friction holds a wrench's shear and torsion under this pressure."""
        grip = _grip(self.pressed)
        return grip.nearest(grip.about_centre(wrench.force, wrench.moment[2]), friction)[1] is None


def cell_load(
    compliance: SurfaceCompliance,
    footprint: Footprint,
    wrench: Wrench,
    options: ContactOptions,
    known: CellLoad | None = None,
) -> CellLoad:
    """Tractions on cells that carry a wrench, or the nearest to it that they can.

    Args:
        compliance: of the pad's surface.
        footprint: of the body.
        wrench: pressing.
        options: law, friction and tilt.
        known: a contact of the same footprint under another wrench, whose cells serve again if they fit.

    Raises:
        ContactError: when no contact was found.
    """
    pressed = press(
        footprint,
        wrench.normal,
        wrench.through,
        tilting=options.tilting,
        count=options.cells,
        solver=_solver(compliance, options),
        softness=compliance.normal_factor,
        known=None if known is None else known.pressed,
    )
    if options.tangential == "stick":
        bonded = _bonded(compliance, pressed, wrench)
        if options.friction is None or bonded.held(wrench, options.friction):
            return bonded
    if options.tangential == "coulomb":
        pressed, shear = _partial_slip(compliance, pressed, wrench, options)
        return _load(pressed, shear, options.friction)
    return _load(pressed, _sheared(pressed, wrench, options), None)


def _solver(compliance: SurfaceCompliance, options: ContactOptions) -> Solver:
    law = {"elastic": _elastic, "foundation": foundation_contact}[options.law]
    return lambda at, resultants, start: law(compliance, at, resultants, start)


def _elastic(compliance: SurfaceCompliance, at: CellContact, resultants: Array, start: Mask | None) -> RigidContact:
    matrix = compliance.normal(at.cells)
    if not at.reached.all():
        matrix = matrix[np.ix_(at.reached, at.reached)]
    return rigid_contact(matrix, at.modes, at.gaps, resultants, start)


def _grip(pressed: Pressed) -> ShearGrip:
    """The cells that carry shear: those under pressure."""
    normal = pressed.contact.forces
    chosen = normal > 0.0
    points = pressed.at.cells.centroids[chosen]
    return ShearGrip(points, normal[chosen], normal[chosen] @ points / normal[chosen].sum(), pressed.at.length)


def _sheared(pressed: Pressed, wrench: Wrench, options: ContactOptions) -> Array:
    """Shear in proportion to the pressure, or of full sliding where friction carries no more, (2, cells) [N]."""
    if not (wrench.force[:2].any() or wrench.moment[2]):
        return np.zeros((2, pressed.at.cells.count))
    grip = _grip(pressed)
    wanted, sliding = grip.about_centre(wrench.force, wrench.moment[2]), None
    if options.friction is not None:
        wanted, sliding = grip.nearest(wanted, options.friction)
    shear = np.zeros((2, pressed.at.cells.count))
    shear[:, pressed.contact.forces > 0.0] = proportional_shear(grip, wanted) if sliding is None else sliding
    return shear


def _partial_slip(
    compliance: SurfaceCompliance,
    pressed: Pressed,
    wrench: Wrench,
    options: ContactOptions,
) -> tuple[Pressed, Array]:
    """Pressing and shear of a contact that slips where friction does not hold.

    A few contacts flip between two states; there, what shear does to pressure is left out.
    """
    assert options.friction is not None
    at = pressed.at
    full = compliance.full(at.cells)
    resultants, places = at.resultants(wrench.normal, wrench.through), np.flatnonzero(at.reached)
    matrix = full[2, :, 2, :][np.ix_(places, places)]
    shear, lifted = np.zeros((2, at.cells.count)), np.zeros(at.cells.count)
    contact = pressed.contact
    for trial in range(_ROUNDS):
        before = np.concatenate([contact.forces, shear.ravel()])
        share = 1.0 if trial < _UNDAMPED else _DAMPING
        lifted = (1.0 - share) * lifted - share * np.einsum("iaj,aj->i", full[2][:, :2], shear)
        try:
            solved = rigid_contact(matrix, at.modes, at.gaps + lifted[places], resultants, contact.pressed[places])
        except ContactError:
            break
        contact = solved.spread(at.reached)
        shear = _slipping(full, Pressed(at, contact), wrench, options.friction)
        if np.abs(np.concatenate([contact.forces, shear.ravel()]) - before).max() <= _AGREED * wrench.normal:
            return Pressed(at, contact), shear
    warnings.warn(
        "pressure and slip do not agree, as on few cells or with much friction: the pressure is that without friction.",
        ContactWarning,
        stacklevel=5,
    )
    return pressed, _slipping(full, pressed, wrench, options.friction)


def _slipping(full: Array, pressed: Pressed, wrench: Wrench, friction: float) -> Array:
    """Shear under a pressure that is known: it sticks where friction holds, (2, cells) [N]."""
    grip, kept = _grip(pressed), np.flatnonzero(pressed.contact.forces > 0.0)
    wanted, sliding = grip.nearest(grip.about_centre(wrench.force, wrench.moment[2]), friction)
    if sliding is None and friction > 0.0:
        tangential = full[:2][:, kept][:, :, :2][:, :, :, kept]
        slip = -full[:2, :, 2][:, kept] @ pressed.contact.forces
        sliding = coulomb_shear(tangential, grip, slip, wanted, friction)
    shear = np.zeros((2, pressed.at.cells.count))
    shear[:, kept] = 0.0 if sliding is None else sliding
    return shear


def _bonded(compliance: SurfaceCompliance, pressed: Pressed, wrench: Wrench) -> CellLoad:
    """Pressing and shear of a contact that does not slip at all."""
    at = pressed.at
    places, count = np.flatnonzero(at.reached), int(at.reached.sum())
    full = compliance.full(at.cells)[:, places][:, :, :, places]
    downward = np.array([1.0, 1.0, -1.0])  # pressing forces count downward
    full = full * downward[:, None, None, None] * downward[:, None]
    grip = ShearGrip(at.cells.centroids[places], np.ones(count), at.centre, at.length)
    motions = at.modes.shape[1]
    modes = np.zeros((3, count, motions + 3))
    modes[2, :, :motions] = at.modes
    modes[:2, :, motions:] = grip.modes
    shear_resultants = grip.about_centre(wrench.force, wrench.moment[2])
    resultants = np.concatenate([at.resultants(wrench.normal, wrench.through), shear_resultants])
    try:
        contact = bonded_contact(full, modes, at.gaps, resultants, pressed.contact.pressed[places])
    except ContactError:
        return _bonded_as_pressed(compliance, pressed, wrench)
    own = replace(contact, map_forces=contact.map_forces[2 * count :])
    shear = np.zeros((2, at.cells.count))
    shear[:, places] = contact.forces[: 2 * count].reshape(2, count)
    return replace(_load(Pressed(at, own.spread(at.reached)), shear, None), bonded=contact)


def _bonded_as_pressed(compliance: SurfaceCompliance, pressed: Pressed, wrench: Wrench) -> CellLoad:
    """Bonded shear on what is pressed without it, where shear so large leaves no cells that both press and stick."""
    grip, places = _grip(pressed), np.flatnonzero(pressed.contact.forces > 0.0)
    full = compliance.full(pressed.at.cells)[:, places]
    slip = -full[:2, :, 2] @ pressed.contact.forces
    tangential = full[:2, :, :2][:, :, :, places]
    shear = np.zeros((2, pressed.at.cells.count))
    wanted = grip.about_centre(wrench.force, wrench.moment[2])
    shear[:, places] = bonded_shear(tangential, grip, slip, wanted)
    return _load(pressed, shear, None)


def _load(pressed: Pressed, shear: Array, friction: float | None) -> CellLoad:
    forces = np.column_stack([*shear, -pressed.contact.forces])
    areas, slopes = pressed.at.cells.areas, pressed.slopes
    touching = pressed.contact.forces > 0.0
    stick_area = np.nan
    if friction is not None:
        holds = np.linalg.norm(shear, axis=0) < (1 - _SLIPS) * friction * pressed.contact.forces
        stick_area = float(areas[holds].sum())
    state = ContactState(
        approach=pressed.approach,
        # The body moves down by approach + slope . (x, y), so it turns by (-slope y, slope x).
        tilts=(-float(slopes[1]), float(slopes[0])),
        contact_area=float(areas[touching].sum()),
        peak_pressure=float((pressed.contact.forces / areas).max()),
        stick_area=stick_area,
    )
    return CellLoad(pressed, forces, state)
