"""Modules that estimate position, size and orientation of a shape; shape modules use their results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.features import Seen
from mjtactile.recognition.network import Network
from mjtactile.recognition.symmetry import Mirrors
from mjtactile.recognition.weight_files import Stored

#: Kinds of pose modules, and their numbers of values.
POSE_KINDS = {"position": 2, "size": 1, "orientation": 12}

#: Orders of rotational symmetry in the orientation's values.
ORDERS = (2, 3, 4, 5, 6, 8)
#: Order of each shape's symmetry, and the angle of one of its mirror lines at rotation 0 [rad]; not for round shapes.
SYMMETRY: dict[str, tuple[int, float]] = {
    "ellipse": (2, 0.0),
    "triangle": (3, np.pi / 2),
    "square": (4, 0.0),
    "cross": (4, 0.0),
    "star": (5, np.pi / 2),
    "hexagon": (6, 0.0),
    "octagon": (8, 0.0),
}


@dataclass(frozen=True, eq=False)
class PoseModule:
    """An estimator of position, size or orientation from features.

    A position has the values (x, y) of the shape's origin [m]. A size has one value, the logarithm of the size relative
    to the shape's own. An orientation has two values for each of `ORDERS`, cosine and sine of the order times the angle
    of a mirror line; they are zero for shapes of another order.
    """

    kind: str  #: a key of `POSE_KINDS`
    network: Network  #: maps features to scaled values
    mean: np.ndarray  #: (values,); a value is mean + scale times its scaled value
    scale: np.ndarray  #: (values,)
    path: str  #: name of the file that the module comes from

    @classmethod
    def from_stored(cls, stored: Stored) -> PoseModule:
        """The module in a file of weights."""
        arrays, kind = stored.arrays, stored.metadata["kind"]
        return cls(
            kind, Network.from_arrays(arrays, kind), arrays["target mean"], arrays["target scale"], stored.path.name
        )

    def scaled(self, seen: Seen) -> np.ndarray:
        """Scaled values in the octant, (readings, values), the inputs of shape modules."""
        return self.network(seen.features)

    def values(self, scaled: np.ndarray) -> Array:
        """Values in the octant from scaled values, (readings, values)."""
        return scaled.astype(np.float64) * self.scale + self.mean


def rotation_of(shape: str, values: Array, mirrors: Mirrors) -> Array:
    """Rotations of a shape on the pad [rad], (n,), from 0 to a full turn divided by the order of the shape's symmetry.

    Args:
        shape: name of the shape. For shapes that are not in `SYMMETRY`, such as round ones, rotations are NaN.
        values: values of the orientation module, in the octant, (n, 2 orders).
        mirrors: how each reading was mirrored.
    """
    if shape not in SYMMETRY:
        return np.full(len(values), np.nan)
    order, line = SYMMETRY[shape]
    k = ORDERS.index(order)
    angle = np.arctan2(values[:, 2 * k + 1], values[:, 2 * k]) / order
    return np.mod(mirrors.original_angles(angle) - line, 2.0 * np.pi / order)
