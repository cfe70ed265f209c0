"""Loads at the extremes: the smallest and largest, at the rim, beyond what a face carries, again and again."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import shapely

from mjtactile.cli.benchmarks.extremes import Row, attempt, difference
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.wrench_basis import WrenchBasis
from mjtactile.errors import ContactWarning
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Array, Layer, Pad

#: Every law, with every way shear spreads that it knows.
WAYS: dict[str, dict[str, Any]] = {
    "uniform": {"law": "uniform"},
    "foundation": {"law": "foundation"},
    "elastic": {"law": "elastic"},
    "elastic, stick": {"law": "elastic", "tangential": "stick"},
    "elastic, coulomb": {"law": "elastic", "tangential": "coulomb", "friction": 0.5},
}
_MILLIMETRE = 1e-3
_OBLIQUE = np.array([0.02, 0.01, -0.2])
_THREADS = 8


def load_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """Faces, forces and moments at the extremes, under every law."""
    influence = influence_matrices(mesh=cases["mesh"], progress=False)
    for case in cases["face"]:
        x, y, width, height = (length * _MILLIMETRE for length in case["box"])
        face = Footprint.from_outline(shapely.box(x - width, y - height, x + width, y + height), influence)
        for way, options in WAYS.items():
            yield _carried_row(f"{case['name']}: {way}", influence, face, _OBLIQUE, options)
    disc = _disc(influence)
    for way, options in WAYS.items():
        yield _carried_row(f"one cell asked for: {way}", influence, disc, _OBLIQUE, {**options, "cells": 1})
        unit = influence.readings(_quietly(influence, disc, _OBLIQUE, options)[0])
        for force in cases["forces"]:
            load = _quietly(influence, disc, _OBLIQUE * force, options)[0]
            readings = influence.readings(load)
            yield Row(f"{0.2 * force:g} N: {way}", _peak(readings), difference(readings / force, unit), "0.2 N, scaled")
        for name, (wrench, moment) in _odd_wrenches().items():
            yield _carried_row(f"{name}: {way}", influence, disc, wrench, options, moment)


def steady_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """The same contact again and again, one after another and in threads."""
    influence = influence_matrices(mesh=cases["mesh"], progress=False)
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
        spread = max(difference(one, results[0]) for one in results)
        yield Row(f"{_THREADS} threads: {way}", "one answer" if spread == 0.0 else "several", spread, "each other")


def wrong_input_rows(cases: dict[str, Any]) -> Iterator[Row]:
    """What is no number, or makes no sense: which error says so."""
    influence = influence_matrices(mesh=cases["mesh"], progress=False)
    disc = _disc(influence)
    for asked, run in wrong_inputs(influence, disc).items():
        yield attempt(asked, "accepted", lambda run=run: (f"{run()}"[:40], None))


def wrong_inputs(influence: InfluenceMatrices, face: Footprint) -> dict[str, Callable[[], object]]:
    """Calls that must end in one of this package's errors, by what is wrong with them."""
    calls: dict[str, Callable[[], object]] = {}
    for name, bad in (("NaN", np.nan), ("inf", np.inf)):
        with np.errstate(invalid="ignore"):  # shapely's own remark
            outline = shapely.Polygon([(0, 0), (1e-3, 0), (bad, 1e-3)])
        calls |= {
            f"{name} force": lambda b=bad: contact_load(influence, face, (0, b, -1)),
            f"{name} moment": lambda b=bad: contact_load(influence, face, (0, 0, -1), moment=(0, b, 0)),
            f"{name} friction": lambda b=bad: contact_load(influence, face, (0, 0, -1), friction=b),
            f"{name} cells": lambda b=bad: contact_load(influence, face, (0, 0, -1), law="elastic", cells=b),  # type: ignore[arg-type]
            f"{name} outline": lambda o=outline: Footprint.from_outline(o, influence),
            f"{name} gap map": lambda b=bad: Footprint.from_gap(lambda x, y: np.full_like(x, b), influence),
            f"{name} thickness": lambda b=bad: Layer(thickness=b, young=3e6, poisson=0.49),
            f"{name} modulus": lambda b=bad: Layer(thickness=1e-3, young=b, poisson=0.49),
            f"{name} Poisson ratio": lambda b=bad: Layer(thickness=1e-3, young=3e6, poisson=b),
            f"{name} size": lambda b=bad: Pad(size=(15e-3, b)),
            f"{name} depth": lambda b=bad: Pad(depths=(1e-3, b)),
            f"{name} sampling radius": lambda b=bad: Pad(sampling_radius=b),
        }
    calls["footprint beside the pad"] = lambda: Footprint.from_outline(shapely.box(1, 1, 2, 2), influence)
    calls["empty footprint"] = lambda: Footprint.from_outline(shapely.Polygon(), influence)
    calls["no cells"] = lambda: contact_load(influence, face, (0, 0, -1), law="elastic", cells=0)
    return calls


def left_over(load: SurfaceLoad, force: Array, moment: Array, length: float) -> float:
    """Given wrench less the resultant of the nodal forces, over the given wrench."""
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
        # The moment of a force on a small face is about the pad's far middle.
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
    return Footprint.from_outline(shapely.Point(1e-3, -0.5e-3).buffer(2.5e-3), influence)


def _peak(readings: Array) -> str:
    return f"peak {readings.max() * 1e-3:.4g} kPa" if np.isfinite(readings).all() else "NaN"
