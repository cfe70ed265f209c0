"""One scene driven for some steps, and what is checked in every one of them."""

from __future__ import annotations

import re
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
import random_scenes as scenes
from pad_contacts import wrenches_by_geom
from random_scenes import Scene
from warning_texts import without_numbers

from mjtactile._types import Array
from mjtactile.pad import Pad
from mjtactile.sim.wrench import geom_frame

#: No reading beyond this share of the modulus of the top layer, or of a stiffer one where the taxel is, or of the mean
#: pressure if that is higher.
MOST_PRESSURE = 1.2
#: A contact is answered within this [s], by fidelity.
TIME_LIMITS = {"fast": 1e-3, "balanced": 5e-3}
#: Relative difference between a sensor's wrench and the sum of MuJoCo's contact forces.
WRENCH_TOLERANCE = 1e-9
#: Of readings beside their bound.
ROUNDING = 1e-12
_PUSH_EVERY = 20
#: Flag with which nothing is read.
DISABLE_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
#: What MuJoCo itself says of simulations that fly apart, or that need more room.
_MUJOCO_SAYS = re.compile(r"^(WARNING: .*|Warning: .*|\s*)$")


@dataclass
class Findings:
    """What went wrong, by kind: how often, and the first time in words."""

    counts: Counter[str] = field(default_factory=Counter)
    first: dict[str, str] = field(default_factory=dict)

    def add(self, kind: str, text: str) -> None:
        """Note one more."""
        self.counts[kind] += 1
        self.first.setdefault(kind, text)


@dataclass(frozen=True)
class Sensor:
    """Where a pad's numbers stand."""

    name: str
    geom: int
    fidelity: str
    modulus: float  #: of the top layer [Pa]
    area: float  #: of the sheet [m^2]
    where: dict[str, slice]
    stiffest: tuple[float, ...] = (0.0,)  #: material that the taxels of each sensing layer meet [Pa]
    is_flat: bool = True  #: whether the sensing surface is

    def share_of_bound(self, readings: Array, force: float) -> float:
        """Highest reading over the highest [Pa] that contacts with a force [N] in all may make."""
        bounds = MOST_PRESSURE * np.maximum(self.stiffest, max(self.modulus, force / self.area))
        return float((readings.reshape(len(bounds), -1) / bounds[:, None]).max(initial=0.0))


def drive(scene: Scene, steps: int) -> dict[str, Any]:
    """Run a scene twice, without sensors and with them, and check every step.

    Args:
        scene: to be run.
        steps: number of steps.

    Returns: plain values:
        findings: {kind: [count, text of the first]}.
        times: {label: processor time [us] that the sensors add to each step, as integers}; a label says which fidelity
            and pad were touched by what.
        python_calls: calls into Python from within steps.
        compile_s: time to make model and data [s].
        touched: steps with contact on a pad.
        peak: highest reading over the bound on readings [-].
        warnings: texts of warnings, numbers left out, with their counts.
    """
    findings = Findings()
    answer: dict[str, Any] = {"times": {}, "python_calls": 0, "touched": 0, "peak": 0.0, "warnings": {}, "refused": ""}
    start = time.perf_counter()
    with _heard() as heard:
        try:
            model = mujoco.MjModel.from_xml_string(scenes.mjcf(scene))
            data = mujoco.MjData(model)
        except ValueError as error:
            if "sdf" in scene.kinds and "mjtactile" in str(error):
                answer["refused"] = str(error)
            else:
                findings.add("does not compile", str(error))
        else:
            answer["compile_s"] = time.perf_counter() - start
            base = _times_without_sensors(scene, model, steps)
            # Changes made meanwhile are undone by compiling anew.
            model = mujoco.MjModel.from_xml_string(scenes.mjcf(scene))
            data = mujoco.MjData(model)
            _watched(scene, model, data, steps, base, findings, answer)
            del data
    said = Counter((one.category.__name__, without_numbers(str(one.message))) for one in heard)
    answer["warnings"] = {f"{category}: {text}": count for (category, text), count in said.items()}
    for (category, text), count in said.items():
        if count > 1:
            findings.add("warns repeatedly", f"{count} times {category}: {text}")
    answer["findings"] = {kind: [count, findings.first[kind]] for kind, count in findings.counts.items()}
    return answer


