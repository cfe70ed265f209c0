"""Accuracy at the extremes: pads, loads and inputs at the limits of their ranges, each compared with a reference.

The reference of a pad is a sparse factorisation of its whole stiffness matrix, refined in extended precision, or the
same pad scaled or on a finer mesh. The reference of a contact is the wrench that it was given: the smallest and the
largest loads, loads at the rim, loads beyond what a face carries, and the same load many times.
"""

from __future__ import annotations

import time
import tomllib
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse.linalg
import shapely

from mjtactile._types import Array
from mjtactile.cli.benchmarks.direct import relative_difference
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.wrench_basis import WrenchBasis
from mjtactile.errors import ContactWarning, MjTactileError
from mjtactile.experiments.markdown import markdown_table
from mjtactile.fem.dissection import DissectedPad
from mjtactile.fem.elements import SweptElements
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.symmetry import BOTH, free_in_plane
from mjtactile.fidelity import Fidelity, MeshDensity, mesh_density
from mjtactile.influence.cache import build_influence, influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.sim.assets import asset_path
from mjtactile.units import MILLIMETRE

#: Rounds of iterative refinement of the sparse solution.
_REFINEMENTS = 3
#: An oblique force on the pad [N].
_OBLIQUE = np.array([0.02, 0.01, -0.2])
_THREADS = 8


class Row(NamedTuple):
    """One line of the table."""

    asked: str  #: description of the case
    outcome: str  #: the result, or the beginning of an error message
    off: float | None  #: relative difference from the reference [-]; None for an error
    truth: str  #: description of the reference


def extreme_cases() -> dict[str, Any]:
    """The content of benchmarks/extremes.toml, which every function `..._rows` takes as `cases`."""
    return tomllib.loads(asset_path("benchmarks/extremes.toml").read_text())


def extremes_benchmark() -> list[dict[str, Any]]:
    """Run all cases: the rows of the table, each a `Row` as a dictionary."""
    cases = extreme_cases()
    rows: list[Row] = []
    for make in (material_rows, size_rows, load_rows, steady_rows, wrong_input_rows):
        rows += make(cases)
    return [row._asdict() for row in rows]


def extremes_table(result: list[dict[str, Any]]) -> str:
    """The benchmark's result as a Markdown table."""
    rows = (
        [row["asked"], row["outcome"], "-" if row["off"] is None else f"{row['off']:.1e}", row["truth"]]
        for row in result
    )
    return markdown_table(["asked", "what comes out", "off by", "against"], rows)


def attempt(asked: str, truth: str, run: Callable[[], tuple[str, float | None]]) -> Row:
    """Call a function and make a row of what it does.

    Args:
        asked: description of the case.
        truth: description of the reference.
        run: the function. It returns the outcome in words and the relative difference from the reference [-]. If it
            raises one of this package's errors, the row holds the beginning of the message.
    """
    try:
        outcome, off = run()
    except MjTactileError as error:
        words = " ".join(str(error).split())
        return Row(asked, f"{type(error).__name__}: {words[:80]}{'...' if len(words) > 80 else ''}", None, "refused")
    return Row(asked, outcome, off, truth)


