"""Checked options of a contact: law, shear, friction, tilt and the wrench."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.laws import BY_NAME, ContactLaw
from mjtactile.contact.tangentials import TANGENTIAL_CHOICES, TANGENTIALS, TangentialChoice
from mjtactile.errors import ContactError, MjTactileError, of_type, shortened
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.fidelity import CONTACT_LAWS, Fidelity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad
from mjtactile.pad_shape.core_surface import core_surface
from mjtactile.units import finite_number, is_whole, real_numbers

_UP = np.array([0.0, 0.0, 1.0])
_UP.setflags(write=False)
#: Sine of the angle to a curved surface up to which a force is along it; rounding makes 1e-9.
_TANGENT = 1e-8
#: Whether the body may tilt under its load.
TILTS = ("free", "fixed")
#: Largest width of a flat face's cells over the thickness of what gives way under them.
_WIDEST = 0.75


@dataclass(frozen=True, kw_only=True)
class ContactOptions:
    """How a contact is solved; see `contact_load`."""

    law: str  #: name of the contact law
    tangential: str  #: name of the tangential choice
    friction: float | None  #: coefficient [-]; None: no bound on shear
    tilting: bool  #: whether the body may tilt
    cells: int  #: number of contact cells

    @property
    def contact_law(self) -> ContactLaw:
        """Properties of the contact law."""
        return BY_NAME[self.law]

    @property
    def choice(self) -> TangentialChoice:
        """Properties of the tangential choice."""
        return TANGENTIAL_CHOICES[self.tangential]

    def widest_cells(self, pad: Pad) -> float:
        """Width [m] of a flat face's cells above which it gets more of them, up to a bound; 0 for no such width.

        A pressure that jumps from cell to cell shears a sheet that is thinner than a cell is wide, where the true one
        does not. It is the part of the sheet that gives way which must not be thinner: a layer stiffer than the top one
        counts in proportion to its compliance. Shear with a compliance of its own is too slow for more cells.
        """
        if self.choice.couples or not self.contact_law.shapes:
            return 0.0
        top = pad.layers[0].young
        return _WIDEST * sum(layer.thickness * min(1.0, top / layer.young) for layer in pad.layers)

    def with_friction(self) -> ContactOptions:
        """The options unchanged, after checking that friction is given if the tangential choice needs it.

        Callers that have no contacts of MuJoCo, which would supply a coefficient, use this.

        Raises:
            ContactError: shear may slip, but friction is None.
        """
        if self.choice.slips and self.friction is None:
            raise ContactError(
                f"tangential={self.tangential!r} needs a coefficient: pass friction=..., for example 0.8."
            )
        return self

    @property
    def gives_moment(self) -> bool:
        """Whether the moments about x and y are results, because the body keeps its orientation."""
        return self.contact_law.shapes and not self.tilting


@dataclass(frozen=True, eq=False)
class Wrench:
    """A force and its moment about the pad's origin, pad frame."""

    force: Array  #: [N], shape (3,)
    moment: Array  #: about the origin [N m], shape (3,)
    moment_given: bool = True  #: False if the force acts at the footprint's centroid because no moment was given
    #: Point of a curved surface at which the force presses, or nearest to it if its line of action passes beside the
    #: surface [m], shape (3,); None on a flat surface, or if no such point was found.
    place: Array | None = None
    #: Unit normal of a curved surface there, out of the pad, shape (3,); None on a flat one.
    leaning: Array | None = None

    @property
    def outward(self) -> Array:
        """Unit normal of the surface where the force presses, out of the pad, shape (3,)."""
        return _UP if self.leaning is None else self.leaning

    @property
    def normal(self) -> float:
        """Pressing force, along the surface's normal [N]; 0 if that is rounding, or if the force has no place there."""
        normal = -float(self.force @ self.outward)
        if self.leaning is None:
            return normal
        if abs(normal) <= _TANGENT * float(np.linalg.norm(self.force)):
            return 0.0
        return min(normal, 0.0) if self.place is None else normal

    @property
    def through(self) -> Array:
        """Point (x, y) of a pressing force's line of action [m]: in the plane z = 0, or on or nearest to `place`."""
        if self.leaning is None:
            return np.array([self.moment[1], -self.moment[0]]) / self.normal
        place = np.zeros(3) if self.place is None else self.place
        arm = np.cross(self.force, self.moment_about_place(self.force, self.moment))
        return (place + arm / (self.force @ self.force))[:2]

    def moment_about_place(self, force: Array, moment: Array) -> Array:
        """Moment about the place where the wrench presses, from a force and its moment about the origin [N m], (3,)."""
        return moment if self.place is None else moment - np.cross(self.place, force)

    def torsion(self, moment: Array) -> Array:
        """The part along the surface's normal of a moment [N m], (3,)."""
        return (moment @ self.outward) * self.outward


