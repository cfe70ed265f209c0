"""Run the study's units in parallel and collect their results."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any

from mjtactile._progress import progress_bar
from mjtactile.experiments.study.plan import StudySettings, Unit, keep, kept, kept_path, units
from mjtactile.experiments.study.presses import law_difference
from mjtactile.influence.cache import influence_matrices
from mjtactile.workers import Workers, distributed


def reproduce(
    settings: StudySettings, *, workers: int = 2, fresh: bool = False, progress: bool = True
) -> dict[str, Any]:
    """Train and test all networks of the study in processes of one core; stored results are reused unless `fresh`.

    Returns:
        {"settings": ..., "foundation_difference": largest relative difference of readings under laws "foundation" and
        "uniform", "elastic_difference": the same for "elastic", "units": [{**unit, "result": ...}], "seconds": of
        training of all units together, "elapsed_seconds": of this run}.

    Raises:
        DistributeError: there are too many workers, or they are killed repeatedly during the same unit.
    """
    start, who = time.perf_counter(), Workers(count=workers)
    influence = influence_matrices(fidelity=settings.fidelity)
    planned = list(units(settings))
    paths = [kept_path(unit, influence) for unit in planned]
    missing = [k for k, path in enumerate(paths) if fresh or kept(path) is None]
    tasks = [planned[k] for k in missing]
    cost = sum(unit.cost for unit in tasks)
    with progress_bar("networks", cost, wanted=progress and bool(missing), counted=False) as advance:
        for place, result in distributed(_timed, tasks, who):
            keep(paths[missing[place]], result)
            advance(tasks[place].cost)
    results = [kept(path) for path in paths]
    return {
        "settings": asdict(settings),
        "foundation_difference": law_difference(influence, "foundation"),
        "elastic_difference": law_difference(influence, "elastic"),
        "units": [{**asdict(unit), **(result or {})} for unit, result in zip(planned, results, strict=True)],
        "seconds": sum(result["seconds"] for result in results if result),
        "elapsed_seconds": time.perf_counter() - start,
    }


def _timed(unit: Unit) -> dict[str, Any]:
    start = time.perf_counter()
    result = unit.run()
    return {"result": result, "seconds": time.perf_counter() - start}
