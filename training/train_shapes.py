"""Train the shape modules: a network for each shape, all at once against each other, written one file each.

    python training/train_shapes.py --data build/presses --weights build/weights/all

The view and the modules for position, size and orientation are used as they are in that folder. The 3 mm disc counts
as a circle. A shape that is a mesh file is called as its file.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from arguments import run_script
from lesson import Lesson, LessonConfig, shape_name

from mjtactile.dataset.shapes import SHAPE_NAMES
from mjtactile.errors import RecognitionError
from mjtactile.recognition.training.examples import EXAMPLES, Examples, choose
from mjtactile.recognition.training.fitting import fit, rate
from mjtactile.recognition.training.shape_networks import PoseNetworks, ShapeNetworks


@dataclass(frozen=True, kw_only=True)
class Config(LessonConfig):
    """Arguments."""

    width: int = 96  #: of each module's hidden layers
    steps: int = 12000  #: batches
    quiet: float = 0.1  #: share of presses without noise
    examples: int = 24000  #: presses kept beside the weights, for shapes that come late
    seed: int = 3  #: of weights, batches and noise


def main(config: Config) -> None:
    """Fit, test on presses held out, write."""
    lesson = Lesson.begin(config)
    poses = PoseNetworks.from_folder(config.weights)
    called = names_of(lesson.presses.shapes)
    named = np.where(called == "disc", "circle", called)
    shapes = tuple(sorted(set(named.tolist())))
    truth = torch.tensor([shapes.index(name) for name in named])
    network = ShapeNetworks(poses, len(shapes), config.width, lesson.inputs + poses.outputs)

    def loss_of(scores: torch.Tensor, index: torch.Tensor, size: torch.Tensor) -> torch.Tensor:
        return torch.nn.functional.cross_entropy(scores, truth[index])

    seconds = fit(network, lesson.looker, lesson.train(), loss_of, lesson.schedule, label="shapes")
    test = lesson.test((lesson.presses.shapes != "disc") & (lesson.presses.shapes != "sphere"))
    with torch.no_grad():
        for noise in (0.0, 0.01, 0.03):
            right = (network(lesson.noisy_features(test, noise)).argmax(1) == truth[test]).numpy()
            each = ", ".join(f"{shape} {rate(right[named[test] == shape])}" for shape in shapes)
            print(f"noise {noise:g}: right on presses held out: {rate(right)}; {each}")
    for k, shape in enumerate(shapes):
        against = [name for name in shapes if name != shape]
        lesson.write(f"shape-{shape}.safetensors", "shape", network.arrays(k), seconds, shape=shape, against=against)
    if config.examples:
        write_examples(lesson, config.examples, called)


def names_of(shapes: np.ndarray) -> np.ndarray:
    """What recognisers call the shapes of presses, (presses,).

    Raises:
        RecognitionError: a mesh file has the name of another shape.
    """
    unique, of = np.unique(shapes, return_inverse=True)
    kinds = unique.tolist()
    names = [shape_name(kind) for kind in kinds]
    for kind, name in zip(kinds, names, strict=True):
        if kind != name and (name in SHAPE_NAMES or names.count(name) > 1):
            raise RecognitionError(
                f"{kind} would be called '{name}', as another shape is. Rename the mesh file, and make the presses "
                "again."
            )
    return np.array(names)[of]


def write_examples(lesson: Lesson, count: int, called: np.ndarray) -> None:
    """Keep some presses beside the weights, with the names of their shapes (presses,).

    Spheres, which look like no punch, are few.
    """
    chosen = choose(lesson.presses, count, lesson.config.seed)
    kept = replace(Examples.of(lesson.presses, chosen), shapes=called[chosen])
    lesson.write(EXAMPLES, "examples", kept.arrays(), 0.0, shapes=kept.names)


if __name__ == "__main__":
    run_script(main, Config, __doc__)