def stray(text: str) -> str:
    """What of a process's stderr is none of MuJoCo's own warnings."""
    return "\n".join(line for line in text.splitlines() if not _MUJOCO_SAYS.match(line))


def _times_without_sensors(scene: Scene, model: mujoco.MjModel, steps: int) -> Array:
    """Processor time of every step [s] while nothing reads."""
    data = mujoco.MjData(model)
    model.opt.disableflags |= DISABLE_SENSORS
    times = np.empty(steps)
    for step in _driven(scene, model, data, steps):
        begin = time.thread_time()
        mujoco.mj_step(model, data)
        times[step] = time.thread_time() - begin
    return times


def _watched(
    scene: Scene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    steps: int,
    base: Array,
    findings: Findings,
    answer: dict[str, Any],
) -> None:
    sensors = _sensors(scene, model)
    calls = 0

    def count(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    times: dict[str, list[int]] = {}
    for step in _driven(scene, model, data, steps):
        sys.setprofile(count)
        begin = time.thread_time()
        mujoco.mj_step(model, data)
        took = time.thread_time() - begin
        sys.setprofile(None)
        touching = [_touching(model, data, sensor) for sensor in sensors]
        label, limit = _label(scene, sensors, touching)
        answer["touched"] += label != "nothing"
        added = max(0.0, took - base[step])
        times.setdefault(label, []).append(round(added * 1e6))
        if added > limit:
            findings.add("slow", f"step {step}: {added * 1e3:.2f} ms for {label}")
        for sensor in sensors:
            numbers = {output: data.sensordata[where] for output, where in sensor.where.items()}
            wrenches = np.reshape([*wrenches_by_geom(model, data, sensor.geom).values()], (-1, 6))
            asleep = scene.sleep and bool((data.tree_asleep >= 0).any())
            force = float(np.linalg.norm(wrenches[:, :3], axis=1).sum())
            pressing = pressing_force(model, data, sensor.geom, any_way=not sensor.is_flat)
            for kind, text in wrong(numbers, wrenches, sensor, asleep, pressing):
                findings.add(kind, f"step {step}, {sensor.name}: {text}")
            answer["peak"] = max(answer["peak"], sensor.share_of_bound(numbers["von_mises"], force))
    if calls:
        findings.add("calls Python", f"{calls} calls within {steps} steps")
    answer["times"], answer["python_calls"] = times, calls


def _driven(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> Iterator[int]:
    """Numbers of steps; forces, velocities and changes of the scene are there when each is to be taken."""
    rng = np.random.default_rng((scene.seed, 7))
    begin(scene, model, data)
    changes = {int(rng.integers(1, max(2, steps))): change for change in scene.changes}
    for step in range(steps):
        if step % _PUSH_EVERY == 0:
            _push(scene, model, data, rng)
        if step in changes:
            _change(changes[step], model, data, rng)
        yield step


def begin(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Velocities with which the bodies of a scene begin, and where everything is."""
    mujoco.mj_kinematics(model, data)
    for number, (pad, bodies) in enumerate(zip(scene.pads, scene.bodies, strict=True)):
        for index, body in enumerate(bodies):
            if body.velocity:
                first = model.joint(f"body{number}-{index}").dofadr[0]
                turn = pad.rotation
                data.qvel[first : first + 3] = turn @ body.velocity[:3]
                data.qvel[first + 3 : first + 6] = body.velocity[3:]


def _push(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator) -> None:
    """Bodies are pushed towards the pad, each with its force and a little of its own weight to the side."""
    for number, (pad, bodies) in enumerate(zip(scene.pads, scene.bodies, strict=True)):
        if pad.moves:
            data.joint(f"finger{number}").qfrc_applied[0] = pad.force * rng.uniform(0.5, 1.2)
        geom = model.geom(f"pad{number}").id
        origin, rotation = geom_frame(model, data, geom)
        for index, body in enumerate(bodies):
            one = model.body(f"body{number}-{index}").id
            if body.joint == "" or pad.moves:
                continue
            goal = origin + rotation @ [*body.target, -0.3 * pad.pad.thickness]
            way = goal - data.xipos[one]
            force = body.force * rng.uniform(0.2, 1.5) * way / max(float(np.linalg.norm(way)), 1e-9)
            side = rng.normal(0, 0.3, 3) * (body.force + float(model.body_mass[one]))
            data.xfrc_applied[one, :3] = force + side
            data.xfrc_applied[one, 3:] = rng.normal(0, 1e-3, 3) * body.force


def _change(change: str, model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator) -> None:
    """Change a model as domain randomisation does; pads stay as they are."""
    if change == "mass":
        model.body_mass[1:] *= rng.uniform(0.5, 2.0)
        model.body_inertia[1:] *= rng.uniform(0.5, 2.0)
        mujoco.mj_setConst(model, data)
    elif change == "friction":
        model.geom_friction[:, 0] = rng.uniform(0.1, 1.5, model.ngeom)
    elif change == "hfield" and model.nhfielddata:
        model.hfield_data[:] = rng.random(model.nhfielddata) * 0.8
    elif change == "size":
        kinds = (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER,
                 mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID)  # fmt: skip
        factor = rng.uniform(0.7, 1.4)
        for geom in range(model.ngeom):
            name = model.geom(geom).name
            if name.startswith("body") and model.geom_type[geom] in [int(kind) for kind in kinds]:
                model.geom_size[geom] *= factor
                model.geom_rbound[geom] *= factor
                model.geom_aabb[geom] *= factor


def _sensors(scene: Scene, model: mujoco.MjModel) -> list[Sensor]:
    found = []
    for number, placed in enumerate(scene.pads):
        pad = placed.pad
        sensor = model.sensor(f"touch{number}")
        first, where = int(sensor.adr[0]), {}
        for output in scenes.ASKED:
            width = scenes.WIDTHS.get(output, int(np.prod(pad.reading_shape)))
            where[output] = slice(first, first + width)
            first += width
        geom = model.geom(f"pad{number}").id
        area = pad.size[0] * pad.size[1]
        name, modulus = f"touch{number} on {placed.kind}", pad.layers[0].young
        found.append(Sensor(name, geom, placed.fidelity, modulus, area, where, _stiffest(pad), pad.surface.is_flat))
    return found


def _stiffest(pad: Pad) -> tuple[float, ...]:
    """Highest modulus [Pa] that the balls of each sensing layer meet."""
    found = []
    for depth in pad.depths:
        top, met = 0.0, []
        for layer in pad.layers:
            if top < depth + pad.sampling_radius and top + layer.thickness > depth - pad.sampling_radius:
                met.append(layer.young)
            top += layer.thickness
        found.append(max(met))
    return tuple(found)


def _touching(model: mujoco.MjModel, data: mujoco.MjData, sensor: Sensor) -> list[str]:
    """Names of the geoms that touch a pad."""
    pairs = data.contact.geom.reshape(-1, 2)
    geoms = set(pairs[(pairs == sensor.geom).any(axis=1)].ravel().tolist()) - {sensor.geom}
    return sorted(model.geom(geom).name for geom in geoms)


def _label(scene: Scene, sensors: list[Sensor], touching: list[list[str]]) -> tuple[str, float]:
    """What was touched in a step, for the table of times, and the time it may take [s]."""
    parts, limit = [], 2e-4
    for number, (sensor, geoms) in enumerate(zip(sensors, touching, strict=True)):
        if not geoms:
            continue
        kinds = sorted({_kind(scene, geom) for geom in geoms})
        parts.append((scene.pads[number].kind, sensor.fidelity, kinds[0] if len(kinds) == 1 else "several kinds"))
        limit += TIME_LIMITS[sensor.fidelity] * len(kinds)
    if not parts:
        return "nothing", limit
    return (" | ".join(parts[0]) if len(parts) == 1 else f"several pads | {parts[0][1]} | several kinds"), limit


def _kind(scene: Scene, name: str) -> str:
    if not name.startswith("body"):
        return "plane" if name == "floor" else "pad"
    number, index, k = (int(part) for part in name.removeprefix("body").split("-"))
    return scene.bodies[number][index].geoms[k].kind


def pressing_force(model: mujoco.MjModel, data: mujoco.MjData, geom: int, any_way: bool = False) -> float:
    """Sum of what single contacts press on a pad with [N]; those that pull along its sides are left out.

    Args:
        model: of the scene.
        data: its state.
        geom: the pad's.
        any_way: take the forces' magnitudes. On a slope, shear that is not carried may have pulled the body off.
    """
    up = geom_frame(model, data, geom).rotation[:, 2]
    total, local = 0.0, np.empty(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        if geom not in contact.geom:
            continue
        mujoco.mj_contactForce(model, data, number, local)
        force = contact.frame.reshape(3, 3).T @ local[:3] * (1.0 if contact.geom[1] == geom else -1.0)
        total += float(np.linalg.norm(force)) if any_way else max(-float(force @ up), 0.0)
    return total


def wrong(
    numbers: dict[str, Array], wrenches: Array, sensor: Sensor, asleep: bool = False, pressing: float | None = None
) -> Iterator[tuple[str, str]]:
    """What is wrong with a sensor's numbers in a state: kinds, and the case in words.

    Args:
        numbers: what it puts out, by output; "von_mises" and "wrench", "carried" and "range" where it has them.
        wrenches: of MuJoCo's contacts with its pad, by geom, in the pad frame [N, N m], (n, 6).
        sensor: whose numbers they are.
        asleep: whether bodies sleep, so that readings may be those of earlier contacts.
        pressing: what the contacts press with, see `pressing_force`; by default what the geoms do.
    """
    for output, values in numbers.items():
        if not np.isfinite(values).all():
            yield "not finite", f"{output} has {np.count_nonzero(~np.isfinite(values))} values that are not finite"
            return
    readings, wrench = numbers["von_mises"], numbers["wrench"]
    peak, force = float(readings.max(initial=0.0)), float(np.linalg.norm(wrenches[:, :3], axis=1).sum())
    if readings.min(initial=0.0) < 0.0:
        yield "negative reading", f"{readings.min():.3g} Pa"
    if "range" in numbers:
        reached = float(numbers["range"][0])
        if reached < 0.0:
            yield "range is wrong", f"{reached:.3g}"
        if peak > sensor.modulus and reached <= 1.0:
            yield "beyond the range unsaid", f"{peak:.3g} Pa on a sheet of {sensor.modulus:.3g} Pa, range {reached:.3g}"
    if asleep:
        return
    slack = WRENCH_TOLERANCE * (force + 1e-9)
    expected = wrenches.sum(axis=0)
    if np.abs(wrench - expected).max() > slack:
        yield "wrench is wrong", f"{_few(wrench)} for MuJoCo's {_few(expected)}"
    if sensor.share_of_bound(readings, force) > 1.0 + ROUNDING:
        yield "reading too high", f"{peak:.3g} Pa under {force:.3g} N; a sheet of {sensor.modulus:.3g} Pa"
    if not len(wrenches) and readings.any():
        yield "reads without contact", f"{peak:.3g} Pa"
    if "carried" in numbers:
        if pressing is None:
            pressing = float(np.maximum(-wrenches[:, 2], 0.0).sum())
        carried = -float(numbers["carried"][2])
        # Cells of a curved pad press along their own normals.
        slack += 0.0 if sensor.is_flat else 0.01 * pressing
        if carried < -slack - (0.0 if sensor.is_flat else pressing) or carried > pressing + slack:
            yield "carries what is not there", f"{carried:.6g} N of {pressing:.6g} N that press"
        if carried > 1e-3 and peak == 0.0:
            yield "carries without reading", f"{carried:.3g} N carried, highest reading 0 Pa"


def _few(numbers: Array) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in numbers) + ")"


@contextmanager
def _heard() -> Iterator[list[warnings.WarningMessage]]:
    """Every warning, those that repeat too."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        yield heard
