"""Force and shape, recognised on pads under punches."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.grasp.known import PadLoads
from mjtactile.experiments.grasp.touch import CONTACT_THRESHOLD, read_pads
from mjtactile.experiments.hands.gripper import GRIPPER_PADS
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.pad import Pad
from mjtactile.recognition import ForceRecogniser, ShapeRecogniser, load


class PunchTouch:
    """Readings of pads that punches press on, as the shipped recognisers of force and shape understand them.

    Args:
        noise: standard deviation of white noise over a pad's largest reading [-].
        seed: of the noise.
        weights: folder of the recognisers' weights; by default those shipped.
    """

    reads = True

    def __init__(self, *, noise: float, seed: tuple[int, ...], weights: str | None = None) -> None:
        self._force, self._shape = punch_recognisers(weights)
        self._noise, self._drawn = noise, np.random.default_rng(seed)

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> PadLoads:
        """What is recognised; the pads must have been read in this step."""
        readings = read_pads(data, self._noise, self._drawn)
        pads = len(GRIPPER_PADS)
        felt = PadLoads(np.zeros(pads), np.zeros((pads, 2)), np.zeros((pads, 2)), np.zeros(pads), readings)
        touched = readings.mean(axis=(1, 2, 3)) > CONTACT_THRESHOLD
        if touched.any():
            found = self._force(readings[touched])
            felt.pressing[touched], felt.tangential[touched] = -found.force[:, 2], found.force[:, :2]
            felt.centre[touched] = found.position
        return felt

    def look(self, felt: PadLoads) -> tuple[Array, Array]:
        """Probability of each of the seven shapes, both pads' mean, in the order of `INDENTER_NAMES`; and places.

        These are of the shape's middle on each pad, (pads, 2) [m].
        """
        assert felt.readings is not None
        found = self._shape(felt.readings, among=INDENTER_NAMES)
        order = [found.shapes.index(name) for name in INDENTER_NAMES]
        return found.probabilities[:, order].mean(axis=0), found.position


@lru_cache(maxsize=1)
def punch_recognisers(weights: str | None) -> tuple[ForceRecogniser, ShapeRecogniser]:
    """What feels forces and sees shapes; arguments and errors as of `touch.grasp_recogniser`."""
    folder = None if weights is None else Path(weights)
    return load("force", pad=Pad(), folder=folder), load("shape", pad=Pad(), folder=folder)
