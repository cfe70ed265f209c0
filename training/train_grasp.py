"""Train the grasp recogniser: force and torsion of a grasped body on a pad, and their standard deviations.

    python training/train_grasp.py --data build/grasps.npz --weights build/weights/grasp

The view comes from the same readings. Some of these are stored, so that results say whether others look like them.
Noise is added before readings are mirrored into an octant, so that a press whose middle is the pad's is learnt in all
octants that noise may put it into.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np
import torch
from arguments import run_script

from mjtactile._progress import progress_bar
from mjtactile.pad import Pad
from mjtactile.recognition.estimator import Estimator
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.grasp import GRASP_OUTPUTS, GraspRecogniser, grasp_targets
from mjtactile.recognition.registry import register
from mjtactile.recognition.symmetry import into_octant
from mjtactile.recognition.training.familiarity import Comparison, taught_presses
from mjtactile.recognition.training.fitting import perceptron, perceptron_arrays
from mjtactile.recognition.weight_files import write_weights

#: Typical errors, by which outputs are scaled: tangential over pressing force, centre [m], torsion over pressing force
#: [m], logarithm of the pressing force.
_SCALE = np.array([0.1, 0.1, 5e-4, 5e-4, 5e-4, 0.1], dtype=np.float32)


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    data: Path  #: file of grasp_presses.py
    weights: Path  #: folder to write to
    parts: int = 128  #: principal parts that are looked at
    width: int = 192  #: of the hidden layers
    depth: int = 3  #: hidden layers
    steps: int = 3500  #: batches
    batch: int = 256  #: readings in each
    rate: float = 1.5e-3  #: largest learning rate
    noise: float = 0.015  #: largest noise, over the largest reading
    seed: int = 1  #: of weights, batches and noise


def main(config: Config) -> None:
    """Fit, test on presses held out, write."""
    torch.manual_seed(config.seed)
    drawn = np.random.default_rng(config.seed)
    stored = np.load(config.data)
    readings, wrenches = stored["readings"], stored["wrenches"]
    held_out = np.arange(len(readings)) % 20 == 0
    octant = into_octant(readings[~held_out])[0]
    view = fitted_view(octant, config.parts)
    train, scale = np.flatnonzero(~held_out), torch.tensor(_SCALE)
    mean = target_mean(view, readings[train], wrenches[train])
    network = perceptron([config.parts + 1, *[config.width] * config.depth, 2 * GRASP_OUTPUTS])
    optimiser = torch.optim.AdamW(network.parameters(), lr=config.rate, weight_decay=1e-4)
    start = perf_counter()
    with progress_bar("grasp", config.steps) as advance:
        for step in range(config.steps):
            rate = min(1.0, (step + 1) / 300) * 0.5 * (1.0 + np.cos(np.pi * step / config.steps))
            for group in optimiser.param_groups:
                group["lr"] = config.rate * rate + 1e-7
            index = drawn.choice(train, config.batch)
            features, wanted = looked_at(view, readings[index], wrenches[index], config.noise, drawn)
            outputs = network(features)
            deviation = outputs[:, GRASP_OUTPUTS:].clamp(-8.0, 4.0)
            off = outputs[:, :GRASP_OUTPUTS] - (wanted - torch.tensor(mean)) / scale
            loss = (0.5 * (off * (-deviation).exp()) ** 2 + deviation).mean()
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            optimiser.step()
            advance(1)
    arrays = {**perceptron_arrays(network, "grasp"), "target mean": mean, "target scale": _SCALE}
    write(config, view, arrays, perf_counter() - start)
    write_familiarity(config, view, octant)
    report(GraspRecogniser(view, Estimator.from_arrays(arrays, "grasp")), readings, wrenches, held_out)


def fitted_view(octant: np.ndarray, parts: int) -> PrincipalComponents:
    """Principal parts of readings in the octant, over their length, as precise as they are kept."""
    shape = Pad().grid_shape
    view = PrincipalComponents.fitted(octant, parts, tuple(range(shape[0])), shape)
    return replace(view, parts=view.parts.astype(np.float16).astype(np.float32))


def looked_at(
    view: PrincipalComponents, readings: np.ndarray, wrenches: np.ndarray, noise: float, drawn: np.random.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
    """Features (n, parts + 1) of readings with noise, and what is to be said of them (n, outputs)."""
    level = noise * drawn.random(len(readings)) * (drawn.random(len(readings)) > 0.2)
    sigma = (level * readings.reshape(len(readings), -1).max(axis=1)).astype(np.float32)
    noisy = readings + sigma[:, None, None, None] * drawn.standard_normal(readings.shape, dtype=np.float32)
    octant, mirrors = into_octant(noisy)
    flat = octant.reshape(len(octant), -1)
    projected = flat @ view.parts
    seen = view.seen(projected, view.left_over(flat, projected), mirrors)
    wanted = grasp_targets(wrenches)
    wanted[:, :2], wanted[:, 2:4] = mirrors.vectors(wanted[:, :2]), mirrors.vectors(wanted[:, 2:4])
    wanted[mirrors.x ^ mirrors.y ^ mirrors.swapped, 4] *= -1.0
    wanted[:, 5] -= np.log(seen.size)
    return torch.tensor(seen.features), torch.tensor(wanted.astype(np.float32))


def target_mean(view: PrincipalComponents, readings: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """Mean of what is to be said, (outputs,); of vectors zero."""
    size = np.linalg.norm(readings.reshape(len(readings), -1) @ view.parts, axis=1)
    mean = np.zeros(GRASP_OUTPUTS, dtype=np.float32)
    mean[5] = (grasp_targets(wrenches)[:, 5] - np.log(size)).mean()
    return mean


def write(config: Config, view: PrincipalComponents, arrays: dict[str, np.ndarray], seconds: float) -> None:
    """The view and the recogniser, entered in their folder's registry."""
    parts = {"parts": view.parts.astype(np.float16), "mean": view.mean, "scale": view.scale}
    for kind, contents in (("view", parts), ("grasp", arrays)):
        write_one(config, kind, view, contents, seconds)


