"""Run one pure function over many tasks: in this process, in processes of this machine, or on a Ray cluster.

Results are returned in the order in which they are completed. The calling process stores them, so that workers on
other machines need no shared disk. A task is repeated if its worker is killed. The result is the same, because it
depends on the task alone.
"""

from __future__ import annotations

import multiprocessing
import os
import socket
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from mjtactile._installed import __version__, require
from mjtactile.errors import DistributeError, shortened
from mjtactile.units import is_whole

Task = TypeVar("Task")
Result = TypeVar("Result")

#: A task is given up after this many of its workers were killed.
_ATTEMPTS = 5
#: Tasks submitted to Ray per processor, so that none idles; more would fill memory with results.
_AHEAD = 2
#: Limit of workers on this machine: the larger of the first number and the second times the processors.
_MOST_WORKERS, _MOST_PER_PROCESSOR = 16, 4
#: Timeout for a connection to a cluster [s].
_PATIENCE = 10.0


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Where tasks run; results never depend on it.

    Raises:
        DistributeError: the count is no whole number, below one, or above the limit of this machine; or an address is
            given without Ray.
    """

    count: int = 1  #: processes on this machine, one core each; not used for a Ray cluster at `ray_address`
    ray: bool = False  #: use Ray, which repeats the tasks of lost workers on the remaining ones
    ray_address: str | None = None  #: of a Ray cluster, such as "10.0.0.1:6379" or "auto"; None starts one here

    def __post_init__(self) -> None:
        # Each worker is a process of some hundred megabytes on this machine, unless it belongs to a remote cluster.
        most = max(_MOST_WORKERS, _MOST_PER_PROCESSOR * (os.cpu_count() or 1))
        if not (is_whole(self.count) and self.count >= 1):
            raise DistributeError(f"workers = {shortened(self.count)}; expected a whole number of at least 1.")
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
    """Check before long work that the workers can be started or reached.

    Raises:
        MissingExtraError: Ray is not installed.
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
    """Write files, each the result of one task, in the order in which tasks are completed.

    Every file appears complete or not at all. To resume after an interruption, ask for the missing files.

    Args:
        function: returns the content of a file for a task. It must be pure and importable by name from a module (for
            pickle), and should take a second or more.
        tasks: by the path of the file that each of them makes.
        workers: where tasks run, one thread each.

    Yields:
        Paths of the files as they are written.

    Raises:
        MissingExtraError: Ray is not installed.
        DistributeError: Ray cannot be reached, or workers are killed repeatedly during the same task.
        OutputError: a file cannot be written.
    """
    from mjtactile._files import write_atomically

    paths = list(tasks)
    for place, content in distributed(function, [tasks[path] for path in paths], workers):
        write_atomically(paths[place], lambda file, content=content: file.write(content))
        yield paths[place]


def distributed(
    function: Callable[[Task], Result], tasks: Sequence[Task], workers: Workers
) -> Iterator[tuple[int, Result]]:
    """Run a function over tasks and yield results in the order in which they are completed.

    Args:
        function: returns the result of a task; pure and importable by name, see `make_files`.
        tasks: the arguments, one per call.
        workers: where tasks run.

    Yields:
        (index in `tasks`, result). Exceptions of the function are passed on.

    Raises:
        MissingExtraError: Ray is not installed.
        DistributeError: Ray cannot be reached, or workers are killed repeatedly during the same task.
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

        # The number of threads changes the order of sums, and so their last bits.
        with threadpool_limits(limits=1):
            return self.function(task)


def process_pool(count: int) -> ProcessPoolExecutor:
    """A pool of `count` new processes, which end with this one, even if it is killed."""
    # Spawned, not forked: this process may have threads.
    return ProcessPoolExecutor(
        count, mp_context=multiprocessing.get_context("spawn"), initializer=end_with_parent_process
    )


def end_with_parent_process() -> None:
    """Let this process end as soon as the process that started it has ended; otherwise it would wait for ever.

    A process that is killed, or terminated by a batch system, cannot end those that it started.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def wait() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def _by_processes(job: _Job[Task, Result], tasks: Sequence[Task], count: int) -> Iterator[tuple[int, Result]]:
    left = dict(enumerate(tasks))
    losses = 0
    while left:
        # One killed process breaks its pool: the remaining tasks go to a new pool.
        with process_pool(min(count, len(left))) as pool:
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
        shared = ray.put(job)
        waiting = iter(enumerate(tasks))
        running: dict[Any, int] = {}
        try:
            while True:
                wanted = _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
                while len(running) < wanted and (following := next(waiting, None)) is not None:
                    place, task = following
                    running[remote.remote(__version__, shared, task)] = place
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
    """Run a task in a Ray worker, after checking that it has the caller's version of mjtactile."""
    if version != __version__:
        raise DistributeError(
            f"a Ray worker has mjtactile {__version__}, but the calling process has {version}. Install the same "
            "version on every machine."
        )
    return job(task)


@contextmanager
def _cluster(workers: Workers) -> Iterator[Any]:
    """Ray, connected to the requested cluster, or to a temporary one on this machine."""
    # No usage reports, and no warning about a future change of accelerator settings.
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
        try:
            _reach(workers.ray_address)  # Ray itself goes on trying for minutes
            ray.init(workers.ray_address, log_to_driver=False)
        except (OSError, RuntimeError, ValueError, OverflowError) as error:
            raise _no_cluster(workers.ray_address, error) from error
    try:
        yield ray
    finally:
        ray.shutdown()


def _reach(address: str) -> None:
    """Try to connect to an address with a port; raises OSError, ValueError or OverflowError if that fails."""
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
        f"{_ATTEMPTS} workers in a row were lost without a result, the last one with: {error}. Is there too little "
        "memory? Ask for fewer workers. Finished results are kept; call again to go on."
    )
