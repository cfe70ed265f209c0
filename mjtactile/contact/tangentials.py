"""Tangential choices: how shear is distributed over a contact. The class of the same name in the core solves it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TangentialChoice:
    """How shear is distributed over the area under pressure."""

    name: str  #: name of the choice
    couples: bool = True  #: whether it needs the tangential compliance of the surface
    slips: bool = False  #: whether cells slip at the limit of friction, so that a coefficient is needed


_CHOICES = (
    # Shear proportional to the pressure, as in sliding, or with law "uniform" constant over the pressed area, plus a
    # rotational part for the torsion.
    TangentialChoice("proportional", couples=False),
    # The surface does not move relative to the body.
    TangentialChoice("stick"),
    # The surface sticks below the limit of friction and slips at it, without history of loading.
    TangentialChoice("coulomb", slips=True),
)
#: All choices by name.
TANGENTIAL_CHOICES = {one.name: one for one in _CHOICES}
#: Their names, the default first.
TANGENTIALS = tuple(TANGENTIAL_CHOICES)
#: Names of those that need no coefficient of friction.
WITHOUT_FRICTION = tuple(name for name, one in TANGENTIAL_CHOICES.items() if not one.slips)
