"""What pads feel of faces that cover them, for the grasp recogniser: any force, torsion and centre of pressure.

    PYTHONPATH=. python training/grasp_presses.py --out build/grasps.npz

Presses are made by the contact law alone, without MuJoCo. Under a flat face readings grow with the force, so every
press has a pressing force of 1 N: the recogniser takes magnitudes out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from arguments import run_script

from mjtactile._files import write_atomically
from mjtactile._progress import progress_bar
from mjtactile._types import Array
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import quiet_contacts
from mjtactile.influence.cache import influence_matrices
from mjtactile.pad import Pad
from mjtactile.workers import process_pool

#: Presses of one job.
_PER_JOB = 500
#: Largest tangential over pressing force [-], distance of the centre of pressure from the middle [m], and torsion over
#: pressing force [m].
RATIO, CENTRE, TORSION = 1.35, 6.5e-3, 6e-3
#: Presets of the readings, in turn from job to job: forces learnt from one are up to 4 % off on readings of another.
FIDELITIES = ("fast", "balanced", "precise")


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    out: Path  #: file that is written
    presses: int = 30000  #: how many
    seed: int = 7  #: of everything
    workers: int = 1  #: processes


def main(config: Config) -> None:
    """Press, write readings and wrenches."""
    jobs = [(config.seed, k) for k in range(math.ceil(config.presses / _PER_JOB))]
    made = []
    with (
        progress_bar("pressing", len(jobs)) as advance,
        process_pool(config.workers) as pool,
    ):
        for one in pool.map(pressed, jobs):
            made.append(one)
            advance(1)
    readings, wrenches = (np.concatenate(parts) for parts in zip(*made, strict=True))
    config.out.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(config.out, lambda file: np.savez(file, readings=readings, wrenches=wrenches))
    print(f"{len(readings)} presses: {config.out}")


def pressed(job: tuple[int, int]) -> tuple[np.ndarray, Array]:
    """Readings (n, layers, rows, columns) [Pa] and wrenches (n, 6) [N, N m]."""
    seed, number = job
    drawn = np.random.default_rng([seed, number])
    pad = Pad()
    influence = influence_matrices(pad, fidelity=FIDELITIES[number % len(FIDELITIES)], progress=False)
    sheet = shapely.box(-pad.size[0] / 2, -pad.size[1] / 2, pad.size[0] / 2, pad.size[1] / 2)
    face = Footprint.from_outline(sheet, influence.surface)
    wrenches = np.array([random_wrench(drawn) for _ in range(_PER_JOB)])
    # Near the edges the pressure leaves the range of small strains; the readings stay those of the linear model.
    with quiet_contacts():
        loads = (contact_load(influence, face, wrench[:3], moment=wrench[3:]) for wrench in wrenches)
        readings = np.array([influence.readings(load) for load in loads], dtype=np.float32)
    return readings, wrenches


def random_wrench(drawn: np.random.Generator) -> Array:
    """With a pressing force of 1 N; small pulls, shifts and torsions come more often than large ones, shape (6,)."""
    ratio, shift = RATIO * drawn.random(), CENTRE * drawn.random() ** 1.5
    around, towards = drawn.uniform(0.0, 2.0 * np.pi, 2)
    force = np.array([ratio * np.cos(around), ratio * np.sin(around), -1.0])
    centre = np.array([shift * np.cos(towards), shift * np.sin(towards), 0.0])
    torsion = TORSION * drawn.random() ** 2 * drawn.choice((-1.0, 1.0))
    return np.concatenate([force, np.cross(centre, force) + np.array([0.0, 0.0, torsion])])


if __name__ == "__main__":
    run_script(main, Config, __doc__)
