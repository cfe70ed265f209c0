"""Random bodies that touch in several places or along lines: read against the dense contact, and slid by 2 micrometres.

    python tests/soak/bodies.py --count 60 --seed 7
    python tests/soak/bodies.py --count 200 --kinds ring,rods --no-dense
    python tests/soak/bodies.py --count 1 --seed 12 --pads default --fidelities fast     # one of them again

Each body is on a slide above a pad, at a random place and turn, under a random force. Bodies that indent a pad beyond
the linear range are left out, and so are slides over which MuJoCo's own wrench jumps.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "reference"), str(HERE.parent / "reference" / "bodies")]

import meshes  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import rough_cases as rough  # noqa: E402
from accuracy import within  # noqa: E402
from bodies_of_model import compare  # noqa: E402
from dense_contact import DenseContactError  # noqa: E402
from rough_cases import Case  # noqa: E402

import mjtactile  # noqa: E402
from mjtactile._types import Array  # noqa: E402
from mjtactile.sim.wrench import contact_wrench  # noqa: E402

Rng = np.random.Generator
#: Pads by name: (x, y, thickness) [m].
PADS = {"default": (15e-3, 15e-3, 5e-3), "narrow": (30e-3, 6e-3, 3e-3), "small": (8e-3, 10e-3, 3e-3)}
#: Way that bodies slide [m], and the change of MuJoCo's wrench over it from which it has jumped, over force and size.
SLIDE, _JUMP = 2e-6, 2e-3
#: Largest distance of a body from the pad's middle [m], and the forces on it [N].
_AWAY, _LEAST_FORCE, _MOST_FORCE = 1.5e-3, 0.01, 0.7
#: Seconds for one dense contact.
_LIMIT = 60.0


@dataclass(frozen=True)
class Shape:
    """What a body is made of: geoms in its frame, whose lowest point is `lowest` [m] below the origin."""

    geoms: str
    lowest: float
    assets: str = ""


def _ring(rng: Rng) -> Shape:
    """A lying torus, a mesh."""
    middle, tube = rng.uniform(1.5e-3, 5e-3), rng.uniform(0.3e-3, 1.5e-3)
    mesh = meshes.torus(middle, tube, int(rng.integers(24, 96)), int(rng.integers(12, 32)))
    return Shape('<geom type="mesh" mesh="body"/>', tube, meshes.mjcf("body", mesh))


def _rods(rng: Rng) -> Shape:
    """Parallel capsules, all as low or within some micrometres."""
    count, radius = int(rng.integers(2, 7)), rng.uniform(0.3e-3, 1e-3)
    apart, half = rng.uniform(2.1, 4.0) * radius, rng.uniform(1e-3, 4e-3)
    places = apart * (np.arange(count) - (count - 1) / 2)
    return Shape("".join(_bar(radius, (x, -half), (x, half), _low(rng)) for x in places), radius)


def _frame(rng: Rng) -> Shape:
    """Four flat beams around a rectangle."""
    x, y, beam = rng.uniform(1.5e-3, 4e-3), rng.uniform(1.5e-3, 4e-3), rng.uniform(0.3e-3, 1e-3)
    beams = [(0, y, x + beam, beam), (0, -y, x + beam, beam), (x, 0, beam, y - beam), (-x, 0, beam, y - beam)]
    return Shape("".join(_box(*beam) for beam in beams), 1e-3)


def _balls(rng: Rng) -> Shape:
    """Two or three balls of any size, all as low or within some micrometres."""
    radii = rng.uniform(0.7e-3, 3e-3, int(rng.integers(2, 4)))
    places = _around(rng, len(radii), rng.uniform(1.2, 2.0) * float(radii.max()))
    lowest = float(radii.max())
    balls = [(x, y, radius, radius - lowest + _low(rng)) for (x, y), radius in zip(places, radii, strict=True)]
    return Shape("".join(_ball(*one) for one in balls), lowest)


def _feet(rng: Rng) -> Shape:
    """Two to six equal balls on a circle."""
    count, radius = int(rng.integers(2, 7)), rng.uniform(0.6e-3, 1.5e-3)
    places = _around(rng, count, rng.uniform(2e-3, 4.5e-3))
    return Shape("".join(_ball(x, y, radius, 0.0) for x, y in places), radius)


def _bars(rng: Rng) -> Shape:
    """A cross, a hash or an H of round bars."""
    a, radius = rng.uniform(1.5e-3, 4e-3), rng.uniform(0.3e-3, 0.9e-3)
    b = rng.uniform(0.3, 0.6) * a
    figures = [
        [(-a, 0, a, 0), (0, -a, 0, a)],
        [(-a, b, a, b), (-a, -b, a, -b), (b, -a, b, a), (-b, -a, -b, a)],
        [(-b, -a, -b, a), (b, -a, b, a), (-b, 0, b, 0)],
    ]
    bars = figures[int(rng.integers(len(figures)))]
    return Shape("".join(_bar(radius, (x0, y0), (x1, y1), 0.0) for x0, y0, x1, y1 in bars), radius)


def _edge(rng: Rng) -> Shape:
    """A box on one of its edges."""
    half, long = rng.uniform(1e-3, 3e-3), rng.uniform(1e-3, 4e-3)
    lean = rng.uniform(20.0, 70.0)
    low = half * (np.sin(np.radians(lean)) + np.cos(np.radians(lean)))
    size = f"{half:.9g} {long:.9g} {half:.9g}"
    return Shape(f'<geom type="box" size="{size}" euler="0 {lean:.9g} 0"/>', float(low))


def _block(rng: Rng) -> Shape:
    """A box or a cylinder on its flat side, which on a narrow pad reaches over the rim."""
    size = rng.uniform(1e-3, 4e-3, 2)
    if rng.random() < 0.5:
        return Shape(_box(0, 0, *size), 1e-3)
    return Shape(f'<geom type="cylinder" size="{size[0]:.9g} .001"/>', 1e-3)


def _bosses(rng: Rng) -> Shape:
    """A plate from which balls stand out by some micrometres."""
    x, y = rng.uniform(2e-3, 4e-3, 2)
    balls = []
    for px, py in _around(rng, int(rng.integers(1, 5)), 0.6 * min(x, y)):
        radius = rng.uniform(0.5e-3, 1.5e-3)
        balls.append(_ball(px, py, radius, radius - 1e-3 - rng.uniform(1e-6, 20e-6)))
    return Shape(_box(0, 0, x, y) + "".join(balls), 1e-3)


def _step(rng: Rng) -> Shape:
    """Two boxes side by side, one lower by some micrometres."""
    x, y, less = rng.uniform(1e-3, 2e-3), rng.uniform(1e-3, 3e-3), rng.uniform(1e-6, 20e-6)
    return Shape(_box(-x, 0, x, y) + _box(x, 0, x, y, less), 1e-3)


def _terrain(rng: Rng) -> Shape:
    """A height field upside down, with a peak or a valley every millimetre or so."""
    count, half, high = int(rng.integers(4, 12)), rng.uniform(2e-3, 6e-3), rng.uniform(0.05e-3, 1e-3)
    heights = rng.random((count, count))
    size = f"{half:.9g} {half:.9g} {high:.9g} .001"
    elevation = " ".join(f"{height:.9g}" for height in heights.ravel())
    field = f'<hfield name="t" nrow="{count}" ncol="{count}" size="{size}" elevation="{elevation}"/>'
    return Shape('<geom type="hfield" hfield="t" euler="180 0 0"/>', high * float(heights.max()), field)


def _bumps(rng: Rng) -> Shape:
    """Many balls of unlike sizes that hang nearly as low as each other."""
    count, half, spread = int(rng.integers(7, 25)), rng.uniform(2e-3, 5e-3), rng.uniform(0.01e-3, 0.3e-3)
    x, y = rng.uniform(-half, half, count), rng.uniform(-half, half, count)
    radii, heights = rng.uniform(0.3e-3, 1.5e-3, count), rng.uniform(0.0, spread, count)
    places = zip(x, y, radii, radii + heights - 1e-3, strict=True)
    return Shape("".join(_ball(*map(float, place)) for place in places), 1e-3)


KINDS: dict[str, Callable[[Rng], Shape]] = {
    "ring": _ring, "rods": _rods, "frame": _frame, "balls": _balls, "feet": _feet, "bars": _bars, "edge": _edge,
    "block": _block, "bosses": _bosses, "step": _step, "terrain": _terrain, "bumps": _bumps,
}  # fmt: skip


def _low(rng: Rng) -> float:
    """What a part is higher than the lowest one [m]: nothing in half of all cases."""
    return 0.0 if rng.random() < 0.5 else float(rng.uniform(0.0, 10e-6))


def _around(rng: Rng, count: int, radius: float) -> Array:
    turn = rng.uniform(0.0, 2 * np.pi) + 2 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(turn), np.sin(turn)])


def _ball(x: float, y: float, radius: float, up: float) -> str:
    return f'<geom type="sphere" size="{radius:.9g}" pos="{x:.9g} {y:.9g} {up:.9g}"/>'


def _bar(radius: float, start: tuple[float, float], end: tuple[float, float], up: float) -> str:
    ends = f"{start[0]:.9g} {start[1]:.9g} {up:.9g} {end[0]:.9g} {end[1]:.9g} {up:.9g}"
    return f'<geom type="capsule" size="{radius:.9g}" fromto="{ends}"/>'


def _box(x: float, y: float, half_x: float, half_y: float, up: float = 0.0) -> str:
    return f'<geom type="box" size="{half_x:.9g} {half_y:.9g} .001" pos="{x:.9g} {y:.9g} {up:.9g}"/>'


def case_of(seed: int, kind: str, pad: str) -> Case:
    """A random body of a kind as a case."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    shape = KINDS[kind](rng)
    x, y = rng.uniform(-_AWAY, _AWAY, 2)
    force = float(np.exp(rng.uniform(np.log(_LEAST_FORCE), np.log(_MOST_FORCE))))
    turn = f'euler="0 0 {rng.uniform(0.0, 360.0):.9g}"'
    body = rough.on_slide(shape.geoms, shape.lowest + 1e-4, at=(x, y), turn=turn)
    return Case(f"{kind} {seed}", body, force, shape.assets, pad=PADS[pad])


