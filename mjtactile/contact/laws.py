"""Contact laws: what each is called, and what it knows of body and pad. The core's class of that name solves it.

A law is one class here and one in native/core/contact/laws; nothing else tells them apart.
"""

from __future__ import annotations

from typing import ClassVar

from mjtactile.contact.tangentials import TANGENTIALS


class ContactLaw:
    """How a body's pressure spreads over what it touches.

    Attributes:
        name: users and the core know it by.
        tangentials: ways shear may spread under it.
        springs: whether it needs the springs that stand for the pad.
        shapes: whether it knows how the pad gives, looks at a curved body's shape and finds its indentation and tilt;
            otherwise the body presses with its lowest part.
    """

    name: ClassVar[str]
    tangentials: ClassVar[tuple[str, ...]] = ("proportional",)
    springs: ClassVar[bool] = False
    shapes: ClassVar[bool] = True


class Uniform(ContactLaw):
    """A pressure that is constant but for the gradient that carries the moment, and zero where it would pull."""

    name = "uniform"
    shapes = False


class Foundation(ContactLaw):
    """Springs under the body's true shape, as stiff as the pad is under a face of the same area."""

    name = "foundation"
    springs = True


class Elastic(ContactLaw):
    """The pad's own compliance against the rigid body: pressure where they touch, a gap where they do not."""

    name = "elastic"
    tangentials = TANGENTIALS


#: All of them by name.
BY_NAME: dict[str, ContactLaw] = {law.name: law for law in (Uniform(), Foundation(), Elastic())}
