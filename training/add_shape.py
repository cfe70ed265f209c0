"""Teach the shape recogniser one more shape: trains that shape's module alone, against all others as they are.

    python training/add_shape.py --shape hexagon --weights build/weights/all
    python training/add_shape.py --shape my_tool.stl --weights my_weights
    python training/add_shape.py --shape other/star.stl --name my_star --weights my_weights

The shape is a name of dataset/shapes.py or a mesh file whose lowest face is flat. A mesh is called as its file, or by
--name; names of other shapes are refused. Presses of it are made the way the other modules' were; of the shapes known
there are examples beside the weights. Then:
mjtactile.recognition.load("shape", folder=..., also=["hexagon"]).
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from arguments import run_script
from lesson import shape_name, write_module

from mjtactile.dataset.files import make_dataset
from mjtactile.dataset.shapes import SHAPE_NAMES, mesh_digest
from mjtactile.dataset.spec import DatasetSpec, spec_from
from mjtactile.errors import RecognitionError
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.registry import read_registry, stored_module
from mjtactile.recognition.shape import ShapeModule
from mjtactile.recognition.training.addition import KnownModules, NewModule, fit_module, look_at, most_alike
from mjtactile.recognition.training.examples import Examples, read_examples
from mjtactile.recognition.training.fitting import Schedule, rate
from mjtactile.recognition.training.looker import Looker
from mjtactile.recognition.training.presses import see_presses
from mjtactile.recognition.training.shape_networks import PoseNetworks
from mjtactile.recognition.weight_files import read_weights


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    shape: str  #: name of a shape, or a mesh file in metres
    weights: Path  #: folder of the weights to add to
    name: str | None = None  #: what the shape is called; by default its name, or that of its file
    presses: int = 9000  #: of the new shape
    workers: int = 2  #: processes that make presses
    like: int = 2  #: modules known that it begins as
    draws: int = 3  #: looks at every press, each under noise of its own
    steps: int = 4000  #: batches
    batch: int = 512  #: looks in each
    rate: float = 2e-3  #: largest learning rate
    noise: float = 0.06  #: largest noise, over the largest reading; its root is drawn uniformly
    quiet: float = 0.1  #: share of looks without noise
    seed: int = 4  #: of presses, batches and noise

    @property
    def called(self) -> str:
        """Name of the shape."""
        return shape_name(self.shape) if self.name is None else self.name

    @property
    def source(self) -> str:
        """What tells the shape from others: its name in dataset/shapes.py, or the digest of its mesh file."""
        return self.shape if self.shape in SHAPE_NAMES else mesh_digest(self.shape)


def check_name(config: Config) -> None:
    """Check that the shape's name is not that of another one.

    Raises:
        RecognitionError: a standard shape or another one in the registry has the name, or no file can.
        IndenterError: there is no such shape, or its mesh file cannot be read.
    """
    name, source = config.called, config.source
    if not name or Path(name).name != name:
        raise RecognitionError(f"the name {name!r} is that of no file. Choose another with --name, such as my_tool.")
    if name in SHAPE_NAMES and name != source:
        raise RecognitionError(
            f"'{name}' is one of the package's shapes ({', '.join(SHAPE_NAMES)}), and {config.shape} is another. "
            "Choose another name with --name."
        )
    entry = read_registry(config.weights).get(f"shape {name}")
    if entry is None or name == source or not (config.weights / entry.file).exists():
        return
    # Modules made before sources were told may be of this mesh.
    if stored_module(config.weights, entry).metadata.get("source", source) != source:
        raise RecognitionError(
            f"{config.weights} has a shape '{name}' already, which was not made from {config.shape} as it is now. "
            "Choose another name with --name. If the mesh was edited and is to replace that shape, first delete "
            f"{config.weights / entry.file}."
        )


def of_shape(spec: DatasetSpec, config: Config) -> DatasetSpec:
    """Presses of the new shape, made as those of the punches known were."""
    contact = replace(spec.contacts[0], shapes=(config.shape,))
    return replace(spec, contacts=(contact,), presses=config.presses, seed=config.seed)


def pressed(spec: DatasetSpec, view: PrincipalComponents, config: Config) -> tuple[Examples, dict[str, Any]]:
    """Presses made for this run only, and the metadata of their dataset."""
    with tempfile.TemporaryDirectory() as scratch:
        make_dataset(spec, Path(scratch), workers=config.workers)
        presses = see_presses(Path(scratch), view)
    return Examples.of(presses, np.arange(len(presses.source))), presses.dataset.metadata


def fitted(config: Config, examples: Examples, looker: Looker, known: KnownModules) -> NewModule:
    """The new shape's module, fitted to examples that are not held out."""
    generator = looker.generator
    train = torch.tensor(np.flatnonzero(~examples.held_out)).repeat(config.draws)
    index = train[torch.randperm(len(train), generator=generator)]
    drawn = torch.rand((2, len(index)), generator=generator)
    noise = torch.where(drawn[0] < config.quiet, 0.0, drawn[1] ** 2 * config.noise)
    own = torch.tensor(examples.shapes == config.called)
    looks = look_at(looker, index, own, noise, known, imperfect=Schedule.imperfect)
    network = NewModule(most_alike(looks, known.shapes, config.like))
    schedule = Schedule(steps=config.steps, batch=config.batch, rate=config.rate, decay=1e-2)
    fit_module(network, looks, schedule, generator, config.called)
    return network