@dataclass(frozen=True)
class Found:
    """One body at one fidelity.

    Attributes:
        name: kind, seed and pad.
        fidelity: preset by name.
        error: against the dense contact [-]; None where that was not asked for, or there is none.
        change: of the readings over a slide [-]; None where MuJoCo's wrench jumps.
        range: of the contact over the linear range [-].
    """

    name: str
    fidelity: str
    error: float | None
    change: float | None
    range: float


def look_at(case: Case, name: str, fidelity: str, *, cells: int, farthest: float = 1.0) -> Found:
    """Press a body and slide it.

    Args:
        case: the body.
        name: under which it is reported.
        fidelity: preset by name.
        cells: of the dense contact; 0 for none.
        farthest: contacts beyond this multiple of the linear range are not compared with it.
    """
    model = mujoco.MjModel.from_xml_string(
        rough.mjcf(case, "body", fidelity=fidelity, law="elastic", output="von_mises range")
    )
    pad, body = model.geom("pad").id, model.jnt_bodyid[model.joint("press").id]
    data = _at_rest(model, case.force)
    readings, range_ = data.sensordata[:-1].copy(), float(data.sensordata[-1])
    error = None
    if cells and range_ <= farthest:
        try:
            with within(_LIMIT):
                error = compare(model, data, cells=cells).error
        except (DenseContactError, TimeoutError, ValueError) as refused:
            print(f"{name}: no dense contact: {refused}", flush=True)
    wrench = contact_wrench(model, data, pad)
    angle = np.random.default_rng(len(name)).uniform(0.0, 2 * np.pi)
    model.body_pos[body, :2] += SLIDE * np.array([np.cos(angle), np.sin(angle)])
    data = _at_rest(model, case.force)
    moved = contact_wrench(model, data, pad)
    jump = float(np.linalg.norm((moved - wrench)[3:])) / (case.force * min(case.pad))
    change = float(np.linalg.norm(data.sensordata[:-1] - readings) / np.linalg.norm(readings))
    return Found(name, fidelity, error, change if jump < _JUMP else None, range_)


