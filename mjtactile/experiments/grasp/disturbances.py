"""Disturbances of a held object: increasing and decreasing loads, a shaking hand, decreasing friction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mjtactile.experiments.grasp.robot import Robot

#: Kinds of disturbances that cause slip, and kinds that do not.
SLIPS, QUIET = ("step", "ramp", "wet"), ("step", "ramp", "less", "shake", "nothing")
#: Ratio of the load to the largest load that the grip holds [-], with and without slip.
_OVERLOAD, _LOAD = (1.15, 2.0), (0.8, 0.92)
#: Rise times of sudden and slow loads [s].
_RISES = {"step": (0.005, 0.02), "ramp": (0.05, 0.4)}
#: Ratio of the weight to the load that the grip holds after the friction has decreased [-], and duration of the
#: decrease [s].
_WET, _WETTING = (1.2, 1.8), 0.02
#: Fraction of the weight that is removed [-].
_LESS = (0.15, 0.6)
#: Acceleration of a shaking hand, relative to gravity [-], and its frequency [Hz].
_SHAKE, _FREQUENCY = 0.08, (2.0, 6.0)


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """One disturbance."""

    kind: str  #: one of `SLIPS` and `QUIET`
    slips: bool  #: whether the load exceeds what the grip holds
    #: For "step" and "ramp", ratio of the load to the largest load that the grip holds; for "wet", ratio of the weight
    #: to what the grip holds afterwards; for "less", removed fraction of the weight [-].
    amount: float
    rise: float  #: rise time [s]
    start: float  #: time at which it begins [s]
    frequency: float  #: frequency of shaking [Hz]

    def progress(self, time: float) -> float:
        """Progress of the disturbance at a time [s], from 0 to 1."""
        return float(np.clip((time - self.start) / self.rise, 0.0, 1.0))

    def apply(self, robot: Robot, begun: float, holds: float, friction: float) -> None:
        """Apply the disturbance to the simulation for the next step.

        Args:
            robot: the robot, with the simulation.
            begun: simulated time from which `start` counts [s].
            holds: largest weight that the grip holds [N].
            friction: friction of the object before the disturbance [-].
        """
        model, data = robot.model, robot.data
        body = model.body("object").id
        weight = float(model.body_mass[body]) * 9.81
        share = self.progress(robot.time - begun)
        if self.kind in _RISES:
            data.xfrc_applied[body, 2] = -share * max(self.amount * holds - weight, 0.0)
        elif self.kind == "less":
            data.xfrc_applied[body, 2] = share * self.amount * weight
        elif self.kind == "wet":
            left = weight / (holds * self.amount)
            model.geom_friction[model.geom("object").id, 0] = friction * (1.0 - share * (1.0 - left))

    def shaken(self, time: float) -> float:
        """Displacement of a shaking hand [m] at a time [s]; 0 for other disturbances."""
        if self.kind != "shake" or time < self.start:
            return 0.0
        pulse = 2.0 * math.pi * self.frequency
        since = time - self.start
        return _SHAKE * 9.81 / pulse**2 * math.sin(pulse * since) * min(1.0, since * self.frequency / 2.0)


def disturbance(drawn: np.random.Generator, *, slips: bool) -> Disturbance:
    """A random disturbance, which makes the object slip or not."""
    kind = str(drawn.choice(SLIPS if slips else QUIET))
    amounts = {"wet": _WET, "less": _LESS}.get(kind, _OVERLOAD if slips else _LOAD)
    return Disturbance(
        kind=kind,
        slips=slips,
        amount=float(drawn.uniform(*amounts)),
        rise=float(drawn.uniform(*_RISES[kind])) if kind in _RISES else _WETTING,
        start=float(drawn.uniform(0.1, 0.3)),
        frequency=float(drawn.uniform(*_FREQUENCY)),
    )
