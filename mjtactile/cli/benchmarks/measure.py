"""Time and error of one fidelity on the cases of cases.py."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from mjtactile._types import Array
from mjtactile.cli.benchmarks.cases import PressCase, moved_bodies
from mjtactile.cli.benchmarks.sweep import Choice, preset_of
from mjtactile.cli.benchmarks.timing import median_time
from mjtactile.contact.wrench_basis import WrenchBasis
from mjtactile.errors import ContactWarning
from mjtactile.influence.cache import cached_path, influence_matrices, stored_path
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad
from mjtactile.units import MILLIMETRE

#: Wrenches on a footprint before its basis counts as settled.
_SETTLING = 4
#: Largest change of each wrench's force and direction.
_WRENCH_CHANGE = 0.02


@dataclass(frozen=True, eq=False)
class Bench:
    """Cases, how often each is timed, and what their readings should be.

    Attributes:
        cases: measured for time and error.
        calculix: measured for error against their own readings.
        moves: footprints timed per case.
        shift: largest shift of those [m].
        wrenches: wrenches timed per case on one footprint.
        truth: readings by name of a case [Pa]; filled by `measure_truth`.
    """

    cases: Sequence[PressCase]
    calculix: Sequence[PressCase]
    moves: int
    shift: float
    wrenches: int
    truth: dict[str, Array] = field(default_factory=dict)
    _loads: dict[tuple[Any, ...], list[SurfaceLoad]] = field(default_factory=dict)

    @classmethod
    def of(cls, design: dict[str, Any], cases: Sequence[PressCase], calculix: Sequence[PressCase]) -> Bench:
        """A bench as benchmarks/trade.toml describes it."""
        return cls(cases, calculix, design["moves"], design["shift"] * MILLIMETRE, design["wrenches"])

    def loads(self, influence: InfluenceMatrices, choice: Choice) -> list[SurfaceLoad]:
        """Tractions of all cases; fidelities that differ only in their stress matrices share them."""
        if choice.contact not in self._loads:
            self._loads[choice.contact] = [case.load(influence) for case in (*self.cases, *self.calculix)]
        return self._loads[choice.contact]


@contextmanager
def one_core() -> Iterator[None]:
    """Linear algebra on one core, and no warnings of a law that cannot carry what another can."""
    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)
        yield


def measure(choice: Choice, bench: Bench) -> dict[str, Any]:
    """One row of the sweep: a choice's plain values, its cost and its errors.

    Returns:
        The choice's values, "preset", "table_bytes", "load_s", by name of case "errors", "calculix", "moved_s" and
        "unchanged_s" and "cache_error", what a basis kept for other wrenches costs.
    """
    built = influence_matrices(fidelity=choice.fidelity)
    with one_core():
        loads = bench.loads(built, choice)
        path = stored_path(Pad(), choice.fidelity) or cached_path(Pad(), choice.fidelity)
        start = time.perf_counter()
        influence = load_influence(path, Pad(), choice.fidelity)
        influence.readings(loads[0])
        load_time = time.perf_counter() - start
        readings = influence.readings(loads)
        read = dict(zip((case.name for case in (*bench.cases, *bench.calculix)), readings, strict=True))
        unchanged = {case.name: _unchanged(case, influence, bench.wrenches) for case in bench.cases}
        return {
            **choice.as_dict(),
            "preset": preset_of(choice),
            "table_bytes": path.stat().st_size,
            "load_s": load_time,
            "errors": {case.name: relative(read[case.name], bench.truth[case.name]) for case in bench.cases},
            "calculix": {case.name: relative(read[case.name], case.reference) for case in bench.calculix},
            "moved_s": {case.name: moved_time(case, influence, bench) for case in bench.cases},
            "unchanged_s": {name: seconds for name, (seconds, _) in unchanged.items()},
            "cache_error": {name: error for name, (_, error) in unchanged.items()},
        }


def moved_time(case: PressCase, influence: InfluenceMatrices, bench: Bench) -> float:
    """Median time from a body in a new place to readings: footprint, contact, product [s]."""
    bodies = iter(moved_bodies(case, bench.moves + 1, bench.shift, seed=1))
    return median_time(lambda: influence.readings(case.load(influence, next(bodies))), bench.moves)


def _unchanged(case: PressCase, influence: InfluenceMatrices, count: int) -> tuple[float, float]:
    """Median time from a new wrench on the same footprint to readings [s], and their error against a new solution."""
    contact = case.contact(influence.fidelity.law)
    basis = WrenchBasis(influence, case.body.footprint(influence.surface), **contact)
    forces = iter(_wrenches(case.force, _SETTLING + count + 2))
    for _ in range(_SETTLING):
        basis.readings(next(forces))
    seconds = median_time(lambda: basis.readings(next(forces)), count)
    last = next(forces)
    changed = replace(case, force=last)
    return seconds, relative(basis.readings(last), influence.readings(changed.load(influence)))


def _wrenches(force: Array, count: int) -> Array:
    """The force and others near it, (count, 3) [N]."""
    change = np.random.default_rng(2).uniform(-1.0, 1.0, (count, 3))
    return force + _WRENCH_CHANGE * np.linalg.norm(force) * change


def relative(values: Array, reference: Array) -> float:
    """Euclidean norm of the difference over that of the reference [-]."""
    return float(np.linalg.norm(values - reference) / np.linalg.norm(reference))
