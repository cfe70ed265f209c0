"""Pads and presses with all data that a contact law and its shear need."""

from __future__ import annotations

import weakref
from collections.abc import Sequence

from mjtactile.contact.core_pad import contact_pad, give_shear, give_springs
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.foundation import foundation_springs
from mjtactile.contact.options import ContactOptions, Wrench
from mjtactile.contact.press import Press, Solved
from mjtactile.influence.core_pad import CorePad
from mjtactile.influence.matrices import InfluenceMatrices


def ready_pad(influence: InfluenceMatrices, options: ContactOptions, *, stress: bool = False) -> CorePad:
    """The core's pad with the data for the given options and, if `stress`, for stress tensors; see `contact_pad`."""
    pad = contact_pad(influence, stress=stress)
    if options.contact_law.springs:
        give_springs(pad, *foundation_springs(influence))
    if options.choice.couples:
        give_shear(pad, influence)
    return pad


def new_press(influence: InfluenceMatrices, options: ContactOptions) -> Press:
    """A new `Press` with the springs that law "foundation" needs."""
    return Press(influence, options, springs=foundation_springs(influence) if options.contact_law.springs else None)


_Pool = dict[ContactOptions, list[Press]]
_presses: weakref.WeakKeyDictionary[InfluenceMatrices, _Pool] = weakref.WeakKeyDictionary()


def solved_bodies(
    influence: InfluenceMatrices, footprints: Sequence[Footprint], wrenches: Sequence[Wrench], options: ContactOptions
) -> list[Solved]:
    """`Press.loads` of a press that is kept and reused for the same options, in one thread at a time."""
    free = _presses.setdefault(influence, {}).setdefault(options, [])
    press = free.pop() if free else new_press(influence, options)
    try:
        return press.loads(footprints, wrenches)
    finally:
        free.append(press)
