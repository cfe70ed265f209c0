"""The benchmark of fidelities: time and error of each."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Iterator, Sequence
from typing import Any

import mujoco

from mjtactile._progress import progress_bar
from mjtactile.cli.benchmarks.cases import calculix_cases, press_case
from mjtactile.cli.benchmarks.direct import solve
from mjtactile.cli.benchmarks.measure import Bench, measure, one_core
from mjtactile.cli.benchmarks.plugin import mujoco_tactile_time
from mjtactile.cli.benchmarks.sweep import plain_values, sweep
from mjtactile.fidelity import Fidelity, mesh_density
from mjtactile.influence.cache import influence_matrices
from mjtactile.pad import Pad
from mjtactile.sim.assets import asset_path


def trade_benchmark(*, quick: bool = False, progress: bool = True) -> dict[str, Any]:
    """Measure every fidelity of benchmarks/trade.toml on the cases of that file, for the default pad on one core.

    Tables come from the cache and stay there, so that an interrupted run starts again quickly.

    Args:
        quick: measure only what the file's section "quick" names.
        progress: show a progress bar on a terminal.

    Returns:
        "reference", the values of the reference; "rows", one result of `measure.measure` per fidelity; "flat",
        names of the cases with a flat face; "direct_s", the time of one direct solution by mesh [s];
        "mujoco_version"; and "mujoco_tactile_s", the time that MuJoCo's own tactile sensor adds to a step [s].
    """
    design = tomllib.loads(asset_path("benchmarks/trade.toml").read_text())
    if quick:
        design = _quick(design)
    wanted = design.get("cases")
    cases = [press_case(case) for case in design["case"] if wanted is None or case["name"] in wanted]
    bench = Bench.of(design, cases, calculix_cases())
    reference = Fidelity(**design["reference"])
    _measure_truth(reference, bench)
    return {
        "reference": plain_values(reference),
        "rows": [measure(fidelity, bench) for fidelity in _tracked(sweep(design), progress)],
        "direct_s": {mesh: _direct_time(mesh, bench) for mesh in design["direct"]},
        "flat": [case.name for case in cases if case.is_flat],
        "mujoco_version": mujoco.mj_versionString(),
        "mujoco_tactile_s": mujoco_tactile_time(),
    }


def _quick(design: dict[str, Any]) -> dict[str, Any]:
    quick = dict(design["quick"])
    product = {name: quick.pop(name) for name in ("meshes", "laws")}
    return {**design, **quick, "product": product, "around": {}}


def _measure_truth(reference: Fidelity, bench: Bench) -> None:
    """Fill in the readings of the reference, with which all others are compared."""
    influence = influence_matrices(fidelity=reference)
    with one_core():
        readings = influence.readings([case.load(influence) for case in bench.cases])
    bench.truth.update({case.name: values for case, values in zip(bench.cases, readings, strict=True)})


def _direct_time(mesh: str, bench: Bench) -> float:
    """Time to solve the finite elements for one load whose contact is known already [s]."""
    influence = influence_matrices(fidelity=Fidelity(mesh=mesh))
    with one_core():
        load = bench.cases[0].load(influence)
        start = time.perf_counter()
        solve(Pad(), mesh_density(mesh), [load], threads=1)
        return time.perf_counter() - start


def _tracked(fidelities: Sequence[Fidelity], progress: bool) -> Iterator[Fidelity]:
    with progress_bar("measuring", len(fidelities), wanted=progress) as advance:
        for fidelity in fidelities:
            yield fidelity
            advance(1)
