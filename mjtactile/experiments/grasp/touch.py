"""Senses of touch for controllers: by recognition, from MuJoCo's contact forces, or none.

The three have the same interface, so that a control law can be tested with each.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.errors import RecognitionError
from mjtactile.experiments.grasp.known import PadLoads
from mjtactile.experiments.hands.gripper import GRIPPER_PADS
from mjtactile.pad import Pad
from mjtactile.recognition import ForceRecogniser, load
from mjtactile.recognition.grasp import GraspRecogniser, GraspResult, grasp_targets
from mjtactile.sim.wrench import contact_wrench

#: A pad is in contact if the mean of its readings is above this [Pa], at about 0.05 N; noise contributes a tenth of it.
CONTACT_THRESHOLD = 100.0
#: A pad is in contact if the true contact force presses with more than this [N].
LEAST_FORCE = 0.05


#: Shape of the readings of the default pad, which the gripper has and recognisers are trained for.
_READING_SHAPE = Pad().reading_shape


class TouchSense(Protocol):
    """A sense of touch: returns the loads on the pads in a state."""

    #: Whether the pads are to be read.
    reads: bool

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> PadLoads:
        """Loads on the pads in a state."""
        ...


class RecognisedTouch:
    """Loads recognised from the pads' readings with noise.

    Args:
        recogniser: recogniser of a grasp's force and torsional moment, or of force and position alone.
        noise: standard deviation of white noise over a pad's largest reading [-].
        seed: seed of the noise.
    """

    reads = True

    def __init__(self, recogniser: GraspRecogniser | ForceRecogniser, *, noise: float, seed: tuple[int, ...]) -> None:
        self._recogniser, self._noise = recogniser, noise
        self._drawn = np.random.default_rng(seed)

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> PadLoads:
        """The recognised loads; the pads must have been read in this step."""
        readings = np.array([data.sensor(name).data.reshape(_READING_SHAPE) for name in GRIPPER_PADS])
        peaks = readings.max(axis=(1, 2, 3))
        readings += self._noise * peaks[:, None, None, None] * self._drawn.standard_normal(readings.shape)
        touched = readings.mean(axis=(1, 2, 3)) > CONTACT_THRESHOLD
        felt = no_loads(readings)
        if touched.any():
            found = self._recogniser(readings[touched])
            felt.pressing[touched], felt.tangential[touched] = -found.force[:, 2], found.force[:, :2]
            if isinstance(found, GraspResult):
                felt.centre[touched], felt.torsion[touched] = found.centre, found.torsion
            else:
                felt.centre[touched] = found.position
        return felt


class TrueTouch:
    """Loads from MuJoCo's contact forces, which no real robot has, for comparison."""

    reads = False

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> PadLoads:
        """The true loads on the pads."""
        wrenches = np.array([contact_wrench(model, data, model.geom(f"{one}_pad").id) for one in GRIPPER_PADS])
        touched = wrenches[:, 2] < -LEAST_FORCE
        felt = no_loads(None)
        if touched.any():
            targets = grasp_targets(wrenches[touched])
            felt.pressing[touched], felt.tangential[touched] = -wrenches[touched, 2], wrenches[touched, :2]
            felt.centre[touched] = targets[:, 2:4]
            felt.torsion[touched] = -targets[:, 4] * wrenches[touched, 2]
        return felt


class NoTouch:
    """No sense of touch."""

    reads = False

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> PadLoads:
        """Zero loads, as without contact."""
        return no_loads(None)


def make_touch(kind: str, *, noise: float, seed: tuple[int, ...], weights: str | None = None) -> TouchSense:
    """A sense of touch by name: "recognised", "true" or "none".

    Args:
        kind: name of the sense of touch.
        noise: standard deviation of the readings' noise over a pad's largest reading [-]; for "recognised".
        seed: seed of the noise; for "recognised".
        weights: folder of the recogniser's weights; by default those of the package; for "recognised".

    Raises:
        RecognitionError: there is no such kind; there are no weights, or they are for another pad.
    """
    if kind == "recognised":
        return RecognisedTouch(grasp_recogniser(weights), noise=noise, seed=seed)
    if kind == "true":
        return TrueTouch()
    if kind != "none":
        raise RecognitionError(f"sense of touch {kind!r} does not exist. Available: recognised, true, none.")
    return NoTouch()


@lru_cache(maxsize=2)
def grasp_recogniser(weights: str | None) -> GraspRecogniser:
    """The recogniser of forces and torsional moments on a gripper's pads; without a folder of weights, the package's.

    Raises:
        RecognitionError: there are no weights, or they are for another pad.
    """
    return load("grasp", pad=Pad(), folder=weights)


def no_loads(readings: Array | None) -> PadLoads:
    """Zero loads, to be filled in where there is contact, and the readings that they belong to."""
    pads = len(GRIPPER_PADS)
    return PadLoads(np.zeros(pads), np.zeros((pads, 2)), np.zeros((pads, 2)), np.zeros(pads), readings)
