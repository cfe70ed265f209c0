"""Specification of a dataset of presses, read from a TOML file.

The file has millimetres, gram-force and degrees, as the files in benchmarks/; the values here are in SI units. A range
is a pair of numbers, the limits of a uniform distribution, or a single number.
"""

from __future__ import annotations

import hashlib
import json
import math
import tomllib
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from mjtactile._files import path_from, read_text, why_unread
from mjtactile._types import Array
from mjtactile.contact.options import contact_options
from mjtactile.contact.tangentials import WITHOUT_FRICTION
from mjtactile.dataset.hardware import transducer_for
from mjtactile.dataset.shapes import SHAPE_NAMES, mesh_digest, shape_face
from mjtactile.errors import ContactError, DatasetError, PadError, of_type, shortened
from mjtactile.fidelity import CONTACT_LAWS, DEFAULT, PRESETS
from mjtactile.pad import Pad
from mjtactile.pad_names import pad_from_file, pad_from_values
from mjtactile.units import GRAM_FORCE, MILLIMETRE, MOST_NOISE, MOST_PRESSES, MOST_SEED, finite_number, is_whole

Range = tuple[float, float]

BACKENDS = ("physics", "mujoco")
#: Largest number of presses of one outline, poses times forces; they are made together.
MOST_PER_OUTLINE = 10_000
#: Largest force [gf], far outside the linear range of any pad; backend "mujoco" has a smaller limit.
MOST_FORCE = 10_000.0

#: Unit of a range in the file, in SI units, and its name; least and largest value in that unit.
_Limits = tuple[float, str, float, float]
_DEGREE = math.pi / 180.0
_CONTACT_LIMITS: dict[str, _Limits] = {
    "size": (1.0, "", 1e-3, 1e3),
    "shift": (MILLIMETRE, " mm", -math.inf, math.inf),
    "rotation": (_DEGREE, " deg", -math.inf, math.inf),
    "force": (GRAM_FORCE, " gf", 1e-6, MOST_FORCE),
    "tilt": (_DEGREE, " deg", 0.0, 89.0),
    "azimuth": (_DEGREE, " deg", -math.inf, math.inf),
}
_NOISE_LIMITS: _Limits = (1.0, "", 0.0, MOST_NOISE)


@dataclass(frozen=True, kw_only=True)
class ContactSpec:
    """One kind of contact: bodies, positions and forces.

    Raises:
        DatasetError: the shapes are no names, or the weight, a range or the share `upright` is invalid; the message
            names it.
    """

    shapes: tuple[str, ...]  #: names of shapes.SHAPE_NAMES, or paths of mesh files
    weight: float = 1.0  #: relative number of presses, compared with the other kinds [-]
    size: Range = (1.0, 1.0)  #: relative to the shape's own [-]
    shift: Range = (0.0, 0.0)  #: along x and along y, each [m]
    rotation: Range = (0.0, 2.0 * math.pi)  #: counter-clockwise [rad]
    force: Range = (5 * GRAM_FORCE, 200 * GRAM_FORCE)  #: magnitude [N]
    tilt: Range = (0.0, math.radians(35.0))  #: angle of the force to the pad's inward normal [rad]
    azimuth: Range = (0.0, 2.0 * math.pi)  #: direction of the tangential force, from +x towards +y [rad]
    upright: float = 0.0  #: fraction of the presses whose force is not tilted [-]

    def __post_init__(self) -> None:
        """Refuse numbers out of range, and make those of NumPy ones of Python, which are written as JSON."""
        object.__setattr__(self, "shapes", _shape_names(self.shapes))
        if not finite_number(self.weight) > 0.0:
            raise DatasetError(f"[[contact]] weight = {shortened(self.weight)}; expected a positive number.")
        object.__setattr__(self, "weight", _plain(self.weight))
        for name, limits in _CONTACT_LIMITS.items():
            object.__setattr__(self, name, _range(f"[[contact]] {name}", getattr(self, name), limits))
        object.__setattr__(self, "upright", _share("[[contact]] upright", self.upright))


