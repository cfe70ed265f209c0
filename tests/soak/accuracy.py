"""How far readings are off in random scenes: contacts as they come, measured against the dense contact.

    python tests/soak/accuracy.py --scenes 200 --seed 60000 --quick-pads --minutes 15 --cache build/soak/dense
    python tests/soak/accuracy.py --only 60012 --at 40 --quick-pads     # one state, looked at closely

Scenes are driven as the soak drives them. In each one or two states are picked in which something presses on a sensing
surface and nothing is torn through it. All are read under law "elastic" with shear "proportional", whatever the scene
asks for: that is what the reference solves. Both fidelities read each state, by sensors that have read nothing before.

An error is the relative L2 difference from the reference on the same influence matrices. The core bounds the shear from
torsion and from what slides, the reference does not: so a second error, "as carried", is taken from the reference's
pressure with the shear that the core says it carries; it is the one that tells of pressures. Of several bodies the core
does not say what each carries, so there it is the error under the normal forces alone. States whose force the
surface cannot carry within its bound on pressure are counted apart: there the reference moves the force, and by how
much is a choice. So are states in which the reference turns a body by more than 45 degrees: it falls over.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import hashlib
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "reference"), str(HERE.parent / "reference" / "bodies")]
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import drive  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import random_scenes as scenes  # noqa: E402
from bodies_of_model import bodies_on_pad, on_surface  # noqa: E402
from dense_contact import Body, DenseContact, DenseContactError, dense_readings  # noqa: E402
from dense_surface import nodal_forces  # noqa: E402
from random_scenes import Scene  # noqa: E402
from shapely import Polygon  # noqa: E402

import mjtactile  # noqa: E402
from mjtactile._types import Array  # noqa: E402
from mjtactile.fem.surface_grid import SurfaceGrid  # noqa: E402
from mjtactile.fidelity import PRESETS  # noqa: E402
from mjtactile.influence.matrices import InfluenceMatrices  # noqa: E402
from mjtactile.influence.surface_load import SurfaceLoad  # noqa: E402
from mjtactile.plugin.health import Health  # noqa: E402
from mjtactile.sensor import TactileSensor  # noqa: E402
from mjtactile.sim.wrench import geom_frame  # noqa: E402

FIDELITIES = ("fast", "balanced")
#: Contacts no deeper than this share of the pad's thickness, and no harder on the average than this share of its
#: modulus, are calm; those with less than a tenth of a gram are none.
DEEPEST, HARDEST, LEAST = 0.25, 0.05, 1e-3
#: What the reference may leave of a moment, over force and root of the pressed area, and still carry it.
LEFT = 1e-3
#: Slope of a body that stands on the pad, at most: beyond that heights over the pad say nothing of how it turns.
STEEPEST = 1.0


@dataclass(frozen=True, eq=False)
class Pressure:
    """Where one body presses: nodal forces per pressure, and per pressure times the place beside its centre."""

    nodal: Array  #: (nodes y, nodes x, 3) [N, N m, N m]
    leaning: Array  #: nodal forces along the surface without resultant, (nodes y, nodes x, 2) [N]
    centre: Array  #: (x, y) [m]
    force: float  #: [N]
    polar: float  #: second moment about the centre [N m^2]

    def sheared(self, wrench: Array) -> Array:
        """Nodal forces [N] with the shear force and the torsion of a wrench about the pad's origin, (6,)."""
        torsion = wrench[5] - (self.centre[0] * wrench[1] - self.centre[1] * wrench[0])
        turn = torsion / self.polar if self.polar > 0.0 else 0.0
        press, along_x, along_y = np.moveaxis(self.nodal, -1, 0)
        x, y = press * (wrench[0] / self.force) - turn * along_y, press * (wrench[1] / self.force) + turn * along_x
        return np.stack([x + self.leaning[..., 0], y + self.leaning[..., 1], -press], axis=-1)


