"""With what force something presses, and where: from one set of readings, whatever presses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.estimator import Estimator
from mjtactile.recognition.features import PrincipalComponents, Seen
from mjtactile.recognition.symmetry import Mirrors
from mjtactile.recognition.weight_files import Stored

#: A direction known to within this is half trusted [rad].
_HALF_TRUSTED = np.radians(3.0)


@dataclass(frozen=True, eq=False)
class ForceResult:
    """What presses, pad frame; batch axes as those of the readings.

    Attributes:
        force: on the pad, (..., 3) [N]; pressing is -z.
        position: where the force's line meets the surface, (..., 2) [m].
        confidence: from 0 to 1, one half where the direction's standard deviation is 3 degrees [-].
        direction_deviation: standard deviation of the direction [rad].
        magnitude_deviation: of the magnitude [N].
        position_deviation: of the position [m].
    """

    force: Array
    position: Array
    confidence: Array
    direction_deviation: Array
    magnitude_deviation: Array
    position_deviation: Array

    @property
    def magnitude(self) -> Array:
        """Length of the force [N]."""
        return np.linalg.norm(self.force, axis=-1)

    @property
    def direction(self) -> Array:
        """Unit vector (..., 3) along the force."""
        return self.force / self.magnitude[..., None]

    @property
    def tilt(self) -> Array:
        """Angle from straight into the pad [rad]."""
        return np.arctan2(np.hypot(self.force[..., 0], self.force[..., 1]), -self.force[..., 2])

    @property
    def azimuth(self) -> Array:
        """Of the tilt, from +x towards +y [rad]."""
        return np.arctan2(self.force[..., 1], self.force[..., 0])


@dataclass(frozen=True, eq=False)
class ForceRecogniser:
    """Readings to force and position; make one with `recognition.load("force")`.

    Attributes:
        view: what is looked at.
        estimator: of tangential over pressing force (2), position (2) [m] and the logarithm of the pressing force over
            the readings' size.
    """

    view: PrincipalComponents
    estimator: Estimator

    @classmethod
    def from_stored(cls, view: PrincipalComponents, stored: Stored) -> ForceRecogniser:
        """The recogniser in a file of weights."""
        return cls(view, Estimator.from_arrays(stored.arrays, "force"))

    def __call__(self, readings: np.ndarray) -> ForceResult:
        """Recognise.

        Args:
            readings: (..., layers, rows, columns) [Pa] of the pad the weights belong to.

        Raises:
            RecognitionError: for another shape, NaN, or where nothing presses.
        """
        flat, batch = self.view.checked(readings)
        return self.from_seen(self.view.see(flat), batch)

    def from_seen(self, seen: Seen, batch: tuple[int, ...]) -> ForceResult:
        """Recognise what a view has seen already."""
        values, deviations = self.estimator(seen.features)
        pressing = np.exp(values[:, 4]) * seen.size
        ratio = seen.mirrors.original(values[:, :2])
        position = seen.mirrors.original(values[:, 2:4])
        slant = np.sqrt(1.0 + (ratio**2).sum(axis=1))
        force = np.column_stack([ratio * pressing[:, None], -pressing])
        # d(direction) of d(ratio): across the tilt 1 / slant, along it 1 / slant^2; both at most that across.
        direction_deviation = np.sqrt((deviations[:, :2] ** 2).sum(axis=1)) / slant
        return ForceResult(
            force.reshape(*batch, 3),
            position.reshape(*batch, 2),
            (1.0 / (1.0 + (direction_deviation / _HALF_TRUSTED) ** 2)).reshape(batch),
            direction_deviation.reshape(batch),
            (deviations[:, 4] * pressing * slant).reshape(batch),
            np.sqrt((deviations[:, 2:4] ** 2).sum(axis=1)).reshape(batch),
        )

    def from_projected(self, projected: np.ndarray, left: np.ndarray) -> ForceResult:
        """Recognise projections (n, parts) in the octant; `left` (n,) are the squares their readings have besides."""
        none = np.zeros(len(projected), dtype=bool)
        return self.from_seen(self.view.seen(projected, left, Mirrors(none, none, none)), (len(projected),))
