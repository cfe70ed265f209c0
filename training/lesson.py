"""What the training scripts share: presses as the view sees them, and how a module is written and entered."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mjtactile.dataset.shapes import SHAPE_NAMES
from mjtactile.dataset.spec import pad_from
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.registry import register
from mjtactile.recognition.training.fitting import Schedule, provenance
from mjtactile.recognition.training.looker import Looker
from mjtactile.recognition.training.presses import Presses, see_presses
from mjtactile.recognition.weight_files import read_weights, write_weights


@dataclass(frozen=True, kw_only=True)
class LessonConfig:
    """Arguments of every script that fits a module to a dataset."""

    data: Path  #: folder of the dataset
    weights: Path  #: folder with the view; where the module is written
    steps: int  #: batches
    batch: int = 512  #: presses in each
    rate: float = 2e-3  #: largest learning rate
    noise: float = 0.06  #: largest noise, over the largest reading; its root is drawn uniformly
    quiet: float = 0.3  #: share of presses without noise
    imperfect: float = 0.15  #: share of presses read by imperfect transducers
    seed: int  #: of weights, batches and noise


@dataclass(frozen=True, eq=False)
class Lesson:
    """Presses to learn from, and the view through which they are seen.

    Attributes:
        config: of the script.
        view: in the folder of weights.
        presses: of the dataset.
        looker: makes batches of them.
    """

    config: LessonConfig
    view: PrincipalComponents
    presses: Presses
    looker: Looker

    @classmethod
    def begin(cls, config: LessonConfig) -> Lesson:
        """Seed torch, and look at a dataset through the view in the folder of weights."""
        torch.manual_seed(config.seed)
        view = stored_view(config.weights)
        presses = see_presses(config.data, view)
        return cls(config, view, presses, Looker(presses, view, torch.Generator().manual_seed(config.seed)))

    @property
    def inputs(self) -> int:
        """Features of a press."""
        return self.view.parts.shape[1] + 1

    @property
    def schedule(self) -> Schedule:
        """The schedule that the arguments ask for."""
        config = self.config
        return Schedule(
            steps=config.steps,
            batch=config.batch,
            rate=config.rate,
            noise=config.noise,
            quiet=config.quiet,
            imperfect=config.imperfect,
        )

    def train(self, known: np.ndarray | None = None) -> np.ndarray:
        """Indices of presses to learn from, of those in `known` (presses,) bool, by default of all."""
        return np.flatnonzero(~self.presses.held_out & (True if known is None else known))

    def test(self, known: np.ndarray | None = None) -> np.ndarray:
        """Indices of presses held out, as in `train`."""
        return np.flatnonzero(self.presses.held_out & (True if known is None else known))

    def noisy_features(self, index: np.ndarray, noise: float) -> torch.Tensor:
        """Features of some presses (n, inputs), all under the same noise."""
        return self.looker.features(torch.tensor(index), torch.full((len(index),), noise))[0]

    def write(self, file: str, kind: str, arrays: dict[str, np.ndarray], seconds: float, **about: Any) -> None:
        """Write a module, and enter it in the registry."""
        write_module(self.config, file, kind, self.view.layers, arrays, self.presses.dataset.metadata, seconds, **about)


def shape_name(shape: str) -> str:
    """What a recogniser calls a shape of dataset/shapes.py, or a mesh file: the latter as its file."""
    return shape if shape in SHAPE_NAMES else Path(shape).stem


def stored_view(weights: Path) -> PrincipalComponents:
    """The view in a folder of weights."""
    return PrincipalComponents.from_stored(read_weights(weights / "view.safetensors"))


def write_module(
    config: Any,
    file: str,
    kind: str,
    layers: tuple[int, ...],
    arrays: dict[str, np.ndarray],
    dataset: dict[str, Any],
    seconds: float,
    *,
    optional: bool = False,
    **about: Any,
) -> None:
    """Write a module with how it was made, and enter it in the registry.

    Args:
        config: dataclass of the script's arguments, with the folder `weights`.
        file: name in that folder.
        kind: of module, see registry.py.
        layers: sensing layers it looks at.
        arrays: weights by name.
        dataset: metadata of the dataset it learnt from.
        seconds: it took to fit.
        optional: whether it takes part only when asked for.
        about: what else to say of it.
    """
    metadata = {"kind": kind, "layers": layers, **about, **provenance(config, dataset, seconds)}
    write_weights(config.weights / file, arrays, metadata, pad_from(dataset["pad"]))
    register(config.weights, file, optional=optional)
