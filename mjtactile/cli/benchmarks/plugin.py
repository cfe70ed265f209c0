"""Time that the plugin adds to a MuJoCo step, compared with MuJoCo's own tactile sensor.

Every result is the difference between two scenes that differ by the sensor alone. In each, one force presses a punch on
our pad or on MuJoCo's tactile sensor, with the same joints, forces and solver settings. The two scenes are timed
alternately, in short runs, so that a temporary slowdown of the machine affects both. All scenes are timed in ten
rounds. The least of the rounds' medians counts for each scene, because other processes can only increase a time.
"""

from __future__ import annotations

import itertools
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import shapely
from shapely import affinity
from trimesh.creation import icosphere, torus

from mjtactile._native import instruction_set
from mjtactile.attach import attach_pad
from mjtactile.cli.benchmarks.measure import one_core
from mjtactile.cli.benchmarks.timing import median_time
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import MjTactileError, quiet_contacts
from mjtactile.experiments.markdown import markdown_table
from mjtactile.fidelity import DEFAULT, as_fidelity
from mjtactile.geometry.indenter import convex_pieces, indenter_outline
from mjtactile.geometry.outlines import punch_outline
from mjtactile.influence.cache import influence_matrices
from mjtactile.pad import Pad
from mjtactile.pad_shape.surfaces import SphereCap

#: Height of punches [m], and the force that presses them [N].
_HEIGHT, _FORCE = 5e-3, 0.5
#: Speed of a moving punch [m/s], and the number of steps after which it turns back.
SPEED, STEPS_EACH_WAY = 0.01, 100

_SCENE = """
<mujoco>
  {extension}
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10" jacobian="dense"/>
  <default><geom solref="0.005 1" condim="4" friction="0.5 0.005 0.0001"/></default>
  <asset>{assets}</asset>
  <worldbody>{pads}{punches}</worldbody>
  <actuator>{actuators}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>
"""
_PUNCH = """
<body name="punch{n}" pos="{x} 0 {z}" gravcomp="1">
  {slide}<joint name="press{n}" type="slide" axis="0 0 1" damping="0.05"/>
  {geoms}
</body>
"""
_SLIDE = '<joint name="slide{n}" type="slide" axis="1 0 0"/>'
_PAD = '<geom name="pad{n}" type="box" size="0.0075 0.0075 0.0025" pos="{x} 0 -0.0025" priority="1"/>'
# A plate lies in its geom's plane x = 0, so MuJoCo's pad is a thin box that is turned into the horizontal plane.
_PLATE = (
    '<geom name="pad{n}" type="box" size="0.000001 0.0075 0.0075" quat="0.70710678 0 -0.70710678 0" pos="{x} 0 0" '
    'priority="1"/>'
)
_EXTENSION = '<extension><plugin plugin="mjtactile.pad"/></extension>'
_OURS = (
    '<plugin name="touch{n}" plugin="mjtactile.pad" objtype="geom" objname="pad{n}">'
    '<config key="pad" value="{table}"/><config key="fidelity" value="{fidelity}"/>'
    '<config key="tangential" value="{tangential}"/></plugin>'
)
_THEIRS = '<tactile name="touch{n}" geom="pad{n}" mesh="plate"/>'
_PITCH = 0.03
#: The pads of curved scenes: the default pad as a dome.
_DOME = Pad(surface=SphereCap(radius=12.5e-3))


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values.ravel())


def _torus_mesh() -> str:
    ring = torus(major_radius=4e-3, minor_radius=1e-3, major_sections=24, minor_sections=12)
    return f'<mesh name="torus" vertex="{_text(ring.vertices)}" face="{_text(ring.faces)}"/>'


def _terrain() -> str:
    heights = np.random.default_rng(0).random((9, 9))
    return f'<hfield name="terrain" nrow="9" ncol="9" size=".005 .005 .001 .001" elevation="{_text(heights)}"/>'