@dataclass(frozen=True, kw_only=True)
class DatasetSpec:
    """A dataset; make it with `load_spec`.

    Raises:
        DatasetError: there is no contact; a backend, fidelity, law or distribution of shear does not exist; a number is
            out of range, a law does not know a distribution of shear, bodies would be beyond a curved pad, press scenes
            cannot make a force, or the transducer or the pad is invalid.
        TransducerError: a value of the transducer is outside its range, or does not suit the pad.
    """

    contacts: tuple[ContactSpec, ...]
    presses: int = 1000  #: number of presses
    seed: int = 0  #: of all random numbers
    backend: str = "physics"  #: "physics": contact laws alone; "mujoco": simulated press scenes
    presets: tuple[str, ...] = (DEFAULT,)  #: fidelities by name, drawn with equal probability
    laws: tuple[str, ...] = ("elastic",)  #: contact laws, drawn with equal probability
    tangential: tuple[str, ...] = ("proportional",)  #: distributions of shear, drawn with equal probability
    free: float = 0.0  #: fraction of the bodies that may tilt; the force then acts at their origin [-]
    poses: int = 6  #: successive poses of each outline; cells of a moved outline cost a fifth of new ones
    forces: int = 4  #: successive forces at each pose; a further force at the same pose costs almost nothing
    noise: Range = (0.0, 0.0)  #: standard deviation of additive noise, relative to the press's largest reading [-]
    transducer: dict[str, Any] | None = field(default=None, hash=False)  #: "name" and parameters; see hardware.py
    pad: Pad = field(default_factory=Pad)  #: the pad that is pressed

    def __post_init__(self) -> None:
        """Refuse unknown names, numbers out of range, and what does not go together.

        That is laws, transducer, pad, positions and forces. Numbers of NumPy become ones of Python.
        """
        contacts = tuple(self.contacts) if isinstance(self.contacts, list | tuple) else ()
        if not contacts or not all(isinstance(one, ContactSpec) for one in contacts):
            raise DatasetError(f"contacts = {shortened(self.contacts)}; expected at least one ContactSpec(shapes=...).")
        object.__setattr__(self, "contacts", contacts)
        if self.backend not in BACKENDS:
            raise DatasetError(f"backend {self.backend!r} does not exist. Available: {', '.join(BACKENDS)}.")
        known = {"presets": tuple(PRESETS), "laws": CONTACT_LAWS, "tangential": WITHOUT_FRICTION}
        for name, available in known.items():
            object.__setattr__(self, name, _known(name, getattr(self, name), available))
        of_type(Pad, "pad", self.pad, DatasetError, "pad_from_file(...) reads one")
        limits = {"presses": (1, MOST_PRESSES), "seed": (0, MOST_SEED)}
        limits |= dict.fromkeys(("poses", "forces"), (1, MOST_PER_OUTLINE))
        for name, (least, most) in limits.items():
            object.__setattr__(self, name, _count(name, getattr(self, name), least, most))
        if self.presses_per_outline > MOST_PER_OUTLINE:
            raise DatasetError(
                f"poses = {self.poses} times forces = {self.forces} presses share one outline; expected at most "
                f"{MOST_PER_OUTLINE}."
            )
        object.__setattr__(self, "free", _share("free", self.free))
        object.__setattr__(self, "noise", _range("noise", self.noise, _NOISE_LIMITS))
        _check_laws(self.laws, self.tangential)
        if self.transducer is not None:
            transducer_for(self.transducer, self.pad.reading_shape, seed=0)
        if not self.pad.surface.is_flat:
            for contact in self.contacts:
                _check_on_pad(contact.shift, self.pad)
        if self.backend == "mujoco":
            for contact in self.contacts:
                _check_forces(contact)

    @property
    def presses_per_outline(self) -> int:
        """Number of presses that share one outline, the unit of work."""
        return self.poses * self.forces

    @property
    def description(self) -> dict[str, Any]:
        """The specification as plain values."""
        values = {**asdict(self), "pad": self.pad.description}
        return json.loads(json.dumps(values, default=lambda number: number.tolist()))  # a transducer's may be NumPy's

    @property
    def fingerprint(self) -> str:
        """SHA-256 of everything but the number of presses, so that a dataset can be extended.

        The contents of mesh files are included.

        Raises:
            IndenterError: a mesh file cannot be read.
        """
        values = {name: value for name, value in self.description.items() if name != "presses"}
        meshes = {shape for contact in self.contacts for shape in contact.shapes if shape not in SHAPE_NAMES}
        if meshes:
            values["meshes"] = {mesh: mesh_digest(mesh) for mesh in meshes}
        return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def load_spec(path: str | Path) -> DatasetSpec:
    """Read a dataset's TOML file.

    Args:
        path: of the file. A file name in `pad` is relative to its folder, those of meshes to the working folder.

    Raises:
        DatasetError: the path is none, the file cannot be read, or an entry is invalid; the message names the entry.
        IndenterError, PadError, TransducerError: as `parse_spec`.
    """
    path = path_from(path, "path", DatasetError)
    try:
        values = tomllib.loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise DatasetError(
            f"cannot read {path} as a dataset's TOML file: {why_unread(error)}. Expected lines such as presses = 1000."
        ) from error
    return parse_spec(values, path.parent)