def write_familiarity(config: Config, view: PrincipalComponents, octant: np.ndarray) -> None:
    """Presses with which readings are compared; each is an outline of its own, for none is in two poses."""
    start = perf_counter()
    taught = taught_presses(octant, np.arange(len(octant)), view, Comparison(noise=config.noise))
    write_one(config, "familiarity", view, taught.arrays(), perf_counter() - start)
    print(f"familiarity: {len(taught.presses)} presses, unfamiliar from {taught.limit:.3f} standard deviations on")


def write_one(
    config: Config, kind: str, view: PrincipalComponents, arrays: dict[str, np.ndarray], seconds: float
) -> None:
    """A module, entered in its folder's registry."""
    about = {
        "layers": view.layers,
        "config": {name: str(value) for name, value in vars(config).items()},
        "seconds": round(seconds, 1),
    }
    write_weights(config.weights / f"{kind}.safetensors", arrays, {"kind": kind, **about}, Pad())
    register(config.weights, f"{kind}.safetensors")


def report(recogniser: GraspRecogniser, readings: np.ndarray, wrenches: np.ndarray, held_out: np.ndarray) -> None:
    """Errors on presses held out, without noise and with 1 %."""
    drawn = np.random.default_rng(0)
    test, true = readings[held_out], wrenches[held_out]
    pressing = -true[:, 2]
    targets = grasp_targets(true)
    for noise in (0.0, 0.01):
        peak = test.reshape(len(test), -1).max(axis=1)[:, None, None, None]
        found = recogniser(test + noise * peak * drawn.standard_normal(test.shape, dtype=np.float32))
        off = np.linalg.norm(found.force[:, :2] - true[:, :2], axis=1) / pressing
        rows = {
            "pressing, relative": np.abs(found.pressing / pressing - 1.0),
            "tangential over pressing": off,
            "centre [mm]": 1e3 * np.linalg.norm(found.centre - targets[:, 2:4], axis=1),
            "torsion over pressing [mm]": 1e3 * np.abs(found.torsion / pressing - targets[:, 4]),
        }
        for name, errors in rows.items():
            print(f"noise {noise:g}: {name}: median {np.median(errors):.4f}, 95 % {np.quantile(errors, 0.95):.4f}")


if __name__ == "__main__":
    run_script(main, Config, __doc__)
