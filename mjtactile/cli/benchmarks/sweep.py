"""The fidelities of a benchmark: all combinations of interacting choices, and other choices one at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from mjtactile.contact.laws import BY_NAME
from mjtactile.errors import PresetError
from mjtactile.fidelity import MESHES, PRESETS, Fidelity


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A fidelity in plain values, as it stands in tables."""

    mesh: str  #: name
    law: str  #: contact law
    cells: int  #: contact cells; 0 for law "uniform", which has none
    points: tuple[int, ...]  #: sample points per axis, by sensing layer; the last repeats
    precision: str  #: of storage
    reduction: float  #: relative error given away [-]
    averaging: str = "points"  #: norms first, or the mean first
    loads: str = "nodes"  #: where nodal forces act

    @property
    def fidelity(self) -> Fidelity:
        """What `influence_matrices` takes."""
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
        """What the tractions depend on: mesh, law and cells."""
        return self.mesh, self.law, self.cells

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {**asdict(self), "points": list(self.points)}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Choice:
        """The choice among the values of a measured row."""
        # Rows from before averaging and loads could be chosen do not name them.
        named = {field.name: values[field.name] for field in fields(cls) if field.name in values}
        return cls(**{**named, "points": tuple(named["points"])})

    @classmethod
    def of(cls, fidelity: Fidelity) -> Choice:
        """The choice behind a fidelity.

        Raises:
            PresetError: when its mesh is no named one, sample points apart.
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
        raise PresetError("the benchmark tells meshes apart by their names, and this fidelity's has none.")


def preset_of(choice: Choice) -> str | None:
    """Name of the preset that makes this choice."""
    return next((name for name, fidelity in PRESETS.items() if Choice.of(fidelity) == choice), None)


def sweep(design: dict[str, Any]) -> list[Choice]:
    """All choices of a design, see benchmarks/trade.toml, in an order that shares tables; none twice."""
    chosen = {*_product(design["product"]), *_around_presets(design.get("around", {}))}
    meshes = list(MESHES)
    return sorted(
        chosen,
        key=lambda c: (meshes.index(c.mesh), c.points, c.loads, c.averaging, c.precision, c.reduction, c.law, c.cells),
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
                yield replace(centre, **{name: (value,) if name == "points" else value})
