"""Controllers that close the loop on what was recognised, and on nothing else.

They know no scene: they are told what a recogniser said and answer where to move, or what they believe.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import MjTactileError


class ControlError(MjTactileError, ValueError):
    """A controller that cannot work: no gain, no stiffness, or a force that does not press."""


@dataclass(frozen=True, kw_only=True)
class ForceServo:
    """Moves a springy arm until the recognised force is the commanded one.

    An arm of stiffness k that is in contact presses with k times how far its target lies beyond the surface, so the
    target moves by the share `gain` of (commanded - recognised) / k at each call: an integrator, whose error falls by
    1 - gain a call if k is right and still vanishes if k is off by up to 2 / gain. Before contact the target
    approaches at a constant speed.

    Raises:
        ControlError: for values with which it would not converge.
    """

    stiffness: float  #: of the arm, as far as it is known [N/m]
    gain: float = 0.15  #: share of the error that a call takes away [-]
    approach_speed: float = 0.02  #: speed at which the surface is looked for [m/s]
    largest_step: float = 4e-4  #: the target moves no further than this in a call [m]

    def __post_init__(self) -> None:
        """Refuse an integrator that runs away."""
        if not (
            self.stiffness > 0.0 and 0.0 < self.gain < 1.0 and self.approach_speed > 0.0 and self.largest_step > 0.0
        ):
            raise ControlError(
                f"{self}; expected a positive stiffness, approach speed and largest step, and a gain between 0 and 1."
            )

    def step(self, recognised: npt.ArrayLike | None, commanded: npt.ArrayLike, period: float) -> Array:
        """How far to move the target now.

        Args:
            recognised: force on the pad, pad frame [N], shape (3,); None while nothing is felt.
            commanded: what it is to be [N], shape (3,); it must press, so commanded[2] < 0.
            period: time since the last call [s].

        Returns:
            Displacement of the target, pad frame [m], shape (3,).

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
    """What shape it is, from one recognition after another of the same touch.

    Probabilities of noisy looks at one thing are averaged, as a committee votes; looks are not independent, so they are
    not multiplied.

    Args:
        enough: probability at which it is sure.
        least: looks before it may be sure.
        most: looks after which it settles for the likeliest.
    """

    def __init__(self, *, enough: float = 0.9, least: int = 10, most: int = 60) -> None:
        if not (0.0 < enough <= 1.0 and 1 <= least <= most):
            raise ControlError(
                f"enough {enough}, least {least}, most {most}; expected a probability, and least <= most."
            )
        self.enough, self.least, self.most = enough, least, most
        self.looks = 0
        self._sum: Array | None = None
        self._shapes: tuple[str, ...] = ()

    def look(self, shapes: Sequence[str], probabilities: npt.ArrayLike) -> None:
        """Add one recognition: the shapes it chose among, and the probability of each, (shapes,)."""
        seen = np.asarray(probabilities, dtype=float)
        if self._sum is None:
            self._shapes, self._sum = tuple(shapes), np.zeros(len(seen))
        if tuple(shapes) != self._shapes or seen.shape != self._sum.shape:
            raise ControlError(f"recognised among {list(shapes)}, but among {list(self._shapes)} before. Begin anew.")
        self._sum = self._sum + seen
        self.looks += 1

    @property
    def shape(self) -> str | None:
        """The likeliest shape; None before the first look."""
        return None if self._sum is None else self._shapes[int(self._sum.argmax())]

    @property
    def confidence(self) -> float:
        """Its mean probability [-]; 0 before the first look."""
        return 0.0 if self._sum is None else float(self._sum.max()) / self.looks

    @property
    def settled(self) -> bool:
        """Whether to look no longer."""
        return self.looks >= self.most or (self.looks >= self.least and self.confidence >= self.enough)
