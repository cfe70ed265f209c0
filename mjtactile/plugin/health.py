"""Warnings and counts of the compiled core, passed to Python after the step.

The core never calls Python during a step. It schedules a call for the next time that Python's main thread runs, which
issues one warning for every pad, body and kind, however many simulations follow one another. Under other filters, such
as those of each `warnings.catch_warnings`, it is issued anew. All occurrences are counted (`Health`), and those in
other simulations reported at the end of the process. Readings that Python asks for bring their own warnings.
"""

from __future__ import annotations

import atexit
import ctypes
import itertools
import os
import threading
import warnings
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from mjtactile._progress import say
from mjtactile.contact.linear_range import APPROXIMATE
from mjtactile.errors import ContactWarning, SceneError, contacts_are_quiet, of_type

#: Whether contacts cause warnings; MJTACTILE_WARNINGS=0 or `set_warnings` switch them off.
_enabled = os.environ.get("MJTACTILE_WARNINGS", "1") != "0"


class Note(ctypes.Structure):
    """A problem that the core has noted, as struct `mjt_note` of native/plugin/plugin.h."""

    _fields_ = [
        ("context", ctypes.c_int64),
        ("event", ctypes.c_int),
        ("body", ctypes.c_int),
        ("pressure", ctypes.c_double),
        ("indentation", ctypes.c_double),
    ]


class Health(NamedTuple):
    """Counts of problems in one pad's readings since it was made.

    Attributes:
        readings: number of readings with contact.
        beyond_range: contacts whose strains are not small.
        not_carried: contacts whose wrench the sensing surface carries only in part.
        approximated: contacts for which no solution of the law, or of its shear, was found; they have a simpler answer.
        refused: contacts that could not be solved.
        resized: readings while the pad's geom had another size than the pad, which has to keep its size.
        behind: contacts with the pad's back, which reads nothing.
        slow: readings that took more than 1 ms.
        very_slow: readings that took more than 5 ms.
        slowest: longest reading [s].
    """

    readings: int
    beyond_range: int
    not_carried: int
    approximated: int
    refused: int
    resized: int
    behind: int
    slow: int
    very_slow: int
    slowest: float

    @classmethod
    def of(cls, numbers: Any) -> Health:
        """Counts from the core's numbers, (HEALTH_NUMBERS,)."""
        counts = [int(number) for number in numbers[:-1]]
        return cls._make([*counts, float(numbers[-1])])


#: Number of fields of `Health`.
HEALTH_NUMBERS = len(Health._fields)


@dataclass(frozen=True)
class Names:
    """Texts for the warnings of one pad."""

    pad: str  #: name of the pad
    pressure: str  #: its limit of pressure in words
    indentation: str  #: its limit of indentation in words
    bodies: tuple[str, ...]  #: names of the model's bodies, by id
    quiet: bool  #: whether nothing is told of it
    asked: bool  #: whether it is read when Python asks for it, which then delivers what that reading notes

    def body(self, number: int) -> str:
        """A body in words, by its id: with its name or, without one, its number; "a flex" for a negative id."""
        if number < 0:
            return "a flex"
        name = self.bodies[number] if number < len(self.bodies) else ""
        return f"body '{name}'" if name else f"body number {number}"


_names: dict[int, Names] = {}
#: What the core has noted and Python has not told yet: number and names of the pad, and the note.
_waiting: deque[tuple[int, Names, Note]] = deque()
#: Held while notes get their names. A thread may hold it twice: pads are released wherever garbage is collected.
_naming = threading.RLock()
_numbers = itertools.count(1)
_warned: Counter[str] = Counter()
_issued: set[str] = set()
#: Filters under which the warnings in `_issued` were issued, and what they were: `warnings.catch_warnings` replaces the
#: list, `warnings.simplefilter` what is in it.
_filters: tuple[Any, tuple[Any, ...]] = (None, ())
_lock = threading.Lock()


def register(names: Names) -> int:
    """Store the names of a pad and return the number by which the core refers to it, until `release`."""
    number = next(_numbers)
    _names[number] = names
    return number


def release(core: ctypes.CDLL, number: int) -> None:
    """Forget the names of a pad, apart from notes that wait to be told."""
    with _naming:
        _fetch(core)
        _names.pop(number, None)


def _fetch(core: ctypes.CDLL) -> None:
    """Take the core's notes over, with the names that they are about."""
    with _naming:
        while core.mjt_plugin_next_note(ctypes.byref(note := Note())):
            number = int(note.context)
            if number in _names:
                _waiting.append((number, _names[number], note))