def contact_options(
    influence: InfluenceMatrices | Fidelity,
    *,
    law: str | None = None,
    tangential: str = "proportional",
    friction: float | None = None,
    tilt: str = "free",
    cells: int | None = None,
) -> ContactOptions:
    """Check the options of `contact_load`.

    Args:
        influence: influence matrices of the pad, or a Fidelity; gives law and number of cells if these are None.
        law: name of the contact law.
        tangential: how shear is distributed.
        friction: coefficient [-]; None for no bound.
        tilt: "free" or "fixed".
        cells: number of contact cells.

    Raises:
        ContactError: an option is unknown or out of range, or options cannot be combined.
    """
    if not isinstance(influence, Fidelity):
        influence = of_type(
            InfluenceMatrices, "influence", influence, ContactError, "influence_matrices(pad) makes them"
        )
    fidelity = influence if isinstance(influence, Fidelity) else influence.fidelity
    law = fidelity.law if law is None else law
    cells = fidelity.cells if cells is None else cells
    for kind, name, known in (
        ("contact law", law, CONTACT_LAWS),
        ("tangential", tangential, TANGENTIALS),
        ("tilt", tilt, TILTS),
    ):
        if not (isinstance(name, str) and name in known):
            raise ContactError(f"{kind} {shortened(name)} does not exist. Available: {', '.join(known)}.")
    if tangential not in BY_NAME[law].tangentials:
        able = " or ".join(repr(one.name) for one in BY_NAME.values() if tangential in one.tangentials)
        raise ContactError(f"tangential={tangential!r} needs law={able}; law {law!r} knows 'proportional' only.")
    if friction is not None and not finite_number(friction) >= 0.0:
        raise ContactError(f"friction = {friction!r}; expected a coefficient that is not negative, for example 0.8.")
    if not is_whole(cells) or cells < 1:
        raise ContactError(f"cells = {cells!r}; expected a whole number of contact cells from 1 on.")
    friction = None if friction is None else float(friction)
    return ContactOptions(law=law, tangential=tangential, friction=friction, tilting=tilt == "free", cells=int(cells))


def wanted_wrench(footprint: Footprint, force: npt.ArrayLike, moment: npt.ArrayLike | None) -> Wrench:
    """The wrench of a force and a moment, checked.

    Args:
        footprint: of the body; without a moment, the force acts at its centroid.
        force: on the pad, pad frame [N], (3,).
        moment: about the pad's origin [N m], (3,), or None.

    Raises:
        ContactError: force or moment is not three finite numbers.
    """
    of_type(Footprint, "footprint", footprint, ContactError, "Footprint.from_outline(...) makes one")
    wanted = vector("force", force)
    if moment is None:
        (x, y), (along, across, normal), outer = footprint.centroid, wanted.tolist(), footprint.surface.outer
        z = 0.0 if outer.is_flat else float(outer.height(x, y))
        moment = np.array([y * normal - z * across, z * along - x * normal, x * across - y * along])
        return _on_surface(footprint.surface, Wrench(wanted, moment, moment_given=False))
    return _on_surface(footprint.surface, Wrench(wanted, vector("moment", moment)))


def _on_surface(surface: SurfaceGrid, wrench: Wrench) -> Wrench:
    """The same wrench, with the place where it presses on a curved surface and the normal there."""
    if surface.outer.is_flat:
        return wrench
    west, south, east, north = surface.bounds
    outer = core_surface(surface.outer, ((east - west) / 2, (north - south) / 2))
    place = outer.centre_of_pressure(np.concatenate([wrench.force, wrench.moment]))
    x, y = (0.0, 0.0) if place is None else place[:2].tolist()
    return replace(wrench, place=place, leaning=surface.outer.normals(x, y))


def vector(name: str, value: npt.ArrayLike, error: type[MjTactileError] = ContactError) -> Array:
    """A force or a moment, checked and copied, so that results do not change with the caller's array.

    Raises:
        MjTactileError: `error`, if it is not three finite numbers.
    """
    numbers = real_numbers(value)
    if numbers is None or numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise error(f"{name} = {shortened(value)}; expected three finite numbers (x, y, z) in the pad frame, N or N m.")
    return np.array(numbers, dtype=float)
