"""What comes out at the extremes: pads, loads and inputs at the ends of what may be asked, each against a truth.

Pads are solved again by a sparse factorisation of the whole stiffness, refined in extended precision, or compared
with the same pad in another unit or on a finer mesh. Contacts are held against the wrench they were given.
"""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse.linalg
import shapely

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import MeshWarning, MjTactileError
from mjtactile.fem.block_elimination import EliminatedSheet
from mjtactile.fem.mesh import MeshDensity, mesh_density, sheet_mesh
from mjtactile.fem.stiffness import PARITIES, assemble, free_in_plane
from mjtactile.fem.taxel_quadrature import layer_sampling, sampling_tables
from mjtactile.fidelity import Fidelity
from mjtactile.influence.build import build_tables
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Array, Layer, Pad, TaxelGrid
from mjtactile.sim.assets import asset_path

_MILLIMETRE = 1e-3
_REFINEMENTS = 3


class Row(NamedTuple):
    """One line of the table."""

    asked: str  #: what was asked for
    outcome: str  #: what came out, or the error's first words
    off: float | None  #: how far from the truth, relative; None for an error
    truth: str  #: what it was held against


def extreme_cases() -> dict[str, Any]:
    """The cases of benchmarks/extremes.toml."""
    return tomllib.loads(asset_path("benchmarks/extremes.toml").read_text())


def extremes_benchmark() -> list[dict[str, Any]]:
    """Every row of the table."""
    from mjtactile.cli.benchmarks.extreme_loads import load_rows, steady_rows, wrong_input_rows

    cases = extreme_cases()
    rows: list[Row] = []
    for make in (material_rows, size_rows, load_rows, steady_rows, wrong_input_rows):
        rows += make(cases)
    return [row._asdict() for row in rows]


def extremes_table(result: list[dict[str, Any]]) -> str:
    """The benchmark's result as a Markdown table."""
    lines = ["| asked | what comes out | off by | against |", "|---|---|---|---|"]
    for row in result:
        off = "-" if row["off"] is None else f"{row['off']:.1e}"
        lines.append(f"| {row['asked']} | {row['outcome']} | {off} | {row['truth']} |")
    return "\n".join(lines)


def attempt(asked: str, truth: str, run: Callable[[], tuple[str, float | None]]) -> Row:
    """A row from what a function returns, an outcome and how far it is off, or from the error it raises."""
    try:
        outcome, off = run()
    except MjTactileError as error:
        words = " ".join(str(error).split())
        return Row(asked, f"{type(error).__name__}: {words[:80]}{'...' if len(words) > 80 else ''}", None, "refused")
    return Row(asked, outcome, off, truth)


