"""What readings must do when a scene is turned, mirrored, moved or pressed harder, whatever the scene.

    python tests/soak/invariants.py --scenes 1000

Bodies of a random scene are on slides above one pad and are brought to rest under their forces. The changed scene is
put into the same state, so that MuJoCo presses alike there: scenes where it does not, because it chose other contact
points, are left out and counted.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import random_scenes as scenes  # noqa: E402
from pad_contacts import wrenches_by_geom  # noqa: E402
from random_scenes import Scene  # noqa: E402

import mjtactile  # noqa: E402
from mjtactile._types import Array  # noqa: E402

#: Where MuJoCo's own wrenches differ by more than this, relative to the force, scenes are not compared.
_SAME_WRENCH = 1e-8
_SETTLING_STEPS = 600
#: Pressures over the modulus of the pad's top layer: below which no cell comes to the bound when they double, not even
#: in a look that finds a smaller contact than the last; and from which on one is at it (shear takes a part of what
#: material bears).
_FAR_BELOW, _AT_ITS_BOUND = 0.05, 0.4
#: Share of a scene's forces under which few faces come to that bound.
_LIGHT = 0.02
_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Still:
    """A scene at rest."""

    readings: Array  #: von Mises, (layers, rows, columns) [Pa]
    wrenches: Array  #: by touching geom, pad frame [N, N m], (n, 6)
    carried: Array | None  #: the wrench that readings carry, where the sensor says so
    positions: Array  #: of the joints
    pressed: Array  #: resultant of the nodal forces on the surface [N, N m], (6,)
    peak: float  #: largest pressure over what the pad's top layer bears [-]


@dataclass
class Worst:
    """The largest deviation over scenes."""

    name: str
    deviation: float = 0.0
    seed: int = -1
    compared: int = 0
    left_out: int = 0

    def add(self, seed: int, deviation: float | None) -> None:
        """Count a scene; None where it could not be compared."""
        if deviation is None:
            self.left_out += 1
            return
        self.compared += 1
        if not deviation <= self.deviation:  # what is not a number is the worst
            self.deviation, self.seed = deviation, seed

    def __str__(self) -> str:
        """One line."""
        where = f" (seed {self.seed})" if self.seed >= 0 else ""
        return f"{self.name}: worst {self.deviation:.3g}{where} in {self.compared} scenes, {self.left_out} left out"


def prepare(pads: Iterable[str]) -> None:
    """Build tables of pads in double precision: what storage rounds is not as symmetric as scenes are."""
    scenes.prepare(pads, scenes.ROOT / "build" / "soak" / "pads", "float64")


def settled(scene: Scene, positions: Array | None = None, factor: float = 1.0) -> Still:
    """A scene of bodies on slides at rest under their forces, or at positions that are known already.

    Args:
        scene: one of `random_scenes.still_scene`.
        positions: of the joints; None to let them settle, without reading meanwhile.
        factor: on all forces.
    """
    model = mujoco.MjModel.from_xml_string(scenes.mjcf(scene))
    data = mujoco.MjData(model)
    for index, body in enumerate(scene.bodies[0]):
        data.joint(f"body0-{index}").qfrc_applied = -factor * body.force
    if positions is None:
        flags = model.opt.disableflags
        model.opt.disableflags = flags | mujoco.mjtDisableBit.mjDSBL_SENSOR
        mujoco.mj_step(model, data, _SETTLING_STEPS)
        model.opt.disableflags = flags
    else:
        data.qpos[:] = positions
    data.qvel[:], data.qacc_warmstart[:] = 0.0, 0.0
    mujoco.mj_forward(model, data)
    pad, numbers = scene.pads[0].pad, data.sensor("touch0").data
    taxels, asked = int(np.prod(pad.reading_shape)), scenes.ASKED
    start = taxels + sum(scenes.WIDTHS[name] for name in asked[1 : asked.index("carried")]) if "carried" in asked else 0
    return Still(
        numbers[:taxels].reshape(pad.reading_shape).copy(),
        np.reshape([*wrenches_by_geom(model, data, model.geom("pad0").id).values()], (-1, 6)),
        numbers[start : start + 6].copy() if start else None,
        data.qpos.copy(),
        *_pressed(model, data, pad),
    )


def _pressed(model: mujoco.MjModel, data: mujoco.MjData, pad: mjtactile.Pad) -> tuple[Array, float]:
    """Resultant of what presses on the surface's nodes, and its largest pressure over the top layer's modulus."""
    load = mjtactile.TactileSensor(model, "touch0").load(data)
    if load is None or load.state is None:
        return np.zeros(6), 0.0
    y, x = np.meshgrid(load.surface.y.nodes, load.surface.x.nodes, indexing="ij")
    places = np.stack([x, y, np.zeros_like(x)], axis=-1)
    force, moment = load.forces.sum(axis=(0, 1)), np.cross(places, load.forces).sum(axis=(0, 1))
    return np.concatenate([force, moment]), load.state.peak_pressure / pad.layers[0].young


def turning(scene: Scene) -> float | None:
    """Bodies turned about the pad's normal, by 90 degrees on square pads and by 180 on others, turn the readings.

    Returns: largest difference over the largest reading; None where MuJoCo presses differently, or not at all.
    """
    pad = scene.pads[0].pad
    times = 1 if pad.size[0] == pad.size[1] and pad.grid.rows == pad.grid.columns else 2
    turn = np.linalg.matrix_power(_QUARTER, times)
    return _compared(scene, scenes.turned(scene, turn), lambda r: np.rot90(r, -times, (1, 2)), turn, turn)


def mirroring(scene: Scene) -> float | None:
    """Bodies mirrored, x -> -x, mirror the readings; see `turning`."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    return _compared(scene, scenes.mirrored(scene), lambda r: r[:, :, ::-1], mirror, -mirror)


