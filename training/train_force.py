"""Train the force recogniser: direction, magnitude and where the force acts, each with its standard deviation.

    python training/train_force.py --data build/presses --weights build/weights/all
    python training/train_force.py --data build/presses --weights build/weights/all \
        --start build/weights/all/force.safetensors --steps 6000 --rate 5e-4 --quiet 0.7 --seed 5 [--favour disc]

Maximum likelihood of normal distributions whose widths the network names too (Nix and Weigend, 1994): where the
readings say little, it says so, and hard presses do not drown easy ones.
The second call goes on from the first with most presses quiet: what noise hides is learnt last.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from arguments import run_script
from lesson import Lesson, LessonConfig

from mjtactile.errors import RecognitionError
from mjtactile.recognition.estimator import Estimator
from mjtactile.recognition.force import ForceRecogniser
from mjtactile.recognition.network import Network
from mjtactile.recognition.symmetry import Mirrors
from mjtactile.recognition.training.fitting import fit, perceptron, perceptron_arrays, set_weights
from mjtactile.recognition.training.presses import Presses
from mjtactile.recognition.weight_files import read_weights

#: Typical errors, by which outputs are scaled: tangential over pressing force, position [m], logarithm of the force.
_SCALE = np.array([0.1, 0.1, 2e-4, 2e-4, 0.1], dtype=np.float32)


@dataclass(frozen=True, kw_only=True)
class Config(LessonConfig):
    """Arguments."""

    width: int = 512  #: of the hidden layers
    depth: int = 3  #: hidden layers
    steps: int = 16000  #: batches
    rate: float = 1.5e-3  #: largest learning rate
    favour: str | None = None  #: a shape that half of the presses learnt from are of
    start: Path | None = None  #: a force recogniser's file to begin with; otherwise at random
    seed: int = 1  #: of weights, batches and noise


def targets(presses: Presses) -> np.ndarray:
    """What the network is to say, (presses, 5); the last is the logarithm of the pressing force [N], size apart."""
    force, position = presses.forces, presses.positions
    pressing = -force[:, 2]
    return np.column_stack([force[:, :2] / pressing[:, None], position, np.log(pressing)]).astype(np.float32)


def main(config: Config) -> None:
    """Fit, test on presses held out, write.

    Raises:
        RecognitionError: no press is of the shape that is favoured.
    """
    lesson = Lesson.begin(config)
    wanted, train = targets(lesson.presses), lesson.train()
    favoured = train[lesson.presses.shapes[train] == config.favour]
    if config.favour is not None and not len(favoured):
        known = ", ".join(sorted(set(lesson.presses.shapes[train].tolist())))
        raise RecognitionError(
            f"--favour {config.favour}: no press learnt from is of that shape. Leave it out, or favour one of {known}."
        )
    clean_size = np.linalg.norm(lesson.presses.projected, axis=1)
    mean = wanted[train].mean(axis=0)
    mean[4] = (wanted[train, 4] - np.log(clean_size[train])).mean()
    network = perceptron([lesson.inputs, *[config.width] * config.depth, 10])
    before = None
    if config.start is not None:
        before = read_weights(config.start)
        set_weights(network, Network.from_arrays(before.arrays, "force"))
    all_targets, scale = torch.tensor(wanted - mean), torch.tensor(_SCALE)

    def loss_of(outputs: torch.Tensor, index: torch.Tensor, size: torch.Tensor) -> torch.Tensor:
        target = all_targets[index].clone()
        target[:, 4] -= size.log()
        deviation = outputs[:, 5:].clamp(-8.0, 4.0)
        return (0.5 * ((outputs[:, :5] - target / scale) * (-deviation).exp()) ** 2 + deviation).mean()

    pool = train if config.favour is None else np.concatenate([train, np.resize(favoured, len(train))])
    seconds = fit(network, lesson.looker, pool, loss_of, lesson.schedule, label="force")
    arrays = {**perceptron_arrays(network, "force"), "target mean": mean, "target scale": _SCALE}
    lesson.write("force.safetensors", "force", arrays, seconds, before=before and before.metadata["config"])
    report(ForceRecogniser(lesson.view, Estimator.from_arrays(arrays, "force")), lesson.presses)


def report(recogniser: ForceRecogniser, presses: Presses) -> None:
    """Errors on presses held out, without noise and with 1 %."""
    rng = np.random.default_rng(0)
    test = np.flatnonzero(presses.held_out)
    force, position = presses.forces[test], presses.positions[test]
    # The presses were mirrored into the octant before.
    unmirrored = Mirrors(*[np.zeros(len(test), dtype=bool)] * 3)
    magnitude = np.linalg.norm(force, axis=1)
    tilted = force[:, 2] > -np.cos(np.radians(3.0)) * magnitude
    for noise in (0.0, 0.01):
        sigma = noise * presses.peak[test, None]
        noisy = presses.projected[test] + sigma * rng.standard_normal(presses.projected[test].shape)
        outside = recogniser.view.parts.shape[0] - recogniser.view.parts.shape[1]
        left = presses.energy[test] - (presses.projected[test] ** 2).sum(axis=1) + outside * sigma[:, 0] ** 2
        seen = recogniser.view.seen(noisy.astype(np.float32), left.astype(np.float32), unmirrored)
        found = recogniser.from_seen(seen, (len(test),))
        cosine = np.einsum("ij,ij->i", found.force, force) / magnitude / found.magnitude
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        where = np.linalg.norm(found.position - position, axis=1)
        print(
            f"noise {noise:g}: direction median {np.median(angle[tilted]):.3f} deg above 3, mean {angle.mean():.3f}; "
            f"magnitude mean {np.abs(found.magnitude - magnitude).mean() / 9.80665e-3:.3f} gf; "
            f"position mean {where.mean() * 1e6:.1f} um"
        )
        for shape in sorted(set(presses.shapes[test])):
            one = presses.shapes[test] == shape
            print(
                f"    {shape:9s} {np.median(angle[one & tilted]):.3f} deg, "
                f"{np.abs(found.magnitude / magnitude - 1)[one].mean():.3%}, {where[one].mean() * 1e6:.1f} um, "
                f"named deviation {np.degrees(np.median(found.direction_deviation[one])):.3f} deg"
            )


if __name__ == "__main__":
    run_script(main, Config, __doc__)
