"""What the plugin adds to a step of MuJoCo, beside what MuJoCo's own tactile sensor adds.

Every figure is the difference between two scenes that differ by the sensor alone. Both are timed turn by turn in
short runs, and the medians compared, so that a machine that slows down for a while does so for both.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from mjtactile._native import instruction_set
from mjtactile.cli.benchmarks.plugin_scenes import BODIES, STEPS_EACH_WAY, PluginScene
from mjtactile.errors import MjTactileError
from mjtactile.fidelity import Fidelity, fidelity
from mjtactile.influence.cache import influence_matrices

_SETTLING_STEPS = 300
#: Simulations of the batch, and steps they are timed over.
_SIMULATIONS, _BATCH_STEPS = 64, 100
#: Contact cells of the law that a bound is named for.
_CELLS = 200


def plugin_benchmark(*, quick: bool = False) -> dict[str, Any]:
    """Time added to a step [s] by scene, and the batch.

    Args:
        quick: a tenth of the runs, for tests.
    """
    import tempfile
    from pathlib import Path

    runs = 5 if quick else 40
    presets = ("fast",) if quick else ("fast", "balanced")
    with tempfile.TemporaryDirectory() as folder:
        table = str(Path(folder) / "elastic200.mjt")
        if not quick:
            _save_table(table)
        rows = [_row(name, scene, bare, runs) for name, scene, bare in _cases(presets, "" if quick else table)]
    return {
        "mujoco_version": mujoco.__version__,
        "instruction_set": instruction_set(),
        "rows": rows,
        "batch": _batch(presets[0], 8 if quick else _SIMULATIONS),
    }


def _save_table(path: str) -> None:
    """Tables of preset "balanced" whose law has as many cells as the bound is for."""
    chosen = fidelity("balanced")
    law = Fidelity(**{**_fields(chosen), "law": "elastic", "cells": _CELLS})
    influence_matrices(preset=law).save(path)


def _fields(chosen: Fidelity) -> dict[str, Any]:
    return {name: getattr(chosen, name) for name in chosen.__dataclass_fields__}


def _cases(presets: tuple[str, ...], table: str) -> Iterator[tuple[str, PluginScene, PluginScene]]:
    """Name, scene with its sensor, and the same without."""
    for shape in ("box", "star"):
        theirs: dict[str, Any] = {"shape": shape, "ground": "theirs"}
        name = f"MuJoCo `<tactile>`, {shape}"
        yield name, PluginScene(sensor="theirs", **theirs), PluginScene(**theirs)
    yield "no contact", PluginScene(sensor="ours", touched=0), PluginScene(touched=0)
    for moving in (False, True):
        for shape in ("box", "star"):
            for preset in presets:
                common: dict[str, Any] = {"shape": shape, "moving": moving}
                name = f"{'moving' if moving else 'unchanged'} {shape}, {preset}"
                yield name, PluginScene(sensor="ours", fidelity=preset, **common), PluginScene(**common)
    for shape in BODIES:
        for preset in presets[:2]:
            bare = PluginScene(shape=shape, moving=True)
            yield f"moving {shape}, {preset}", replace(bare, sensor="ours", fidelity=preset), bare
    if table:
        bare = PluginScene(moving=True)
        name = f"moving box, balanced with {_CELLS} cells"
        yield name, PluginScene(moving=True, sensor="ours", fidelity="", table=table), bare
    for touched in range(6):
        common = {"pads": 5, "touched": touched}
        name = f"five pads, {touched} touched, {presets[-1]}"
        yield name, PluginScene(sensor="ours", fidelity=presets[-1], **common), PluginScene(**common)


def _row(name: str, scene: PluginScene, bare: PluginScene, runs: int) -> dict[str, Any]:
    timed, plain = _Stepper(scene), _Stepper(bare)
    pairs = np.array([(timed.run(), plain.run()) for _ in range(runs)])
    if scene.touched and not timed.reads_something:
        raise MjTactileError(f"the sensor of '{name}' reads nothing under the punch: its timing would be meaningless.")
    step, without = np.median(pairs, axis=0)
    return {"name": name, "added_s": float(step - without), "bare_s": float(without)}


class _Stepper:
    """One scene, stepped in short runs."""

    def __init__(self, scene: PluginScene) -> None:
        self._scene = scene
        self._model = compiled(scene)
        self._data = mujoco.MjData(self._model)
        self._step = 0
        self._data.ctrl[:] = scene.controls(0)
        self._data.ctrl[scene.pads :] = 0.0
        mujoco.mj_step(self._model, self._data, _SETTLING_STEPS)

    def run(self) -> float:
        """Time per step over one stroke [s]."""
        self._data.ctrl[:] = self._scene.controls(self._step)
        start = time.perf_counter()
        mujoco.mj_step(self._model, self._data, STEPS_EACH_WAY)
        self._step += STEPS_EACH_WAY
        return (time.perf_counter() - start) / STEPS_EACH_WAY

    @property
    def reads_something(self) -> bool:
        """Whether the sensor's depth or stress is anywhere not zero."""
        data = self._data.sensordata
        return bool(data[: len(data) // 3].any())


def compiled(scene: PluginScene) -> mujoco.MjModel:
    """The scene's model; MuJoCo's own sensor sees meshes through signed distances, made here."""
    spec = mujoco.MjSpec.from_string(scene.xml())
    for mesh in spec.meshes:
        mesh.needsdf = scene.sensor == "theirs" and mesh.name != "plate"
    return spec.compile()


def _batch(preset: str, simulations: int) -> dict[str, Any]:
    """Many simulations at once: speed-up of two threads over one, and whether a plain loop gives the same bits."""
    try:
        from mujoco.batch import Batch
    except ImportError:
        return {"available": False}
    scene = PluginScene(sensor="ours", fidelity=preset, moving=True)
    model = compiled(scene)
    times, readings = {}, {}
    for threads in (1, 2):
        batch = Batch(model, nsim=simulations, nthread=threads)
        batch.ctrl[:] = _batch_controls(scene, simulations)
        sensordata = batch.bind("sensordata")
        batch.step()
        start = time.perf_counter()
        for _ in range(_BATCH_STEPS):
            batch.step()
        times[threads] = time.perf_counter() - start
        readings[threads] = sensordata.copy()
    loop = np.array([_looped(model, control) for control in _batch_controls(scene, simulations)])
    same = all((found == loop).all() for found in readings.values())
    return {"available": True, "simulations": simulations, "speed_up": times[1] / times[2], "same_bits": bool(same)}


def _batch_controls(scene: PluginScene, simulations: int) -> np.ndarray:
    factor = 0.5 + np.arange(simulations)[:, None] / simulations
    return factor * scene.controls(0)


def _looped(model: mujoco.MjModel, control: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.ctrl[:] = control
    mujoco.mj_step(model, data, _BATCH_STEPS + 1)
    return data.sensordata.copy()


def plugin_table(result: dict[str, Any]) -> str:
    """The benchmark's result as a Markdown table."""
    rows = {row["name"]: row["added_s"] for row in result["rows"]}
    yardsticks = {shape: rows[f"MuJoCo `<tactile>`, {shape}"] for shape in ("box", "star")}
    lines = [
        "| scene | added to a step | over `<tactile>`, box | over `<tactile>`, same punch |",
        "| --- | --- | --- | --- |",
    ]
    for name, added in rows.items():
        same = yardsticks["star" if "star" in name else "box"]
        beside = "-" if any(body in name for body in BODIES) else f"{added / same:.2f} x"
        lines.append(f"| {name} | {added * 1e6:.1f} us | {added / yardsticks['box']:.2f} x | {beside} |")
    batch = result["batch"]
    if batch["available"]:
        bits = "the same bits as" if batch["same_bits"] else "OTHER BITS THAN"
        lines.append(
            f"| `mujoco.batch`, {batch['simulations']} moving scenes, two threads over one | "
            f"{batch['speed_up']:.2f} x as fast, {bits} a plain loop | - | - |"
        )
    return "\n".join(lines)
