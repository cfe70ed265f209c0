"""The benchmark of the meshes: time, memory and error of each. Its cases are in benchmarks/mesh.toml."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import mujoco

from mjtactile.cli.benchmarks.cases import press_case
from mjtactile.cli.benchmarks.direct import relative_difference
from mjtactile.cli.benchmarks.plugin import mujoco_tactile_time
from mjtactile.cli.benchmarks.timing import median_time
from mjtactile.errors import MjTactileError
from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import CACHE_VARIABLE, cached_path
from mjtactile.influence.matrices import load_influence
from mjtactile.pad import Pad
from mjtactile.sim.assets import asset_path

_REPEATS = 30


def mesh_benchmark() -> dict[str, Any]:
    """Build, store and apply the default pad on every mesh. Each is built in a fresh process, with an empty cache.

    Returns:
        "reference", the name of the mesh that errors refer to; "meshes", by name the times [s], sizes [bytes] and
        relative errors by case [-]; "mujoco_version"; and "mujoco_tactile_s", the time that MuJoCo's own tactile
        sensor adds to a step [s].

    Raises:
        MjTactileError: the tables of a mesh could not be built.
    """
    design = tomllib.loads(asset_path("benchmarks/mesh.toml").read_text())
    cases, pad = [press_case(case) for case in design["case"]], Pad()
    with tempfile.TemporaryDirectory(prefix="mjtactile-bench-") as folder:
        built = {name: _build_in_fresh_process(name, pad, Path(folder)) for name in design["meshes"]}
        readings, figures = {}, {}
        for name, (path, build_time, peak_memory) in built.items():
            start = time.perf_counter()
            influence = load_influence(path, pad, Fidelity(mesh=name))
            load_time = time.perf_counter() - start
            loads = [case.load(influence) for case in cases]
            readings[name] = [influence.readings(load) for load in loads]
            figures[name] = {
                "build_s": build_time,
                "peak_memory_bytes": peak_memory,
                "table_bytes": path.stat().st_size,
                "load_s": load_time,
                "new_footprint_s": median_time(lambda i=influence: [i.readings(one.load(i)) for one in cases], _REPEATS)
                / len(loads),
                "same_footprint_s": median_time(lambda i=influence, ls=loads: [i.readings(one) for one in ls], _REPEATS)
                / len(loads),
            }
        reference = readings[design["reference"]]
        for name, values in readings.items():
            errors = [relative_difference(a, b) for a, b in zip(values, reference, strict=True)]
            figures[name]["errors"] = dict(zip((case.name for case in cases), errors, strict=True))
    return {
        "reference": design["reference"],
        "meshes": figures,
        "mujoco_version": mujoco.mj_versionString(),
        "mujoco_tactile_s": mujoco_tactile_time(),
    }


def _build_in_fresh_process(mesh: str, pad: Pad, folder: Path) -> tuple[Path, float, int]:
    """Path of the built table, wall time of the build [s] and peak memory of its process [bytes]."""
    code = (
        "import json, resource, sys, time\n"
        "from mjtactile import Fidelity, influence_matrices\n"
        "start = time.perf_counter(); influence_matrices(fidelity=Fidelity(mesh=sys.argv[1]), progress=False)\n"
        "unit = 1 if sys.platform == 'darwin' else 1024\n"
        "print(json.dumps([time.perf_counter() - start, unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]))\n"
    )
    environment = {**os.environ, CACHE_VARIABLE: str(folder)}
    run = subprocess.run([sys.executable, "-c", code, mesh], env=environment, capture_output=True, text=True)
    if run.returncode != 0:
        raise MjTactileError(f"building mesh {mesh!r} failed: {run.stderr.strip()[-500:]}")
    build_time, peak_memory = json.loads(run.stdout)
    return folder / cached_path(pad, Fidelity(mesh=mesh)).name, build_time, peak_memory