def material_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Poisson ratios, moduli and their contrasts, thin skins: readings and how far the solution is off."""
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
    """Sheets of other sizes and thicknesses, wide ones, one taxel, and storage precisions."""
    density = mesh_density(cases["mesh"])
    reference = build(Pad(), density)
    expected = _pressed(reference)
    for case in cases["scaled"]:

        def scaled(factor: float = case["scale"]) -> tuple[str, float]:
            readings = _pressed(build(_scaled(factor), density), factor)
            return _peak(readings), difference(readings, expected)

        yield attempt(case["name"], "the same pad, 5 mm thick", scaled)
    for case in cases["thickness"]:

        def thick(depth: float = case["thickness"] * _MILLIMETRE) -> tuple[str, float]:
            pad = replace(
                Pad(),
                layers=Layer(thickness=depth, young=3e6, poisson=0.49),
                depths=tuple(np.array([0.2, 0.4, 0.6, 0.8]) * depth),
                sampling_radius=0.125 * min(depth, 5e-3),
            )
            own = replace(density, most_elements=cases["elements"])
            coarse, finer = (_pressed(build(pad, d)) for d in (own, _finer(own)))
            return _peak(coarse), difference(coarse, finer)

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
        yield Row(f"tables in {precision}", _peak(_pressed(stored)), difference(_pressed(stored), expected), "float64")


def build(pad: Pad, density: MeshDensity, precision: str = "float64") -> InfluenceMatrices:
    """Influence matrices that no cache keeps, by default in double precision."""
    from mjtactile.influence.stress_matrix import stored_matrix

    tables: dict[str, Any] = {}
    for k in range(len(pad.depths)):
        tables |= sampling_tables(layer_sampling(pad, k, density.points_at(k)), k)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeshWarning)
        for of_class in build_tables(pad, density, dtype=np.float64):
            for name, table in of_class.items():
                whole = name.startswith("compliance")
                tables |= {name: table} if whole else stored_matrix(name, (table,), precision)
    return InfluenceMatrices(pad, Fidelity(mesh=density, precision=precision), tables)


def solution_error(pad: Pad, density: MeshDensity) -> float:
    """Relative difference of the surface displacement, plane elimination against a refined sparse solution."""
    mesh, parity = sheet_mesh(pad, density).quarter(), PARITIES[0]
    stiffness, free = assemble(mesh), free_in_plane(mesh, parity)
    everywhere = np.tile(free, stiffness.plane_count)
    everywhere[: free.size] = False
    kept = np.flatnonzero(everywhere)
    matrix = stiffness.matrix()[kept][:, kept]
    root = scipy.sparse.diags_array(1 / np.sqrt(matrix.diagonal()))
    scaled = (root @ matrix @ root).tocsc()
    surface = int(free.sum())
    loads = np.zeros((len(kept), 2))
    loads[-1 - surface // 7, 0] = 1.0  # normal, near the rim
    loads[-surface:, 1] = np.cos(np.arange(surface))
    right = root @ loads
    factor = scipy.sparse.linalg.splu(scaled)
    solution = factor.solve(right)
    extended = scaled.astype(np.longdouble)
    for _ in range(_REFINEMENTS):
        solution += factor.solve(
            (right.astype(np.longdouble) - extended @ solution.astype(np.longdouble)).astype(float)
        )
    expected = (root @ solution)[-surface:]
    actual = EliminatedSheet(stiffness, parity).surface_compliance @ loads[-surface:]
    return max(difference(a, b) for a, b in zip(actual.T, expected.T, strict=True))


def difference(actual: Array, expected: Array) -> float:
    """Euclidean norm of the difference over that of what was expected."""
    return float(np.linalg.norm(actual - expected) / np.linalg.norm(expected))


def _solved_row(asked: str, pad: Callable[[], Pad], density: MeshDensity) -> Row:
    def run() -> tuple[str, float]:
        made = pad()
        return _peak(_pressed(build(made, density))), solution_error(made, density)

    return attempt(asked, "sparse factors, refined", run)


def _pressed(influence: InfluenceMatrices, scale: float = 1.0) -> Array:
    """Readings of 0.2 N on a fifth of the sheet, slightly off its middle, for a pad that is scaled by a factor."""
    side = 3e-3 * scale
    face = Footprint.from_outline(shapely.box(-side, -side, 1.2 * side, side), influence)
    return influence.readings(contact_load(influence, face, np.array([0.02, 0.0, -0.2]) * scale**2, law="uniform"))


def _peak(readings: Array) -> str:
    return f"peak {readings.max() * 1e-3:.4g} kPa" if np.isfinite(readings).all() else "NaN"


def _pad(layers: list[tuple[float, float, float]]) -> Pad:
    stack = tuple(Layer(thickness=t * _MILLIMETRE, young=e, poisson=nu) for t, e, nu in layers)
    return Pad(layers=stack, depths=(1e-3, 2e-3, 3e-3, 4e-3))


def _scaled(factor: float) -> Pad:
    pad = Pad()
    taxels = replace(pad.taxels, pitch=(pad.taxels.pitch[0] * factor, pad.taxels.pitch[1] * factor))
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
