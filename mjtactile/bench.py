"""Benchmarks: cases as data in benchmarks/, one runner each, tables as Markdown for the README."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjtactile.assets import asset_path
from mjtactile.cache import CACHE_VARIABLE, cached_path
from mjtactile.contact import SurfaceLoad, contact_load
from mjtactile.errors import MjTactileError
from mjtactile.footprint import Footprint
from mjtactile.indenter import indenter_outline
from mjtactile.influence import InfluenceMatrices, load_influence
from mjtactile.pad import Pad
from mjtactile.scene import force_vector
from mjtactile.timing import median_time
from mjtactile.units import GRAM_FORCE, MILLIMETRE

_REPEATS = 30
_STEPS = 2000
_SETTLING_STEPS = 200
#: A press on MuJoCo's own tactile sensor: a square punch, its best case, on a plate of 26 x 26 = 676 points. A plate
#: lies in its geom's plane x = 0, so the pad is a thin box standing in the world's horizontal plane.
_MUJOCO_TACTILE = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100" jacobian="dense"/>
  <asset><mesh name="plate" builtin="plate" params="26 26" scale="0.0075 0.0075 0.0001"/></asset>
  <worldbody>
    <geom name="pad" type="box" size="0.000001 0.0075 0.0075" quat="0.70710678 0 -0.70710678 0" priority="1"
          solref="0.003 1" solimp="0.98 0.99 0.001 0.5 2"/>
    <body pos="0 0 0.0025" gravcomp="1">
      <joint name="press" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.005 0.005 0.0025" mass="0.015"/>
    </body>
  </worldbody>
  <actuator><motor joint="press"/></actuator>
  {sensor}
</mujoco>
"""
_TACTILE_SENSOR = '<sensor><tactile geom="pad" mesh="plate"/></sensor>'


def mesh_benchmark() -> dict[str, Any]:
    """Build, store and apply the paper's pad on every mesh, each built in a fresh process and a cache of its own.

    Returns:
        {"meshes": {name: figures}, "mujoco_tactile_s": what MuJoCo's own tactile sensor adds to a step [s], ...}.
    """
    cases = tomllib.loads(asset_path("benchmarks/mesh.toml").read_text())
    pad = Pad()
    with tempfile.TemporaryDirectory(prefix="mjtactile-bench-") as folder:
        built = {name: _build_in_fresh_process(name, pad, Path(folder)) for name in cases["meshes"]}
        readings, figures = {}, {}
        for name, (path, build_time, peak_memory) in built.items():
            start = time.perf_counter()
            influence = load_influence(path, pad, name)
            load_time = time.perf_counter() - start
            loads = [_load(influence, case) for case in cases["load"]]
            readings[name] = [influence.readings(load) for load in loads]
            figures[name] = {
                "build_s": build_time,
                "peak_memory_bytes": peak_memory,
                "table_bytes": path.stat().st_size,
                "load_s": load_time,
                "new_footprint_s": median_time(
                    lambda i=influence: [i.readings(_load(i, c)) for c in cases["load"]], _REPEATS
                )
                / len(loads),
                "same_footprint_s": median_time(lambda i=influence, ls=loads: [i.readings(one) for one in ls], _REPEATS)
                / len(loads),
            }
        reference = readings[cases["reference"]]
        for name, values in readings.items():
            errors = [_relative(a, b) for a, b in zip(values, reference, strict=True)]
            figures[name]["errors"] = dict(zip((c["name"] for c in cases["load"]), errors, strict=True))
    return {
        "reference": cases["reference"],
        "meshes": figures,
        "mujoco_version": mujoco.mj_versionString(),
        "mujoco_tactile_s": mujoco_tactile_time(),
    }


