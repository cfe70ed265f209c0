"""Tangential choices: how shear is distributed over a contact. The class of the same name in the core solves it."""

from __future__ import annotations

from typing import ClassVar


class TangentialChoice:
    """How shear is distributed over the area under pressure."""

    name: ClassVar[str]  #: name of the choice
    couples: ClassVar[bool] = True  #: whether it needs the tangential compliance of the surface
    slips: ClassVar[bool] = False  #: whether cells slip at the limit of friction, so that a coefficient is needed


class Proportional(TangentialChoice):
    """Shear proportional to the pressure, as in sliding, plus a rotational part for the torsion."""

    name = "proportional"
    couples = False


class Stick(TangentialChoice):
    """The surface does not move relative to the body."""

    name = "stick"


class Coulomb(TangentialChoice):
    """The surface sticks below the limit of friction and slips at it, without history of loading."""

    name = "coulomb"
    slips = True


#: All choices by name.
TANGENTIAL_CHOICES: dict[str, TangentialChoice] = {one.name: one for one in (Proportional(), Stick(), Coulomb())}
#: Their names, the default first.
TANGENTIALS = tuple(TANGENTIAL_CHOICES)
#: Names of those that need no coefficient of friction.
WITHOUT_FRICTION = tuple(name for name, one in TANGENTIAL_CHOICES.items() if not one.slips)
