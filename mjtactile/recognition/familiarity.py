"""Whether readings look like those that recognisers were taught.

Networks answer anything with confidence. So some of the presses that they learnt from are stored with the weights as
the view sees them, and readings are compared with the nearest of these (Sun et al. 2022, "Out-of-distribution detection
with deep nearest neighbors"). Components of the view are scaled to like variance, so this is a Mahalanobis distance to
one press. The presses lie on a curved surface of some seven dimensions, of which a distance to their common mean (Lee
et al. 2018) says less.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.recognition.features import Seen
from mjtactile.recognition.weight_files import Stored

#: Number of readings compared at once, so that the distances to all taught presses fill some ten megabytes.
_CHUNK = 500


@dataclass(frozen=True, eq=False)
class Familiarity:
    """How far readings are from what was taught, with the batch axes of the readings.

    Attributes:
        distance: to the nearest taught press, in standard deviations of the view's components, less what the readings'
            noise accounts for, (...) [-].
        limit: distance from which readings count as unfamiliar [-].
        false_alarms: share of presses like the taught ones that are farther than `limit` [-].
    """

    distance: Array
    limit: float
    false_alarms: float

    @property
    def familiar(self) -> Mask:
        """Whether readings look like those that were taught, (...) bool."""
        return self.distance <= self.limit


@dataclass(frozen=True, eq=False)
class TaughtPresses:
    """Some of the presses that recognisers learnt from, with which readings are compared."""

    presses: np.ndarray  #: their first features, (presses, parts) float32
    scale: np.ndarray  #: factor by which the view scales these components, (parts,) float32
    limit: float  #: distance from which readings count as unfamiliar [-]
    false_alarms: float  #: share of presses like the taught ones that are farther [-]

    @classmethod
    def from_stored(cls, stored: Stored, scale: np.ndarray) -> TaughtPresses:
        """The presses in a file of weights, of a view that scales its components by `scale` (all parts,)."""
        arrays = stored.arrays
        presses = arrays["presses"].astype(np.float32)
        return cls(presses, scale[: presses.shape[1]], arrays["limit"].item(), arrays["false alarms"].item())

    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays to be stored, by the names that `from_stored` expects."""
        return {
            "presses": self.presses.astype(np.float16),
            "limit": np.array(self.limit),
            "false alarms": np.array(self.false_alarms),
        }

    @cached_property
    def _squares(self) -> np.ndarray:
        """Sum of squares of each press's features, (presses,)."""
        return np.einsum("ij,ij->i", self.presses, self.presses)

    def __call__(self, seen: Seen, batch: tuple[int, ...]) -> Familiarity:
        """Compare readings with the taught presses.

        Args:
            seen: features of n readings.
            batch: batch axes of the readings; their product is n.
        """
        return Familiarity(self.distances(seen).reshape(batch), self.limit, self.false_alarms)

    def distances(self, seen: Seen) -> Array:
        """Distances of readings to the nearest taught press, (n,) [-]; see `Familiarity.distance`."""
        parts = self.presses.shape[1]
        nearest = np.empty(len(seen.features))
        for first in range(0, len(nearest), _CHUNK):
            features = seen.features[first : first + _CHUNK, :parts]
            apart = self._squares - 2.0 * (features @ self.presses.T)
            nearest[first : first + _CHUNK] = apart.min(axis=1) + np.einsum("ij,ij->i", features, features)
        # White noise adds its variance to every component; what the projection leaves over says how large it is.
        noise = seen.noise**2 * (self.scale.astype(np.float64) ** 2).sum()
        return np.sqrt(np.maximum(nearest - noise, 0.0) / parts)
