"""Train the shape modules: a network for each shape, all at once against each other, written one file each.

    python training/train_shapes.py --data build/presses --weights build/weights/all

The view and the modules for position, size and orientation are used as they are in that folder. The 3 mm disc counts
as a circle.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from arguments import parsed

from mjtactile.dataset_spec import pad_from
from mjtactile.recognition.fitting import Looker, Schedule, fit, provenance, rate, see_presses
from mjtactile.recognition.modules import PoseNetworks, ShapeNetworks
from mjtactile.recognition.registry import register
from mjtactile.recognition.store import read_weights, write_weights
from mjtactile.recognition.view import View


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    data: Path  #: folder of the dataset
    weights: Path  #: folder with view, position, size and orientation; where the modules are written
    width: int = 96  #: of each module's hidden layers
    steps: int = 12000  #: batches
    batch: int = 512  #: presses in each
    rate: float = 2e-3  #: largest learning rate
    noise: float = 0.015  #: largest noise, over the largest reading
    quiet: float = 0.1  #: share of presses without noise
    seed: int = 3  #: of weights, batches and noise


def main(config: Config) -> None:
    """Fit, test on presses held out, write."""
    torch.manual_seed(config.seed)
    view = View.from_stored(read_weights(config.weights / "view.safetensors"))
    poses = PoseNetworks.from_folder(config.weights)
    presses = see_presses(config.data, view)
    named = np.where(presses.shapes == "disc", "circle", presses.shapes)
    shapes = tuple(sorted(set(named.tolist())))
    truth = torch.tensor([shapes.index(name) for name in named])
    looker = Looker(presses, view, torch.Generator().manual_seed(config.seed))
    network = ShapeNetworks(poses, len(shapes), config.width, view.parts.shape[1] + 1 + poses.outputs)

    def loss_of(scores: torch.Tensor, index: torch.Tensor, size: torch.Tensor) -> torch.Tensor:
        return torch.nn.functional.cross_entropy(scores, truth[index])

    schedule = Schedule(
        steps=config.steps, batch=config.batch, rate=config.rate, noise=config.noise, quiet=config.quiet
    )
    seconds = fit(network, looker, np.flatnonzero(~presses.held_out), loss_of, schedule, label="shapes")
    test = np.flatnonzero(presses.held_out & (presses.shapes != "disc") & (presses.shapes != "sphere"))
    with torch.no_grad():
        for noise in (0.0, 0.01):
            features, _ = looker.features(torch.tensor(test), torch.full((len(test),), noise))
            right = (network(features).argmax(1) == truth[torch.tensor(test)]).numpy()
            each = ", ".join(f"{shape} {rate(right[named[test] == shape])}" for shape in shapes)
            print(f"noise {noise:g}: right on presses held out: {rate(right)}; {each}")
    for k, shape in enumerate(shapes):
        about = {
            "kind": "shape",
            "shape": shape,
            "layers": view.layers,
            "against": [name for name in shapes if name != shape],
            **provenance(config, presses.dataset.metadata, seconds),
        }
        pad = pad_from(presses.dataset.metadata["pad"])
        file = f"shape-{shape}.safetensors"
        write_weights(config.weights / file, network.arrays(k), about, pad)
        register(config.weights, file)


if __name__ == "__main__":
    main(parsed(Config, __doc__))
