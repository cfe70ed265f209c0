"""What happens to a held object: loads that grow, loads that go, hands that shake, friction that goes away."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mjtactile.experiments.grasp.robot import Robot

#: Kinds that make it slip, and kinds that do not.
SLIPS, QUIET = ("step", "ramp", "wet"), ("step", "ramp", "less", "shake", "nothing")
#: Share of what the grip holds that a load reaches: where it slips, and where it does not.
_OVERLOAD, _LOAD = (1.15, 2.0), (0.8, 0.92)
#: Time in which loads rise [s]: at once, or slowly.
_RISES = {"step": (0.005, 0.02), "ramp": (0.05, 0.4)}
#: Weight over what the grip still holds when friction has gone, and how long it takes to go [s].
_WET, _WETTING = (1.2, 1.8), 0.02
#: Share of the weight that is taken off.
_LESS = (0.15, 0.6)
#: Acceleration of a shaking hand, over gravity, and its frequency [Hz].
_SHAKE, _FREQUENCY = 0.08, (2.0, 6.0)


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """One disturbance.

    Attributes:
        kind: see above.
        slips: whether it takes more than the grip holds.
        amount: of the kind: load over what the grip holds, weight over what it still holds, share of the weight.
        rise: how long it takes to come [s].
        start: when it begins [s].
        frequency: of shaking [Hz].
    """

    kind: str
    slips: bool
    amount: float
    rise: float
    start: float
    frequency: float

    def progress(self, time: float) -> float:
        """From 0 before it to 1 when it is all there."""
        return float(np.clip((time - self.start) / self.rise, 0.0, 1.0))

    def apply(self, robot: Robot, begun: float, holds: float, friction: float) -> None:
        """Do it to the world, for the next step.

        Args:
            robot: whose world it is.
            begun: time at which the object began to be held [s].
            holds: weight that the grip can hold [N].
            friction: of the object, before.
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
        """How far a shaking hand is from where it was [m]."""
        if self.kind != "shake" or time < self.start:
            return 0.0
        pulse = 2.0 * math.pi * self.frequency
        since = time - self.start
        return _SHAKE * 9.81 / pulse**2 * math.sin(pulse * since) * min(1.0, since * self.frequency / 2.0)


def disturbance(drawn: np.random.Generator, *, slips: bool) -> Disturbance:
    """One at random."""
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
