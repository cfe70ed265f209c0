from __future__ import annotations

import fcntl
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mjtactile import workers as distribute
from mjtactile.errors import DistributeError, MissingExtraError, OutputError
from mjtactile.workers import Workers, distributed, make_files


def square(number: int) -> bytes:
    return str(number**2).encode()


def refuse(number: int) -> bytes:
    if number == 3:
        raise ZeroDivisionError("three is refused")
    return square(number)


def lose_the_first_worker(task: tuple[int, Path]) -> int:
    """The square of a number; who does 3 is killed over it the first time."""
    number, mark = task
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def lose_every_worker(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def never_done(folder: Path) -> None:
    """Hold a lock on a file of this process's own, until it ends."""
    with (folder / str(os.getpid())).open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        (folder / f"{os.getpid()}.locked").touch()
        threading.Event().wait()


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_the_process_that_started_them(tmp_path, how):
    """A killed process cannot end its workers, which would keep their memory for ever."""
    context = multiprocessing.get_context("spawn")
    asker = context.Process(target=ask_for_what_never_ends, args=(tmp_path,))
    asker.start()
    assert holds_soon(lambda: len(list(tmp_path.glob("*.locked"))) == 2)
    files = [path.with_suffix("") for path in tmp_path.glob("*.locked")]
    assert all(is_locked(file) for file in files)
    os.kill(asker.pid or 0, how)
    asker.join()
    assert holds_soon(lambda: not any(is_locked(file) for file in files))


def ask_for_what_never_ends(folder: Path) -> None:
    list(distributed(never_done, [folder] * 2, Workers(count=2)))


def holds_soon(condition: Callable[[], bool]) -> bool:
    """Whether a condition holds within half a minute, which starting processes on a busy machine may take."""
    end = time.monotonic() + 30.0
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def is_locked(path: Path) -> bool:
    with path.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


@pytest.mark.parametrize("count", [1, 2])
def test_every_task_makes_its_file(tmp_path, count):
    tasks = {tmp_path / f"{number}": number for number in range(5)}
    assert sorted(make_files(square, tasks, Workers(count=count))) == sorted(tasks)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {str(n): str(n**2) for n in range(5)}


def test_files_are_there_as_soon_as_they_are_told(tmp_path):
    making = make_files(square, {tmp_path / f"{number}": number for number in range(3)}, Workers())
    for done, path in enumerate(making, start=1):
        assert path.is_file()
        assert len(list(tmp_path.iterdir())) == done


@pytest.mark.parametrize("count", [1, 2])
def test_errors_of_a_task_come_out_as_they_are(count):
    with pytest.raises(ZeroDivisionError, match="three is refused"):
        list(distributed(refuse, range(5), Workers(count=count)))


def test_a_file_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        list(make_files(square, {tmp_path / "missing" / "file": 1}, Workers()))


@pytest.mark.slow
def test_a_killed_process_costs_only_time(tmp_path):
    tasks = [(number, tmp_path / "killed") for number in range(6)]
    results = dict(distributed(lose_the_first_worker, tasks, Workers(count=2)))
    assert (tmp_path / "killed").exists()
    assert results == {number: number**2 for number in range(6)}


@pytest.mark.slow
def test_a_task_that_kills_every_worker_is_given_up(monkeypatch):
    monkeypatch.setattr(distribute, "_ATTEMPTS", 2)
    with pytest.raises(DistributeError, match=r"2 workers in a row.*memory"):
        list(distributed(lose_every_worker, range(3, 5), Workers(count=2)))


def test_no_tasks_need_no_workers():
    assert list(distributed(square, [], Workers(count=2))) == []


@pytest.mark.parametrize(
    ("asked", "said"),
    [({"count": 0}, "at least 1"), ({"count": "2"}, "whole number"), ({"ray_address": "auto"}, "--ray")],
)
def test_workers_that_make_no_sense_are_refused(asked, said):
    with pytest.raises(DistributeError, match=said):
        Workers(**asked)


def test_without_ray_installed_the_cure_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtraError, match=r'pip install "mjtactile\[ray\]"'):
        list(distributed(square, [1], Workers(ray=True)))
