"""Ways that shear spreads over a contact: what each is called and needs. The core's class of that name solves it."""

from __future__ import annotations

from typing import ClassVar


class TangentialChoice:
    """How shear spreads over what presses.

    Attributes:
        name: users and the core know it by.
        couples: whether it asks how shear moves the surface.
        slips: whether cells slip where friction bears no more, so that a coefficient must be known.
    """

    name: ClassVar[str]
    couples: ClassVar[bool] = True
    slips: ClassVar[bool] = False


class Proportional(TangentialChoice):
    """Everywhere in proportion to the pressure, as in sliding, with a turn for the torsion."""

    name = "proportional"
    couples = False


class Stick(TangentialChoice):
    """The surface does not move along the body anywhere."""

    name = "stick"


class Coulomb(TangentialChoice):
    """It sticks where it can and slips where shear reaches what friction bears, after loading without history."""

    name = "coulomb"
    slips = True


#: All of them by name.
TANGENTIAL_CHOICES: dict[str, TangentialChoice] = {one.name: one for one in (Proportional(), Stick(), Coulomb())}
#: Their names, the default first.
TANGENTIALS = tuple(TANGENTIAL_CHOICES)
#: Of those that need no friction.
WITHOUT_FRICTION = tuple(name for name, one in TANGENTIAL_CHOICES.items() if not one.slips)
