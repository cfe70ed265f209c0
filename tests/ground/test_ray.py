"""The same files from a Ray cluster, with workers and machines lost midway."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from mjtactile.cli.main import app
from mjtactile.dataset import files as dataset
from mjtactile.dataset.spec import load_spec
from mjtactile.errors import DistributeError
from mjtactile.workers import Workers, distributed

pytest.importorskip("ray", reason="Ray is not installed: pip install 'mjtactile[ray]'")
pytestmark = pytest.mark.slow

SPEC = """
presses = 400
seed = 11
fidelity = "fast"
law = ["elastic", "uniform"]
poses = 2
forces = 2
noise = [0.0, 0.01]
[[contact]]
shapes = ["star", "triangle", "sphere"]
size = [0.7, 1.0]
shift = 1.5
"""
STORE = 80_000_000  # bytes for objects; Ray takes no less


@pytest.fixture(scope="module")
def spec_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spec") / "presses.toml"
    path.write_text(SPEC)
    return path


@pytest.fixture(autouse=True)
def _small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dataset, "_PRESSES_PER_PART", 8)


@pytest.fixture(scope="module")
def local(spec_file: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files as one process of this machine makes them."""
    folder = tmp_path_factory.mktemp("local")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dataset, "_PRESSES_PER_PART", 8)
        dataset.make_dataset(load_spec(spec_file), folder, progress=False)
    return contents(folder)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A cluster of one node with one worker, to which tests may add."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        from ray.cluster_utils import Cluster

        made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": STORE})
        try:
            yield made
        finally:
            made.shutdown()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def busy_workers() -> list[int]:
    """Ray's worker processes below this one that are doing a task."""
    listed = subprocess.run(["ps", "-axo", "pid=,ppid=,command="], capture_output=True, text=True, check=True).stdout
    parent: dict[int, int] = {}
    busy = []
    for line in listed.splitlines():
        pid, above, command = line.split(maxsplit=2)
        parent[int(pid)] = int(above)
        if command.startswith("ray::_on_version"):
            busy.append(int(pid))

    def is_ours(pid: int) -> bool:
        return pid == os.getpid() or (pid in parent and is_ours(parent[pid]))

    return [pid for pid in busy if is_ours(pid)]


def test_two_workers_make_the_same_files_though_one_is_killed_and_one_machine_lost(cluster, spec_file, local, tmp_path):
    lost = cluster.add_node(num_cpus=1, object_store_memory=STORE)
    told: list[int] = []

    def parts_there() -> int:
        return len(list(tmp_path.glob("presses-*.parquet")))

    def wait_for(parts: int) -> None:
        while parts_there() < parts:
            time.sleep(0.005)

    def kill() -> None:
        wait_for(2)
        while not (busy := busy_workers()):
            time.sleep(0.005)
        os.kill(busy[0], signal.SIGKILL)
        told.append(parts_there())
        wait_for(6)
        cluster.remove_node(lost)
        told.append(parts_there())

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    workers = Workers(ray=True, ray_address=cluster.address)
    assert dataset.make_dataset(load_spec(spec_file), tmp_path, workers=workers, progress=False) == 400
    killer.join(timeout=30)
    assert len(told) == 2
    assert max(told) < len(local)
    assert contents(tmp_path) == local


def test_on_a_cluster_that_is_there_tasks_are_done_again_and_errors_come_out_as_they_are(cluster, tmp_path):
    mark = tmp_path / "killed"

    def square(number: int) -> int:
        if number == 3 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number**2

    def refuse(number: int) -> int:
        raise ZeroDivisionError(f"{number} is refused")

    workers = Workers(ray=True, ray_address=cluster.address)
    assert dict(distributed(square, range(6), workers)) == {number: number**2 for number in range(6)}
    assert mark.exists()
    with pytest.raises(ZeroDivisionError, match="7 is refused"):
        list(distributed(refuse, [7], workers))


def test_the_same_command_makes_the_same_files_with_ray(spec_file, local, tmp_path):
    made = CliRunner().invoke(app, ["dataset", "--spec", str(spec_file), "--out", str(tmp_path), "--ray"])
    assert made.exit_code == 0, made.output
    assert contents(tmp_path) == local


@pytest.mark.parametrize("address", ["127.0.0.1:9", "no address"])
def test_a_cluster_that_does_not_answer_is_said(address):
    with pytest.raises(DistributeError, match=rf"no Ray cluster answers at '{re.escape(address)}'.*ray start --head"):
        list(distributed(abs, [1], Workers(ray=True, ray_address=address)))
