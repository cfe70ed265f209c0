"""The fidelities of a benchmark: every combination of mesh and law, and presets with one choice changed at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from mjtactile.contact.laws import BY_NAME
from mjtactile.errors import PresetError
from mjtactile.fidelity import MESHES, PRESETS, Fidelity


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A fidelity as plain values, as the benchmark's result stores it."""

    mesh: str  #: name
    law: str  #: contact law
    cells: int  #: contact cells; 0 for law "uniform", which has none
    points: tuple[int, ...]  #: sample points per axis, by sensing layer; the last repeats
    precision: str | tuple[str, ...]  #: number format of the stored tables, see `Fidelity.precision`
    reduction: float  #: relative error that the low-rank reduction may add [-]
    averaging: str | tuple[str, ...] = "points"  #: see `Fidelity.averaging`
    loads: str = "nodes"  #: see `Fidelity.loads`

    @property
    def fidelity(self) -> Fidelity:
        """The same as a `Fidelity`, which `influence_matrices` takes."""
        named = MESHES[self.mesh]
        own = self.points == named.points_per_axis
        return Fidelity(
            mesh=self.mesh if own else replace(named, points_per_axis=self.points),
            precision=self.precision,
            reduction=self.reduction,
            averaging=self.averaging,
            loads=self.loads,
            law=self.law,
            cells=max(self.cells, 1),
        )

    @property
    def contact(self) -> tuple[str, str, int]:
        """The choices that the tractions depend on: mesh, law and number of cells."""
        return self.mesh, self.law, self.cells

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {**asdict(self), "points": list(self.points)}

    @classmethod
    def of(cls, fidelity: Fidelity) -> Choice:
        """A fidelity as plain values.

        Raises:
            PresetError: the fidelity's mesh differs from every named one in more than its sample points.
        """
        density = fidelity.density
        for name, named in MESHES.items():
            if replace(named, points_per_axis=density.points_per_axis) == density:
                return cls(
                    mesh=name,
                    law=fidelity.law,
                    cells=fidelity.cells if BY_NAME[fidelity.law].shapes else 0,
                    points=density.points_per_axis,
                    precision=fidelity.precision,
                    reduction=fidelity.reduction,
                    averaging=fidelity.averaging,
                    loads=fidelity.loads,
                )
        raise PresetError(
            "the benchmark knows meshes by their names, but the mesh of this fidelity has none. Use one of "
            f"{', '.join(MESHES)}; only its sample points may differ."
        )


def preset_of(choice: Choice) -> str | None:
    """Name of the preset that makes this choice; None if there is none."""
    return next((name for name, fidelity in PRESETS.items() if Choice.of(fidelity) == choice), None)


def sweep(design: dict[str, Any]) -> list[Choice]:
    """All choices of a design, each once, sorted so that choices with the same tables follow each other."""
    chosen = {*_product(design["product"]), *_around_presets(design.get("around", {}))}
    meshes = list(MESHES)
    return sorted(
        chosen,
        key=lambda c: (
            meshes.index(c.mesh),
            c.points,
            c.loads,
            str(c.averaging),
            str(c.precision),
            c.reduction,
            c.law,
            c.cells,
        ),
    )


def _product(product: dict[str, Any]) -> Iterator[Choice]:
    for mesh in product["meshes"]:
        for law in product["laws"]:
            yield Choice.of(Fidelity(mesh=mesh, **law))


def _around_presets(around: dict[str, dict[str, list[Any]]]) -> Iterator[Choice]:
    for preset, ranges in around.items():
        centre = Choice.of(PRESETS[preset])
        yield centre
        for name, values in ranges.items():
            for value in values:
                yield replace(centre, **{name: (value,) if name == "points" else _fixed(value)})


def _fixed(value: Any) -> Any:
    """A value from TOML, with a tuple for a list."""
    return tuple(value) if isinstance(value, list) else value