@dataclass(frozen=True, eq=False)
class Reference:
    """The dense contact of a state."""

    readings: Array  #: (layers, rows, columns) [Pa]
    pressed: Array  #: places of the pressed cells (x, y) and forces on them, (n, 3) [m, N]
    area: float  #: that is pressed [m^2]
    full: float  #: share of the force on cells at the bound of pressure
    left: float  #: moment that is not carried, over force and root of the pressed area [-]
    slope: float  #: largest slope by which a body tilts [-]
    pressure: Pressure | None  #: where one body presses, for other shear
    nodal: Array  #: (nodes y, nodes x, 3) [N]


@dataclass(frozen=True)
class Read:
    """What one fidelity reads of a state."""

    fidelity: str
    error: float  #: relative L2 difference from the reference [-]
    as_carried: float  #: the same with the shear that the core carries; of several bodies, without shear [-]
    peak: float  #: largest reading [Pa]
    area: float  #: under pressure [m^2]
    aside: float  #: distance of the centres of pressure [m]
    said: str  #: what the core counts besides a reading
    reference: Reference


@dataclass(frozen=True)
class State:
    """One contact, and how it is read."""

    seed: int
    step: int
    pad: int
    story: str
    kind: str  #: of the pad
    modulus: float  #: of its top layer [Pa]
    tilt: str
    kinds: str  #: of the geoms that press
    bodies: int  #: that press
    force: float  #: normal, of what presses on the surface [N]
    beside: bool  #: whether something presses beside the surface too
    reads: tuple[Read, ...]
    refused: str  #: why there is no reference
    seconds: float  #: that the references took

    @property
    def beyond(self) -> bool:
        """Whether the wrench cannot be carried within the bound on pressure, or by a body that stands."""
        found = [read.reference for read in self.reads]
        return self.tilt == "free" and any(one.left > LEFT or one.slope > STEEPEST for one in found)


# ------------------------------------------------------------------------------------------------------ states


def calm(model: mujoco.MjModel, data: mujoco.MjData, geom: int, pad: mjtactile.Pad) -> bool:
    """Whether something presses on a pad's sensing surface, and nothing violently on the pad."""
    touching = [data.contact[number] for number in range(data.ncon) if geom in data.contact[number].geom]
    if not touching or min(contact.dist for contact in touching) < -DEEPEST * pad.thickness:
        return False
    force = drive.pressing_force(model, data, geom)
    if not LEAST < force < HARDEST * pad.layers[0].young * float(np.prod(pad.size)):
        return False
    up = geom_frame(model, data, geom).rotation[:, 2]
    return any(abs(contact.frame[:3] @ up) > np.sqrt(0.5) for contact in touching)


def driven(scene: Scene, steps: int) -> Iterator[tuple[int, mujoco.MjModel, mujoco.MjData]]:
    """A scene after each of its steps; nothing is read."""
    model = mujoco.MjModel.from_xml_string(scenes.mjcf(scene))
    data = mujoco.MjData(model)
    model.opt.disableflags |= drive.DISABLE_SENSORS
    for step in drive._driven(scene, model, data, steps):
        mujoco.mj_step(model, data)
        yield step, model, data


def picked(scene: Scene, steps: int, count: int) -> list[tuple[int, int]]:
    """Up to `count` calm states, spread over those of a scene: steps and numbers of pads."""
    found = [
        (step, number)
        for step, model, data in driven(scene, steps)
        for number, placed in enumerate(scene.pads)
        if calm(model, data, model.geom(f"pad{number}").id, placed.pad)
    ]
    places = (np.arange(1, count + 1) * len(found)) // (count + 1)
    return sorted({found[place] for place in places if place < len(found)})


def measured(scene: Scene, steps: int, states: Iterable[tuple[int, int]], how: Dense) -> Iterator[State]:
    """States of a scene, read and compared.

    Args:
        scene: driven.
        steps: that the whole scene takes: changes at run time fall between them.
        states: steps and numbers of pads.
        how: references are found.
    """
    wanted = sorted(states)
    last = max((step for step, _ in wanted), default=-1)
    for step, model, data in driven(scene, steps):
        for at, number in wanted:
            if at == step:
                yield _state(scene, step, number, model, data, how)
        if step >= last:
            return