def _at_rest(model: mujoco.MjModel, force: float) -> mujoco.MjData:
    """The model's body at rest under a force [N], read."""
    data = mujoco.MjData(model)
    rough.pressed(model, data, force)
    mujoco.mj_forward(model, data)
    return data


def look_at_all(
    seeds: Sequence[int], kinds: Sequence[str], pads: Sequence[str], fidelities: Sequence[str], *, cells: int
) -> Iterator[Found]:
    """Bodies of all kinds in turn, each at every fidelity."""
    for seed in seeds:
        for number, kind in enumerate(kinds):
            pad = pads[(seed + number) % len(pads)]
            case = case_of(seed, kind, pad)
            for fidelity in fidelities:
                yield look_at(case, f"{kind} {seed} {pad}", fidelity, cells=cells)


def summary(found: Sequence[Found], fidelity: str) -> str:
    """A line on the errors and a line on the slides of a fidelity."""
    lines = []
    own = [one for one in found if one.fidelity == fidelity and one.range <= 1.0]
    for about, key in (("error", "error"), ("slide", "change")):
        pairs = sorted((getattr(one, key), one.name) for one in own if getattr(one, key) is not None)
        if not pairs:
            continue
        values = 100 * np.array([value for value, _ in pairs])
        worst = ", ".join(f"{100 * value:.1f} ({name})" for value, name in pairs[:-6:-1])
        over = int((values > 1.0).sum())
        lines.append(
            f"{fidelity}, {about}: {len(values)} bodies, median {np.median(values):.2f} %, over 1 %: {over}, "
            f"worst {worst} %"
        )
    return "\n".join(lines)


def main() -> int:
    """Print what stands out while it is found, and a summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20, help="seeds; each gives a body of every kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--pads", default=",".join(PADS))
    parser.add_argument("--fidelities", default="fast,balanced")
    parser.add_argument("--cells", type=int, default=2500, help="of the dense contact")
    parser.add_argument("--no-dense", action="store_true", help="only slide the bodies")
    asked = parser.parse_args()
    fidelities = asked.fidelities.split(",")
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mjtactile.ContactWarning)
        every = look_at_all(
            range(asked.seed, asked.seed + asked.count),
            asked.kinds.split(","),
            asked.pads.split(","),
            fidelities,
            cells=0 if asked.no_dense else asked.cells,
        )
        for one in every:
            found.append(one)
            error = "-" if one.error is None else f"{100 * one.error:.2f}"
            change = "-" if one.change is None else f"{100 * one.change:.3f}"
            print(f"{one.name:28s}{one.fidelity:10s}error {error:>7s} %  slide {change:>7s} %  range {one.range:.2f}")
            sys.stdout.flush()
    for fidelity in fidelities:
        print(summary(found, fidelity))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
