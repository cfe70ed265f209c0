"""Warnings and counts of the compiled core, passed on to Python after the step, each warning once.

The core never calls Python from within a step. It asks to be called back when Python runs next, and hands over then
what there is to warn of: once for every pad, body and kind. How often a kind came up is counted (`health`) and told at
the end of the process.
"""

from __future__ import annotations

import atexit
import ctypes
import itertools
import os
import sys
import threading
import warnings
from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

from mjtactile.errors import ContactWarning

#: Numbers of which `Health` is made.
HEALTH_NUMBERS = 8
#: Whether contacts are warned of: set MJTACTILE_WARNINGS=0, or call `set_warnings`.
_enabled = os.environ.get("MJTACTILE_WARNINGS", "1") != "0"


class Note(ctypes.Structure):
    """`mjt_note` of native/plugin/plugin.h."""

    _fields_ = [
        ("context", ctypes.c_int64),
        ("event", ctypes.c_int),
        ("body", ctypes.c_int),
        ("pressure", ctypes.c_double),
        ("indentation", ctypes.c_double),
    ]


class Health(NamedTuple):
    """Counts of what went wrong in one pad's readings since it was made.

    Attributes:
        readings: how many there were with contact.
        beyond_range: contacts whose strains are not small.
        not_carried: contacts of which the sensing surface carries a part only.
        bounded: contacts whose law found no solution; they got the pressure that the pad bears at most.
        refused: contacts that could not be read.
        slow: readings that took more than 1 ms.
        very_slow: readings that took more than 5 ms.
        slowest: longest reading [s].
    """

    readings: int
    beyond_range: int
    not_carried: int
    bounded: int
    refused: int
    slow: int
    very_slow: int
    slowest: float

    @classmethod
    def of(cls, numbers: Any) -> Health:
        """Counts from the core's numbers, (HEALTH_NUMBERS,)."""
        readings, beyond, left, bounded, refused, slow, very_slow = (int(number) for number in numbers[:-1])
        return cls(readings, beyond, left, bounded, refused, slow, very_slow, float(numbers[-1]))


@dataclass(frozen=True)
class Names:
    """Names that warnings use: of the pad, its limits in words, and of the model's bodies."""

    pad: str
    pressure: str
    indentation: str
    bodies: tuple[str, ...]

    def body(self, number: int) -> str:
        """A body by its name; by its number where it has none."""
        if number < 0:
            return "a flex"
        name = self.bodies[number] if number < len(self.bodies) else ""
        return f"body '{name}'" if name else f"body number {number}"


_names: dict[int, Names] = {}
_numbers = itertools.count(1)
_warned: Counter[str] = Counter()
_lock = threading.Lock()


def register(names: Names) -> int:
    """Number under which the core speaks of a pad, until `release`."""
    number = next(_numbers)
    _names[number] = names
    return number


def release(number: int) -> None:
    """Forget a pad."""
    _names.pop(number, None)


def set_warnings(enabled: bool) -> None:
    """Switch warnings about contacts on or off in this process; `Health` counts those contacts either way.

    Args:
        enabled: whether contacts that a pad cannot carry, or that lie beyond small strains, cause a ContactWarning.
    """
    global _enabled
    _enabled = enabled


def deliver(library: ctypes.CDLL) -> None:
    """Warn of everything the core has noted since the last call.

    Where warnings are errors, the first is raised after the queue is empty; notes that stay in it would be taken for
    those of the next simulation. The other warnings are added to that error as notes.
    """
    note, fresh = Note(), []
    while library.mjt_plugin_next_note(ctypes.byref(note)):
        names = _names.get(int(note.context))
        if names is None or not _enabled:
            continue
        text = message(names, note)
        with _lock:
            _warned[text] += 1
            if _warned[text] == 1:
                fresh.append(text)
    raised: ContactWarning | None = None
    for text in fresh:
        try:
            warnings.warn(text, ContactWarning, stacklevel=2)
        except ContactWarning as error:
            if raised is None:
                raised = error
            else:
                raised.add_note(text)
    if raised is not None:
        raise raised


def message(names: Names, note: Note) -> str:
    """What a note says; the same text for the same pad, body and kind."""
    who = f"pad '{names.pad}', {names.body(int(note.body))}"
    return (
        f"{who}: strains are no longer small ({names.pressure}, or {names.indentation}), and the readings of this "
        "linear model are too simple there.",
        f"{who}: a part of its contact force acts beside the sensing surface, or along it harder than the contact can "
        "carry. The nearest load that the surface carries is read; output 'carried' says which.",
        f"{who}: no contact was found as its law wants it: the pressure is spread over as much area as it needs at the "
        "top layer's modulus, or the shear in proportion to the pressure.",
        f"{who}: nothing is read from it. It presses where nothing of its geometry faces the sensing surface, or its "
        "contact force is not finite.",
    )[int(note.event)]


@atexit.register
def _tell_counts() -> None:
    again = sum(_warned.values()) - len(_warned)
    if _enabled and again > 0:
        print(
            f"mjtactile: {len(_warned)} warnings of contacts came up {again} more times in other simulations.",
            file=sys.stderr,
        )
