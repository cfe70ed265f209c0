"""Fidelities by name: the trade between the time of a reading and its error.

A preset bundles the choices that trade speed for accuracy: the mesh, how its influence matrices are stored, and how
the contact pressure is found. The contact law and its number of cells can be changed later; the other choices decide
which table is built.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from mjtactile.errors import MeshError, PresetError, shortened
from mjtactile.pad import Pad
from mjtactile.units import finite_number, is_whole

#: Storage precisions of the stress matrices, coarse to fine.
PRECISIONS = ("int8", "float16", "float32", "float64")
#: How a taxel's stress becomes one reading. "points": the mean over the sample points of the von Mises stress.
#: "quarters": the mean stress tensor over each quarter of the taxel's ball, then the mean of their von Mises stresses.
#: "mean": the von Mises stress of the mean stress tensor over the ball.
AVERAGINGS = ("points", "quarters", "mean")
#: Where nodal forces may act: at all nodes of the surface, or at the elements' corners only.
LOADS = ("nodes", "corners")
#: Contact laws a preset may name.
CONTACT_LAWS = ("uniform", "foundation", "elastic")
#: Reference length over the shallowest sensing depth, as on the paper's pad [-].
_DEPTHS_PER_LENGTH = 5.0
#: Smallest value of a density's sizes and gradings [-].
_LEAST = 1e-6


@dataclass(frozen=True, kw_only=True)
class MeshDensity:
    """How finely a pad is meshed and sampled.

    Sizes are relative to a reference length, over which the sensed stress varies: the smaller of the sheet's thickness
    and five times the shallowest sensing depth (both are 5 mm on the paper's pad). `most_elements` bounds the cost of
    wide or thin sheets. Where elements would then be wider than 0.6 reference lengths, there are more, up to 2.5 times
    as many. A MeshWarning is issued where the bounds make the mesh coarser. A sheet whose elements would be more than
    1.5 times as wide as it is thick is refused, unless `reference_length` is given.

    Raises:
        MeshError: a number is outside its range.
    """

    in_plane_size: float  #: mean element size in the plane over the reference length [-]
    through_size: float  #: mean element size across the thickness over the reference length [-]
    rim_grading: float  #: size of the middle element over that of the rim element, on a flat pad [-]
    base_grading: float  #: size of the top element over that of the base element [-]
    #: Sample points along each axis of a taxel's ball, for each sensing layer; the last number repeats.
    points_per_axis: tuple[int, ...]
    most_elements: int = 800  #: bound on elements in the plane of the sheet, see above; tables grow with its square
    reference_length: float | None = None  #: length that sizes are relative to [m]; None: as described above

    def __post_init__(self) -> None:
        for name in ("in_plane_size", "through_size", "rim_grading", "base_grading", "reference_length"):
            value = getattr(self, name)
            if value is None and name == "reference_length":
                continue
            number = finite_number(value)
            if not _LEAST <= number <= 1 / _LEAST:
                raise MeshError(
                    f"{name} = {shortened(value)}; expected a positive number, {_LEAST:g} to {1 / _LEAST:g}."
                )
            object.__setattr__(self, name, number)
        points, most = self.points_per_axis, self.most_elements
        if not (isinstance(points, tuple) and points and all(is_whole(n) and 1 <= n <= 8 for n in points)):
            raise MeshError(
                f"points_per_axis = {shortened(points)}; expected whole numbers from 1 to 8, for example (2,)."
            )
        if not (is_whole(most) and most >= 16):
            raise MeshError(f"most_elements = {shortened(most)}; expected a whole number of at least 16.")
        object.__setattr__(self, "points_per_axis", tuple(map(int, points)))
        object.__setattr__(self, "most_elements", int(most))

    def length_for(self, pad: Pad) -> float:
        """The reference length on a pad [m]."""
        if self.reference_length is not None:
            return self.reference_length
        shallowest = min(map(max, pad.sensed_depths, pad.sensed_radii))
        return min(pad.thickness, _DEPTHS_PER_LENGTH * shallowest)

    def points_at(self, sensing_layer: int) -> int:
        """Sample points per axis of one sensing layer, counted from the top."""
        return self.points_per_axis[min(sensing_layer, len(self.points_per_axis) - 1)]


#: Named meshes, coarse to fine. Cost and error on the paper's pad: docs/benchmarks.md, from `mjtactile bench mesh`.
MESHES: dict[str, MeshDensity] = {
    "draft": MeshDensity(in_plane_size=0.3, through_size=0.2, rim_grading=1.0, base_grading=1.0, points_per_axis=(2,)),
    "default": MeshDensity(
        in_plane_size=0.15, through_size=0.125, rim_grading=2.0, base_grading=0.75, points_per_axis=(2,)
    ),
    # For loads="corners", whose resolution is the distance between corners: element sizes vary little over the sheet.
    "even": MeshDensity(
        in_plane_size=0.137,
        through_size=0.125,
        rim_grading=1.4,
        base_grading=0.75,
        points_per_axis=(2,),
        most_elements=1000,
    ),
    "fine": MeshDensity(
        in_plane_size=0.125,
        through_size=1 / 12,
        rim_grading=2.0,
        base_grading=0.75,
        points_per_axis=(3, 2),
        most_elements=1100,
    ),
}


def mesh_density(mesh: str | MeshDensity) -> MeshDensity:
    """The density of a named mesh; a MeshDensity is returned unchanged.

    Raises:
        MeshError: when no mesh has that name; the message lists those that exist.
    """
    if isinstance(mesh, MeshDensity):
        return mesh
    if not (isinstance(mesh, str) and mesh in MESHES):
        known = ", ".join(MESHES)
        raise MeshError(f"mesh {shortened(mesh)} does not exist. Available: {known}; or pass a MeshDensity.")
    return MESHES[mesh]


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Choices that trade speed for accuracy; by default the mesh is "default", and nothing is reduced.

    Raises:
        PresetError: for a choice that does not exist.
        MeshError: for a mesh that does not exist.
    """

    mesh: str | MeshDensity = "default"  #: name of a mesh, or a density
    #: Storage of the stress matrices, one of `PRECISIONS`; or one for each sensing layer, and the last repeats.
    #: "float64" is for all layers or none.
    precision: str | tuple[str, ...] = "float32"
    #: Relative error of a layer's readings that is accepted for speed [-], 0 for none: its matrices are then stored as
    #: products of smaller ones.
    reduction: float = 0.0
    #: How a reading is averaged over a taxel's ball, one of `AVERAGINGS`; or one for each sensing layer, and the last
    #: repeats.
    averaging: str | tuple[str, ...] = "points"
    loads: str = "nodes"  #: "nodes", or "corners": nodal forces are moved to the corners of elements first
    law: str = "uniform"  #: contact law: "uniform", "foundation" or "elastic"
    cells: int = 400  #: wanted number of contact cells; law "uniform" has none

    def __post_init__(self) -> None:
        mesh_density(self.mesh)
        object.__setattr__(self, "precision", _by_layer("precision", self.precision, PRECISIONS))
        if isinstance(self.precision, tuple) and "float64" in self.precision:
            raise PresetError(
                f"precision = {self.precision}; expected 'float64' for all sensing layers or for none of them."
            )
        object.__setattr__(self, "averaging", _by_layer("averaging", self.averaging, AVERAGINGS))
        if not (isinstance(self.loads, str) and self.loads in LOADS):
            raise PresetError(f"loads {shortened(self.loads)} does not exist. Available: {', '.join(LOADS)}.")
        reduction = finite_number(self.reduction)
        if not 0.0 <= reduction < 1.0:
            raise PresetError(
                f"reduction = {shortened(self.reduction)}; expected a relative error from 0 (none) to below 1, such as "
                "0.003."
            )
        if not (isinstance(self.law, str) and self.law in CONTACT_LAWS):
            raise PresetError(
                f"contact law {shortened(self.law)} does not exist. Available: {', '.join(CONTACT_LAWS)}."
            )
        if not (is_whole(self.cells) and self.cells >= 1):
            raise PresetError(f"cells = {shortened(self.cells)}; expected a whole number of cells, such as 400.")
        object.__setattr__(self, "reduction", reduction)
        object.__setattr__(self, "cells", int(self.cells))

    @property
    def density(self) -> MeshDensity:
        """The density of the mesh."""
        return mesh_density(self.mesh)

    def averaging_at(self, sensing_layer: int) -> str:
        """How the readings of one sensing layer, counted from the top, are averaged: one of `AVERAGINGS`."""
        return _at_layer(self.averaging, sensing_layer)

    def precision_at(self, sensing_layer: int) -> str:
        """How the matrices of one sensing layer, counted from the top, are stored: one of `PRECISIONS`."""
        return _at_layer(self.precision, sensing_layer)

    @property
    def widest_precision(self) -> str:
        """The widest of the layers' precisions."""
        return max(_entries(self.precision), key=PRECISIONS.index)


def by_layer_text(choice: str | tuple[str, ...]) -> str:
    """A choice for each sensing layer in words, from the top layer down, such as "quarters in 2 layers, then mean"."""
    if isinstance(choice, str):
        return choice
    runs = [(one, len(list(layers))) for one, layers in itertools.groupby(choice)]
    return ", then ".join(one if count == 1 else f"{one} in {count} layers" for one, count in runs)


def _entries(choice: str | Sequence[str]) -> tuple[str, ...]:
    """The entries of a choice by sensing layer, from the top layer down."""
    return tuple(choice) if isinstance(choice, list | tuple) else (choice,)  # type: ignore[return-value]


def _at_layer(choice: str | tuple[str, ...], sensing_layer: int) -> str:
    """The choice for one sensing layer, counted from the top; the last one repeats."""
    by_layer = _entries(choice)
    return by_layer[min(sensing_layer, len(by_layer) - 1)]


def _by_layer(name: str, choice: str | Sequence[str], known: tuple[str, ...]) -> str | tuple[str, ...]:
    """A choice by sensing layer with as few entries as possible, so that equal choices are equal values."""
    by_layer = list(_entries(choice))
    for one in by_layer or [None]:
        if not (isinstance(one, str) and one in known):
            raise PresetError(
                f"{name} {shortened(one)} does not exist. Available: {', '.join(known)}; or one for each sensing "
                f"layer, such as {known[-2:]}."
            )
    while by_layer[-2:-1] == by_layer[-1:]:
        by_layer.pop()
    return by_layer[0] if len(by_layer) == 1 else tuple(by_layer)


#: The default preset everywhere.
DEFAULT = "balanced"
#: Named fidelities, fast to accurate.
PRESETS: dict[str, Fidelity] = {
    "fast": Fidelity(mesh="draft", precision="int8", reduction=0.03, averaging="mean", law="elastic", cells=20),
    "balanced": Fidelity(
        mesh="even",
        precision=("float16", "int8"),
        reduction=0.02,
        averaging=("quarters", "quarters", "mean"),
        loads="corners",
        law="elastic",
        cells=60,
    ),
    "precise": Fidelity(mesh="default", precision="float32", reduction=0.003, law="elastic", cells=200),
    "accurate": Fidelity(mesh="fine", precision="float32", reduction=0.0, law="elastic", cells=800),
}


def as_fidelity(fidelity: str | Fidelity) -> Fidelity:
    """The fidelity of a named preset; a Fidelity is returned unchanged.

    Raises:
        PresetError: when no preset has that name; the message lists those that exist.
    """
    if isinstance(fidelity, Fidelity):
        return fidelity
    if not (isinstance(fidelity, str) and fidelity in PRESETS):
        raise PresetError(
            f"fidelity {shortened(fidelity)} does not exist. Available: {', '.join(PRESETS)}; in Python also a "
            "Fidelity, such as Fidelity(mesh='draft')."
        )
    return PRESETS[fidelity]


def fidelity_text(fidelity: str | Fidelity) -> str:
    """A fidelity as the text of a model's attribute: its preset's name, or its choices as compact JSON.

    Raises:
        PresetError: when no preset has that name.
    """
    chosen = as_fidelity(fidelity)
    name = next((name for name, preset in PRESETS.items() if preset == chosen), None)
    return json.dumps(asdict(chosen), separators=(",", ":")) if name is None else name


def fidelity_summary(fidelity: Fidelity) -> str:
    """A fidelity in a few words: its preset's name, or the choices that differ from the defaults of `Fidelity`."""
    if (name := fidelity_text(fidelity)) in PRESETS:
        return name
    plain = Fidelity()
    chosen = {one.name: getattr(fidelity, one.name) for one in fields(Fidelity)}
    mesh = fidelity.mesh if isinstance(fidelity.mesh, str) else mesh_name(fidelity.mesh) or "of its own"
    texts = chosen | {key: by_layer_text(chosen[key]) for key in ("precision", "averaging")}
    others = [f"{key} {texts[key]}" for key, value in chosen.items() if key != "mesh" and value != getattr(plain, key)]
    return ", ".join([f"mesh {mesh}", *others])


def fidelity_from_text(text: str) -> Fidelity:
    """The fidelity that `fidelity_text` wrote.

    Raises:
        PresetError: the text is neither a preset's name nor the JSON of a fidelity.
        MeshError: it names a mesh that does not exist.
    """
    if not text.lstrip().startswith("{"):
        return as_fidelity(text)
    try:
        values: dict[str, Any] = json.loads(text)
        mesh = values.get("mesh")
        if isinstance(mesh, dict):
            mesh["points_per_axis"] = tuple(mesh["points_per_axis"])
            values["mesh"] = MeshDensity(**mesh)
        return Fidelity(**values)
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        if isinstance(error, PresetError | MeshError):
            raise
        raise PresetError(f"the text does not describe a fidelity ({error}). Write it with fidelity_text.") from error


def mesh_name(density: MeshDensity) -> str | None:
    """Name of a mesh; None when it has none."""
    return next((name for name, named in MESHES.items() if named == density), None)