def _state(scene: Scene, step: int, number: int, model: mujoco.MjModel, data: mujoco.MjData, how: Dense) -> State:
    placed = scene.pads[number]
    geom, pad = model.geom(f"pad{number}").id, placed.pad
    bodies = bodies_on_pad(model, data, geom, pad.thickness)
    tilt = dict(placed.config).get("tilt", "free")
    key = f"{scene.seed}-{step}-{number}"
    reads, refused, begun = [], "", time.perf_counter()
    try:
        for fidelity in FIDELITIES:
            influence = influence_of(placed.kind, fidelity)
            reference = how.found(key, influence, bodies, tilt == "free")
            reads.append(_read(fidelity, influence, model, data, f"pad{number}", tilt, reference))
    except (DenseContactError, ValueError) as error:
        reads, refused = [], str(error)
    seconds = time.perf_counter() - begun
    kinds, beside = _pressing(scene, model, data, geom)
    force = float(sum(-body.force[2] for body in bodies))
    return State(
        scene.seed, step, number, scene.story, placed.kind, pad.layers[0].young, tilt, kinds, len(bodies), force,
        beside, tuple(reads), refused, seconds,
    )  # fmt: skip


def _read(
    fidelity: str,
    influence: InfluenceMatrices,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    geom: str,
    tilt: str,
    reference: Reference,
) -> Read:
    sensor = TactileSensor(model, influence.pad, geom=geom, influence=influence, law="elastic", tilt=tilt)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        readings = sensor.read(data)
        health = sensor.health()
        found = sensor._reader.read(model, data, forces=True)
    down = found.carried[2]
    through = np.array([found.carried[4], -found.carried[3]]) / -down if down < 0.0 else np.full(2, np.nan)
    places = reference.pressed
    middle = places[:, 2] @ places[:, :2] / places[:, 2].sum()
    if reference.pressure is not None:
        as_carried = _differ(readings, _under(influence, reference.pressure.sheared(found.carried)))
    else:
        alone = np.array([0.0, 0.0, 1.0])
        as_carried = _differ(_under(influence, alone * found.forces), _under(influence, alone * reference.nodal))
    return Read(
        fidelity,
        _differ(readings, reference.readings),
        as_carried,
        float(readings.max()),
        found.area,
        float(np.linalg.norm(through - middle)),
        said(health),
        reference,
    )


def _under(influence: InfluenceMatrices, nodal: Array) -> Array:
    """Readings under nodal forces [Pa]."""
    return influence.readings(SurfaceLoad(nodal, influence.surface, Polygon()))


def said(health: Health) -> str:
    """What the core counts in a single reading besides the reading."""
    names = {"approximated": "approximated", "refused": "refused", "not_carried": "in part", "beyond_range": "range"}
    return ",".join(name for field, name in names.items() if getattr(health, field)) or "-"


def _pressing(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, pad: int) -> tuple[str, bool]:
    """Kinds of the geoms that press on a sensing surface, and whether any presses beside it."""
    frame = geom_frame(model, data, pad)
    kinds, beside, local = set(), False, np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        if pad not in contact.geom or min(contact.geom) < 0:
            continue
        mujoco.mj_contactForce(model, data, number, local)
        axes = contact.frame.reshape(3, 3) * (1.0 if contact.geom[1] == pad else -1.0)
        if on_surface(frame.rotation.T @ axes[0], frame.rotation.T @ axes.T @ local[:3]):
            other = int(contact.geom[0] if contact.geom[1] == pad else contact.geom[1])
            kinds.add(drive._kind(scene, model.geom(other).name))
        elif local[0] > 0.0:
            beside = True
    return "+".join(sorted(kinds)), beside


@functools.cache
def influence_of(kind: str, fidelity: str) -> InfluenceMatrices:
    """Matrices of a pad as the soak's sensors have them: balanced ones of the mesh "draft", but for the default pad."""
    pad, preset = scenes.PADS[kind].pad, PRESETS[fidelity]
    if pad != mjtactile.Pad():
        preset = dataclasses.replace(preset, mesh="draft")
    return mjtactile.influence_matrices(pad, fidelity=preset)


# --------------------------------------------------------------------------------------------------- references