def mesh_table(result: dict[str, Any]) -> str:
    """The benchmark's result as a Markdown table."""
    lines = [
        "| mesh | build | table | peak memory | load | update, new footprint | update, same footprint "
        f"| error against {result['reference']}: median (worst) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, row in result["meshes"].items():
        errors = list(row["errors"].values())
        error = "-" if name == result["reference"] else f"{np.median(errors):.2%} ({max(errors):.2%})"
        lines.append(
            f"| {name} | {row['build_s']:.1f} s | {row['table_bytes'] / 1e6:.0f} MB "
            f"| {row['peak_memory_bytes'] / 1e9:.2f} GB | {row['load_s'] * 1e3:.0f} ms "
            f"| {row['new_footprint_s'] * 1e3:.1f} ms | {row['same_footprint_s'] * 1e3:.1f} ms | {error} |"
        )
    lines.append(
        f"| MuJoCo {result['mujoco_version']} `<tactile>`, 676 points | - | - | - | - "
        f"| {result['mujoco_tactile_s'] * 1e3:.3f} ms | {result['mujoco_tactile_s'] * 1e3:.3f} ms "
        "| penetration depth, no stress |"
    )
    return "\n".join(lines)


def rewrite_table(path: Path, name: str, table: str) -> None:
    """Replace the table between the markers `<!-- bench NAME -->` and `<!-- end -->` of a Markdown file.

    Raises:
        MjTactileError: when the file has no such markers.
    """
    text = path.read_text()
    pattern = re.compile(rf"(<!-- bench {re.escape(name)} -->\n).*?(<!-- end -->)", flags=re.DOTALL)
    if not pattern.search(text):
        raise MjTactileError(
            f"{path} has no lines '<!-- bench {name} -->' and '<!-- end -->' to put the table between."
        )
    path.write_text(pattern.sub(lambda match: match.group(1) + table + "\n" + match.group(2), text))


def mujoco_tactile_time() -> float:
    """Time MuJoCo's own tactile sensor with 676 points adds to a step under a pressing square punch [s]."""
    return _step_time(_TACTILE_SENSOR) - _step_time("")


def _step_time(sensor: str) -> float:
    model = mujoco.MjModel.from_xml_string(_MUJOCO_TACTILE.format(sensor=sensor))
    data = mujoco.MjData(model)
    data.ctrl[:] = -1.0
    mujoco.mj_step(model, data, _SETTLING_STEPS)
    if sensor and not data.sensordata[: model.nsensordata // 3].any():
        raise MjTactileError("MuJoCo's tactile sensor reads nothing under the punch: its timing would be meaningless.")
    return median_time(lambda: mujoco.mj_step(model, data, _STEPS), 5) / _STEPS


def _build_in_fresh_process(mesh: str, pad: Pad, folder: Path) -> tuple[Path, float, int]:
    """Path of the built table, wall time of the build [s] and peak memory of its process [bytes]."""
    code = (
        "import json, resource, sys, time\n"
        "from mjtactile import influence_matrices\n"
        "start = time.perf_counter(); influence_matrices(mesh=sys.argv[1], progress=False)\n"
        "unit = 1 if sys.platform == 'darwin' else 1024\n"
        "print(json.dumps([time.perf_counter() - start, unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]))\n"
    )
    environment = {**os.environ, CACHE_VARIABLE: str(folder)}
    run = subprocess.run([sys.executable, "-c", code, mesh], env=environment, capture_output=True, text=True)
    if run.returncode != 0:
        raise MjTactileError(f"building mesh {mesh!r} failed: {run.stderr.strip()[-500:]}")
    build_time, peak_memory = json.loads(run.stdout)
    return folder / cached_path(pad, mesh).name, build_time, peak_memory


def _load(influence: InfluenceMatrices, case: dict[str, Any]) -> SurfaceLoad:
    x, y = case.get("shift", (0.0, 0.0))
    outline = indenter_outline(
        case["shape"],
        shift=(x * MILLIMETRE, y * MILLIMETRE),
        rotate_deg=case.get("rotate", 0.0),
        scale=case.get("scale", 1.0),
    )
    force = force_vector(case["force"] * GRAM_FORCE, case.get("tilt", 0.0), case.get("azimuth", 0.0))
    return contact_load(influence, Footprint.from_outline(outline, influence), force)


def _relative(values: np.ndarray, reference: np.ndarray) -> float:
    return float(np.linalg.norm(values - reference) / np.linalg.norm(reference))