def report(
    config: Config,
    examples: Examples,
    looker: Looker,
    known: KnownModules,
    network: NewModule,
) -> None:
    """How many presses held out are named right with 1 % noise, of the new shape and of the others."""
    index = torch.tensor(np.flatnonzero(examples.held_out))
    own = torch.tensor(examples.shapes == config.called)
    looks = look_at(looker, index, own, torch.full((len(index),), 0.01), known)
    names = np.array([*(module.shape for module in known.shapes), config.called])
    with torch.no_grad():
        scores = torch.cat([looks.scores, network(looks.inputs)[:, None]], 1)
    truth = np.where(examples.shapes == "disc", "circle", examples.shapes)[examples.held_out]
    right, before = names[scores.argmax(1)] == truth, names[looks.scores.argmax(1)] == truth
    new = looks.own.numpy()
    print(
        f"{config.called}: right with 1 % noise on presses held out: {rate(right[new])}, others: {rate(right[~new])}, "
        f"without the new module {before[~new].mean():.2%}"
    )


def main(config: Config) -> None:
    """Press, fit, write and register one module, and test it on presses held out.

    Raises:
        RecognitionError: the folder holds no weights or no examples, or another shape of that name.
    """
    start = time.perf_counter()
    check_name(config)
    stored = read_weights(config.weights / "view.safetensors")
    view = PrincipalComponents.from_stored(stored)
    examples = read_examples(config.weights, view)
    if examples is None:
        raise RecognitionError(
            f"{config.weights} holds no examples of the shapes known. Make them first: training/train_shapes.py"
        )
    shapes = [
        ShapeModule.from_stored(stored_module(config.weights, entry))
        for entry in read_registry(config.weights).values()
        if entry.kind == "shape" and entry.name != f"shape {config.called}"
    ]
    known = KnownModules(PoseNetworks.from_folder(config.weights), shapes)
    made, metadata = pressed(of_shape(spec_from(stored.metadata["dataset"]["spec"]), config), view, config)
    pressing = time.perf_counter() - start
    examples = examples.joined(replace(made, shapes=np.full(len(made.shapes), config.called)))
    looker = Looker(examples, view, torch.Generator().manual_seed(config.seed))
    network = fitted(config, examples, looker, known)
    seconds = time.perf_counter() - start - pressing
    about = {"shape": config.called, "source": config.source, "against": [module.shape for module in shapes]}
    file = f"shape-{config.called}.safetensors"
    write_module(config, file, "shape", view.layers, network.arrays(), metadata, seconds, optional=True, **about)
    report(config, examples, looker, known, network)
    print(f"{time.perf_counter() - start:.0f} s in all, {pressing:.0f} s of it for presses")


if __name__ == "__main__":
    run_script(main, Config, __doc__)
