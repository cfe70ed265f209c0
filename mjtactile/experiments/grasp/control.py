"""Control laws of the grasp experiments. They are told what is felt, and nothing else of the world.

Friction is found by rubbing: fingers that slide down an object standing on a table pull with friction times grip,
whatever the object weighs. From then on a grip is as large as what it has to hold asks for, with a margin.

What slips is caught by a reflex that knows the friction and watches how much of it is used. A pull that nears what
friction holds is an overload. A pull that falls all at once is either a load that went away or friction that did, and a
squeeze tells them apart: what slides pulls with the grip, what rests does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import theilslopes

from mjtactile.experiments.grasp.known import Arm, PadLoads

#: Grip with which fingers close and rub [N].
CLOSING_GRIP, RUBBING_GRIP = 0.6, 1.5
#: Speed of rubbing [m/s] and of the ticks over which it is averaged; how long it may take [s].
_RUBBING_SPEED, _RUBBING_TICKS, _RUBBING_TIME = 5e-3, 12, 0.12
#: A pad counts as touched for that many ticks, so that fingers may bounce; a gripper has closed when both are touched
#: for so many in a row; when it gives up looking for them, and how long it takes to settle at most [s].
_MEMORY, _REST_TICKS, _CLOSING_TIME, _SETTLING_TIME = 8, 15, 2.0, 1.0
#: Speed at which the wrist gives way to the only side that is touched, and evens out two sides [m/s].
_GIVE, _EVENING = 0.01, 4e-3
#: Friction is hardly ever outside these [-].
_FRICTIONS = (0.05, 3.0)
#: An object has landed when it pulls with less than this share of its weight [-]; force with which fingers open [N],
#: and for how long [s].
_LANDED, _OPENING_GRIP, _OPENING_TIME = 0.6, -1.0, 0.3
#: Acceleration of the wrist [m/s^2].
_ACCELERATION = 0.4


@dataclass(frozen=True, kw_only=True)
class GripLaw:
    """How hard to grip what is felt.

    The load is what both fingers hold together, pull and turn, shared evenly. Forces that the fingers put on each other
    through the object do not count: where they are too large for friction they give way, and nothing falls. A turn
    counts over `turn_arm`, the distance from its middle at which a pad holds it; it shares the friction with the pull
    as on an ellipsoidal limit surface.
    """

    friction: float  #: as found [-]
    margin: float = 1.2  #: grip over the least that holds [-]
    least: float = 0.4  #: grip when there is next to nothing to hold [N]
    most: float = 19.0  #: never more [N]
    turn_arm: float = 7e-3  #: [m]
    rise: float = 0.5  #: share of a deficit that a tick makes good [-]
    fall: float = 0.03  #: share of an excess that a tick gives away [-]

    def load(self, felt: PadLoads) -> float:
        """What each finger has to hold by friction [N]."""
        return float(np.hypot(np.hypot(*felt.pull), felt.turn / self.turn_arm)) / 2.0

    def wanted(self, felt: PadLoads) -> float:
        """Grip that holds what is felt, with the margin [N]."""
        return float(np.clip(self.margin * self.load(felt) / self.friction, self.least, self.most))

    def step(self, grip: float, felt: PadLoads) -> float:
        """Grip to command next [N], given the one that is commanded."""
        lacking = self.wanted(felt) - grip
        return grip + (self.rise if lacking > 0.0 else self.fall) * lacking

    def secure(self, felt: PadLoads) -> bool:
        """Whether what is felt is well inside what friction holds."""
        pressing = float(felt.pressing.mean())
        return pressing > 0.0 and self.load(felt) < 0.93 * self.friction * pressing


def close(robot: Arm) -> bool:
    """Close the gripper until both pads are touched steadily. Returns whether they are.

    While only one pad is touched, the wrist gives way to that side, so that the object stays where it stands; then the
    fingers take hold, and the wrist evens out what still differs between them.
    """
    robot.grip = CLOSING_GRIP
    since, until = np.full(2, _MEMORY), robot.time + _CLOSING_TIME
    while not (since < _MEMORY).all():
        if robot.time > until:
            return False
        give = float(since[1] < _MEMORY) - float(since[0] < _MEMORY)
        felt = robot.move("x", give * _GIVE * robot.period, speed=_GIVE)
        since = np.where(felt.pressing > 0.0, 0, since + 1)
    firm, mean, until = 0, robot.felt.pressing, robot.time + _SETTLING_TIME
    while firm < _REST_TICKS and robot.time < until:
        robot.grip += 0.1 * (RUBBING_GRIP - robot.grip)
        mean = mean + 0.1 * (robot.felt.pressing - mean)
        uneven = float(mean[1] - mean[0]) / max(float(mean.sum()), CLOSING_GRIP)
        felt = robot.move("x", _EVENING * uneven * robot.period, speed=_EVENING)
        firm = firm + 1 if felt.both and robot.grip > 0.9 * RUBBING_GRIP else 0
    return firm > 0


def rub(robot: Arm) -> float:
    """Slide the fingers down an object that stands on a table. Returns the friction that was felt [-].

    The fingers slide down by half a millimetre or so. It ends with the fingers neither pulled up nor down.
    """
    ratios: list[float] = []
    for _ in range(round(_RUBBING_TIME / robot.period)):
        felt = robot.move("z", -1.0, speed=_RUBBING_SPEED)
        if felt.both:
            ratios.append(float(np.hypot(*felt.tangential.T).sum() / felt.pressing.sum()))
    friction = float(np.median(ratios[-_RUBBING_TICKS:])) if ratios else _FRICTIONS[1]
    while robot.place["z"] < 0.0 and robot.felt.pull[1] > 0.0:
        robot.move("z", -robot.place["z"], speed=_RUBBING_SPEED)
    return float(np.clip(friction, *_FRICTIONS))


class Ride:
    """Drives an axis to a place without jerks.

    Args:
        robot: that is driven.
        axis: "x", "y" or "z".
        to: displacement of the wrist at which to end [m].
        speed: largest [m/s].
    """

    def __init__(self, robot: Arm, axis: str, to: float, *, speed: float) -> None:
        self._robot, self._axis, self._to, self._most = robot, axis, to, speed
        self._speed = 0.0

    @property
    def left(self) -> float:
        """How far it still is [m]."""
        return self._to - self._robot.place[self._axis]

    @property
    def arrived(self) -> bool:
        """Whether it is there."""
        return abs(self.left) < 1e-6

    def tick(self, *, halt: bool = False) -> PadLoads:
        """One tick of the ride, or, to halt, one of slowing down."""
        change = _ACCELERATION * self._robot.period
        wanted = 0.0 if halt else min(self._most, max(np.sqrt(2.0 * _ACCELERATION * abs(self.left)), change))
        self._speed += float(np.clip(wanted - self._speed, -4.0 * change, change))
        return self._robot.move(self._axis, self.left, speed=max(self._speed, 0.0))


def raise_object(robot: Arm, law: GripLaw, height: float, *, speed: float) -> None:
    """Lift what is held, the grip following what it pulls with; halting wherever it is about to slip.

    Args:
        robot: with the object between its fingers.
        law: of the grip.
        height: displacement of the wrist at which to end [m].
        speed: largest, once the object hangs free [m/s].
    """
    start = robot.time
    # Slowly, until it no longer gets heavier.
    slow = Ride(robot, "z", robot.place["z"] + 2e-3, speed=6e-3)
    while not slow.arrived and robot.time < start + 3.0:
        felt = slow.tick(halt=not law.secure(robot.felt))
        robot.grip = law.step(robot.grip, felt)
    ride = Ride(robot, "z", height, speed=speed)
    while not ride.arrived and robot.time < start + 6.0:
        felt = ride.tick(halt=not law.secure(robot.felt))
        robot.grip = law.step(robot.grip, felt)


def hold(robot: Arm, law: GripLaw, time: float) -> None:
    """Hold on for some time [s], the grip following what is felt."""
    for _ in range(round(time / robot.period)):
        robot.grip = law.step(robot.grip, robot.tick())


def lower(robot: Arm, lowest: float, *, speed: float) -> bool:
    """Lower what is held until it lands on something. Returns whether it did.

    Args:
        robot: with the object between its fingers, at rest.
        lowest: displacement of the wrist at which to give up [m].
        speed: largest [m/s].
    """
    weight = float(np.mean([-robot.tick().pull[1] for _ in range(_RUBBING_TICKS)]))
    ride = Ride(robot, "z", lowest, speed=speed)
    landed = 0
    while not ride.arrived:
        felt = ride.tick()
        landed = landed + 1 if -felt.pull[1] < _LANDED * weight else 0
        if landed == 2:
            return True
    return False


def let_go(robot: Arm) -> None:
    """Loosen the grip, open, and wait."""
    for _ in range(round(_OPENING_TIME / robot.period)):
        robot.grip += 0.15 * (_OPENING_GRIP - robot.grip)
        robot.tick()


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

    def step(self, felt: PadLoads) -> float:
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