def material_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Rows on Poisson ratios, moduli and their contrasts, and thin skins, compared with a sparse solution."""
    density = replace(mesh_density(cases["mesh"]), most_elements=cases["elements"])
    for poisson in (*cases["poissons"], 0.5):
        yield _solved_row(f"nu {poisson!r}", lambda nu=poisson: _pad([(5.0, 3e6, nu)]), density)
    for young in cases["moduli"]:
        yield _solved_row(f"E {young:g} Pa", lambda e=young: _pad([(5.0, e, 0.49)]), density)
    for contrast in cases["contrasts"]:
        layers = [(1.0, 3e6 * contrast, 0.49), (4.0, 3e6, 0.49)]
        yield _solved_row(f"top layer {contrast:g} times as stiff", lambda one=layers: _pad(one), density)
    for contrast in cases["skins"]:
        layers = [(1e-3, 3e6 * contrast, 0.49), (4.999, 3e6, 0.49)]
        yield _solved_row(f"skin of 1 um, {contrast:g} times as stiff", lambda one=layers: _pad(one), density)
    yield _solved_row("skin of 0.9 um", lambda: _pad([(0.9e-3, 3e6, 0.49), (4.999, 3e6, 0.49)]), density)


def size_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Rows on scaled sheets, thin and thick sheets, a pad of one taxel, and the precisions of storage."""
    density = mesh_density(cases["mesh"])
    reference = build(Pad(), density)
    expected = _pressed(reference)
    for case in cases["scaled"]:

        def scaled(factor: float = case["scale"]) -> tuple[str, float]:
            readings = _pressed(build(_scaled(factor), density), factor)
            return _peak(readings), relative_difference(readings, expected)

        yield attempt(case["name"], "the same pad, 5 mm thick", scaled)
    for case in cases["thickness"]:

        def thick(depth: float = case["thickness"] * MILLIMETRE) -> tuple[str, float]:
            pad = replace(
                Pad(),
                layers=Layer(thickness=depth, young=3e6, poisson=0.49),
                depths=tuple(np.array([0.2, 0.4, 0.6, 0.8]) * depth),
                sampling_radius=0.125 * min(depth, 5e-3),
            )
            own = replace(density, most_elements=cases["elements"])
            coarse, finer = (_pressed(build(pad, d)) for d in (own, _finer(own)))
            return _peak(coarse), relative_difference(coarse, finer)

        yield attempt(case["name"], "elements two thirds the size", thick)
    one = replace(Pad(), taxels=TaxelGrid(rows=1, columns=1), depths=(2e-3,))
    middle = expected[1, 6, 6]
    yield attempt(
        "one taxel",
        "the same among 676",
        lambda: (
            _peak(_pressed(build(one, density))),
            abs(float(_pressed(build(one, density))[0, 0, 0]) / middle - 1),
        ),
    )
    for precision in ("float32", "float16"):
        stored = build(Pad(), density, precision)
        yield Row(
            f"tables in {precision}",
            _peak(_pressed(stored)),
            relative_difference(_pressed(stored), expected),
            "float64",
        )


def build(pad: Pad, density: MeshDensity, precision: str = "float64") -> InfluenceMatrices:
    """Influence matrices of a pad, by default in double precision. They are not kept in the cache."""
    return build_influence(pad, Fidelity(mesh=density, precision=precision), progress=False)