def _taken(core: ctypes.CDLL, reader: int | None) -> Iterator[tuple[Names, Note]]:
    """Take the notes of one reader or, for None, of all pads that are read in steps."""
    _fetch(core)
    for _ in range(len(_waiting)):
        with _naming:
            if not _waiting:
                return
            number, names, note = _waiting.popleft()
            mine = not names.asked if reader is None else number == reader
            if not mine:
                _waiting.append((number, names, note))
        if mine:
            yield names, note


def set_warnings(enabled: bool) -> None:
    """Switch warnings about contacts on or off in this process; `Health` counts those contacts either way.

    Args:
        enabled: whether contacts that a pad cannot carry, or with large strains, cause a ContactWarning.

    Raises:
        SceneError: it is neither True nor False.
    """
    global _enabled
    _enabled = of_type(bool, "enabled", enabled, SceneError)


def deliver(core: ctypes.CDLL, stacklevel: int, reader: int | None = None) -> None:
    """Issue warnings for what the core has noted since the last call.

    If warnings are errors, the first is raised after the queue is empty, because remaining notes would be attributed to
    the next simulation. The other warnings are added to that error as notes.

    Args:
        core: the compiled core.
        stacklevel: of the code that the warnings point at, as for `warnings.warn`, counted from the caller.
        reader: number of the reader whose notes are told; None for those of all steps.

    Warns:
        ContactWarning: once for every pad, body and kind of problem; where warnings are errors, in every simulation.
    """
    fresh = []
    for names, note in _taken(core, reader):
        if not _enabled or (names.quiet if reader is None else contacts_are_quiet()):
            continue
        text = message(names, note)
        with _lock:
            _warned[text] += 1
        if not _is_issued(text):
            fresh.append(text)
    raised: ContactWarning | None = None
    for text in fresh:
        try:
            warnings.warn(text, ContactWarning, stacklevel=stacklevel + 1)
            _issued.add(text)
        except ContactWarning as error:
            if raised is None:
                raised = error
            else:
                raised.add_note(text)
    if raised is not None:
        raise raised


def _is_issued(text: str) -> bool:
    """Whether a warning was issued, and not raised, under the filters of warnings as they are now."""
    global _filters
    with _lock:
        rules = tuple(warnings.filters)
        if warnings.filters is not _filters[0] or rules != _filters[1]:
            _filters = warnings.filters, rules
            _issued.clear()
        return text in _issued


def message(names: Names, note: Note) -> str:
    """Text of a warning; the same for the same pad, body and kind of problem."""
    who = f"pad '{names.pad}', {names.body(int(note.body))}"
    return (
        f"{who}: strains are no longer small ({names.pressure}, or {names.indentation}), so {APPROXIMATE}",
        f"{who}: a part of its contact force acts beside the sensing surface, or along it harder than the contact can "
        "carry. The nearest load that the surface carries is read; output 'carried' says which.",
        f"{who}: no solution of its contact law was found. The pressure is spread over the area that the force needs "
        "at the top layer's modulus, or the shear is spread in proportion to the pressure.",
        f"{who}: nothing is read from it. It presses where nothing of its geometry faces the sensing surface, or its "
        "contact force is not finite.",
        f"pad '{names.pad}': its geom has changed its size since the simulation was made. The tables are those of the "
        "first size. Leave geom_size of pads as it is, or make a model for each size.",
        f"{who}: it presses on the pad's back, where nothing is read. The sensing surface is on the pad's +z side. "
        "Turn the pad by `quat` if it faces the wrong way.",
        f"pad '{names.pad}': its readings are NaN, because the simulation (MjData) is stepped with another model than "
        "it was made for, whose sensor has other attributes or another place. Make an MjData of each such model; give "
        "mujoco.rollout only models together whose sensors are alike.",
        f"pad '{names.pad}': a flex that touches it, or may touch it, is not felt, because MuJoCo does not tell its "
        'contact forces. Those of flexes with <contact passive="true"/> are not told, nor are those of two-dimensional '
        'flexes under <flag ipc="enable"/>: leave the attribute out.',
    )[int(note.event)]


@atexit.register
def _tell_counts() -> None:
    again = sum(_warned.values()) - len(_warned)
    if _enabled and again > 0:
        kinds = f"{len(_warned)} contact warnings" if len(_warned) > 1 else "a contact warning"
        say(f"{kinds} came up {again} more {'times' if again > 1 else 'time'} in other simulations.")
