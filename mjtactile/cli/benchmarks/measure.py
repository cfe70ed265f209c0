"""Time and error of one fidelity on the presses of cases.py."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from mjtactile._types import Array
from mjtactile.cli.benchmarks.cases import PressCase, moved_bodies
from mjtactile.cli.benchmarks.direct import relative_difference
from mjtactile.cli.benchmarks.sweep import plain_values, preset_of
from mjtactile.cli.benchmarks.timing import median_time
from mjtactile.contact.wrench_basis import WrenchBasis
from mjtactile.errors import quiet_contacts
from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import cached_path, influence_matrices, stored_path
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad
from mjtactile.units import MILLIMETRE

#: Wrenches applied to a footprint before its wrench basis is timed.
_SETTLING = 4
#: Largest random change of each component of the force, relative to the force [-].
_WRENCH_CHANGE = 0.02


@dataclass(frozen=True, eq=False)
class Bench:
    """Presses to measure, how often each is timed, and their reference readings."""

    cases: Sequence[PressCase]  #: presses that are measured for time, and for error against `truth`
    calculix: Sequence[PressCase]  #: presses that are measured for error against the readings of CalculiX
    moves: int  #: number of footprints timed per press, each in another place
    shift: float  #: largest shift of these places along x and y [m]
    wrenches: int  #: number of wrenches timed per press on one footprint
    #: Reference readings by name of a press, (layers, rows, columns) [Pa]; the benchmark fills them in.
    truth: dict[str, Array] = field(default_factory=dict)
    _loads: dict[tuple[Any, ...], list[SurfaceLoad]] = field(default_factory=dict)

    @classmethod
    def of(cls, design: dict[str, Any], cases: Sequence[PressCase], calculix: Sequence[PressCase]) -> Bench:
        """The bench that benchmarks/trade.toml describes; `design` is the content of that file."""
        return cls(cases, calculix, design["moves"], design["shift"] * MILLIMETRE, design["wrenches"])

    def loads(self, influence: InfluenceMatrices) -> list[SurfaceLoad]:
        """Tractions of all cases, then of CalculiX's; shared by fidelities with the same mesh and contact law."""
        values = plain_values(influence.fidelity)
        contact = values["mesh"], values["law"], values["cells"]
        if contact not in self._loads:
            self._loads[contact] = [case.load(influence) for case in (*self.cases, *self.calculix)]
        return self._loads[contact]


@contextmanager
def one_core() -> Iterator[None]:
    """Context in which linear algebra uses one core, and contact warnings are suppressed."""
    with threadpool_limits(limits=1), quiet_contacts():
        yield


def measure(fidelity: Fidelity, bench: Bench) -> dict[str, Any]:
    """Measure the time, size and errors of one fidelity: a row of the table.

    Returns:
        Its `plain_values`; "preset", its name or None; "table_bytes", the size of its tables; "load_s", the time to
        load them [s]; and by name of a case: "errors" against the reference [-], "calculix", the errors against
        CalculiX [-], "moved_s", the time after a move [s], "unchanged_s", the time under a new wrench on the same
        footprint [s], and "cache_error", the error of the kept wrench basis against a new solution [-].
    """
    built = influence_matrices(fidelity=fidelity)
    with one_core():
        loads = bench.loads(built)
        path = stored_path(Pad(), fidelity) or cached_path(Pad(), fidelity)
        start = time.perf_counter()
        influence = load_influence(path, Pad(), fidelity)
        influence.readings(loads[0])
        load_time = time.perf_counter() - start
        readings = influence.readings(loads)
        read = dict(zip((case.name for case in (*bench.cases, *bench.calculix)), readings, strict=True))
        unchanged = {case.name: _unchanged(case, influence, bench.wrenches) for case in bench.cases}
        return {
            **plain_values(fidelity),
            "preset": preset_of(fidelity),
            "table_bytes": path.stat().st_size,
            "load_s": load_time,
            "errors": {case.name: relative_difference(read[case.name], bench.truth[case.name]) for case in bench.cases},
            "calculix": {case.name: relative_difference(read[case.name], case.reference) for case in bench.calculix},
            "moved_s": {case.name: moved_time(case, influence, bench) for case in bench.cases},
            "unchanged_s": {name: seconds for name, (seconds, _) in unchanged.items()},
            "cache_error": {name: error for name, (_, error) in unchanged.items()},
        }


def moved_time(case: PressCase, influence: InfluenceMatrices, bench: Bench) -> float:
    """Median time from a body in a new place to readings [s]: footprint, contact and product with the matrices."""
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
    return seconds, relative_difference(basis.readings(last), influence.readings(changed.load(influence)))


def _wrenches(force: Array, count: int) -> Array:
    """Forces near a given one, drawn at random, (count, 3) [N]."""
    change = np.random.default_rng(2).uniform(-1.0, 1.0, (count, 3))
    return force + _WRENCH_CHANGE * np.linalg.norm(force) * change
