"""One pure function over many tasks: in this process, in processes of this machine, or on a Ray cluster.

Results come as they are done and are stored by the process that asks for them, so that workers on other machines need
no common disk. A task whose worker is killed is done again: that costs nothing but time, because a function of its
task alone gives the same result anywhere.
"""

from __future__ import annotations

import multiprocessing
import os
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from mjtactile._installed import require
from mjtactile.errors import DistributeError

Task = TypeVar("Task")
Result = TypeVar("Result")

#: A task is given up when so many workers were lost over it.
_ATTEMPTS = 5
#: Tasks handed to Ray ahead of each processor, so that none waits; more would pile up results in memory.
_AHEAD = 2
#: Workers of one machine are at most so many, or so many for each processor.
_MOST_WORKERS, _MOST_PER_PROCESSOR = 16, 4
#: How long a cluster may take to answer [s].
_PATIENCE = 10.0


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Who does the work; results never depend on it.

    Raises:
        DistributeError: for no workers, more than this machine can do with, or an address without Ray.
    """

    count: int = 1  #: processes of this machine, one core each; of a Ray cluster at `ray_address`, its processors count
    ray: bool = False  #: on Ray, which does tasks of lost workers again on those that are left
    ray_address: str | None = None  #: of a Ray cluster, such as "10.0.0.1:6379" or "auto"; None starts one here

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        # Each is a process of some hundred megabytes; those of a cluster elsewhere are not made here.
        most = max(_MOST_WORKERS, _MOST_PER_PROCESSOR * (os.cpu_count() or 1))
        if self.count < 1:
            raise DistributeError(f"workers = {self.count}; expected at least 1.")
        if self.count > most and self.ray_address is None:
            raise DistributeError(
                f"workers = {self.count}; expected at most {most} on this machine. One for each processor is enough."
            )
        if self.ray_address == "":
            raise DistributeError("the address of the Ray cluster is empty. Leave it out for one on this machine.")
        if self.ray_address is not None and not self.ray:
            raise DistributeError(
                f"the address {self.ray_address!r} of a Ray cluster was given without Ray: add --ray."
            )


def check_workers(workers: Workers) -> None:
    """Find out before long work whether the workers can be had.

    Raises:
        MissingExtraError: Ray is missing.
        DistributeError: no cluster answers at the address.
    """
    if not workers.ray:
        return
    require("ray")
    if workers.ray_address is not None:
        try:
            _reach(workers.ray_address)
        except (OSError, ValueError, OverflowError) as error:
            raise _no_cluster(workers.ray_address, error) from error


def make_files(function: Callable[[Task], bytes], tasks: Mapping[Path, Task], workers: Workers) -> Iterator[Path]:
    """Make files, each of them the result of a task, in whatever order they are done.

    Every file appears whole or not at all, so going on after an interruption is asking for those that are missing.

    Args:
        function: from a task to a file's content. It must be pure, importable by name from a module (as pickle wants
            it), and do as much work as is worth sending, a second or more.
        tasks: by the path of the file each of them makes.
        workers: who does it. They run one thread each.

    Yields:
        Paths as they are written.

    Raises:
        MissingExtraError: when Ray is missing.
        DistributeError: when Ray cannot be reached, or workers die over a task again and again.
        OutputError: when a file cannot be written.
    """
    from mjtactile._files import write_atomically

    paths = list(tasks)
    for place, content in distributed(function, [tasks[path] for path in paths], workers):
        write_atomically(paths[place], lambda file, content=content: file.write(content))
        yield paths[place]


def distributed(
    function: Callable[[Task], Result], tasks: Sequence[Task], workers: Workers
) -> Iterator[tuple[int, Result]]:
    """Do tasks, in whatever order they are done.

    Args:
        function: from a task to its result, pure and importable by name, see `make_files`.
        tasks: one after another.
        workers: who does them.

    Yields:
        Places in `tasks`, and results. Errors of the function come out as they are.
    """
    job = _Job(function)
    if not tasks:
        return iter(())
    if workers.ray:
        return _by_ray(job, tasks, workers)
    if workers.count == 1:
        return ((place, job(task)) for place, task in enumerate(tasks))
    return _by_processes(job, tasks, workers.count)


@dataclass(frozen=True)
class _Job(Generic[Task, Result]):
    """The function as a worker calls it."""

    function: Callable[[Task], Result]

    def __call__(self, task: Task) -> Result:
        from threadpoolctl import threadpool_limits

        # Sums come out in another order, and with other last bits, on another number of threads.
        with threadpool_limits(limits=1):
            return self.function(task)


def _by_processes(job: _Job[Task, Result], tasks: Sequence[Task], count: int) -> Iterator[tuple[int, Result]]:
    left = dict(enumerate(tasks))
    context = multiprocessing.get_context("spawn")
    losses = 0
    while left:
        # One killed process breaks its pool: those that are left go to another one.
        with ProcessPoolExecutor(min(count, len(left)), mp_context=context) as pool:
            try:
                running = {pool.submit(job, task): place for place, task in left.items()}
                for future in as_completed(running):
                    result = future.result()
                    del left[running[future]]
                    losses = 0
                    yield running[future], result
            except BrokenProcessPool as error:
                losses += 1
                if losses == _ATTEMPTS:
                    raise _given_up(error) from error
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise


def _by_ray(job: _Job[Task, Result], tasks: Sequence[Task], workers: Workers) -> Iterator[tuple[int, Result]]:
    with _cluster(workers) as ray:
        remote = ray.remote(num_cpus=1, max_retries=_ATTEMPTS - 1)(_on_version)
        version, shared = _version(), ray.put(job)
        waiting = iter(enumerate(tasks))
        running: dict[Any, int] = {}
        try:
            while True:
                wanted = _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
                while len(running) < wanted and (following := next(waiting, None)) is not None:
                    place, task = following
                    running[remote.remote(version, shared, task)] = place
                if not running:
                    return
                (done,), _ = ray.wait(list(running), num_returns=1)
                yield running.pop(done), _result(ray, done)
        finally:
            for one in running:
                ray.cancel(one, force=True)


def _result(ray: Any, reference: Any) -> Any:
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from error
    except ray.exceptions.RayError as error:
        raise _given_up(error) from error


def _on_version(version: str, job: Callable[[Any], Any], task: Any) -> Any:
    """What a Ray worker runs."""
    if version != _version():
        raise DistributeError(
            f"a Ray worker has mjtactile {_version()}, but {version} asks. Install the same version on every machine."
        )
    return job(task)


def _version() -> str:
    from mjtactile._installed import __version__

    return __version__


@contextmanager
def _cluster(workers: Workers) -> Iterator[Any]:
    """Ray, connected: to the cluster asked for, or to one of this machine's processes for as long as it is needed."""
    # What Ray reports home, and a warning of what it will do with accelerators some day, are nobody's wish here.
    for name in ("RAY_USAGE_STATS_ENABLED", "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"):
        os.environ.setdefault(name, "0")
    require("ray")
    import ray

    if ray.is_initialized():
        yield ray
        return
    if workers.ray_address is None:
        ray.init("local", num_cpus=workers.count, include_dashboard=False, log_to_driver=False)
    else:
        _connect(ray, workers.ray_address)
    try:
        yield ray
    finally:
        ray.shutdown()


def _connect(ray: Any, address: str) -> None:
    try:
        _reach(address)  # Ray itself goes on trying for minutes
        ray.init(address, log_to_driver=False)
    except (OSError, RuntimeError, ValueError, OverflowError) as error:
        raise _no_cluster(address, error) from error


def _reach(address: str) -> None:
    """Raises OSError, ValueError or OverflowError where nothing answers at an address with a port."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if colon:
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()


def _no_cluster(address: str, error: BaseException) -> DistributeError:
    return DistributeError(
        f"no Ray cluster answers at {address!r}: {error}. Start one with `ray start --head`, or leave the address "
        "out for one on this machine."
    )


def _given_up(error: BaseException) -> DistributeError:
    return DistributeError(
        f"{_ATTEMPTS} workers in a row were lost without a result, the last one so: {error}. Is there too little "
        "memory? Ask for fewer workers. What was finished is kept; call again to go on."
    )
