"""Estimation of wrenches from readings, the common part of force and grasp recognisers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Generic, Self, TypeVar

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.estimator import Estimator
from mjtactile.recognition.familiarity import Familiarity, TaughtPresses
from mjtactile.recognition.features import PrincipalComponents, Seen
from mjtactile.recognition.weight_files import Stored

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class EstimatedWrenches:
    """Wrenches on a pad in the pad frame, as estimated by a network."""

    pressing: Array  #: force into the pad [N], (n,)
    ratio: Array  #: tangential force along x and y over pressing force [-], (n, 2)
    position: Array  #: centre of pressure (x, y) [m], (n, 2)
    #: Moment about the pad's normal through the centre of pressure [N m], (n,); None if not estimated.
    torsion: Array | None
    deviations: Array  #: standard deviations of the network's values, (n, values)
    familiarity: Familiarity | None  #: whether the readings look like what was taught; None if not known

    @property
    def force(self) -> Array:
        """Force on the pad [N], (n, 3); pressing is -z."""
        return np.column_stack([self.ratio * self.pressing[:, None], -self.pressing])

    @property
    def ratio_deviation(self) -> Array:
        """Standard deviation of the ratio, both directions together, (n,) [-]."""
        return np.sqrt((self.deviations[:, :2] ** 2).sum(axis=1))

    @property
    def position_deviation(self) -> Array:
        """Standard deviation of the position, both directions together, (n,) [m]."""
        return np.sqrt((self.deviations[:, 2:4] ** 2).sum(axis=1))

    @property
    def pressing_deviation(self) -> Array:
        """Relative standard deviation of the pressing force [-], (n,)."""
        return self.deviations[:, -1]


@dataclass(frozen=True, eq=False)
class WrenchRecogniser(Generic[Result]):
    """Estimates force and position from readings, and the torsional moment if the network has that output."""

    #: Name of the network in the weights.
    name: ClassVar[str]

    view: PrincipalComponents  #: principal components for the features
    #: Estimates tangential over pressing force (2) [-], position (2) [m], optionally torsional moment over pressing
    #: force [m], and the logarithm of the pressing force over the readings' size.
    estimator: Estimator
    taught: TaughtPresses | None = None  #: presses with which readings are compared; None if the weights have none

    @classmethod
    def from_stored(cls, view: PrincipalComponents, stored: Stored, taught: TaughtPresses | None = None) -> Self:
        """The recogniser in a file of weights."""
        return cls(view, Estimator.from_arrays(stored.arrays, cls.name), taught)

    def __call__(self, readings: np.ndarray) -> Result:
        """Recognise the force of a contact.

        Args:
            readings: (..., layers, rows, columns) [Pa] of the pad the weights belong to.

        Raises:
            RecognitionError: the readings have another shape, contain NaN, or are all zero.
        """
        flat, batch = self.view.checked(readings)
        return self.from_seen(self.view.see(flat), batch)

    def from_seen(self, seen: Seen, batch: tuple[int, ...]) -> Result:
        """Recognise from features that were computed before, of as many readings as the product of their batch axes."""
        values, deviations = self.estimator(seen.features)
        pressing = np.exp(values[:, -1]) * seen.size
        # Each mirror changes the sign of the torsional moment.
        flips = seen.mirrors.x ^ seen.mirrors.y ^ seen.mirrors.swapped
        torsion = np.where(flips, -1.0, 1.0) * values[:, 4] * pressing if values.shape[1] == 6 else None
        ratio, position = seen.mirrors.original(values[:, :2]), seen.mirrors.original(values[:, 2:4])
        familiarity = None if self.taught is None else self.taught(seen, batch)
        return self.result(EstimatedWrenches(pressing, ratio, position, torsion, deviations, familiarity), batch)

    def result(self, found: EstimatedWrenches, batch: tuple[int, ...]) -> Result:
        """Convert the estimates to the recogniser's result, with these batch axes."""
        raise NotImplementedError