def parse_spec(values: dict[str, Any], folder: Path = Path()) -> DatasetSpec:
    """A dataset from the values of a TOML file; a file name in `pad` is relative to `folder`.

    Raises:
        DatasetError: an entry is invalid; the message names the entry.
        IndenterError: there is no such shape.
        PadError: the pad is invalid.
        TransducerError: a value of the transducer is outside its range.
    """
    known = {"presses", "seed", "backend", "fidelity", "law", "tangential", "free", "poses", "forces", "noise"}
    _refuse_unknown("the dataset", values, {*known, "transducer", "pad", "contact"})
    contacts = values.get("contact", [])
    if not isinstance(contacts, list) or not contacts:
        raise DatasetError("there is no [[contact]]: expected at least one, with shapes = [...].")
    backend, *others = _names(values, "backend", "physics", BACKENDS)
    if others:
        raise DatasetError(f"backend = {[backend, *others]}; expected one of {', '.join(BACKENDS)}.")
    return DatasetSpec(
        contacts=tuple(_contact(entry) for entry in contacts),
        backend=backend,
        presets=_names(values, "fidelity", DEFAULT, tuple(PRESETS)),
        laws=_names(values, "law", "elastic", CONTACT_LAWS),
        tangential=_names(values, "tangential", "proportional", WITHOUT_FRICTION),
        free=_as_float(values.get("free", 0.0)),
        noise=_in_si(values.get("noise", 0.0), 1.0),
        transducer=values.get("transducer"),
        pad=pad_from(values.get("pad", {}), folder),
        **{name: values[name] for name in ("presses", "seed", "poses", "forces") if name in values},
    )


def spec_from(description: dict[str, Any]) -> DatasetSpec:
    """The specification from a `DatasetSpec.description`, as stored with datasets and weights."""
    contacts = tuple(ContactSpec(**_with_tuples(entry)) for entry in description["contacts"])
    values = _with_tuples(description)
    return DatasetSpec(**{**values, "contacts": contacts, "pad": pad_from(description["pad"])})