def moving(scene: Scene) -> float | None:
    """Pad and bodies moved through the world together leave the readings as they are; see `turning`."""
    rng = np.random.default_rng(scene.seed)
    rotation = scenes.any_rotation(rng)
    moved = scenes.elsewhere(scene, rng.normal(0, 0.5, 3), rotation)
    return _compared(scene, moved, lambda r: r, np.eye(3), np.eye(3))


def doubling(scene: Scene) -> float | None:
    """Twice the force under a flat face doubles the readings; for scenes made with `flat`.

    Deformation is linear there, so contact does not grow: faces stay where they are. The pad's material bears no
    pressure above its modulus, so forces are small enough for twice of them to stay below that.
    """
    light = _LIGHT
    while (peak := settled(scene, factor=light).peak) > _FAR_BELOW:
        light /= 10.0  # a peak at the bound does not tell how small the force must be
    if not peak > 0.0:
        return None  # too light to come down in time
    share = min(1.0, light * _FAR_BELOW / peak)
    once, twice = settled(scene, factor=share), settled(scene, factor=2.0 * share)
    if not once.readings.any() or not _alike(2.0 * once.wrenches, twice.wrenches, 1e-6):
        return None
    return _difference(2.0 * once.readings, twice.readings)


def resultant(scene: Scene) -> float | None:
    """What the sensor says that its readings carry presses on the surface's nodes, and is MuJoCo's wrench.

    For scenes made with `flat`, whose face is wholly over the sheet or partly beside it. Where the face's pressure has
    come to what the pad's material bears, less than MuJoCo's wrench may be carried. None without the output.
    """
    still = settled(scene)
    if still.carried is None or not len(still.wrenches):
        return None
    force = float(np.linalg.norm(still.wrenches[:, :3], axis=1).sum())
    unsaid = float(np.abs(still.carried - still.pressed).max())
    left = float(np.abs(still.carried - still.wrenches.sum(axis=0)).max())
    return max(unsaid, left if still.peak < _AT_ITS_BOUND else 0.0) / force


def _compared(
    scene: Scene, other: Scene, expected: Callable[[Array], Array], vectors: Array, moments: Array
) -> float | None:
    still = settled(scene)
    changed = settled(other, still.positions)
    turned = np.hstack([still.wrenches[:, :3] @ vectors.T, still.wrenches[:, 3:] @ moments.T])
    if not still.readings.any() or not _alike(turned, changed.wrenches, _SAME_WRENCH):
        return None
    return _difference(expected(still.readings), changed.readings)


def _alike(expected: Array, found: Array, tolerance: float) -> bool:
    if expected.shape != found.shape:
        return False
    force = np.linalg.norm(expected[:, :3], axis=1).sum()
    return bool(np.abs(expected[:, :3] - found[:, :3]).max(initial=0.0) <= tolerance * force) and bool(
        np.abs(expected[:, 3:] - found[:, 3:]).max(initial=0.0) <= tolerance * force * 0.01
    )


def _difference(expected: Array, found: Array) -> float:
    return float(np.abs(expected - found).max() / expected.max())


#: Invariants by name: what is compared, whether on flat faces alone, and the bound on the relative deviation.
INVARIANTS: dict[str, tuple[Callable[[Scene], float | None], bool, float]] = {
    "turned bodies turn readings": (turning, False, 1e-6),
    "mirrored bodies mirror readings": (mirroring, False, 1e-6),
    "moved scenes read the same": (moving, False, 1e-6),
    "twice the force doubles readings under flat faces": (doubling, True, 1e-6),
    "what is carried is MuJoCo's wrench under flat faces": (resultant, True, 1e-9),
}


def worst(name: str, seeds: Iterable[int], pads: Iterable[str]) -> Worst:
    """The largest deviation from an invariant over scenes of seeds."""
    deviation, flat, _ = INVARIANTS[name]
    found, pads = Worst(name), tuple(pads)
    for seed in seeds:
        scene = scenes.still_scene(seed, pads, flat)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what cannot be carried cannot be carried on either side
            found.add(seed, deviation(scene))
    return found


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick-pads", action="store_true")
    parser.add_argument("--only", help=f"one of: {'; '.join(INVARIANTS)}")
    given = parser.parse_args()
    pads = scenes.QUICK_PADS if given.quick_pads else scenes.FLAT_PADS
    prepare(pads)
    failed = False
    for name in [given.only] if given.only else INVARIANTS:
        found = worst(name, range(given.seed, given.seed + given.scenes), pads)
        bound = INVARIANTS[name][2]
        failed |= not found.deviation <= bound
        print(f"{found}; at most {bound:g}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
