"""A number of an observation or action, described where it is defined: spaces and documentation come from here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import gymnasium
import numpy as np


@dataclass(frozen=True)
class Channel:
    """One number that goes in or out.

    Attributes:
        name: what it is.
        unit: of the number, "-" for none.
        low, high: its range; what would lie outside is cut off.
        meaning: in a sentence; for an action, what -1 to 1 stand for.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str


def box(channels: Sequence[Channel]) -> gymnasium.spaces.Box:
    """The space of so many numbers, float32."""
    low, high = (np.array([getattr(channel, end) for channel in channels], np.float32) for end in ("low", "high"))
    return gymnasium.spaces.Box(low, high, dtype=np.float32)
