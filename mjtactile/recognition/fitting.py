"""Training, shared by the scripts in training/: presses as recognisers see them, networks, and one way to fit them.

Noise is added to projections, not to readings: the principal parts are orthonormal, so white noise on the taxels is
white noise on them, and what it leaves outside is a chi-squared number. This is several times cheaper and the same.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mjtactile.dataset import Dataset, read_dataset
from mjtactile.dataset_spec import pad_from
from mjtactile.progress import progress_bar
from mjtactile.recognition.octant import Mirrors, into_octant, is_symmetric, mirrored
from mjtactile.recognition.store import RecognitionError
from mjtactile.recognition.view import NOISE_FLOOR, SCALE_FLOOR, View

#: Presses whose middle is this close to the octant's border, in taxels, are learnt on both sides of it.
_BORDER = 0.12


@dataclass(frozen=True, eq=False)
class Presses:
    """Presses in the octant, projected.

    Attributes:
        readings: (presses, layers, rows, columns) [Pa], as mirrored.
        projected: (presses, parts) [Pa].
        energy: sum of squares of all readings (presses,) [Pa^2].
        peak: largest reading (presses,) [Pa].
        dataset: where labels come from.
        source: index into the dataset, (presses,); presses near the border come twice.
        mirrors: how each was mirrored.
        held_out: presses kept for testing (presses,) bool: whole outlines, so that no pose is in both.
    """

    readings: np.ndarray
    projected: np.ndarray
    energy: np.ndarray
    peak: np.ndarray
    dataset: Dataset
    source: np.ndarray
    mirrors: Mirrors
    held_out: np.ndarray

    @property
    def shapes(self) -> np.ndarray:
        """Name of each press's shape."""
        return self.dataset.labels["shape"][self.source]

    @property
    def forces(self) -> np.ndarray:
        """As mirrored, (presses, 3) [N]."""
        return self.mirrors.vectors(self.dataset.forces[self.source])

    @property
    def positions(self) -> np.ndarray:
        """As mirrored, (presses, 2) [m]."""
        return self.mirrors.vectors(self.dataset.positions[self.source])


def fit_view(folder: Path, layers: tuple[int, ...], parts: int) -> tuple[View, dict[str, Any]]:
    """Principal parts of a dataset's readings over their length, and the dataset's metadata.

    Raises:
        RecognitionError: the dataset's pad is not symmetric.
    """
    dataset = read_dataset(folder)
    pad = pad_from(dataset.metadata["pad"])
    if not is_symmetric(pad):
        raise RecognitionError(
            f"a {pad.summary} is not symmetric: recognisers mirror readings into one octant of a square pad with a "
            "square, centred grid of taxels."
        )
    readings = _octants(dataset, layers)[0].reshape(len(dataset.readings), -1)
    unit = readings / np.linalg.norm(readings, axis=1, keepdims=True)
    gram = np.zeros((unit.shape[1],) * 2)
    for chunk in np.array_split(unit, 50):
        gram += chunk.astype(np.float64).T @ chunk
    basis = np.linalg.eigh(gram)[1][:, ::-1][:, :parts].astype(np.float32)
    along = unit @ basis
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    mean, deviation = along.mean(axis=0), along.std(axis=0)
    scale = (1.0 / np.sqrt(deviation**2 + SCALE_FLOOR**2)).astype(np.float32)
    shape = dataset.metadata["reading_shape"]
    return View(basis, mean.astype(np.float32), scale, layers, tuple(shape)), dataset.metadata


def see_presses(folder: Path, view: View, *, most: int | None = None) -> Presses:
    """A dataset as a view sees it.

    Args:
        folder: of the dataset.
        view: what looks at it.
        most: stop reading once there are this many presses; by default all.
    """
    dataset = read_dataset(folder, most=most)
    octant, mirrors = _octants(dataset, view.layers)
    images, source, all_mirrors = [octant], [np.arange(len(octant))], [mirrors]
    for flip, near in _borders(octant):
        images.append(mirrored(octant[near], flip))
        source.append(near)
        all_mirrors.append(Mirrors(mirrors.x[near], mirrors.y[near], mirrors.swapped[near]).then(flip))
    whole = np.concatenate(images)
    readings = whole.reshape(-1, view.parts.shape[0])
    index = np.concatenate(source)
    poses = int(dataset.metadata["spec"]["poses"]) * int(dataset.metadata["spec"]["forces"])
    outline = dataset.labels["press"][index] // poses
    return Presses(
        readings=whole,
        projected=readings @ view.parts,
        energy=np.einsum("ij,ij->i", readings, readings),
        peak=readings.max(axis=1),
        dataset=Dataset(np.zeros(0, dtype=np.float32), dataset.labels, dataset.metadata),
        source=index,
        mirrors=_joined_mirrors(all_mirrors),
        held_out=outline % 40 == 0,
    )


