"""Contact laws: their names and properties. The class of the same name in the compiled core solves them.

A law is one entry here and one class in native/core/contact/laws; no other code depends on which law it is.
"""

from __future__ import annotations

from dataclasses import dataclass

from mjtactile.contact.tangentials import TANGENTIALS


@dataclass(frozen=True)
class ContactLaw:
    """How the pressure under a body is distributed."""

    name: str  #: name of the law
    tangentials: tuple[str, ...] = ("proportional",)  #: names of the tangential choices it allows
    springs: bool = False  #: whether it needs the springs of `foundation_springs`
    #: Whether it uses the pad's compliance and a body's shape, and computes indentation and tilt; otherwise a body
    #: presses with its lowest part.
    shapes: bool = True


_LAWS = (
    # Constant pressure plus a linear gradient that carries the moment, and zero where it would be negative.
    ContactLaw("uniform", shapes=False),
    # Independent springs under the body's true shape, as stiff as the pad is under a face of the same area.
    ContactLaw("foundation", springs=True),
    # Unilateral contact of the rigid body with the elastic pad: pressure where they touch, a gap elsewhere.
    ContactLaw("elastic", TANGENTIALS),
)
#: All laws by name.
BY_NAME = {law.name: law for law in _LAWS}