def _contact(entry: dict[str, Any]) -> ContactSpec:
    _refuse_unknown(
        "[[contact]]", entry, {"shapes", "weight", "size", "shift", "rotation", "force", "tilt", "azimuth", "upright"}
    )
    shapes = _shape_names(entry.get("shapes", []))
    for shape in shapes:
        shape_face(shape)
    given = {"weight": len(shapes), "shift": 0.0, **entry}
    if _is_number(given["shift"]):
        given["shift"] = [-given["shift"], given["shift"]]
    ranges = {name: _in_si(given[name], unit) for name, (unit, *_) in _CONTACT_LIMITS.items() if name in given}
    shares = {name: _as_float(given[name]) for name in ("weight", "upright") if name in given}
    return ContactSpec(shapes=shapes, **ranges, **shares)


def _shape_names(shapes: object) -> tuple[str, ...]:
    """Names of shapes, or paths of mesh files, as a tuple, checked."""
    if not (isinstance(shapes, list | tuple) and shapes and all(isinstance(shape, str) for shape in shapes)):
        raise DatasetError(
            f"[[contact]] shapes = {shortened(shapes)}; expected a list of names, for example ['star', 'sphere']."
        )
    return tuple(shapes)


def pad_from(values: dict[str, Any] | str, folder: Path = Path()) -> Pad:
    """A pad in SI units from the values or the name of a pad's TOML file (`pad_from_file`); by default the default pad.

    File names are relative to `folder`.

    Raises:
        DatasetError: a value is unknown.
        PadError: `Pad` refuses the values, or a file cannot be read.
    """
    if isinstance(values, str):
        return pad_from_file(folder / values)
    _refuse_unknown("[pad]", values, {"size", "layers", "taxels", "depths", "sampling_radius", "surface"})
    try:
        return pad_from_values(values, folder)
    except PadError as error:
        raise PadError(f"[pad]: {error}") from error


def _check_on_pad(shift: Range, pad: Pad) -> None:
    """Refuse positions beyond a curved pad's edge, where there is no surface to touch."""
    most = min(pad.size) / 2
    if max(abs(shift[0]), abs(shift[1])) > most:
        raise DatasetError(
            f"[[contact]] shift from {shift[0] / MILLIMETRE:g} to {shift[1] / MILLIMETRE:g} mm reaches beyond the "
            f"curved pad, which ends {most / MILLIMETRE:g} mm from its middle. Give a smaller shift."
        )


def _check_laws(laws: tuple[str, ...], tangential: tuple[str, ...]) -> None:
    """Refuse a contact law and a distribution of shear that would be drawn together, but cannot be."""
    for law in laws:
        for one in tangential:
            try:
                contact_options(PRESETS[DEFAULT], law=law, tangential=one)
            except ContactError as error:
                raise DatasetError(
                    f"law and tangential are drawn independently, but {error} Leave one of them out, or make a dataset "
                    "of each."
                ) from error


def _check_forces(contact: ContactSpec) -> None:
    """Refuse forces that the actuators of press scenes cannot make; each of them makes one component."""
    force, quarter = contact.force[1], math.pi / 2
    across = force * math.sin(0.0 if contact.upright == 1.0 else contact.tilt[1])
    low, high = contact.azimuth
    components = {
        "x": across * _largest_cosine(low, high),
        "y": across * _largest_cosine(low - quarter, high - quarter),
        "z": force * math.cos(0.0 if contact.upright > 0.0 else contact.tilt[0]),
    }
    for (axis, component), most in zip(components.items(), _scene_forces().tolist(), strict=True):
        if component > most:
            raise DatasetError(
                f"[[contact]] forces up to {force / GRAM_FORCE:.6g} gf may have {component / GRAM_FORCE:.6g} gf along "
                f"{axis}, but with backend 'mujoco' a press has at most {math.floor(most / GRAM_FORCE)} gf along it. "
                "Give a smaller force, or backend = 'physics'."
            )


def _largest_cosine(low: float, high: float) -> float:
    """Largest absolute value of the cosine among the angles of a range [rad]."""
    return 1.0 if math.ceil(low / math.pi) <= high / math.pi else max(abs(math.cos(low)), abs(math.cos(high)))