def joined(first: Presses, second: Presses) -> Presses:
    """Presses of two datasets as one; the metadata is the second's."""
    one, other = first.dataset, second.dataset
    labels = {name: np.concatenate([one.labels[name], other.labels[name]]) for name in one.labels}
    arrays = {
        name: np.concatenate([getattr(first, name), getattr(second, name)])
        for name in ("readings", "projected", "energy", "peak", "held_out")
    }
    return Presses(
        **arrays,
        dataset=Dataset(one.readings, labels, other.metadata),
        source=np.concatenate([first.source, second.source + len(one.labels["press"])]),
        mirrors=_joined_mirrors([first.mirrors, second.mirrors]),
    )


class Looker:
    """Batches of features of presses, with fresh noise."""

    def __init__(self, presses: Presses, view: View, generator: torch.Generator) -> None:
        self.readings = torch.tensor(presses.readings)
        self.parts = torch.tensor(view.parts)
        self.projected = torch.tensor(presses.projected)
        self.energy = torch.tensor(presses.energy)
        self.peak = torch.tensor(presses.peak)
        self.mean, self.scale = torch.tensor(view.mean), torch.tensor(view.scale)
        self.outside = view.parts.shape[0] - view.parts.shape[1]
        self.generator = generator

    def features(
        self, index: torch.Tensor, noise: torch.Tensor, imperfect: int = 0
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Features and sizes of some presses.

        Args:
            index: which, (n,).
            noise: standard deviation over the press's largest reading, (n,).
            imperfect: how many of them, the first ones, are read by imperfect transducers.
        """
        clean, energy = self.projected[index], self.energy[index]
        if imperfect:
            flat = self._imperfect(self.readings[index[:imperfect]])
            clean = torch.cat([flat @ self.parts, clean[imperfect:]])
            energy = torch.cat([(flat**2).sum(1), energy[imperfect:]])
        sigma = noise * self.peak[index]
        inside = (clean**2).sum(1)
        left = (energy - inside).clamp_min(0.0)
        # Noise outside the parts: (e + sigma z)^2 summed, with chi-squared z^2 nearly normal for hundreds of taxels.
        z = torch.randn((2, len(index)), generator=self.generator)
        spread = self.outside + (2.0 * self.outside) ** 0.5 * z[0]
        outside = (left + sigma**2 * spread + 2.0 * sigma * left.sqrt() * z[1]).clamp_min(0.0)
        noisy = clean + sigma[:, None] * torch.randn(clean.shape, generator=self.generator)
        size = (noisy**2).sum(1).sqrt()
        level = (outside / self.outside).sqrt() / size
        last = torch.log(level + NOISE_FLOOR) / 1.5 + 5.0
        features = (noisy / size[:, None] - self.mean) * self.scale
        return torch.cat([features, last[:, None]], 1), size

    def _imperfect(self, readings: torch.Tensor) -> torch.Tensor:
        """Readings as arrays of unequal, coupled taxels report them, (n, taxels) [Pa]."""
        spread = torch.rand((2, len(readings), 1, 1, 1), generator=self.generator)
        # Each taxel gives up to 1.5 % to each neighbour, and its gain is off by up to 2 % (standard deviation).
        padded = torch.nn.functional.pad(readings, (1, 1, 1, 1), mode="replicate")
        around = padded[..., 1:-1, 2:] + padded[..., 1:-1, :-2] + padded[..., 2:, 1:-1] + padded[..., :-2, 1:-1]
        coupled = readings + 0.015 * spread[0] * (around - 4.0 * readings)
        gains = 1.0 + 0.02 * spread[1] * torch.randn(readings.shape, generator=self.generator)
        return (coupled * gains).flatten(1)


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """How long and how fast to fit."""

    steps: int  #: batches
    batch: int = 512  #: presses in each
    rate: float = 1.5e-3  #: largest learning rate; rises over the first steps, falls as a cosine
    decay: float = 1e-4  #: of weights, per step and rate
    quiet: float = 0.3  #: share of a batch without noise
    noise: float = 0.015  #: largest standard deviation of noise, over the largest reading
    imperfect: float = 0.15  #: share of a batch read by imperfect transducers


def perceptron(sizes: list[int]) -> torch.nn.Sequential:
    """A fully connected network, silu between its layers; see network.py."""
    layers: list[torch.nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.SiLU()]
    return torch.nn.Sequential(*layers[:-1])


def perceptron_arrays(network: torch.nn.Module, name: str) -> dict[str, np.ndarray]:
    """A perceptron's weights by the names `Network.from_arrays` expects, half precision."""
    linear = [layer for layer in network.modules() if isinstance(layer, torch.nn.Linear)]
    arrays: dict[str, np.ndarray] = {}
    for k, layer in enumerate(linear):
        arrays[f"{name} weights {k}"] = layer.weight.detach().numpy().T.astype(np.float16)
        arrays[f"{name} biases {k}"] = layer.bias.detach().numpy().astype(np.float32)
    return arrays


def fit(
    network: torch.nn.Module,
    looker: Looker,
    train: np.ndarray,
    loss_of: Callable[[torch.Tensor, torch.Tensor, torch.Tensor], torch.Tensor],
    schedule: Schedule,
    *,
    label: str,
) -> float:
    """Fit a network by AdamW on noisy presses.

    Args:
        network: features to outputs.
        looker: makes features.
        train: which presses.
        loss_of: (outputs, index of the presses, their sizes) to the loss.
        schedule: how long.
        label: for the progress bar.

    Returns:
        seconds it took.
    """
    start, generator = time.perf_counter(), looker.generator
    pool = torch.tensor(train)
    optimiser = torch.optim.AdamW(network.parameters(), lr=schedule.rate, weight_decay=schedule.decay)
    with progress_bar(label, schedule.steps) as advance:
        for step in range(schedule.steps):
            along = step / schedule.steps
            rate = schedule.rate * min(1.0, (step + 1) / 300) * 0.5 * (1.0 + np.cos(np.pi * along))
            for group in optimiser.param_groups:
                group["lr"] = rate + 1e-7
            index = pool[torch.randint(len(pool), (schedule.batch,), generator=generator)]
            drawn = torch.rand((2, schedule.batch), generator=generator)
            noise = torch.where(drawn[0] < schedule.quiet, 0.0, drawn[1] * schedule.noise)
            features, size = looker.features(index, noise, int(schedule.imperfect * schedule.batch))
            loss = loss_of(network(features), index, size)
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            optimiser.step()
            advance(1)
    return time.perf_counter() - start


def rate(right: np.ndarray) -> str:
    """How many of some answers are right, in words."""
    return f"{right.mean():.2%} of {len(right)}" if len(right) else "none asked"


def provenance(config: Any, dataset: dict[str, Any], seconds: float) -> dict[str, Any]:
    """What is written beside weights: configuration, versions, and the presses they come from."""
    import platform

    import mujoco

    from mjtactile import __version__

    return {
        "config": {name: value for name, value in asdict(config).items() if not isinstance(value, Path)},
        "dataset": {"spec_fingerprint": dataset["spec_fingerprint"], "spec": dataset["spec"]},
        "versions": {
            "mjtactile": __version__,
            "mujoco": mujoco.mj_versionString(),
            "numpy": np.__version__,
            "torch": torch.__version__,
            "python": platform.python_version(),
        },
        "training_seconds": round(seconds, 1),
    }


def _joined_mirrors(mirrors: list[Mirrors]) -> Mirrors:
    return Mirrors(*(np.concatenate([getattr(one, name) for one in mirrors]) for name in ("x", "y", "swapped")))


def _octants(dataset: Dataset, layers: tuple[int, ...]) -> tuple[np.ndarray, Mirrors]:
    return into_octant(np.ascontiguousarray(dataset.readings[:, list(layers)]))


def _borders(octant: np.ndarray) -> list[tuple[Mirrors, np.ndarray]]:
    """For presses near the octant's two borders, the mirror across it, and which presses."""
    total = octant.sum(axis=1)
    weight = total.sum(axis=(1, 2))
    middle = (octant.shape[-1] - 1) / 2
    x = total.sum(axis=1) @ (np.arange(octant.shape[-1]) - middle) / weight
    y = total.sum(axis=2) @ (np.arange(octant.shape[-1]) - middle) / weight
    below, across = np.flatnonzero(y < _BORDER), np.flatnonzero(x - y < _BORDER)
    none = [np.zeros(len(near), dtype=bool) for near in (below, across)]
    return [
        (Mirrors(none[0], ~none[0], none[0]), below),
        (Mirrors(none[1], none[1], ~none[1]), across),
    ]
