"""A sense of touch for punches: recognition of force and shape."""

from __future__ import annotations

from functools import lru_cache

from mjtactile._types import Array
from mjtactile.experiments.grasp.known import PadLoads
from mjtactile.experiments.grasp.touch import RecognisedTouch
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.pad import Pad
from mjtactile.recognition import ForceRecogniser, ShapeRecogniser, load


class PunchTouch(RecognisedTouch):
    """Loads and shapes of punches on the pads, recognised from readings with noise; arguments as in `make_touch`."""

    def __init__(self, *, noise: float, seed: tuple[int, ...], weights: str | None = None) -> None:
        force, self._shape = punch_recognisers(weights)
        super().__init__(force, noise=noise, seed=seed)

    def look(self, felt: PadLoads) -> tuple[Array, Array]:
        """Probabilities of the seven shapes, (7,), and the position of the shape's centre on each pad [m], (pads, 2).

        Probabilities are means over the pads, in the order of `INDENTER_NAMES`.
        """
        assert felt.readings is not None
        found = self._shape(felt.readings, among=INDENTER_NAMES)
        order = [found.shapes.index(name) for name in INDENTER_NAMES]
        return found.probabilities[:, order].mean(axis=0), found.position


@lru_cache(maxsize=1)
def punch_recognisers(weights: str | None) -> tuple[ForceRecogniser, ShapeRecogniser]:
    """The recognisers of forces and of shapes on a gripper's pads; without a folder of weights, those of the package.

    Raises:
        RecognitionError: there are no weights, or they are for another pad.
    """
    return load("force", pad=Pad(), folder=weights), load("shape", pad=Pad(), folder=weights)
