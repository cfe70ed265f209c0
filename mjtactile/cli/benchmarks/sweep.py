"""The fidelities of a benchmark: every combination of mesh and law, and presets with one choice changed at a time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from mjtactile.contact.laws import BY_NAME
from mjtactile.errors import PresetError
from mjtactile.fidelity import MESHES, PRESETS, Fidelity


def plain_values(fidelity: Fidelity) -> dict[str, Any]:
    """A fidelity as plain values, as the benchmark's result stores it.

    Returns:
        Its choices by name. "mesh" is a name; "points" are the sample points per axis, by sensing layer; "cells" is 0
        for law "uniform", which has none.

    Raises:
        PresetError: the fidelity's mesh differs from every named one in more than its sample points.
    """
    density = fidelity.density
    for name, named in MESHES.items():
        if replace(named, points_per_axis=density.points_per_axis) == density:
            return {
                "mesh": name,
                "law": fidelity.law,
                "cells": fidelity.cells if BY_NAME[fidelity.law].shapes else 0,
                "points": list(density.points_per_axis),
                "precision": fidelity.precision,
                "reduction": fidelity.reduction,
                "averaging": fidelity.averaging,
                "loads": fidelity.loads,
            }
    raise PresetError(
        "the benchmark knows meshes by their names, but the mesh of this fidelity has none. Use one of "
        f"{', '.join(MESHES)}; only its sample points may differ."
    )


def preset_of(fidelity: Fidelity) -> str | None:
    """Name of the preset that makes these choices; None if there is none."""
    values = plain_values(fidelity)
    return next((name for name, preset in PRESETS.items() if plain_values(preset) == values), None)


def sweep(design: dict[str, Any]) -> list[Fidelity]:
    """All fidelities of a design, each once, sorted so that those with the same tables follow each other."""
    found = (*_product(design["product"]), *_around_presets(design.get("around", {})))
    return sorted({json.dumps(plain_values(one)): one for one in found}.values(), key=_order)


def _order(fidelity: Fidelity) -> tuple[Any, ...]:
    values = plain_values(fidelity)
    of_table = (values["points"], values["loads"], str(values["averaging"]), str(values["precision"]))
    return list(MESHES).index(values["mesh"]), *of_table, values["reduction"], values["law"], values["cells"]


def _product(product: dict[str, Any]) -> Iterator[Fidelity]:
    for mesh in product["meshes"]:
        for law in product["laws"]:
            yield Fidelity(mesh=mesh, **law)


def _around_presets(around: dict[str, dict[str, list[Any]]]) -> Iterator[Fidelity]:
    for preset, ranges in around.items():
        centre = PRESETS[preset]
        yield centre
        for name, values in ranges.items():
            for value in values:
                yield _with_points(centre, value) if name == "points" else replace(centre, **{name: _fixed(value)})


def _with_points(fidelity: Fidelity, points: int) -> Fidelity:
    """The same with other sample points per axis; a mesh that has a name is given by it."""
    density = replace(fidelity.density, points_per_axis=(points,))
    return replace(fidelity, mesh=next((name for name, named in MESHES.items() if named == density), density))


def _fixed(value: Any) -> Any:
    """A value from TOML, with a tuple for a list."""
    return tuple(value) if isinstance(value, list) else value
