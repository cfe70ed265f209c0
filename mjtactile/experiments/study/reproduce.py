"""Run the study's units in parallel and collect their results."""

from __future__ import annotations

import multiprocessing
import queue
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import asdict
from multiprocessing.managers import SyncManager
from typing import Any

from mjtactile._progress import progress_bar
from mjtactile.experiments.study.plan import StudySettings, Unit, keep, kept, kept_path, units
from mjtactile.experiments.study.presses import law_difference
from mjtactile.influence.cache import influence_matrices
from mjtactile.workers import end_with_parent_process, process_pool

#: Time between two updates of the progress bar [s].
_LOOK = 0.2
#: Least time between two progress reports of a worker [s].
_SAY = 0.5


def reproduce(
    settings: StudySettings, *, workers: int = 2, fresh: bool = False, progress: bool = True
) -> dict[str, Any]:
    """Train and test all networks of the study; stored results of units are reused.

    Args:
        settings: extent of the study.
        workers: number of processes, one core each; 1 for this process alone.
        fresh: ignore stored results.
        progress: show a progress bar on a terminal.

    Returns:
        {"settings": ..., "foundation_difference": largest relative difference of readings under laws "foundation" and
        "uniform", "elastic_difference": the same for "elastic", "units": [{**unit, "result": ...}], "seconds": of
        training of all units together, "elapsed_seconds": of this run}.
    """
    start = time.perf_counter()
    influence = influence_matrices(fidelity=settings.fidelity)
    planned = list(units(settings))
    paths = [kept_path(unit, influence) for unit in planned]
    missing = [k for k, path in enumerate(paths) if fresh or kept(path) is None]
    costs, shares = [planned[k].cost for k in missing], [0.0] * len(missing)
    with progress_bar("networks", sum(costs), wanted=progress and bool(missing), counted=False) as advance:

        def told(k: int, share: float) -> None:
            advance((share - shares[k]) * costs[k])
            shares[k] = share

        _run([planned[k] for k in missing], [paths[k] for k in missing], workers, told)
    results = [kept(path) for path in paths]
    return {
        "settings": asdict(settings),
        "foundation_difference": law_difference(influence, "foundation"),
        "elastic_difference": law_difference(influence, "elastic"),
        "units": [{**asdict(unit), **(result or {})} for unit, result in zip(planned, results, strict=True)],
        "seconds": sum(result["seconds"] for result in results if result),
        "elapsed_seconds": time.perf_counter() - start,
    }


def _run(missing: Sequence[Unit], paths: Sequence[Any], workers: int, told: Callable[[int, float], None]) -> None:
    if workers <= 1 or len(missing) <= 1:
        for k, (unit, path) in enumerate(zip(missing, paths, strict=True)):
            keep(path, _timed(unit, lambda share, k=k: told(k, share)))
        return
    manager = SyncManager(ctx=multiprocessing.get_context("spawn"))
    manager.start(end_with_parent_process)
    with manager, process_pool(workers) as pool:
        shares = manager.Queue()
        running = {pool.submit(_in_worker, unit, k, shares): k for k, unit in enumerate(missing)}
        try:
            _gather(running, paths, shares, told)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _gather(
    running: dict[Future[dict[str, Any]], int], paths: Sequence[Any], shares: Any, told: Callable[[int, float], None]
) -> None:
    """Store each result when it is available, and update the progress bar."""
    while running:
        for future in [future for future in running if future.done()]:
            k = running.pop(future)
            keep(paths[k], future.result())
            told(k, 1.0)
        try:
            while True:
                told(*shares.get(timeout=_LOOK))
        except queue.Empty:
            continue


def _in_worker(unit: Unit, k: int, shares: Any) -> dict[str, Any]:
    said = 0.0

    def say(share: float) -> None:
        nonlocal said
        if time.monotonic() - said > _SAY:
            said = time.monotonic()
            shares.put((k, share))

    return _timed(unit, say)


def _timed(unit: Unit, progress: Callable[[float], None]) -> dict[str, Any]:
    start = time.perf_counter()
    result = unit.run(progress)
    return {"result": result, "seconds": time.perf_counter() - start}
