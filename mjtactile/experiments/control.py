"""Controllers that use the results of recognition only.

They have no access to the scene: their inputs are recognised values, their outputs displacements or beliefs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import ControlError


@dataclass(frozen=True, kw_only=True)
class ForceServo:
    """Moves a compliant arm until the recognised force equals the commanded one.

    In contact, an arm of stiffness k presses with k times the distance of its target behind the surface. The target
    moves by `gain` times (commanded - recognised) / k at each call. With the correct k, this integrator multiplies the
    error by 1 - gain at each call. It converges as long as the true stiffness is below 2 / gain times the assumed one.
    Before contact, the target approaches at a constant speed.

    Raises:
        ControlError: the servo would not converge with these values.
    """

    stiffness: float  #: estimated stiffness of the arm [N/m]
    gain: float = 0.15  #: fraction of the error that is corrected per call [-]
    approach_speed: float = 0.02  #: speed before contact [m/s]
    largest_step: float = 4e-4  #: largest displacement of the target per call [m]

    def __post_init__(self) -> None:
        if not (
            self.stiffness > 0.0 and 0.0 < self.gain < 1.0 and self.approach_speed > 0.0 and self.largest_step > 0.0
        ):
            raise ControlError(
                f"{self}; expected a positive stiffness, approach speed and largest step, and a gain between 0 and 1."
            )

    def step(self, recognised: npt.ArrayLike | None, commanded: npt.ArrayLike, period: float) -> Array:
        """The next displacement of the target, pad frame [m], shape (3,).

        Args:
            recognised: force on the pad, pad frame [N], shape (3,); None without contact.
            commanded: desired force on the pad [N], shape (3,); it must press (commanded[2] < 0).
            period: time since the last call [s].

        Raises:
            ControlError: the commanded force does not press.
        """
        wanted = np.asarray(commanded, dtype=float)
        if wanted.shape != (3,) or not np.isfinite(wanted).all() or wanted[2] >= 0.0:
            raise ControlError(f"commanded force {commanded}; expected three finite numbers [N] with force[2] < 0.")
        if recognised is None:
            return np.array([0.0, 0.0, -self.approach_speed * period])
        move = self.gain * (wanted - np.asarray(recognised, dtype=float)) / self.stiffness
        length = float(np.linalg.norm(move))
        return move if length <= self.largest_step else move * (self.largest_step / length)


class ShapeBelief:
    """Belief about a shape from a sequence of recognitions of the same contact.

    Probabilities are averaged, not multiplied, because successive recognitions are not independent.

    Args:
        enough: mean probability at which the belief is settled [-].
        least: least number of recognitions.
        most: number of recognitions after which the belief is settled in any case.

    Raises:
        ControlError: an argument is out of range.
    """

    def __init__(self, *, enough: float = 0.9, least: int = 10, most: int = 60) -> None:
        if not (0.0 < enough <= 1.0 and 1 <= least <= most):
            raise ControlError(
                f"enough = {enough}, least = {least}, most = {most}; expected 0 < enough <= 1, and 1 <= least <= most."
            )
        self.enough, self.least, self.most = enough, least, most
        self.looks = 0  #: number of recognitions so far
        self._sum: Array | None = None
        self._shapes: tuple[str, ...] = ()

    def look(self, shapes: Sequence[str], probabilities: npt.ArrayLike) -> None:
        """Add one recognition: probabilities [-], (shapes,), of the candidate shapes, which are the same at every call.

        Raises:
            ControlError: the candidates differ from those of earlier calls.
        """
        seen = np.asarray(probabilities, dtype=float)
        if self._sum is None:
            self._shapes, self._sum = tuple(shapes), np.zeros(len(seen))
        if tuple(shapes) != self._shapes or seen.shape != self._sum.shape:
            raise ControlError(
                f"recognised among {list(shapes)}, but among {list(self._shapes)} before. Begin with a new ShapeBelief."
            )
        self._sum = self._sum + seen
        self.looks += 1

    @property
    def shape(self) -> str | None:
        """The most probable shape; None before the first recognition."""
        return None if self._sum is None else self._shapes[int(self._sum.argmax())]

    @property
    def confidence(self) -> float:
        """Mean probability of that shape [-]; 0 before the first recognition."""
        return 0.0 if self._sum is None else float(self._sum.max()) / self.looks

    @property
    def settled(self) -> bool:
        """Whether no further recognition is needed."""
        return self.looks >= self.most or (self.looks >= self.least and self.confidence >= self.enough)
