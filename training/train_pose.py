"""Train one of the modules for position, size and orientation.

python training/train_pose.py --module size --data build/presses --weights build/weights/all
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from arguments import parsed

from mjtactile.dataset_spec import pad_from
from mjtactile.recognition.fitting import (
    Looker,
    Presses,
    Schedule,
    fit,
    perceptron,
    perceptron_arrays,
    provenance,
    see_presses,
)
from mjtactile.recognition.pose import POSE_KINDS, orientation_targets
from mjtactile.recognition.registry import register
from mjtactile.recognition.store import read_weights, write_weights
from mjtactile.recognition.view import View
from mjtactile.shapes import DISC_RADIUS

#: Typical errors, by which outputs are scaled.
_SCALE = {"position": 1e-3, "size": 0.1, "orientation": 0.5}
#: Half the width of the paper's punches, whose size is 1 [m].
_HALF_BOX = 5e-3


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    module: str  #: position, size or orientation
    data: Path  #: folder of the dataset
    weights: Path  #: folder with the view; where the module is written
    width: int = 128  #: of the hidden layers
    depth: int = 2  #: hidden layers
    steps: int = 5000  #: batches
    batch: int = 512  #: presses in each
    rate: float = 2e-3  #: largest learning rate
    noise: float = 0.015  #: largest noise, over the largest reading
    seed: int = 2  #: of weights, batches and noise


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
    torch.manual_seed(config.seed)
    view = View.from_stored(read_weights(config.weights / "view.safetensors"))
    presses = see_presses(config.data, view)
    wanted, known = targets(config.module, presses)
    train = np.flatnonzero(~presses.held_out & known)
    mean, scale = wanted[train].mean(axis=0), np.full(wanted.shape[1], _SCALE[config.module])
    looker = Looker(presses, view, torch.Generator().manual_seed(config.seed))
    outputs = POSE_KINDS[config.module]
    network = perceptron([view.parts.shape[1] + 1, *[config.width] * config.depth, outputs])
    scaled = torch.tensor(((wanted - mean) / scale).astype(np.float32))

    def loss_of(found: torch.Tensor, index: torch.Tensor, size: torch.Tensor) -> torch.Tensor:
        return torch.nn.functional.smooth_l1_loss(found, scaled[index], beta=0.05)

    schedule = Schedule(steps=config.steps, batch=config.batch, rate=config.rate, noise=config.noise)
    seconds = fit(network, looker, train, loss_of, schedule, label=config.module)
    test = torch.tensor(np.flatnonzero(presses.held_out & known))
    with torch.no_grad():
        for noise in (0.0, 0.01):
            features, _ = looker.features(test, torch.full((len(test),), noise))
            error = (network(features) - scaled[test]).numpy() * scale
            print(f"{config.module}, noise {noise:g}: mean error {np.linalg.norm(error, axis=1).mean():.3g}")
    arrays = {**perceptron_arrays(network, config.module), "target mean": mean, "target scale": scale}
    about = {
        "kind": config.module,
        "layers": view.layers,
        **provenance(config, presses.dataset.metadata, seconds),
    }
    file = f"{config.module}.safetensors"
    write_weights(config.weights / file, arrays, about, pad_from(presses.dataset.metadata["pad"]))
    register(config.weights, file)


if __name__ == "__main__":
    main(parsed(Config, __doc__))
