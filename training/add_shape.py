"""Teach the shape recogniser one more shape: trains that shape's module alone, against all others as they are.

    python training/add_shape.py --shape hexagon --weights build/weights/all --data build/presses
    python training/add_shape.py --shape my_tool.stl --weights my_weights

The shape is a name of mjtactile.shapes or a mesh file whose lowest face is flat. Presses of it
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
from mjtactile.recognition.fitting import Looker, Presses, Schedule, fit, joined, provenance, rate, see_presses
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
    data: Path | None = None  #: folder of the dataset the others were trained on; without it the known are pressed anew
    presses: int = 3000  #: of the new shape
    known: int = 24000  #: of the shapes known, from the dataset; a quarter as many where they are pressed anew
    workers: int = 2  #: processes that make presses
    width: int = 96  #: of the module's hidden layers
    steps: int = 1600  #: batches
    batch: int = 512  #: presses in each
    rate: float = 2e-3  #: largest learning rate
    noise: float = 0.015  #: largest noise, over the largest reading
    seed: int = 4  #: of presses, weights, batches and noise


def of_shape(spec: DatasetSpec, config: Config) -> DatasetSpec:
    """Presses of the new shape, made as those of the punches known were."""
    contact = replace(spec.contacts[0], shapes=(config.shape,))
    return replace(spec, contacts=(contact,), presses=config.presses, seed=config.seed, poses=8, forces=2)


def pressed(spec: DatasetSpec, view: View, config: Config) -> Presses:
    """Presses made for this run only."""
    with tempfile.TemporaryDirectory() as scratch:
        make_dataset(spec, Path(scratch), workers=config.workers)
        return see_presses(Path(scratch), view)


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
    spec = spec_from(stored.metadata["dataset"]["spec"])
    if config.data is not None:
        others = see_presses(config.data, view, most=config.known)
    else:
        others = pressed(replace(spec, presses=config.known // 4, seed=config.seed), view, config)
    presses = joined(others, pressed(of_shape(spec, config), view, config))
    seconds_pressing = time.perf_counter() - start
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
    # As many of the new shape as of all others.
    old, new = (np.flatnonzero(~presses.held_out & (of_new == (named == shape))) for of_new in (False, True))
    seconds = fit(network, looker, np.concatenate([old, np.resize(new, len(old))]), loss_of, schedule, label=shape)
    # Half of a batch was the new shape; in use it is one among all, as likely as any.
    network.last_bias.data -= float(np.log(len(known)))
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
        f"{time.perf_counter() - start:.0f} s, {seconds_pressing:.0f} s of it for presses"
    )


if __name__ == "__main__":
    main(parsed(Config, __doc__))
