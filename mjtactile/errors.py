"""Every error and warning the package raises, so that callers can catch them by name; values in their messages."""

import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar, TypeVar

_Kind = TypeVar("_Kind")
#: Threads in `quiet_contacts`, by their numbers.
_quiet: list[int] = []
#: Most characters of a value in an error message.
_LONGEST = 120


class MjTactileError(Exception):
    """Base of all errors of this package: the message says what is wrong, what was expected and the cure."""

    #: Page in docs/ with more information, or None.
    page: ClassVar[str | None] = None


def of_type(kind: type[_Kind], name: str, value: object, error: type[MjTactileError], cure: str = "") -> _Kind:
    """An argument that must be of some type.

    Args:
        kind: the type.
        name: of the argument.
        value: the argument.
        error: what to raise.
        cure: what makes a value of that type, for example "MjSpec.compile() makes one"; empty if that is plain.

    Raises:
        MjTactileError: `error`, if the type differs.
    """
    if isinstance(value, kind):
        return value
    room = "" if kind.__module__ == "builtins" else kind.__module__.split(".")[0] + "."
    expected = f"{room}{kind.__name__}" + (f": {cure}" if cure else "")
    raise error(f"{name} is of type {type(value).__name__}; expected a {expected}.")


def shortened(value: object) -> str:
    """A value as text for an error message, cut if it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to convert integers with thousands of digits to text
        return "a very large number"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


class PadError(MjTactileError, ValueError):
    """A pad that cannot exist: a wrong size, material, taxel grid or depth."""

    page = "plugin.md"


class MeshError(MjTactileError, ValueError):
    """A finite-element mesh that cannot be made for the pad, or an unknown mesh name."""

    page = "benchmarks.md"


class PresetError(MjTactileError, ValueError):
    """An unknown preset, or one with a storage precision, reduction or contact law that does not exist."""

    page = "benchmarks.md"


class InfluenceError(MjTactileError, ValueError):
    """A request for something that influence matrices do not contain."""


class StaleInfluenceError(InfluenceError):
    """A saved table that was built for another pad, mesh or format version."""


class CorruptInfluenceError(InfluenceError):
    """A saved table that is damaged, or that lacks what its pad and fidelity need."""


class IndenterError(MjTactileError, ValueError):
    """An unknown indenter, or a geometry that has no usable outline or solid."""


class FootprintError(MjTactileError, ValueError):
    """A footprint that does not touch the pad or is not a valid area."""

    page = "contact.md"


class ContactError(MjTactileError, ValueError):
    """A wrench or a contact law that makes no sense: not finite, unknown name."""

    page = "contact.md"


class SceneError(MjTactileError, ValueError):
    """A MuJoCo model that lacks what the pad needs, or a press that never settles."""

    page = "plugin.md"


class NativeError(MjTactileError, RuntimeError):
    """The compiled core is missing, of another version, or cannot do what was asked."""


class MissingExtraError(MjTactileError, ImportError):
    """An optional package is not installed; the message gives the command that installs it."""


class DistributeError(MjTactileError, RuntimeError):
    """Workers that cannot be started or reached, or that are killed repeatedly during the same task."""

    page = "datasets.md"


class RenderError(MjTactileError, RuntimeError):
    """Off-screen OpenGL does not work, or an image has no size."""


class ContactWarning(UserWarning):
    """A wrench that the footprint cannot carry, or a contact outside the range of the linear model."""


@contextmanager
def quiet_contacts() -> Iterator[None]:
    """Issue no ContactWarning of what this thread presses or reads meanwhile, nor ever of an MjData that it makes.

    Filters of warnings stay as they are: they belong to all threads.
    """
    _quiet.append(threading.get_ident())
    try:
        yield
    finally:
        _quiet.remove(threading.get_ident())


def contacts_are_quiet() -> bool:
    """Whether this thread is in `quiet_contacts`, or is one that MuJoCo has started while another was.

    MuJoCo's batches make their data on such threads, which Python does not know.
    """
    own = threading.get_ident()
    return own in _quiet or (bool(_quiet) and all(one.ident != own for one in threading.enumerate()))


def warn_of_contact(text: str) -> None:
    """Issue a ContactWarning at the line outside of this package that led here, unless contacts are quiet.

    Warns:
        ContactWarning: with this text.
    """
    if contacts_are_quiet():
        return
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals["__name__"].partition(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, ContactWarning, stacklevel=level)


class MeshWarning(UserWarning):
    """A finite-element mesh coarser than those whose accuracy was measured."""


class InfluenceWarning(UserWarning):
    """A cached table that had to be rebuilt or could not be saved."""


class UnitError(MjTactileError, ValueError):
    """Text that is not a quantity with the unit that was expected."""


class OutputError(MjTactileError, OSError):
    """A file that cannot be written."""


class DatasetError(MjTactileError, ValueError):
    """A dataset that cannot be described, written, resumed or read."""

    page = "datasets.md"


class ViewError(MjTactileError, ValueError):
    """A live view that cannot be opened, recorded or replayed."""

    page = "view.md"


class DamagedPartError(DatasetError):
    """A damaged part; `make_dataset` makes it again."""


class TransducerError(MjTactileError, ValueError):
    """A transducer with invalid values, or readings that do not suit it."""


class RecognitionError(MjTactileError, ValueError):
    """Readings or weights that a recogniser cannot use."""

    page = "recognition.md"


class ControlError(MjTactileError, ValueError):
    """A controller with an invalid gain or stiffness, or a commanded force that does not press."""


class TrialsError(MjTactileError, ValueError):
    """Invalid settings of trials, or a file with results of other trials."""


class EnvError(MjTactileError, ValueError):
    """An environment was given an invalid option, or misused."""

    page = "environments.md"


class DatasetWarning(UserWarning):
    """A part of a dataset was damaged and is made again, or presses were left out."""