#: Bodies that touch with a small part of their surface, by name: assets, and geoms whose lowest point is at z = 0.
BODIES = {
    "ball": ("", '<geom type="sphere" size="0.005" pos="0 0 0.005" mass="0.015"/>'),
    "ball of 320 triangles": (
        f'<mesh name="ball" vertex="{_text(icosphere(subdivisions=2, radius=5e-3).vertices)}"/>',
        '<geom type="mesh" mesh="ball" pos="0 0 0.005" mass="0.015"/>',
    ),
    "box leaning 2 degrees": (
        "",
        '<geom type="box" size="0.004 0.004 0.0025" pos="0 0 0.00264" euler="0 2 0" mass="0.015"/>',
    ),
    "lying cylinder": (
        "",
        '<geom type="cylinder" size="0.003 0.005" pos="0 0 0.003" euler="90 0 0" mass="0.015"/>',
    ),
    "standing cylinder at the rim": (
        "",
        '<geom type="cylinder" size="0.003 0.0025" pos="0.006 0 0.0025" mass="0.015"/>',
    ),
    # Contacts that take longest: a thin ring, and many small parts.
    "torus of 576 triangles": (_torus_mesh(), '<geom type="mesh" mesh="torus" pos="0 0 0.001" mass="0.015"/>'),
    "height field of 9 x 9 heights": (
        _terrain(),
        '<geom type="hfield" hfield="terrain" pos="0 0 0.001" euler="180 0 0" mass="0.015"/>',
    ),
}
#: Punches on which tangential choices besides "proportional" are timed, and these choices as they stand in row names.
_SHEARED = ("box", "ball")
_WAYS = (", stick, ", ", coulomb, ")


