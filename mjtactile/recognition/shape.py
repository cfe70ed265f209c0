"""What shape presses: one module for each shape, all looking at the same view and the same pose.

Every shape's module is a network of its own, which says how much the readings look like its shape. The largest wins;
their softmax is the confidence. A new shape is a new module, trained against the others as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.features import PrincipalComponents, Seen
from mjtactile.recognition.network import Network, silu
from mjtactile.recognition.pose import PoseModule, rotation_of
from mjtactile.recognition.weight_files import RecognitionError, Stored


@dataclass(frozen=True, eq=False)
class ShapeResult:
    """What shape presses, and where; batch axes as those of the readings.

    Attributes:
        shape: name, a str array of the batch's shape.
        confidence: probability of that shape among those known, (...).
        probabilities: of every shape, (..., shapes), in the order of `shapes`.
        shapes: names of all shapes among which it was chosen.
        position: of the shape's origin, (..., 2) [m].
        size: relative to the shape's own, 1 for the paper's 10 mm punches, (...) [-]; NaN for a sphere.
        rotation: counter-clockwise, from 0 to a full turn over the order of the shape's symmetry, (...) [rad]; NaN for
            round shapes.
        modules: which module said what: "position", "size", "orientation" and "shape NAME" for every shape it was
            chosen among, with their files; `recognition.modules()` tells more of each.
    """

    shape: np.ndarray
    confidence: Array
    probabilities: Array
    shapes: tuple[str, ...]
    position: Array
    size: Array
    rotation: Array
    modules: dict[str, str]


@dataclass(frozen=True, eq=False)
class ShapeModule:
    """One shape's own network: inputs to how much it looks like this shape.

    Attributes:
        shape: name.
        network: inputs, of `shape_inputs`, to one number.
        path: name of the file it comes from.
    """

    shape: str
    network: Network
    path: str

    @classmethod
    def from_stored(cls, stored: Stored) -> ShapeModule:
        """The module in a file of weights."""
        return cls(stored.metadata["shape"], Network.from_arrays(stored.arrays, "shape"), stored.path.name)


def shape_inputs(seen: Seen, poses: Sequence[np.ndarray]) -> np.ndarray:
    """What shape modules take: a view's features and the pose modules' scaled values, (readings, inputs)."""
    return np.concatenate([seen.features, *poses], axis=1)


class ModuleStack:
    """Networks of the same sizes as one: a call costs what one wide network does."""

    def __init__(self, modules: Sequence[ShapeModule]) -> None:
        self._groups: list[tuple[list[int], list[np.ndarray], list[np.ndarray]]] = []
        sizes: dict[tuple[tuple[int, ...], ...], list[int]] = {}
        for k, module in enumerate(modules):
            sizes.setdefault(tuple(weights.shape for weights in module.network.weights), []).append(k)
        for members in sizes.values():
            networks = [modules[k].network for k in members]
            weights = [np.stack(layer) for layer in zip(*(network.weights for network in networks), strict=True)]
            biases = [np.stack(layer)[:, None] for layer in zip(*(network.biases for network in networks), strict=True)]
            # All first layers as one product.
            weights[0] = np.concatenate(list(weights[0]), axis=1)
            self._groups.append((members, weights, biases))
        self.count = len(modules)

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """How much each reading looks like each module's shape, (readings, modules)."""
        out = np.empty((len(inputs), self.count), dtype=np.float32)
        for members, weights, biases in self._groups:
            hidden = (inputs @ weights[0]).reshape(len(inputs), len(members), -1).swapaxes(0, 1) + biases[0]
            for layer, bias in zip(weights[1:], biases[1:], strict=True):
                hidden = silu(hidden) @ layer + bias
            out[:, members] = hidden[..., 0].T
        return out


@dataclass(frozen=True, eq=False)
class ShapeRecogniser:
    """Readings to shape, position, size and rotation; make one with `recognition.load("shape")`.

    Attributes:
        view: what is looked at.
        poses: position, size and orientation, in this order.
        modules: one for each shape.
        stack: the modules' networks.
    """

    view: PrincipalComponents
    poses: tuple[PoseModule, PoseModule, PoseModule]
    modules: tuple[ShapeModule, ...]
    stack: ModuleStack

    @property
    def shapes(self) -> tuple[str, ...]:
        """Names of all shapes it knows."""
        return tuple(module.shape for module in self.modules)

    def __call__(self, readings: np.ndarray, *, among: Sequence[str] | None = None) -> ShapeResult:
        """Recognise.

        Args:
            readings: (..., layers, rows, columns) [Pa] of the pad the weights belong to.
            among: names of the shapes it can be, where that is known.

        Raises:
            RecognitionError: for another shape of readings, NaN, where nothing presses, or an unknown shape's name.
        """
        flat, batch = self.view.checked(readings)
        return self.from_seen(self.view.see(flat), batch, among)

    def from_seen(self, seen: Seen, batch: tuple[int, ...], among: Sequence[str] | None = None) -> ShapeResult:
        """Recognise what a view has seen already."""
        chosen = self._chosen(among)
        scaled = [module.scaled(seen) for module in self.poses]
        scores = self.stack(shape_inputs(seen, scaled))[:, chosen].astype(np.float64)
        weights = np.exp(scores - scores.max(axis=1, keepdims=True))
        probabilities = weights / weights.sum(axis=1, keepdims=True)
        names = [self.modules[k].shape for k in chosen]
        best = probabilities.argmax(axis=1)
        position = seen.mirrors.original(self.poses[0].values(scaled[0]))
        size = np.exp(self.poses[1].values(scaled[1])[:, 0])
        orientation = self.poses[2].values(scaled[2])
        rotation = np.full(len(best), np.nan)
        for k in np.unique(best):
            here = best == k
            rotation[here] = rotation_of(names[k], orientation, seen.mirrors)[here]
            if names[k] == "sphere":
                size[here] = np.nan
        return ShapeResult(
            shape=np.array(names)[best].reshape(batch),
            confidence=probabilities.max(axis=1).reshape(batch),
            probabilities=probabilities.reshape(*batch, len(names)),
            shapes=tuple(names),
            position=position.reshape(*batch, 2),
            size=size.reshape(batch),
            rotation=rotation.reshape(batch),
            modules={module.kind: module.path for module in self.poses}
            | {f"shape {name}": self.modules[k].path for name, k in zip(names, chosen, strict=True)},
        )

    def _chosen(self, among: Sequence[str] | None) -> list[int]:
        if among is None:
            return list(range(len(self.modules)))
        unknown = [name for name in among if name not in self.shapes]
        if unknown or not among:
            raise RecognitionError(f"among = {list(among)}; expected some of the shapes known: {list(self.shapes)}.")
        return [self.shapes.index(name) for name in among]
