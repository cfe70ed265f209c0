"""Teach the shape recogniser one more shape: trains that shape's module alone, against all others as they are.

    python training/add_shape.py --shape hexagon --weights build/weights/all
    python training/add_shape.py --shape my_tool.stl --weights my_weights

The shape is a name of mjtactile.shapes or a mesh file whose lowest face is flat. Presses of it and of the shapes known
are made the way the other modules' were. Then: mjtactile.recognition.load("shape", folder=..., also=["hexagon"]).
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from arguments import parsed

from mjtactile.dataset import make_dataset
from mjtactile.dataset_spec import DatasetSpec, pad_from, spec_from
from mjtactile.recognition.fitting import Looker, Schedule, fit, provenance, rate, see_presses
from mjtactile.recognition.modules import PoseNetworks, ShapeNetworks
from mjtactile.recognition.registry import read_registry, register, stored_module
from mjtactile.recognition.shape import ShapeModule
from mjtactile.recognition.store import read_weights, write_weights
from mjtactile.recognition.view import View


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    shape: str  #: name of a shape, or a mesh file in metres
    weights: Path  #: folder of the weights to add to
    presses: int = 4000  #: to learn from, half of them of the new shape
    workers: int = 2  #: processes that make presses
    width: int = 96  #: of the module's hidden layers
    steps: int = 1200  #: batches
    batch: int = 512  #: presses in each
    rate: float = 2e-3  #: largest learning rate
    noise: float = 0.015  #: largest noise, over the largest reading
    seed: int = 4  #: of presses, weights, batches and noise


def with_shape(spec: DatasetSpec, config: Config) -> DatasetSpec:
    """The presses the other modules were trained on, fewer, and as many of the new shape."""
    punches = spec.contacts[0]
    others = sum(contact.weight for contact in spec.contacts)
    new = replace(punches, shapes=(config.shape,), weight=others)
    return replace(spec, contacts=(*spec.contacts, new), presses=config.presses, seed=config.seed, poses=8, forces=2)


def main(config: Config) -> None:
    """Press, fit, test on presses held out, write and register one module."""
    start = time.perf_counter()
    torch.manual_seed(config.seed)
    stored = read_weights(config.weights / "view.safetensors")
    view = View.from_stored(stored)
    shape = config.shape if not Path(config.shape).suffix else Path(config.shape).stem
    entries = [
        entry
        for entry in read_registry(config.weights).values()
        if entry.kind == "shape" and entry.name != f"shape {shape}"
    ]
    known = [ShapeModule.from_stored(stored_module(config.weights, entry)) for entry in entries]
    with tempfile.TemporaryDirectory() as scratch:
        spec = with_shape(spec_from(stored.metadata["dataset"]["spec"]), config)
        make_dataset(spec, Path(scratch), workers=config.workers)
        presses = see_presses(Path(scratch), view)
    pressed = time.perf_counter() - start
    names = [module.shape for module in known] + [shape]
    named = np.where(
        presses.shapes == "disc", "circle", np.where(presses.shapes == config.shape, shape, presses.shapes)
    )
    truth = torch.tensor([names.index(name) for name in named])
    poses = PoseNetworks.from_folder(config.weights)
    network = ShapeNetworks(poses, 1, config.width, view.parts.shape[1] + 1 + poses.outputs, known)
    looker = Looker(presses, view, torch.Generator().manual_seed(config.seed))

    def loss_of(scores: torch.Tensor, index: torch.Tensor, size: torch.Tensor) -> torch.Tensor:
        return torch.nn.functional.cross_entropy(scores, truth[index])

    schedule = Schedule(steps=config.steps, batch=config.batch, rate=config.rate, noise=config.noise, decay=1e-2)
    seconds = fit(network, looker, np.flatnonzero(~presses.held_out), loss_of, schedule, label=shape)
    test = np.flatnonzero(presses.held_out)
    with torch.no_grad():
        features, _ = looker.features(torch.tensor(test), torch.full((len(test),), 0.01))
        right = (network(features).argmax(1) == truth[torch.tensor(test)]).numpy()
    own = named[test] == shape
    file = f"shape-{shape}.safetensors"
    about = {
        "kind": "shape",
        "shape": shape,
        "layers": view.layers,
        "against": names[:-1],
        **provenance(config, presses.dataset.metadata, seconds),
    }
    write_weights(config.weights / file, network.arrays(0), about, pad_from(presses.dataset.metadata["pad"]))
    register(config.weights, file, optional=True)
    print(
        f"{shape}: right with 1 % noise on presses held out: {rate(right[own])}, others: {rate(right[~own])}; "
        f"{time.perf_counter() - start:.0f} s, {pressed:.0f} s of it for presses"
    )


if __name__ == "__main__":
    main(parsed(Config, __doc__))