@dataclass(frozen=True, kw_only=True)
class PluginScene:
    """Punches on pads, as a MuJoCo model."""

    shape: str = "box"  #: shape of the punches: "box", one of the seven punches, or one of `BODIES`
    sensor: str | None = None  #: "ours", "theirs" (MuJoCo's tactile sensor) or None
    fidelity: str = DEFAULT  #: fidelity of our sensor; empty for that of the table file
    tangential: str = "proportional"  #: distribution of shear for our sensor
    table: str = "default"  #: pad or table file of our sensor
    moving: bool = False  #: whether the punches slide to and fro
    pads: int = 1  #: number of pads
    touched: int = 1  #: number of pads whose punch presses; the punches over the others hover
    ground: str = "ours"  #: kind of the pads, "ours" or "theirs", with or without the sensor
    curved: bool = False  #: whether our pads are domes
    threads: int = 1  #: threads of a step, the caller's included, in MuJoCo's own pool

    def spec(self) -> mujoco.MjSpec:
        """The scene as a specification. Our curved pads are attached here, others stand in the MJCF."""
        spec = mujoco.MjSpec.from_string(self.xml())
        for mesh in spec.meshes:
            # MuJoCo's own sensor needs the signed distance fields of punches.
            mesh.needsdf = self.sensor == "theirs" and mesh.name != "plate"
        for n in range(self.pads if self.curved else 0):
            attach_pad(
                spec,
                name=f"touch{n}",
                pad=_DOME,
                fidelity=self.fidelity,
                output="von_mises" if self.sensor == "ours" else None,
                **self._dome_place(n),
            )
        return spec

    def _dome_place(self, pad: int) -> dict[str, Any]:
        """Where a dome is attached, as arguments of `attach_pad`."""
        return {"body": "world", "pos": (_PITCH * pad, 0.0, 0.0)}

    def xml(self) -> str:
        """The scene as MJCF."""
        places = [(n, _PITCH * n) for n in range(self.pads)]
        assets, geoms = _punch(self.shape)
        theirs = self.ground == "theirs"
        plate = '<mesh name="plate" builtin="plate" params="26 26" scale="0.0075 0.0075 0.0001"/>' if theirs else ""
        ground = _PLATE if theirs else _PAD
        sensor = {"ours": _OURS, "theirs": _THEIRS, None: ""}[self.sensor]
        if self.curved:
            ground = sensor = ""
        actuators = [f'<motor joint="press{n}"/>' for n, _ in places]
        if self.moving:
            actuators += [f'<velocity joint="slide{n}" kv="200"/>' for n, _ in places]
        return _SCENE.format(
            extension=_EXTENSION if self.sensor == "ours" and not self.curved else "",
            assets=assets + plate,
            pads="".join(ground.format(n=n, x=x) for n, x in places),
            punches="".join(
                _PUNCH.format(
                    n=n,
                    x=x,
                    z=0.0 if n < self.touched else 0.005,
                    slide=_SLIDE.format(n=n) if self.moving else "",
                    geoms=geoms,
                )
                for n, x in places
            ),
            actuators="".join(actuators),
            sensors="".join(self._sensor(sensor, n) for n, _ in places),
        )

    def _sensor(self, template: str, pad: int) -> str:
        return template.format(n=pad, table=self.table, fidelity=self.fidelity, tangential=self.tangential)

    def controls(self, step: int) -> np.ndarray:
        """Controls at one step: pressing forces [N], then the sliding speeds of moving punches [m/s]."""
        pressing = np.where(np.arange(self.pads) < self.touched, -_FORCE, 0.0)
        if not self.moving:
            return pressing
        speed = SPEED if (step // STEPS_EACH_WAY) % 2 == 0 else -SPEED
        return np.concatenate([pressing, np.full(self.pads, speed)])


#: Fingers whose pads press radially on a ball that turns to and fro; gravity is compensated.
_FINGER = """
<body name="finger{n}" euler="0 0 {angle}" gravcomp="1">
  <joint name="press{n}" type="slide" axis="1 0 0" damping="0.05"/>
  <inertial pos="{x} 0 0" mass="0.015" diaginertia="4e-7 4e-7 4e-7"/>
  {pad}
</body>
"""
_FINGER_PAD = (
    '<geom name="pad{n}" type="box" size="0.0075 0.0075 0.0025" pos="{x} 0 0" euler="0 -90 0" priority="1" '
    'contype="1" conaffinity="2"/>'
)
_HELD_BALL = """
<body name="ball" gravcomp="1">
  <joint name="turn" type="hinge" axis="0 0 1"/>
  <geom type="sphere" size="{radius}" mass="0.015" contype="2" conaffinity="1"/>
</body>
"""
_BALL_RADIUS = 12e-3


class FingersScene(PluginScene):
    """Fingers around a ball that turns, each with a pad; `pads` is the number of fingers."""

    def xml(self) -> str:
        """The scene as MJCF."""
        numbers, x = range(self.pads), _BALL_RADIUS + 0.0025
        pad = "" if self.curved else _FINGER_PAD
        fingers = [_FINGER.format(n=n, angle=360 / self.pads * n, x=x, pad=pad.format(n=n, x=x)) for n in numbers]
        # Domes overlap at their rims.
        pairs = [(i, k) for i in numbers for k in range(i)] if self.curved else []
        apart = "".join(f'<exclude body1="finger{i}" body2="finger{k}"/>' for i, k in pairs)
        turning = '<velocity joint="turn" kv="0.03"/>'
        ours = self.sensor == "ours" and not self.curved
        return _SCENE.format(
            extension=(_EXTENSION if ours else "") + f"<contact>{apart}</contact>",
            assets="",
            pads="".join(fingers),
            punches=_HELD_BALL.format(radius=_BALL_RADIUS),
            actuators="".join(f'<motor joint="press{n}"/>' for n in numbers) + turning,
            sensors="".join(self._sensor(_OURS, n) for n in numbers) if ours else "",
        )

    def _dome_place(self, pad: int) -> dict[str, Any]:
        quarter_turn = (0.5**0.5, 0.0, -(0.5**0.5), 0.0)
        return {"body": f"finger{pad}", "pos": (_BALL_RADIUS, 0.0, 0.0), "quat": quarter_turn}

    def controls(self, step: int) -> np.ndarray:
        """Controls at one step: pressing forces of the fingers [N], then the speed of the ball's joint [rad/s]."""
        speed = SPEED if (step // STEPS_EACH_WAY) % 2 == 0 else -SPEED
        return np.append(np.full(self.pads, -_FORCE), speed / _BALL_RADIUS)


def _punch(shape: str) -> tuple[str, str]:
    """Assets and geoms of a punch whose face is at z = 0."""
    if shape in BODIES:
        return BODIES[shape]
    if shape == "box":
        return "", f'<geom type="box" size="0.005 0.005 {_HEIGHT / 2}" pos="0 0 {_HEIGHT / 2}" mass="0.015"/>'
    pieces = convex_pieces(shape) if shape in ("star", "doughnut") else [indenter_outline(shape)]
    assets, geoms = [], []
    for number, piece in enumerate(pieces):
        rim = shapely.get_coordinates(piece)[:-1]
        vertices = np.vstack([np.column_stack([rim, np.full(len(rim), z)]) for z in (0.0, _HEIGHT)])
        assets.append(f'<mesh name="piece{number}" vertex="{_text(vertices)}"/>')
        geoms.append(f'<geom type="mesh" mesh="piece{number}" mass="{0.015 / len(pieces):.6g}"/>')
    return "".join(assets), "".join(geoms)


_SETTLING_STEPS = 300
#: Simulations of the batch, rounds in which they are timed, and steps of a round.
_SIMULATIONS, _BATCH_ROUNDS, _BATCH_STEPS = 64, 7, 40
#: Name of the case that is timed in Python alone, without MuJoCo.
_PYTHON = "outline of the star to readings in Python"
#: Contact cells of the finer elastic law, in the case of a moving box.
_CELLS = 200
#: Number of rounds in which all scenes are timed, and the added time from which a scene takes long [s].
_ROUNDS, _SLOW = 10, 5e-4
#: Number of runs in which other benchmarks time MuJoCo's own sensor.
_TACTILE_RUNS = 100


def plugin_benchmark(*, quick: bool = False) -> dict[str, Any]:
    """Measure the time that the sensor adds to a step in every scene, and the speed-up of a batch of simulations.

    If `quick`, for tests, only preset "fast" is measured, in an eighth of the runs.

    Returns:
        "mujoco_version"; "instruction_set" of the core; "rows", each with "name", "added_s", the time that the sensor
        adds [s], and "bare_s", the time of a step without it [s]; and "batch": "available", "simulations",
        "speed_up" of two threads over one [-], and "same_bits", whether a plain loop reads the same bits.

    Raises:
        MjTactileError: a sensor reads nothing under its punch.
    """
    runs = 5 if quick else 12
    presets = ("fast",) if quick else ("fast", "balanced")
    with tempfile.TemporaryDirectory() as folder:
        table = str(Path(folder) / "elastic200.mjt")
        if not quick:
            influence_matrices(fidelity=replace(as_fidelity("balanced"), law="elastic", cells=_CELLS)).save(table)
        with quiet_contacts():  # peaks of a height field indent a pad deeply
            timed = [_Timed(name, scene, bare) for name, scene, bare in _cases(presets, "" if quick else table)]
            for _ in range(1 if quick else _ROUNDS):
                for one in timed:
                    one.go_on(runs)
    rows = [one.row() for one in timed]
    rows.append(_python_row(presets[-1], 50 if quick else 400))
    return {
        "mujoco_version": mujoco.__version__,
        "instruction_set": instruction_set(),
        "rows": rows,
        "batch": _batch(presets[0], 8 if quick else _SIMULATIONS),
    }


def _cases(presets: tuple[str, ...], table: str) -> Iterator[tuple[str, PluginScene, PluginScene]]:
    """Name of each case, its scene with the sensor, and the same scene without."""
    for shape in ("box", "star"):
        yield _tactile_case(shape)
    for name, bare, options in _cases_of_ours(presets, table):
        yield name, replace(bare, sensor="ours", **options), bare


def _cases_of_ours(presets: tuple[str, ...], table: str) -> Iterator[tuple[str, PluginScene, dict[str, Any]]]:
    """Name of each case of our sensor, its scene without the sensor, and the sensor's options."""
    yield "no contact", PluginScene(touched=0), {}
    for moving, shape, preset in itertools.product((False, True), ("box", "star"), presets):
        name = f"{'moving' if moving else 'unchanged'} {shape}, {preset}"
        yield name, PluginScene(shape=shape, moving=moving), {"fidelity": preset}
    for shape, preset in itertools.product(BODIES, presets):
        yield f"moving {shape}, {preset}", PluginScene(shape=shape, moving=True), {"fidelity": preset}
    for shape, way, preset in itertools.product(_SHEARED, _WAYS, presets):
        options = {"fidelity": preset, "tangential": way.strip(", ")}
        yield f"moving {shape}{way}{preset}", PluginScene(shape=shape, moving=True), options
    for preset in presets:
        bare = PluginScene(shape="ball", moving=True, curved=True)
        yield f"moving ball on a dome, {preset}", bare, {"fidelity": preset}
    fingers = FingersScene(pads=5, touched=5)
    for preset in presets:
        yield f"five domes around a ball, {preset}", replace(fingers, curved=True), {"fidelity": preset}
        for threads, name in ((1, ""), (2, " on two threads")):
            if threads == 1 or hasattr(mujoco, "mju_threadpool"):
                bare = replace(fingers, threads=threads)
                yield f"five fingers around a ball{name}, {preset}", bare, {"fidelity": preset}
    if table:
        name = f"moving box, balanced with {_CELLS} cells"
        yield name, PluginScene(moving=True), {"fidelity": "", "table": table}
    for touched in range(6):
        name = f"five pads, {touched} touched, {presets[-1]}"
        yield name, PluginScene(pads=5, touched=touched), {"fidelity": presets[-1]}


def _tactile_case(shape: str) -> tuple[str, PluginScene, PluginScene]:
    """MuJoCo's own tactile sensor with 676 points under a punch, as an entry of `_cases`."""
    bare = PluginScene(shape=shape, ground="theirs")
    return f"MuJoCo `<tactile>`, {shape}", replace(bare, sensor="theirs"), bare


def mujoco_tactile_time() -> float:
    """Time that MuJoCo's own tactile sensor with 676 points adds to a step under a square punch, its best case [s].

    Raises:
        MjTactileError: the sensor reads nothing under the punch.
    """
    timed = _Timed(*_tactile_case("box"))
    timed.go_on(_TACTILE_RUNS)
    return timed.row()["added_s"]


def _python_row(preset: str, moves: int) -> dict[str, Any]:
    """Time from the star's outline in a new place to readings, in Python without MuJoCo."""
    influence = influence_matrices(fidelity=preset)
    shifts = np.random.default_rng(1).uniform(-1e-3, 1e-3, (moves + 1, 2))
    outlines = iter([affinity.translate(punch_outline("star"), *shift) for shift in shifts])
    force = [0.1 * _FORCE, 0.0, -_FORCE]

    def press() -> None:
        footprint = Footprint.from_outline(next(outlines), influence.surface)
        influence.readings(contact_load(influence, footprint, force))

    with one_core():
        return {"name": f"`contact_load`, {_PYTHON}, {preset}", "added_s": median_time(press, moves), "bare_s": 0.0}


class _Stepper:
    """One scene, stepped in short runs."""

    def __init__(self, scene: PluginScene) -> None:
        self._scene = scene
        self._model = scene.spec().compile()
        self._data = mujoco.MjData(self._model)
        if scene.threads > 1:
            mujoco.mju_threadpool(self._data, scene.threads - 1)
        self._step = 0
        self._data.ctrl[:] = scene.controls(0)
        self._data.ctrl[scene.pads :] = 0.0
        mujoco.mj_step(self._model, self._data, _SETTLING_STEPS)

    def run(self) -> float:
        """Time per step over one stroke of `STEPS_EACH_WAY` steps [s]."""
        self._data.ctrl[:] = self._scene.controls(self._step)
        start = time.perf_counter()
        mujoco.mj_step(self._model, self._data, STEPS_EACH_WAY)
        self._step += STEPS_EACH_WAY
        return (time.perf_counter() - start) / STEPS_EACH_WAY

    @property
    def reads_something(self) -> bool:
        """Whether any of the sensor's depths or stresses differs from zero."""
        data = self._data.sensordata
        return bool(data[: len(data) // 3].any())


class _Timed:
    """Two scenes that differ by the sensor alone, timed in turn."""

    def __init__(self, name: str, scene: PluginScene, bare: PluginScene) -> None:
        self._name, self._touched = name, scene.touched
        self._scene, self._bare = _Stepper(scene), _Stepper(bare)
        self._step, self._without = np.inf, np.inf

    def go_on(self, runs: int) -> None:
        """Time a number of further runs of each scene, or one of scenes that are known to take long."""
        if self._without < self._step - _SLOW < np.inf:
            runs = 1
        pairs = np.array([(self._scene.run(), self._bare.run()) for _ in range(runs)])
        step, without = np.median(pairs, axis=0)
        self._step, self._without = min(self._step, float(step)), min(self._without, float(without))

    def row(self) -> dict[str, Any]:
        """The result as an entry of "rows", see `plugin_benchmark`."""
        if self._touched and not self._scene.reads_something:
            raise MjTactileError(
                f"the sensor of '{self._name}' reads nothing under the punch: its timing would be meaningless."
            )
        return {"name": self._name, "added_s": self._step - self._without, "bare_s": self._without}


def _batch(preset: str, simulations: int) -> dict[str, Any]:
    """Step many simulations at once. Returns the entry "batch" of `plugin_benchmark`."""
    try:
        from mujoco.batch import Batch
    except ImportError:
        return {"available": False}
    scene = PluginScene(sensor="ours", fidelity=preset, moving=True)
    model = scene.spec().compile()
    batches = {threads: Batch(model, nsim=simulations, nthread=threads) for threads in (1, 2)}
    readings = {threads: batch.bind("sensordata") for threads, batch in batches.items()}
    for batch in batches.values():
        batch.ctrl[:] = _batch_controls(scene, simulations)
        batch.step()
    # One and two threads in turns: what else the machine does slows both.
    times = {threads: np.zeros(_BATCH_ROUNDS) for threads in batches}
    for at in range(_BATCH_ROUNDS):
        for threads, batch in batches.items():
            start = time.perf_counter()
            for _ in range(_BATCH_STEPS):
                batch.step()
            times[threads][at] = time.perf_counter() - start
    speed_up = float(np.median(times[1] / times[2]))
    loop = np.array([_looped(model, control) for control in _batch_controls(scene, simulations)])
    same = all((found == loop).all() for found in readings.values())
    return {"available": True, "simulations": simulations, "speed_up": speed_up, "same_bits": bool(same)}


def _batch_controls(scene: PluginScene, simulations: int) -> np.ndarray:
    factor = 0.5 + np.arange(simulations)[:, None] / simulations
    return factor * scene.controls(0)


def _looped(model: mujoco.MjModel, control: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.ctrl[:] = control
    mujoco.mj_step(model, data, _BATCH_ROUNDS * _BATCH_STEPS + 1)
    return data.sensordata.copy()


def plugin_table(result: dict[str, Any]) -> str:
    """The result of `plugin_benchmark` as a Markdown table."""
    rows = {row["name"]: row["added_s"] for row in result["rows"]}
    yardsticks = {shape: rows[f"MuJoCo `<tactile>`, {shape}"] for shape in ("box", "star")}
    titles = [
        "scene",
        "added to a step",
        "over `<tactile>`, box",
        "over `<tactile>`, same punch",
        "over `proportional`",
    ]
    lines = []
    for name, added in rows.items():
        same = yardsticks["star" if "star" in name else "box"]
        beside = "-" if any(other in name for other in (*BODIES, _PYTHON)) else f"{added / same:.2f} x"
        plain = next((rows[name.replace(way, ", ")] for way in _WAYS if way in name), None)
        over_plain = "-" if plain is None else f"{added / plain:.2f} x"
        lines.append([name, f"{added * 1e6:.1f} us", f"{added / yardsticks['box']:.2f} x", beside, over_plain])
    batch = result["batch"]
    if batch["available"]:
        bits = "the same bits as" if batch["same_bits"] else "OTHER BITS THAN"
        name = f"`mujoco.batch`, {batch['simulations']} moving scenes, two threads over one"
        lines.append([name, f"{batch['speed_up']:.2f} x as fast, {bits} a plain loop", *["-"] * 3])
    return markdown_table(titles, lines)
