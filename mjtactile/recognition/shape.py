"""Recognition of a body's shape: one module for each shape, with the same features and pose estimates as inputs.

Each shape has a network of its own that computes a score. The shape with the largest score is the result; the softmax
of the scores is the confidence. A new shape is added as a new module, trained while the others stay fixed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjtactile._types import Array
from mjtactile.errors import RecognitionError, shortened
from mjtactile.recognition.familiarity import Familiarity, TaughtPresses
from mjtactile.recognition.features import PrincipalComponents, Seen
from mjtactile.recognition.network import Network, silu
from mjtactile.recognition.pose import PoseModule, rotation_of
from mjtactile.recognition.weight_files import Stored


@dataclass(frozen=True, eq=False)
class ShapeResult:
    """Shape and pose of a body in the pad frame, with the batch axes of the readings.

    Attributes:
        shape: name of the recognised shape, a str array (...).
        confidence: probability of that shape among `shapes` [-], (...). It compares these with each other, and
            holds for familiar readings only.
        probabilities: probability of every shape [-], (..., shapes), in the order of `shapes`.
        shapes: names of the candidate shapes.
        position: position (x, y) of the shape's origin [m], (..., 2); of a shape that was added, about the middle of
            its face.
        size: size relative to the shape's own, 1 for the 10 mm punches of Aoyagi 2008, (...) [-]; NaN for a sphere.
        rotation: counter-clockwise, from 0 to a full turn divided by the order of the shape's symmetry, (...) [rad];
            NaN for round shapes and for meshes that were added.
        modules: files of the modules that were used, by name: "position", "size", "orientation" and "shape NAME" for
            every candidate; `recognition.modules()` has more on each.
        familiarity: whether the readings look like presses of the training data, and how far they are from them; None
            if the weights do not say: they have no module "familiarity".
    """

    shape: np.ndarray
    confidence: Array
    probabilities: Array
    shapes: tuple[str, ...]
    position: Array
    size: Array
    rotation: Array
    modules: dict[str, str]
    familiarity: Familiarity | None = None


@dataclass(frozen=True, eq=False)
class ShapeModule:
    """The network of one shape, which computes the shape's score."""

    shape: str  #: name of the shape
    network: Network  #: its inputs are those of `shape_inputs`, its output is the score
    path: str  #: name of its file

    @classmethod
    def from_stored(cls, stored: Stored) -> ShapeModule:
        """The module in a file of weights."""
        return cls(stored.metadata["shape"], Network.from_arrays(stored.arrays, "shape"), stored.path.name)


def shape_inputs(seen: Seen, poses: Sequence[np.ndarray]) -> np.ndarray:
    """Inputs of shape modules, (readings, inputs): features and the pose modules' scaled values."""
    return np.concatenate([seen.features, *poses], axis=1)


class ModuleStack:
    """Several networks of the same sizes, evaluated together as fast as one wide network."""

    def __init__(self, modules: Sequence[ShapeModule]) -> None:
        self._groups: list[tuple[list[int], list[np.ndarray], list[np.ndarray]]] = []
        sizes: dict[tuple[tuple[int, ...], ...], list[int]] = {}
        for k, module in enumerate(modules):
            sizes.setdefault(tuple(weights.shape for weights in module.network.weights), []).append(k)
        for members in sizes.values():
            networks = [modules[k].network for k in members]
            weights = [np.stack(layer) for layer in zip(*(network.weights for network in networks), strict=True)]
            biases = [np.stack(layer)[:, None] for layer in zip(*(network.biases for network in networks), strict=True)]
            # The first layers are joined, because one wide product is faster than several narrow ones.
            weights[0] = np.concatenate(list(weights[0]), axis=1)
            self._groups.append((members, weights, biases))
        self.count = len(modules)

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """Scores of all modules, (readings, modules), from `shape_inputs`, (readings, inputs)."""
        out = np.empty((len(inputs), self.count), dtype=np.float32)
        for members, weights, biases in self._groups:
            width = weights[0].shape[1] // len(members)
            hidden = (inputs @ weights[0]).reshape(len(inputs), len(members), width).swapaxes(0, 1) + biases[0]
            for layer, bias in zip(weights[1:], biases[1:], strict=True):
                hidden = silu(hidden) @ layer + bias
            out[:, members] = hidden[..., 0].T
        return out


@dataclass(frozen=True, eq=False)
class ShapeRecogniser:
    """Recognises shape, position, size and rotation of a body; `recognition.load("shape")` makes one.

    Attributes:
        view: principal components for the features.
        poses: modules for position, size and orientation, in this order.
        modules: one module for each shape.
        taught: presses with which readings are compared; None if the weights have none.
    """

    view: PrincipalComponents
    poses: tuple[PoseModule, PoseModule, PoseModule]
    modules: tuple[ShapeModule, ...]
    taught: TaughtPresses | None = None

    @cached_property
    def _stack(self) -> ModuleStack:
        """The modules' networks, evaluated together."""
        return ModuleStack(self.modules)

    @property
    def shapes(self) -> tuple[str, ...]:
        """Names of all shapes that can be recognised."""
        return tuple(module.shape for module in self.modules)

    def __call__(self, readings: np.ndarray, *, among: Sequence[str] | None = None) -> ShapeResult:
        """Recognise the shape of a body and its pose.

        Args:
            readings: (..., layers, rows, columns) [Pa] of the pad the weights belong to.
            among: names of the candidate shapes; by default all.

        Raises:
            RecognitionError: the readings have another shape, contain NaN or are all zero; or a name is unknown or
                given twice.
        """
        flat, batch = self.view.checked(readings)
        return self.from_seen(self.view.see(flat), batch, among)

    def from_seen(self, seen: Seen, batch: tuple[int, ...], among: Sequence[str] | None = None) -> ShapeResult:
        """Recognise from features that were computed before.

        Args:
            seen: the features, of n readings.
            batch: batch axes of the readings; their product is n.
            among: names of the candidate shapes; by default all.

        Raises:
            RecognitionError: a name is unknown or given twice.
        """
        chosen = self._chosen(among)
        scaled = [module.scaled(seen) for module in self.poses]
        scores = self._stack(shape_inputs(seen, scaled))[:, chosen].astype(np.float64)
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
            familiarity=None if self.taught is None else self.taught(seen, batch),
        )

    def _chosen(self, among: Sequence[str] | None) -> list[int]:
        if among is None:
            return list(range(len(self.modules)))
        names = list(among) if isinstance(among, Iterable) else []
        known = all(isinstance(name, str) and name in self.shapes for name in names)
        if not names or not known or len(set(names)) < len(names):
            raise RecognitionError(
                f"among = {shortened(among)}; expected names of known shapes, each once: {list(self.shapes)}."
            )
        return [self.shapes.index(name) for name in names]
