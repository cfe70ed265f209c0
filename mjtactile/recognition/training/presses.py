"""Presses of a dataset for training: mirrored into one octant and projected on principal components."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile.dataset.files import Dataset, read_dataset
from mjtactile.dataset.spec import pad_from
from mjtactile.errors import RecognitionError
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.symmetry import NEEDED, Mirrors, into_octant, is_symmetric, mirrored

#: Presses whose centre is closer than this to the octant's border, in taxels, are used on both sides of it.
_BORDER = 0.12
#: Default number of principal components, where there are enough taxels.
_MOST_PARTS = 256


@dataclass(frozen=True, eq=False)
class Presses:
    """Presses that are mirrored into the octant and projected."""

    readings: np.ndarray  #: mirrored readings, (presses, layers, rows, columns) [Pa]
    projected: np.ndarray  #: projections, (presses, parts) [Pa]
    energy: np.ndarray  #: sum of squares of all readings, (presses,) [Pa^2]
    peak: np.ndarray  #: largest reading, (presses,) [Pa]
    dataset: Dataset  #: the dataset with the labels
    source: np.ndarray  #: index into the dataset, (presses,); presses near the border occur twice
    mirrors: Mirrors  #: how each press was mirrored
    outline: np.ndarray  #: number of each press's outline, (presses,)

    @property
    def held_out(self) -> np.ndarray:
        """Whether a press is kept for testing, (presses,) bool.

        It is the same for all presses of an outline, so that no pose is in both parts.
        """
        return self.outline % 40 == 0

    @property
    def shapes(self) -> np.ndarray:
        """Name of each press's shape, (presses,)."""
        return self.dataset.labels["shape"][self.source]

    @property
    def forces(self) -> np.ndarray:
        """Forces after mirroring [N], (presses, 3)."""
        return self.mirrors.vectors(self.dataset.forces[self.source])

    @property
    def positions(self) -> np.ndarray:
        """Positions after mirroring [m], (presses, 2)."""
        return self.mirrors.vectors(self.dataset.positions[self.source])


def fit_view(
    folder: Path, layers: tuple[int, ...] | None, parts: int | None
) -> tuple[PrincipalComponents, dict[str, Any]]:
    """Principal components of a dataset's normalised readings, and the dataset's metadata.

    Args:
        folder: folder of the dataset.
        layers: indices of the sensing layers to use, 0 at the top; None for all.
        parts: number of components; None for 256, or five sevenths of the taxels of these layers if they are fewer.

    Raises:
        RecognitionError: the dataset's pad is not symmetric, it does not have these layers, or there are not more
            taxels than components.
    """
    dataset = read_dataset(folder)
    pad = pad_from(dataset.metadata["pad"])
    if not is_symmetric(pad):
        raise RecognitionError(
            f"a {pad.summary} is not symmetric: {NEEDED}. Networks of your own may learn from the dataset's readings."
        )
    shape = tuple(dataset.metadata["reading_shape"])
    layers = tuple(range(shape[0])) if layers is None else layers
    if not layers or len(set(layers)) < len(layers) or not set(layers) <= set(range(shape[0])):
        raise RecognitionError(
            f"layers {list(layers)} of a {pad.summary}; expected some of {list(range(shape[0]))}, 0 at the top, each "
            "once."
        )
    taxels = len(layers) * shape[1] * shape[2]
    parts = min(_MOST_PARTS, taxels * 5 // 7) if parts is None else parts
    if not 1 <= parts < taxels:
        raise RecognitionError(
            f"{parts} principal parts of {taxels} taxels; expected at least one and fewer than taxels, because noise "
            "is what parts leave over. Ask for fewer, or for more layers."
        )
    return PrincipalComponents.fitted(_octants(dataset, layers)[0], parts, layers, shape), dataset.metadata


def see_presses(folder: Path, view: PrincipalComponents) -> Presses:
    """Read a dataset, mirror it into the octant and project it."""
    dataset = read_dataset(folder)
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
    return Presses(
        readings=whole,
        projected=readings @ view.parts,
        energy=np.einsum("ij,ij->i", readings, readings),
        peak=readings.max(axis=1),
        dataset=Dataset(np.zeros(0, dtype=np.float32), dataset.labels, dataset.metadata),
        source=index,
        mirrors=_joined_mirrors(all_mirrors),
        outline=dataset.labels["press"][index] // poses,
    )


def _joined_mirrors(mirrors: list[Mirrors]) -> Mirrors:
    return Mirrors(*(np.concatenate([getattr(one, name) for one in mirrors]) for name in ("x", "y", "swapped")))


def _octants(dataset: Dataset, layers: tuple[int, ...]) -> tuple[np.ndarray, Mirrors]:
    return into_octant(np.ascontiguousarray(dataset.readings[:, list(layers)]))


def _borders(octant: np.ndarray) -> list[tuple[Mirrors, np.ndarray]]:
    """For each of the octant's two borders, the mirror across it and the indices of the presses near it."""
    total = octant.sum(axis=1)
    weight = total.sum(axis=(1, 2))
    middle = (octant.shape[-1] - 1) / 2
    x = total.sum(axis=1) @ (np.arange(octant.shape[-1]) - middle) / weight
    y = total.sum(axis=2) @ (np.arange(octant.shape[-1]) - middle) / weight
    below, across = np.flatnonzero(y < _BORDER), np.flatnonzero(x - y < _BORDER)
    none = [np.zeros(len(near), dtype=bool) for near in (below, across)]
    return [(Mirrors(none[0], ~none[0], none[0]), below), (Mirrors(none[1], none[1], ~none[1]), across)]
