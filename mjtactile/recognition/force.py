"""Recognition of a contact's force and position from one set of readings, for any shape of body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.familiarity import Familiarity
from mjtactile.recognition.wrench import EstimatedWrenches, WrenchRecogniser

#: Standard deviation of the direction at which the confidence is one half [rad].
_HALF_TRUSTED = np.radians(3.0)


@dataclass(frozen=True, eq=False)
class ForceResult:
    """Force and position of a contact in the pad frame, with the batch axes of the readings.

    Attributes:
        force: on the pad [N], (..., 3); pressing is -z.
        position: point (x, y) where the force's line of action meets the surface [m], (..., 2).
        confidence: from 0 to 1, (...) [-]; one half if the direction's standard deviation is 3 degrees. It holds for
            familiar readings only.
        direction_deviation: standard deviation of the direction [rad], (...).
        magnitude_deviation: standard deviation of the magnitude [N], (...).
        position_deviation: standard deviation of the position [m], (...).
        familiarity: whether the readings look like presses of the training data, and how far they are from them; None
            if the weights do not say: they have no module "familiarity".
    """

    force: Array
    position: Array
    confidence: Array
    direction_deviation: Array
    magnitude_deviation: Array
    position_deviation: Array
    familiarity: Familiarity | None = None

    @property
    def magnitude(self) -> Array:
        """Magnitude of the force [N], (...)."""
        return np.linalg.norm(self.force, axis=-1)

    @property
    def direction(self) -> Array:
        """Unit vector (..., 3) along the force."""
        return self.force / self.magnitude[..., None]

    @property
    def tilt(self) -> Array:
        """Angle of the force to the pad's inward normal [rad], (...)."""
        return np.arctan2(np.hypot(self.force[..., 0], self.force[..., 1]), -self.force[..., 2])

    @property
    def azimuth(self) -> Array:
        """Direction of the tangential force, from +x towards +y [rad], (...)."""
        return np.arctan2(self.force[..., 1], self.force[..., 0])


class ForceRecogniser(WrenchRecogniser[ForceResult]):
    """Recognises force and position of a contact from readings; `recognition.load("force")` makes one."""

    name = "force"

    def result(self, found: EstimatedWrenches, batch: tuple[int, ...]) -> ForceResult:
        """Convert estimated wrenches to a result with the batch axes of the readings."""
        slant = np.sqrt(1.0 + (found.ratio**2).sum(axis=1))
        # The derivative of the direction by the ratio is 1 / slant across the tilt and 1 / slant^2 along it. The former
        # is the larger, so it gives an upper bound.
        direction_deviation = found.ratio_deviation / slant
        return ForceResult(
            found.force.reshape(*batch, 3),
            found.position.reshape(*batch, 2),
            (1.0 / (1.0 + (direction_deviation / _HALF_TRUSTED) ** 2)).reshape(batch),
            direction_deviation.reshape(batch),
            (found.pressing_deviation * found.pressing * slant).reshape(batch),
            found.position_deviation.reshape(batch),
            found.familiarity,
        )
