"""Example presses stored with the weights, for training a new shape without the original dataset.

They are stored as normalised projections with one byte per component, which is precise enough. A few thousand presses
take a few megabytes.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.registry import REGISTRY, read_registry, stored_module
from mjtactile.recognition.training.presses import Presses
from mjtactile.recognition.weight_files import Stored, read_weights

EXAMPLES = "examples.safetensors"


@dataclass(frozen=True, eq=False)
class Examples:
    """Presses that are mirrored into the octant, projected, and divided by the norm of their projection."""

    projected: np.ndarray  #: projections, (presses, parts) [-]
    energy: np.ndarray  #: sum of squares of all readings, (presses,) [-]
    peak: np.ndarray  #: largest reading, (presses,) [-]
    shapes: np.ndarray  #: name of each press's shape, (presses,)
    held_out: np.ndarray  #: whether a press is kept for testing, (presses,) bool
    #: Readings, (presses, layers, rows, columns) [-]. Those of a file are computed from the projections.
    readings: np.ndarray

    @classmethod
    def of(cls, presses: Presses, chosen: np.ndarray) -> Examples:
        """Examples from presses of a dataset, by their indices."""
        size = np.linalg.norm(presses.projected[chosen], axis=1)
        return cls(
            presses.projected[chosen] / size[:, None],
            presses.energy[chosen] / size**2,
            presses.peak[chosen] / size,
            np.asarray(presses.shapes[chosen]).astype(str),
            presses.held_out[chosen],
            presses.readings[chosen] / size[:, None, None, None],
        )

    @classmethod
    def from_stored(cls, stored: Stored, view: PrincipalComponents) -> Examples:
        """Examples from a file written with `arrays`, for the same principal components."""
        arrays = stored.arrays
        projected = arrays["projected"] * arrays["scale"]
        names = np.array(stored.metadata["shapes"])
        own = (len(view.layers), *view.reading_shape[1:])
        return cls(
            projected,
            (projected**2).sum(axis=1) + arrays["left"].astype(np.float32) ** 2,
            arrays["peak"].astype(np.float32),
            names[arrays["shape"]],
            arrays["held out"].astype(bool),
            (projected @ view.parts.T).reshape(-1, *own),
        )

    @property
    def names(self) -> list[str]:
        """Names of the shapes in the examples, sorted."""
        return sorted(set(self.shapes.tolist()))

    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays to be stored, by name; the shape is an index into `names`."""
        scale = np.abs(self.projected).max(axis=0) / 127.0
        left = np.sqrt(np.maximum(self.energy - (self.projected**2).sum(axis=1), 0.0))
        return {
            "projected": np.round(self.projected / scale).astype(np.int8),
            "scale": scale.astype(np.float32),
            "left": left.astype(np.float16),
            "peak": self.peak.astype(np.float16),
            "shape": np.searchsorted(self.names, self.shapes).astype(np.uint8),
            "held out": self.held_out.astype(np.uint8),
        }

    def joined(self, other: Examples) -> Examples:
        """These examples followed by others."""
        return Examples(*(np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(Examples)))


def read_examples(folder: Path, view: PrincipalComponents) -> Examples | None:
    """The examples in a folder of weights; None if there are none."""
    if not (folder / EXAMPLES).is_file():
        return None
    entry = read_registry(folder).get("examples") if (folder / REGISTRY).is_file() else None
    stored = read_weights(folder / EXAMPLES) if entry is None else stored_module(folder, entry)
    return Examples.from_stored(stored, view)


def choose(presses: Presses, count: int, seed: int) -> np.ndarray:
    """Ascending indices of about `count` presses to keep as examples; spheres get a quarter of other shapes' share."""
    names, of = np.unique(presses.shapes, return_inverse=True)
    share = np.where(names == "sphere", 0.25, 1.0)
    rng, chosen = np.random.default_rng(seed), []
    for k, wanted in enumerate(np.round(count * share / share.sum()).astype(int)):
        own = np.flatnonzero(of == k)
        chosen.append(rng.permutation(own)[:wanted])
    return np.sort(np.concatenate(chosen))
