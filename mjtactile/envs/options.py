"""Options of every environment, and their checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile.attach import pad_table
from mjtactile.errors import EnvError, PresetError, SceneError, shortened
from mjtactile.fidelity import DEFAULT, Fidelity, as_fidelity
from mjtactile.pad import Pad
from mjtactile.transducer.array import ELEMENTS
from mjtactile.units import finite_number, is_whole

#: Kinds of observations of the pads.
OBSERVATIONS = ("readings", "pascals", "wrench", "recognised", "none")


@dataclass(frozen=True, kw_only=True)
class TouchOptions:
    """Observation of the pads.

    Raises:
        EnvError: a value is invalid; the message lists the valid ones.
    """

    #: "readings": von Mises stress at every taxel, divided by 10 kPa; "pascals": the same in Pa; "wrench": contact
    #: force and moment on each pad; "recognised": force, position and confidence, recognised from the readings; "none":
    #: no observation, and no pad is simulated.
    observation: str = "readings"
    fidelity: str | Fidelity = DEFAULT  #: fidelity of the readings: a preset by name, or a Fidelity
    transducer: str | None = None  #: imperfect "capacitive" or "piezoresistive" cells; None for ideal readings
    noise: float = 0.01  #: standard deviation of white noise over a pad's largest reading [-]
    randomise: float = 0.0  #: domain randomisation: 0 for none, 1 for the ranges in docs/environments.md
    #: pad of every finger: a Pad, or another argument that `attach_pad` accepts; None for the default pad
    pad: Pad | str | Path | None = None
    #: folder of recognisers of your own for "recognised", see `recognition.load`; None for those of the package
    weights: str | Path | None = None

    def __post_init__(self) -> None:
        if not (isinstance(self.observation, str) and self.observation in OBSERVATIONS):
            raise EnvError(f"observation = {self.observation!r} does not exist. Available: {', '.join(OBSERVATIONS)}.")
        try:
            as_fidelity(self.fidelity)
        except PresetError as error:
            raise EnvError(str(error)) from error
        known = self.transducer is None or (isinstance(self.transducer, str) and self.transducer in ELEMENTS)
        if not known:
            raise EnvError(
                f"transducer = {self.transducer!r} does not exist. Available: {', '.join(ELEMENTS)}, or None."
            )
        if self.transducer is not None and self.observation in ("wrench", "none"):
            raise EnvError(
                f"transducer = {self.transducer!r} is for readings, but observation = {self.observation!r} has none. "
                "Leave it out, or observe 'readings', 'pascals' or 'recognised'."
            )
        if self.weights is not None and self.observation != "recognised":
            raise EnvError(
                f"weights = {shortened(self.weights)} are for observation 'recognised', but observation = "
                f"{self.observation!r}. Leave them out, or observe 'recognised'."
            )
        for name in ("noise", "randomise"):
            value = getattr(self, name)
            if not finite_number(value) >= 0.0:
                raise EnvError(f"{name} = {value!r}; expected a number of at least 0.")
        if self.randomise > 1.0:
            raise EnvError(f"randomise = {self.randomise}; expected 0 (none) to 1 (all).")
        try:
            pad_table(self.pad)
        except SceneError as error:
            raise EnvError(str(error)) from error

    @property
    def touches(self) -> bool:
        """Whether pads are read."""
        return self.observation != "none"

    @property
    def finger_pad(self) -> Pad:
        """The pad of every finger."""
        return pad_table(self.pad)[1]


#: Largest width and height of a picture [pixels].
_MOST_PIXELS = 16384


def refuse_unknown(options: Mapping[str, Any], task: str) -> None:
    """Refuse options, by name, that `TouchOptions` does not have; `task` is the task's name for the message.

    Raises:
        EnvError: an option is unknown; the message lists the known ones.
    """
    known = [one.name for one in fields(TouchOptions)]
    if unknown := [name for name in options if name not in known]:
        raise EnvError(
            f"{task} has no option {unknown[0]!r}. Available: {', '.join(known)}, render_mode, width, height; "
            "split for GraspLift only."
        )


def reset_options(options: Any) -> dict[str, Any]:
    """A copy of the options of `reset`.

    Raises:
        EnvError: they are not a mapping of values by name.
    """
    if options is not None and not isinstance(options, Mapping):
        raise EnvError(f'reset options = {options!r}; expected values by name, such as {{"mass": 0.1}}, or None.')
    return dict(options or {})


def check_picture(width: Any, height: Any) -> None:
    """Check the size of a picture [pixels].

    Raises:
        EnvError: width or height is not a whole number from 1 to 16384.
    """
    for name, value in (("width", width), ("height", height)):
        if not (is_whole(value) and 1 <= value <= _MOST_PIXELS):
            raise EnvError(f"{name} = {value!r}; expected a whole number of pixels from 1 to {_MOST_PIXELS}.")


#: Choices of bands to draw from.
SPLITS = ("all", "train", "test")


class Bands:
    """A range divided into bands of equal width; every second band, from the second on, is for tests only.

    Args:
        low, high: limits of the range.
        split: "all" bands, or those for "train" or "test".
        count: number of bands; odd, so that every band for tests lies between bands for training.

    Raises:
        EnvError: there is no such split.
    """

    def __init__(self, low: float, high: float, *, split: str, count: int = 7) -> None:
        if not (isinstance(split, str) and split in SPLITS):
            raise EnvError(f"split = {split!r} does not exist. Available: {', '.join(SPLITS)}.")
        self._low, self._width = low, (high - low) / count
        self._bands = {"all": np.arange(count), "train": np.arange(0, count, 2), "test": np.arange(1, count, 2)}[split]

    def draw(self, drawn: np.random.Generator) -> float:
        """A value drawn uniformly from the bands."""
        band = self._bands[drawn.integers(len(self._bands))]
        return float(self._low + (band + drawn.random()) * self._width)
