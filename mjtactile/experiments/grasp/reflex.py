"""Catching what slips: a reflex that knows the friction and watches how much of it is used.

A pull that nears what friction holds is an overload. A pull that falls all at once is either a load that went away or
friction that did, and a squeeze tells them apart: what slides pulls with the grip, what rests does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import theilslopes

from mjtactile.experiments.grasp.control import GripLaw
from mjtactile.experiments.grasp.touch import Felt

#: Ticks over which a squeeze is judged.
_JUDGED = 8


@dataclass(frozen=True, kw_only=True)
class ReflexSettings:
    """When to be alarmed, and what to do."""

    used: float = 0.97  #: share of friction in use that alarms [-]
    fall: float = 0.1  #: share by which a pull must fall to arouse suspicion [-]
    memory: float = 0.1  #: time constant with which what was pulled before is forgotten [s]
    squeeze: float = 25.0  #: by which the grip grows while suspicious, over itself [1/s]
    squeeze_time: float = 0.008  #: for how long at least; four times that at most [s]
    squeezed: float = 0.07  #: growth of the grip over which a pull is judged, at least [-]
    left: float = 0.75  #: share of the friction found then that is counted on: it may still be going [-]
    follows: float = 0.5  #: share of that growth that a sliding object's pull follows at least [-]
    jump: float = 1.6  #: grip over the one before, when alarmed [-]


class SlipReflex:
    """Tells what grip to command, tick by tick.

    Args:
        law: of the grip, with the friction that was found.
        grip: commanded so far [N]; it stays unless something slips.
        period: between ticks [s].
        settings: when to be alarmed.

    Attributes:
        alarmed: whether it has been.
        law: as it is known now: friction that went away is found anew.
    """

    def __init__(self, law: GripLaw, grip: float, period: float, settings: ReflexSettings | None = None) -> None:
        self.law, self.grip, self.alarmed = law, grip, False
        self._period, self._settings = period, settings or ReflexSettings()
        self._usual: float | None = None
        self._before = grip
        self._suspected: list[tuple[float, float]] | None = None

    def step(self, felt: Felt) -> float:
        """Grip to command next [N], given what is felt."""
        if not felt.both:
            return self.grip
        load, pressing = self.law.load(felt), float(felt.pressing.mean())
        if self.alarmed:
            self.grip = max(self.grip, min(self.law.wanted(felt), self.law.most))
        elif load > self._settings.used * self.law.friction * pressing:
            self._alarm()
        elif self._suspected is not None:
            self._suspect(load, pressing)
        elif self._usual is not None and load < (1.0 - self._settings.fall) * self._usual:
            self._before, self._suspected = self.grip, [(load, pressing)]
            self._squeeze()
        self._remember(load)
        return self.grip

    def _alarm(self) -> None:
        self.alarmed = True
        self.grip = min(max(self.grip, self._before * self._settings.jump), self.law.most)

    def _suspect(self, load: float, pressing: float) -> None:
        """While squeezing, find out whether the pull follows."""
        assert self._suspected is not None
        self._suspected.append((load, pressing))
        self._squeeze()
        if len(self._suspected) * self._period < self._settings.squeeze_time:
            return
        # Fingers may bounce on what slides: a slope between all pairs (Theil and Sen) is not misled by single ticks.
        loads, grips = np.array(self._suspected[-_JUDGED:]).T
        grown = grips[-2:].mean() / grips[:2].mean() - 1.0
        slope = float(np.asarray(theilslopes(np.log(np.maximum(loads, 1e-3)), np.log(grips)))[0])
        if grown > self._settings.squeezed and slope > self._settings.follows:
            self.law = replace(self.law, friction=self._settings.left * float(np.median(loads / grips)))
            self._alarm()
        elif len(self._suspected) * self._period > 4.0 * self._settings.squeeze_time:
            # What rests pulls less now: that is usual from here on.
            self._suspected, self._usual, self.grip = None, load, self._before

    def _squeeze(self) -> None:
        self.grip = min(self.grip * (1.0 + self._settings.squeeze * self._period), self.law.most)

    def _remember(self, load: float) -> None:
        if self._suspected is None:
            share = self._period / self._settings.memory
            self._usual = load if self._usual is None else self._usual + share * (load - self._usual)