@dataclass(frozen=True)
class Dense:
    """How references are found.

    Attributes:
        cells: near the contacts of all bodies.
        cache: folder where they are kept; None for none.
        limit: time for one [s].
    """

    cells: int = 2500
    cache: Path | None = None
    limit: float = 60.0

    def found(self, key: str, influence: InfluenceMatrices, bodies: Sequence[Body], tilting: bool) -> Reference:
        """Reference of a state.

        Raises:
            DenseContactError: there is none; see `dense_readings`.
        """
        # What is solved depends on the mesh alone; how it is read, on the rest of a fidelity.
        numbers = [f"{value:.6e}" for body in bodies for value in (*body.force, *body.moment)]
        about = f"leaning {influence.pad.fingerprint} {influence.density} {tilting} {self.cells} {numbers}"
        name = f"{key}-{hashlib.sha1(about.encode()).hexdigest()[:12]}"
        if name not in _solved:
            _solved.clear() if len(_solved) > 8 else None
            _solved[name] = self._kept(name, influence, bodies, tilting)
        solved = _solved[name]
        if "error" in solved:
            raise DenseContactError(str(solved["error"]))
        area, full, left, slope = (float(value) for value in solved["numbers"])
        pressure = None
        if "single" in solved:
            x, y, force, polar = (float(value) for value in solved["about"])
            pressure = Pressure(solved["single"], solved["leaning"], np.array([x, y]), force, polar)
        nodal = solved["nodal"]
        return Reference(_under(influence, nodal), solved["pressed"], area, full, left, slope, pressure, nodal)

    def _kept(self, name: str, influence: InfluenceMatrices, bodies: Sequence[Body], tilting: bool) -> dict[str, Array]:
        path = None if self.cache is None else self.cache / f"{name}.npz"
        if path is not None and path.is_file():
            with np.load(path) as file:
                return dict(file)
        try:
            cap = influence.pad.layers[0].young
            # Several bodies share the cells: time goes with the cube of their number.
            cells = self.cells // max(1, len(bodies))
            with within(self.limit):
                found = dense_readings(influence, bodies, cells=cells, tilting=tilting, cap=cap)
        except TimeoutError as error:
            return {"error": np.array(str(error))}
        except DenseContactError as error:
            solved = {"error": np.array(str(error))}
        else:
            solved = _numbers(found, cap, influence.surface)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            np.savez(path, allow_pickle=False, **solved)
        return solved


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Raise TimeoutError where what is done inside takes longer [s]."""

    def over(_signal: int, _frame: object) -> None:
        raise TimeoutError(f"it takes more than {seconds:g} s.")

    before = signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


#: The last references that were solved, by name.
_solved: dict[str, dict[str, Array]] = {}


def _numbers(found: DenseContact, cap: float, surface: SurfaceGrid) -> dict[str, Array]:
    """What is kept of a dense contact."""
    places, full = [], 0.0
    for part in found.bodies:
        on = part.forces[:, 2] < 0.0
        places.append(np.column_stack([part.centroids[on], -part.forces[on, 2]]))
        full += -float(part.forces[part.pressures >= cap * part.cells.share * (1 - 1e-9), 2].sum())
    force, area = -float(found.wrench[2]), found.pressed_area
    left = float(np.linalg.norm(found.left[3:5])) / (force * np.sqrt(area))
    slope = max(float(np.linalg.norm(part.motion[1:])) for part in found.bodies)
    kept = {
        "nodal": found.nodal,
        "pressed": np.concatenate(places),
        "numbers": np.array([area, full / force, left, slope]),
    }
    if len(found.bodies) == 1:
        cells, pressing = found.bodies[0].cells, -found.bodies[0].forces[:, 2]
        centre = pressing @ cells.centres / pressing.sum()
        offset = cells.centres - centre
        kept["single"] = nodal_forces(
            surface, cells, pressing[:, None] * np.column_stack([np.ones(len(offset)), offset])
        )
        leaning = found.bodies[0].leaning
        kept["leaning"] = nodal_forces(surface, cells, np.column_stack([leaning, np.zeros(len(leaning))]))[..., :2]
        kept["about"] = np.array([*centre, pressing.sum(), pressing @ (offset**2).sum(axis=1)])
    return kept


# ------------------------------------------------------------------------------------------------------ reports


HEAD = (
    f"{'seed':>7s} {'step':>5s} pad {'story':13s}{'pad kind':25s}{'what presses':22s}{'tilt':6s}{'force N':>8s}"
    f"{'area mm2':>10s}{'dense':>6s}{'full %':>7s}{'left %':>7s}   "
    "| fidelity: largest over modulus, area over dense, error %, as carried %, core says"
)


def row(state: State) -> str:
    """One line of the table."""
    start = (
        f"{state.seed:7d} {state.step:5d} {state.pad:3d} {state.story:13s}{state.kind[:24]:25s}{state.kinds[:21]:22s}"
        f"{state.tilt:6s}{state.force:8.3g}"
    )
    if state.refused:
        return f"{start}  no reference: {state.refused[:110]}"
    one = state.reads[0].reference
    text = f"{start}{one.area * 1e6:10.4f}{len(one.pressed):6d}{100 * one.full:7.1f}{100 * one.left:7.2f} "
    text += "+s" if state.beside else "  "
    for read in state.reads:
        text += (
            f"| {read.fidelity[0]} {read.peak / state.modulus:6.3f} {read.area / one.area:6.2f} "
            f"{100 * read.error:7.2f} {100 * read.as_carried:7.2f} {read.said:8s}"
        )
    return text


def summary(states: Sequence[State]) -> str:
    """Tables of errors."""
    solved = [state for state in states if state.reads]
    lines = [
        f"{len(states)} states of {len({state.seed for state in states})} scenes, {len(states) - len(solved)} without "
        f"a reference, {sum(state.beyond for state in solved)} that the surface cannot carry; the references took "
        f"{sum(state.seconds for state in states):.0f} s"
    ]
    groups: dict[str, Callable[[State], str]] = {
        "story": lambda state: state.story,
        "pad": lambda state: state.kind,
        "what presses": lambda state: state.kinds if "+" not in state.kinds else "several kinds",
        "bodies": lambda state: f"{state.bodies} bodies" if state.bodies > 1 else "1 body",
        "tilt": lambda state: state.tilt,
        "pressed area, of the pad": _size,
    }
    carried = [state for state in solved if not state.beyond]
    lines += ["", "states that can be carried; errors from what the core carries:", *_rows(carried)]
    for name, group in groups.items():
        lines += ["", f"by {name}:"]
        for key in sorted({group(state) for state in carried}):
            lines += _rows([state for state in carried if group(state) == key], key)
    lines += ["", "states that cannot be carried:", *_rows([state for state in solved if state.beyond])]
    return "\n".join(lines)


def _size(state: State) -> str:
    share = state.reads[0].reference.area / float(np.prod(scenes.PADS[state.kind].pad.size))
    return next((f"below {limit:g}" for limit in (1e-4, 1e-3, 1e-2, 1e-1) if share < limit), "more")


def _rows(states: Sequence[State], name: str = "all") -> Iterator[str]:
    for number, fidelity in enumerate(FIDELITIES):
        errors = np.array([state.reads[number].as_carried for state in states])
        plain = np.array([state.reads[number].error for state in states])
        if len(errors):
            last = states[int(errors.argmax())]
            middle, high = 100 * np.percentile(errors, (50, 90))
            all_in, all_high = 100 * np.percentile(plain, (50, 90))
            where = f"seed {last.seed} step {last.step} pad {last.pad}"
            yield (
                f"  {name:26s}{fidelity:10s}{len(errors):5d}  median {middle:7.2f} %   90 % {high:7.2f} %   worst "
                f"{100 * errors.max():7.2f} %  ({where}); of what MuJoCo gives {all_in:.2f}, {all_high:.2f} %"
            )


def worst(states: Sequence[State], count: int) -> str:
    """The states furthest off, of each fidelity."""
    lines = []
    carried = [state for state in states if state.reads and not state.beyond]
    for number, fidelity in enumerate(FIDELITIES):
        lines += ["", f"worst of {fidelity}:", HEAD]
        lines += [row(s) for s in sorted(carried, key=lambda s: -s.reads[number].as_carried)[:count]]
    return "\n".join(lines)


def look(scene: Scene, steps: int, at: int | None, number: int | None, cache: Path | None, count: int) -> None:
    """Print the states of one scene with references of several numbers of cells, and where each presses."""
    states = picked(scene, steps, count) if at is None else [(at, k) for k in range(len(scene.pads))]
    states = [(step, pad) for step, pad in states if number is None or pad == number]
    found = {cells: list(measured(scene, steps, states, Dense(cells, cache))) for cells in (1600, 2500, 3600)}
    print(f"{scene.story}; {scene.kinds}; {scene.changes}; {[pad.config for pad in scene.pads]}\n{HEAD}")
    for cells, several in found.items():
        for state in several:
            print(f"dense of {cells} cells:\n{row(state)}")
            for read in state.reads[: 1 if cells != 2500 else None]:
                places = read.reference.pressed
                middle = places[:, 2] @ places[:, :2] / places[:, 2].sum() * 1e3
                low, high = places[:, :2].min(axis=0) * 1e3, places[:, :2].max(axis=0) * 1e3
                print(
                    f"    {read.fidelity}: pressed x {low[0]:.4f} .. {high[0]:.4f}, y {low[1]:.4f} .. {high[1]:.4f} "
                    f"mm, centre {middle[0]:.4f} {middle[1]:.4f}, the core's {read.aside * 1e3:.4f} mm from it; "
                    f"areas {read.area * 1e6:.5f} and {read.reference.area * 1e6:.5f} mm2; tilts by "
                    f"{np.degrees(read.reference.slope):.3f} degrees; largest readings {read.peak:.4g} and "
                    f"{read.reference.readings.max():.4g} Pa"
                )
    for small, large in ((1600, 3600), (2500, 3600)):
        for one, other in zip(found[small], found[large], strict=True):
            if one.reads and other.reads:
                a, b = one.reads[-1].reference.readings, other.reads[-1].reference.readings
                print(f"references of {small} and {large} cells differ by {100 * _differ(a, b):.3f} %")


def _differ(one: Array, other: Array) -> float:
    return float(np.linalg.norm(one - other) / max(np.linalg.norm(other), np.finfo(float).tiny))


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--states", type=int, default=2, help="of each scene, at most")
    parser.add_argument("--quick-pads", action="store_true", help="only pads whose tables are built within seconds")
    parser.add_argument("--cells", type=int, default=2500, help="of the reference")
    parser.add_argument("--cache", type=Path, help="folder where references are kept")
    parser.add_argument("--limit", type=float, default=20.0, help="seconds for one reference")
    parser.add_argument("--minutes", type=float, default=np.inf, help="no further scene is begun after that")
    parser.add_argument("--worst", type=int, default=10, help="states to name at the end, of each fidelity")
    parser.add_argument("--only", type=int, help="seed of one scene, looked at closely")
    parser.add_argument("--at", type=int, help="step to look at, with --only")
    parser.add_argument("--pad", type=int, help="number of the pad to look at, with --only")
    given = parser.parse_args()
    pads = scenes.QUICK_PADS if given.quick_pads else scenes.FLAT_PADS
    scenes.prepare(pads, scenes.ROOT / "build" / "soak" / "pads")
    if given.only is not None:
        look(scenes.scene(given.only, pads), given.steps, given.at, given.pad, given.cache, given.states)
        return 0
    how, begun, states = Dense(given.cells, given.cache, given.limit), time.monotonic(), []
    print(HEAD)
    for seed in range(given.seed, given.seed + given.scenes):
        if time.monotonic() - begun > 60 * given.minutes:
            print(f"stopped before seed {seed}: time is up")
            break
        scene = scenes.scene(seed, pads)
        try:
            chosen = picked(scene, given.steps, given.states)
        except ValueError as error:
            print(f"{seed:7d} does not compile: {str(error)[:100]}")
            continue
        for state in measured(scene, given.steps, chosen, how):
            states.append(state)
            print(row(state), flush=True)
    print(f"\n{summary(states)}\n{worst(states, given.worst)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