def solution_error(pad: Pad, density: MeshDensity) -> float:
    """Relative error of the surface displacement that dissection gives [-], largest of two loads.

    The reference is a sparse factorisation of the whole stiffness matrix, refined in extended precision.
    """
    quarter = sheet_mesh(pad, density).quarter()
    elements = SweptElements(quarter)
    equations = DissectedPad(elements, free_in_plane(quarter, BOTH.classes[0]))
    matrix = equations.restricted(elements.matrix())
    root = scipy.sparse.diags_array(1 / np.sqrt(matrix.diagonal()))
    scaled = (root @ matrix @ root).tocsc()
    surface = equations.surface
    loads = np.zeros((equations.count, 2))
    loads[surface[-1 - len(surface) // 7], 0] = 1.0  # normal, near the rim
    loads[surface, 1] = np.cos(np.arange(len(surface)))
    right = root @ loads
    factor = scipy.sparse.linalg.splu(scaled)
    solution = factor.solve(right)
    extended = scaled.astype(np.longdouble)
    for _ in range(_REFINEMENTS):
        solution += factor.solve(
            (right.astype(np.longdouble) - extended @ solution.astype(np.longdouble)).astype(float)
        )
    expected = (root @ solution)[surface]
    actual = equations.solve(loads)[surface]
    return max(relative_difference(a, b) for a, b in zip(actual.T, expected.T, strict=True))


def _solved_row(asked: str, pad: Callable[[], Pad], density: MeshDensity) -> Row:
    def run() -> tuple[str, float]:
        made = pad()
        return _peak(_pressed(build(made, density))), solution_error(made, density)

    return attempt(asked, "sparse factors, refined", run)


def _pressed(influence: InfluenceMatrices, scale: float = 1.0) -> Array:
    """Readings under 0.2 N on a fifth of the sheet, slightly off its middle. A scaled pad is pressed alike."""
    side = 3e-3 * scale
    face = Footprint.from_outline(shapely.box(-side, -side, 1.2 * side, side), influence.surface)
    return influence.readings(contact_load(influence, face, np.array([0.02, 0.0, -0.2]) * scale**2, law="uniform"))


def _peak(readings: Array) -> str:
    return f"peak {readings.max() * 1e-3:.4g} kPa" if np.isfinite(readings).all() else "NaN"


def _pad(layers: list[tuple[float, float, float]]) -> Pad:
    stack = tuple(Layer(thickness=t * MILLIMETRE, young=e, poisson=nu) for t, e, nu in layers)
    return Pad(layers=stack, depths=(1e-3, 2e-3, 3e-3, 4e-3))


def _scaled(factor: float) -> Pad:
    pad = Pad()
    taxels = replace(pad.grid, pitch=(pad.grid.pitch[0] * factor, pad.grid.pitch[1] * factor))
    return Pad(
        size=(pad.size[0] * factor, pad.size[1] * factor),
        layers=tuple(replace(layer, thickness=layer.thickness * factor) for layer in pad.layers),
        taxels=taxels,
        depths=tuple(depth * factor for depth in pad.depths),
        sampling_radius=pad.sampling_radius * factor,
    )


def _finer(density: MeshDensity) -> MeshDensity:
    return replace(
        density,
        in_plane_size=density.in_plane_size / 1.5,
        through_size=density.through_size / 1.5,
        most_elements=round(density.most_elements * 1.5**2),
    )


#: Options of `contact_load` for every contact law with every tangential choice that it offers, by name.
WAYS: dict[str, dict[str, Any]] = {
    "uniform": {"law": "uniform"},
    "foundation": {"law": "foundation"},
    "elastic": {"law": "elastic"},
    "elastic, stick": {"law": "elastic", "tangential": "stick"},
    "elastic, coulomb": {"law": "elastic", "tangential": "coulomb", "friction": 0.5},
}


def load_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Rows on extreme faces, forces and moments under every contact law, compared with the wrench that was given."""
    influence = influence_matrices(fidelity=Fidelity(mesh=cases["mesh"]), progress=False)
    for case in cases["face"]:
        x, y, width, height = (length * MILLIMETRE for length in case["box"])
        face = Footprint.from_outline(shapely.box(x - width, y - height, x + width, y + height), influence.surface)
        for way, options in WAYS.items():
            yield _carried_row(f"{case['name']}: {way}", influence, face, _OBLIQUE, options)
    disc = _disc(influence)
    for way, options in WAYS.items():
        yield _carried_row(f"one cell asked for: {way}", influence, disc, _OBLIQUE, {**options, "cells": 1})
        unit = influence.readings(_quietly(influence, disc, _OBLIQUE, options)[0])
        for force in cases["forces"]:
            load = _quietly(influence, disc, _OBLIQUE * force, options)[0]
            readings = influence.readings(load)
            yield Row(
                f"{0.2 * force:g} N: {way}",
                _peak(readings),
                relative_difference(readings / force, unit),
                "0.2 N, scaled",
            )
        for name, (wrench, moment) in _odd_wrenches().items():
            yield _carried_row(f"{name}: {way}", influence, disc, wrench, options, moment)


def steady_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Rows on the same contact solved many times, one after another and in threads: its readings must not change."""
    influence = influence_matrices(fidelity=Fidelity(mesh=cases["mesh"]), progress=False)
    disc = _disc(influence)
    for way in ("uniform", "foundation", "elastic"):
        basis = WrenchBasis(influence, disc, **WAYS[way])
        moment = np.cross([*disc.centroid, 0.0], _OBLIQUE)
        first = [basis.readings(_OBLIQUE, moment) for _ in range(3)][-1]
        end, done = time.monotonic() + cases["update_seconds"] / 3, 0
        drift = 0.0
        while done < cases["updates"] and time.monotonic() < end:
            drift = max(drift, float(np.abs(basis.readings(_OBLIQUE, moment) - first).max() / first.max()))
            done += 1
        yield Row(
            f"the same contact {done:,} times: {way}", "no drift" if drift == 0.0 else "drift", drift, "the first"
        )
    for way, options in WAYS.items():

        def once(_: int, options: dict[str, Any] = options) -> Array:
            return influence.readings(contact_load(influence, disc, _OBLIQUE, **options))

        with ThreadPoolExecutor(_THREADS) as threads:
            results = list(threads.map(once, range(4 * _THREADS)))
        spread = max(relative_difference(one, results[0]) for one in results)
        yield Row(f"{_THREADS} threads: {way}", "one answer" if spread == 0.0 else "several", spread, "each other")


def wrong_input_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Rows on invalid inputs, with the errors that they raise."""
    influence = influence_matrices(fidelity=Fidelity(mesh=cases["mesh"]), progress=False)
    disc = _disc(influence)
    for asked, run in wrong_inputs(influence, disc).items():
        yield attempt(asked, "accepted", lambda run=run: (f"{run()}"[:40], None))


def wrong_inputs(influence: InfluenceMatrices, face: Footprint) -> dict[str, Callable[[], object]]:
    """Calls that must raise one of this package's errors, by a description of the wrong argument."""
    calls: dict[str, Callable[[], object]] = {}
    for name, bad in (("NaN", np.nan), ("inf", np.inf)):
        with np.errstate(invalid="ignore"):  # shapely warns of it as well
            outline = shapely.Polygon([(0, 0), (1e-3, 0), (bad, 1e-3)])
        calls |= {
            f"{name} force": lambda b=bad: contact_load(influence, face, (0, b, -1)),
            f"{name} moment": lambda b=bad: contact_load(influence, face, (0, 0, -1), moment=(0, b, 0)),
            f"{name} friction": lambda b=bad: contact_load(influence, face, (0, 0, -1), friction=b),
            f"{name} cells": lambda b=bad: contact_load(influence, face, (0, 0, -1), law="elastic", cells=b),  # type: ignore[arg-type]
            f"{name} outline": lambda o=outline: Footprint.from_outline(o, influence.surface),
            f"{name} gap": lambda b=bad: Footprint.from_gap(lambda x, y: np.full_like(x, b), influence.surface),
            f"{name} thickness": lambda b=bad: Layer(thickness=b, young=3e6, poisson=0.49),
            f"{name} modulus": lambda b=bad: Layer(thickness=1e-3, young=b, poisson=0.49),
            f"{name} Poisson ratio": lambda b=bad: Layer(thickness=1e-3, young=3e6, poisson=b),
            f"{name} size": lambda b=bad: Pad(size=(15e-3, b)),
            f"{name} depth": lambda b=bad: Pad(depths=(1e-3, b)),
            f"{name} sampling radius": lambda b=bad: Pad(sampling_radius=b),
        }
    calls["footprint beside the pad"] = lambda: Footprint.from_outline(shapely.box(1, 1, 2, 2), influence.surface)
    calls["empty footprint"] = lambda: Footprint.from_outline(shapely.Polygon(), influence.surface)
    calls["no cells"] = lambda: contact_load(influence, face, (0, 0, -1), law="elastic", cells=0)
    return calls


def left_over(load: SurfaceLoad, force: Array, moment: Array, length: float) -> float:
    """Part of a wrench that a load does not carry, relative to the wrench [-].

    Args:
        load: the load, whose nodal forces are summed.
        force: the force that was given [N].
        moment: the moment that was given, about the pad's origin [N m].
        length: divides moments to compare them with forces [m].

    Returns:
        The relative part; under a wrench of zero, the largest nodal force [N].
    """
    carried_force, carried_moment = load.resultant()
    size = np.linalg.norm(force) + np.linalg.norm(moment) / length
    missing = np.linalg.norm(force - carried_force) + np.linalg.norm(moment - carried_moment) / length
    return float(missing / size) if size > 0.0 else float(np.abs(load.forces).max())


def _carried_row(
    asked: str,
    influence: InfluenceMatrices,
    face: Footprint,
    force: Array,
    options: dict[str, Any],
    moment: Array | None = None,
) -> Row:
    given = np.cross([*face.centroid, 0.0], force) if moment is None else moment

    def run() -> tuple[str, float]:
        load, warned = _quietly(influence, face, force, options, given)
        outcome = _peak(influence.readings(load)) + (", warns" if warned else "")
        # Moments are about the pad's origin, which may be far from a small face.
        length = max(float(np.sqrt(face.area)), float(np.hypot(*face.centroid)))
        return outcome, left_over(load, force, given, length)

    return attempt(asked, "the wrench given", run)


def _quietly(
    influence: InfluenceMatrices, face: Footprint, force: Array, options: dict[str, Any], moment: Array | None = None
) -> tuple[SurfaceLoad, bool]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        load = contact_load(influence, face, force, moment=moment, **options)
    return load, bool(caught)


def _odd_wrenches() -> dict[str, tuple[Array, Array]]:
    none, press = np.zeros(3), np.array([0.0, 0.0, -0.2])
    return {
        "no force": (none, none),
        "pulling": (-press, none),
        "shear without pressure": (np.array([0.1, 0.0, 0.0]), none),
        "torsion without pressure": (none, np.array([0.0, 0.0, 1e-3])),
        "moment of a force 1 m outside": (press, np.array([0.2, 0.0, 0.0])),
    }


def _disc(influence: InfluenceMatrices) -> Footprint:
    return Footprint.from_outline(shapely.Point(1e-3, -0.5e-3).buffer(2.5e-3), influence.surface)
