"""Train one of the modules for position, size and orientation.

python training/train_pose.py --module size --data build/presses --weights build/weights/all
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from arguments import run_script
from lesson import Lesson, LessonConfig

from mjtactile._types import Array
from mjtactile.dataset.shapes import DISC_RADIUS
from mjtactile.recognition.pose import ORDERS, POSE_KINDS, SYMMETRY
from mjtactile.recognition.symmetry import Mirrors
from mjtactile.recognition.training.fitting import fit, perceptron, perceptron_arrays
from mjtactile.recognition.training.presses import Presses

#: Typical errors, by which outputs are scaled.
_SCALE = {"position": 1e-3, "size": 0.1, "orientation": 0.5}
#: Half the width of the paper's punches, whose size is 1 [m].
_HALF_BOX = 5e-3


@dataclass(frozen=True, kw_only=True)
class Config(LessonConfig):
    """Arguments."""

    module: str  #: position, size or orientation
    width: int = 128  #: of the hidden layers
    depth: int = 2  #: hidden layers
    steps: int = 5000  #: batches
    seed: int = 2  #: of weights, batches and noise


def orientation_targets(shapes: np.ndarray, rotations: Array, mirrors: Mirrors) -> Array:
    """Training targets of an orientation module, in the octant, (presses, 2 orders).

    Args:
        shapes: name of each press's shape, (presses,).
        rotations: rotation of each shape on the pad [rad], (presses,).
        mirrors: how each press was mirrored.
    """
    order = np.array([SYMMETRY.get(shape, (0, 0.0))[0] for shape in shapes])
    line = np.array([SYMMETRY.get(shape, (0, 0.0))[1] for shape in shapes])
    angle = mirrors.angles(rotations + line)
    out = np.zeros((len(shapes), 2 * len(ORDERS)))
    for k, n in enumerate(ORDERS):
        out[:, 2 * k] = np.where(order == n, np.cos(n * angle), 0.0)
        out[:, 2 * k + 1] = np.where(order == n, np.sin(n * angle), 0.0)
    return out


def targets(module: str, presses: Presses) -> tuple[np.ndarray, np.ndarray]:
    """What the module is to say, (presses, values), and of which presses it can."""
    labels, every = presses.dataset.labels, np.ones(len(presses.source), dtype=bool)
    if module == "position":
        return presses.mirrors.vectors(presses.dataset.shifts[presses.source]), every
    if module == "orientation":
        rotations = labels["rotation"][presses.source]
        return orientation_targets(presses.shapes, rotations, presses.mirrors), every
    own = np.where(presses.shapes == "disc", DISC_RADIUS / _HALF_BOX, 1.0)
    return np.log(labels["size"][presses.source] * own)[:, None], presses.shapes != "sphere"


def main(config: Config) -> None:
    """Fit, test on presses held out, write."""
    lesson = Lesson.begin(config)
    wanted, known = targets(config.module, lesson.presses)
    train, test = lesson.train(known), lesson.test(known)
    mean, scale = wanted[train].mean(axis=0), np.full(wanted.shape[1], _SCALE[config.module])
    network = perceptron([lesson.inputs, *[config.width] * config.depth, POSE_KINDS[config.module]])
    scaled = torch.tensor(((wanted - mean) / scale).astype(np.float32))

    def loss_of(found: torch.Tensor, index: torch.Tensor, size: torch.Tensor) -> torch.Tensor:
        return torch.nn.functional.smooth_l1_loss(found, scaled[index], beta=0.05)

    seconds = fit(network, lesson.looker, train, loss_of, lesson.schedule, label=config.module)
    with torch.no_grad():
        for noise in (0.0, 0.01):
            error = (network(lesson.noisy_features(test, noise)) - scaled[test]).numpy() * scale
            print(f"{config.module}, noise {noise:g}: mean error {np.linalg.norm(error, axis=1).mean():.3g}")
    arrays = {**perceptron_arrays(network, config.module), "target mean": mean, "target scale": scale}
    lesson.write(f"{config.module}.safetensors", config.module, arrays, seconds)


if __name__ == "__main__":
    run_script(main, Config, __doc__)