@cache
def _scene_forces() -> Array:
    """Largest components of the force on the indenter of a press scene, along x, y and z [N], (3,)."""
    from mjtactile.sim.press_scene import press_scene

    model = press_scene("circle")
    ranges = model.actuator_ctrlrange[[model.actuator(f"press_{axis}").id for axis in "xyz"]]
    return np.abs(ranges).min(axis=1)


def _with_tuples(values: dict[str, Any]) -> dict[str, Any]:
    """The same values with lists as tuples."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}


def _refuse_unknown(where: str, values: Any, known: set[str]) -> None:
    if not isinstance(values, dict):
        raise DatasetError(f"{where} is {shortened(values)}; expected a table with entries {', '.join(sorted(known))}.")
    unknown = sorted(set(values) - known)
    if unknown:
        raise DatasetError(
            f"{where} has no entry {', '.join(map(repr, unknown))}. Available: {', '.join(sorted(known))}."
        )


def _is_number(value: object) -> bool:
    return math.isfinite(finite_number(value))


def _count(name: str, value: object, least: int, most: int) -> int:
    if not (is_whole(value) and least <= value <= most):
        raise DatasetError(f"{name} = {shortened(value)}; expected a whole number from {least} to {most}.")
    return int(value)


def _plain(number: Any) -> float:
    """A number that was checked, as one of Python; whole numbers stay whole, on which fingerprints depend."""
    return int(number) if is_whole(number) else float(number)


def _share(name: str, value: object) -> float:
    """A share as a number of Python, checked."""
    if not 0.0 <= finite_number(value) <= 1.0:
        raise DatasetError(f"{name} = {shortened(value)}; expected a share from 0 to 1.")
    return _plain(value)


def _names(values: dict[str, Any], name: str, default: str, known: tuple[str, ...]) -> tuple[str, ...]:
    return _known(name, values.get(name, default), known)


def _known(name: str, given: Any, known: tuple[str, ...]) -> tuple[str, ...]:
    """Names of which each is known; a single one may be given alone."""
    names = tuple(given) if isinstance(given, list | tuple) else (given,)
    for one in names:
        if one not in known:
            raise DatasetError(f"{name} {one!r} does not exist. Available: {', '.join(known)}.")
    if not names:
        raise DatasetError(f"{name} is empty. Available: {', '.join(known)}.")
    return names


def _as_float(value: Any) -> Any:
    """A number as a float; what is none stays as it is, and the specification refuses it."""
    return float(value) if _is_number(value) else value


def _in_si(given: Any, unit: float) -> Any:
    """A range of the file in SI units; a single number is both limits.

    What is no range stays as it is, and the specification refuses it.
    """
    pair = (given, given) if _is_number(given) else given
    return tuple(value * unit for value in pair) if _is_pair(pair) else given


def _is_pair(given: object) -> TypeGuard[Range]:
    return isinstance(given, list | tuple) and len(given) == 2 and all(map(_is_number, given))


def _range(name: str, given: object, limits: _Limits) -> Range:
    """A range in SI units, as numbers of Python, checked; error messages have the units of the file."""
    given = given.tolist() if isinstance(given, np.ndarray) else given
    if not _is_pair(given):
        one = finite_number(given)
        such = "" if math.isnan(one) else f", such as [{one:g}, {one:g}]"
        raise DatasetError(f"{name} = {shortened(given)}; expected [low, high]{such}.")
    unit, of, least, most = limits
    (low, high), said = given, f"{name} = [{given[0] / unit:.6g}, {given[1] / unit:.6g}]{of}"
    if low > high:
        raise DatasetError(f"{said}; expected [low, high] with low <= high.")
    if low < least * unit or high > most * unit:
        raise DatasetError(f"{said}; expected values from {least:g} to {most:g}{of}.")
    return _plain(low), _plain(high)
