"""Contact laws: what each is called, and what it knows of body and pad. The core's `Law` solves them.

A law is one class here and one case in native/core/contact/laws/cell_contact.cpp; nothing else tells them apart.
"""

from __future__ import annotations

from typing import ClassVar

#: Names of the ways shear spreads over a contact.
TANGENTIALS = ("proportional", "stick", "coulomb")


class ContactLaw:
    """How a body's pressure spreads over what it touches.

    Attributes:
        name: users know it by.
        number: the core knows it by, in `Law` of native/core/contact/laws/cell_contact.hpp.
        tangentials: ways shear may spread under it.
        springs: whether it needs the springs that stand for the pad.
        shapes: whether it knows how the pad gives, looks at a curved body's shape and finds its indentation and tilt;
            otherwise the body presses with its lowest part.
    """

    name: ClassVar[str]
    number: ClassVar[int]
    tangentials: ClassVar[tuple[str, ...]] = ("proportional",)
    springs: ClassVar[bool] = False
    shapes: ClassVar[bool] = True


class Uniform(ContactLaw):
    """A pressure that is constant but for the gradient that carries the moment, and zero where it would pull."""

    name = "uniform"
    number = 2
    shapes = False


class Foundation(ContactLaw):
    """Springs under the body's true shape, as stiff as the pad is under a face of the same area."""

    name = "foundation"
    number = 1
    springs = True


class Elastic(ContactLaw):
    """The pad's own compliance against the rigid body: pressure where they touch, a gap where they do not."""

    name = "elastic"
    number = 0
    tangentials = TANGENTIALS


#: All of them by name.
BY_NAME: dict[str, ContactLaw] = {law.name: law for law in (Uniform(), Foundation(), Elastic())}
