"""What pads feel in grasps, for the grasp recogniser: boxes held, pulled and twisted at random by the gripper.

    python training/grasp_presses.py --out build/grasps.npz

Every grasp has a box of its own: its size, mass and friction, where and how turned it stands, and how high it is taken.
It is rubbed where it stands and lifted; then grip and an outer force and moment on it change at random every 60 ms, up
to what slips.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import mujoco
import numpy as np
from arguments import parsed

from mjtactile.grasp.scene import GraspObject, grasp_spec, open_gripper
from mjtactile.gripper import GRIPPER_PADS
from mjtactile.pad import Array, Pad
from mjtactile.progress import progress_bar
from mjtactile.report import write_atomically
from mjtactile.wrench import contact_wrenches

#: Steps of a grasp, of which one in `EVERY` is read once the object is touched; steps with one outer force.
STEPS, EVERY, SEGMENT = 1200, 6, 60
#: When the fingers rub the object that stands on the table, and when it is lifted clear of it [steps].
RUBBED, LIFTED = 250, 360
#: A force that passes further from the middle of a pad presses on an edge [m].
INSIDE = 6.8e-3
#: A pad that bears less is not touched [N].
LEAST_FORCE = 0.05


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    out: Path  #: file that is written
    grasps: int = 500  #: how many boxes are held
    seed: int = 7  #: of everything
    workers: int = 1  #: processes
    fidelity: tuple[str, ...] = ("fast",)  #: presets of the readings, one after the other


def main(config: Config) -> None:
    """Hold boxes, write readings and wrenches."""
    jobs = [(config.seed, k, config.fidelity[k % len(config.fidelity)]) for k in range(config.grasps)]
    made = []
    with (
        progress_bar("holding boxes", len(jobs)) as advance,
        ProcessPoolExecutor(config.workers, mp_context=get_context("spawn")) as pool,
    ):
        for one in pool.map(held, jobs):
            made.append(one)
            advance(1)
    readings, wrenches, grasp = (np.concatenate(parts) for parts in zip(*made, strict=True))
    config.out.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(config.out, lambda file: np.savez(file, readings=readings, wrenches=wrenches, grasp=grasp))
    print(f"{len(readings)} readings of {config.grasps} grasps: {config.out}")


def held(job: tuple[int, int, str]) -> tuple[np.ndarray, Array, np.ndarray]:
    """Readings (n, layers, rows, columns) [Pa], wrenches (n, 6) [N, N m] and the number of the grasp (n,)."""
    seed, number, fidelity = job
    drawn = np.random.default_rng([seed, number])
    model = random_scene(drawn, fidelity)
    data = mujoco.MjData(model)
    open_gripper(model, data, float(model.geom("object").size[0] * 2 + 0.008))
    grip, lift = model.actuator("grip").id, model.actuator("wrist_z").id
    body, geoms = model.body("object").id, [model.geom(f"{name}_pad").id for name in GRIPPER_PADS]
    mass, friction = float(model.body("object").mass[0]), float(model.geom("object").friction[0])
    model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    readings, wrenches = [], []
    for step in range(STEPS):
        if step % SEGMENT == 0:
            force = 1.0 if step < 2 * SEGMENT else np.exp(drawn.uniform(np.log(0.3), np.log(20.0)))
            weight = 9.81 * mass / 2.0 / friction
            data.ctrl[grip] = force if step < LIFTED else min(20.0, max(force, weight * drawn.uniform(0.95, 1.5)))
            if step >= LIFTED:
                data.xfrc_applied[body] = outer_wrench(drawn, data.ctrl[grip] * friction, 2.0 * data.ctrl[grip])
        data.ctrl[lift] = min(max(step - LIFTED, 0) * 2e-4, 0.01) - min(max(step - RUBBED, 0) * 1e-5, 1e-3)
        mujoco.mj_step(model, data)
        if step % EVERY == EVERY - 1 and not on_an_edge(model, data, geoms):
            model.opt.disableflags = 0
            mujoco.mj_forward(model, data)
            model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
            for name, geom in zip(GRIPPER_PADS, geoms, strict=True):
                wrench = contact_wrenches(model, data, geom).total
                if wrench[2] < -LEAST_FORCE:
                    readings.append(data.sensor(name).data.astype(np.float32).reshape(Pad().reading_shape))
                    wrenches.append(wrench)
        if step > LIFTED and data.body("object").xpos[2] < data.site("grasp").xpos[2] - 0.03:
            break  # dropped
    return np.array(readings), np.array(wrenches), np.full(len(readings), number)


def on_an_edge(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> bool:
    """Whether a pad is pressed along an edge, far beyond small strains: nothing is to be learnt from that."""
    for geom in geoms:
        wrench = contact_wrenches(model, data, geom).total
        if wrench[2] < 0.0 and np.abs(wrench[3:5] / wrench[2]).max() > INSIDE:
            return True
    return False


def random_scene(drawn: np.random.Generator, fidelity: str) -> mujoco.MjModel:
    """A box that both pads meet, wholly or in part."""
    size = drawn.uniform((0.02, 0.012, 0.03), (0.06, 0.06, 0.1))
    # Of the pad's width, at least 9 mm lie on the face.
    most = max(size[1] / 2 - 1.5e-3, 0.0)
    overhang = drawn.uniform(-1.0, 1.0) * min(most, 0.01)
    lowest, highest = 0.0105, size[2] - 1.5e-3
    grasped = GraspObject(
        size=(float(size[0]), float(size[1]), float(size[2])),
        mass=float(np.exp(drawn.uniform(np.log(0.02), np.log(0.5)))),
        friction=float(drawn.uniform(0.2, 1.2)),
    )
    pose = (float(drawn.uniform(-2e-3, 2e-3)), float(overhang), float(drawn.uniform(-0.03, 0.03)))
    height = float(np.clip(size[2] / 2 + drawn.uniform(-0.01, 0.01), lowest, highest))
    return grasp_spec(grasped, pose=pose, grasp_height=height, fidelity=fidelity).compile()


def outer_wrench(drawn: np.random.Generator, friction_force: float, grip: float) -> Array:
    """A force [N] and a moment [N m] on the object that friction may or may not hold, shape (6,)."""
    direction = drawn.standard_normal(3) * (0.3, 1.0, 1.0)
    force = direction / np.linalg.norm(direction) * friction_force * drawn.uniform(0.0, 2.0)
    moment = drawn.uniform(-1.0, 1.0, 3) * (friction_force * 6e-3, grip * 2e-3, grip * 2e-3)
    return np.concatenate([force, moment * drawn.uniform(0.0, 1.0)])


if __name__ == "__main__":
    main(parsed(Config, __doc__))
