"""Contact laws: their names and properties. The class of the same name in the compiled core solves them.

A law is one class here and one in native/core/contact/laws; no other code depends on which law it is.
"""

from __future__ import annotations

from typing import ClassVar

from mjtactile.contact.tangentials import TANGENTIALS


class ContactLaw:
    """How the pressure under a body is distributed."""

    name: ClassVar[str]  #: name of the law
    tangentials: ClassVar[tuple[str, ...]] = ("proportional",)  #: names of the tangential choices it allows
    springs: ClassVar[bool] = False  #: whether it needs the springs of `foundation_springs`
    #: Whether it uses the pad's compliance and a body's shape, and computes indentation and tilt; otherwise a body
    #: presses with its lowest part.
    shapes: ClassVar[bool] = True


class Uniform(ContactLaw):
    """Constant pressure plus a linear gradient that carries the moment, and zero where it would be negative."""

    name = "uniform"
    shapes = False


class Foundation(ContactLaw):
    """Independent springs under the body's true shape, as stiff as the pad is under a face of the same area."""

    name = "foundation"
    springs = True


class Elastic(ContactLaw):
    """Unilateral contact of the rigid body with the elastic pad: pressure where they touch, a gap elsewhere."""

    name = "elastic"
    tangentials = TANGENTIALS


#: All laws by name.
BY_NAME: dict[str, ContactLaw] = {law.name: law for law in (Uniform(), Foundation(), Elastic())}
