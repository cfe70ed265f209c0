"""Control laws of the grasp experiments. Their only information about the world is the sense of touch.

Friction is estimated by rubbing: while the fingers slide down an object on a table, the tangential force is friction
times grip, independently of the object's weight. Afterwards the grip is proportional to the load, with a margin.

A reflex catches slipping objects. It knows the friction and monitors the ratio of load to friction limit. A load close
to the limit is an overload. A sudden decrease of the load means that either the load or the friction has decreased. A
squeeze distinguishes the two: the load on the fingers follows the grip if the object slides, but not if it rests.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import theilslopes

from mjtactile.experiments.grasp.known import Arm, PadLoads

#: Grip force while closing, and while rubbing [N].
CLOSING_GRIP, RUBBING_GRIP = 0.6, 1.5
#: Speed of rubbing [m/s], number of ticks over which the friction is averaged, and time limit [s].
_RUBBING_SPEED, _RUBBING_TICKS, _RUBBING_TIME = 5e-3, 12, 0.12
#: Number of ticks for which a pad counts as touched after a contact, so that fingers may bounce; number of successive
#: ticks with both pads touched after which the gripper counts as closed; time limits for closing and settling [s].
_MEMORY, _REST_TICKS, _CLOSING_TIME, _SETTLING_TIME = 8, 15, 2.0, 1.0
#: Speed of the wrist while one pad is touched, and while the two pads' forces are equalised [m/s].
_GIVE, _EVENING = 0.01, 4e-3
#: Plausible range of friction [-].
_FRICTIONS = (0.05, 3.0)
#: An object has landed when its load is below this fraction of its weight [-]; force and time of opening [N], [s].
_LANDED, _OPENING_GRIP, _OPENING_TIME = 0.6, -1.0, 0.3
#: Acceleration of the wrist [m/s^2].
_ACCELERATION = 0.4


@dataclass(frozen=True, kw_only=True)
class GripLaw:
    """Computes the grip force for a load.

    The load consists of the tangential force and the torsional moment that both fingers carry together, shared equally.
    Internal forces between the fingers are ignored: if they exceed friction they relax, and the object does not fall.
    The moment is divided by `turn_arm`, the effective radius of a pad, and combined with the force as on an ellipsoidal
    limit surface.
    """

    friction: float  #: estimated friction [-]
    margin: float = 1.2  #: ratio of the grip to the least grip that holds [-]
    least: float = 0.4  #: smallest grip [N]
    most: float = 19.0  #: largest grip [N]
    turn_arm: float = 7e-3  #: effective radius of a pad for torsion [m]
    rise: float = 0.5  #: fraction of a deficit that is corrected per tick [-]
    fall: float = 0.03  #: fraction of an excess that is corrected per tick [-]

    def load(self, felt: PadLoads) -> float:
        """Load that each finger carries by friction [N]."""
        return float(np.hypot(np.hypot(*felt.pull), felt.turn / self.turn_arm)) / 2.0

    def wanted(self, felt: PadLoads) -> float:
        """Grip for the present load, with the margin [N]."""
        return float(np.clip(self.margin * self.load(felt) / self.friction, self.least, self.most))

    def step(self, grip: float, felt: PadLoads) -> float:
        """Next commanded grip [N], given the present one."""
        lacking = self.wanted(felt) - grip
        return grip + (self.rise if lacking > 0.0 else self.fall) * lacking

    def secure(self, felt: PadLoads) -> bool:
        """Whether the load is below 93 % of the friction limit."""
        pressing = float(felt.pressing.mean())
        return pressing > 0.0 and self.load(felt) < 0.93 * self.friction * pressing


def close(robot: Arm) -> bool:
    """Close the gripper until both pads are steadily in contact. Returns whether they are.

    While only one pad is in contact, the wrist moves to that side, so that the object is not pushed. Then the fingers
    grip, and the wrist equalises the forces on the two pads.
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
    """Slide the fingers about half a millimetre down an object on a table. Returns the estimated friction [-].

    At the end there is no vertical force on the fingers.
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
    """Moves axis "x", "y" or "z" of the wrist to a displacement [m] with limited speed [m/s] and acceleration."""

    def __init__(self, robot: Arm, axis: str, to: float, *, speed: float) -> None:
        self._robot, self._axis, self._to, self._most = robot, axis, to, speed
        self._speed = 0.0

    @property
    def left(self) -> float:
        """Remaining distance [m]."""
        return self._to - self._robot.place[self._axis]

    @property
    def arrived(self) -> bool:
        """Whether the position is reached."""
        return abs(self.left) < 1e-6

    def tick(self, *, halt: bool = False) -> PadLoads:
        """One tick of the motion; with `halt`, one tick of braking."""
        change = _ACCELERATION * self._robot.period
        wanted = 0.0 if halt else min(self._most, max(np.sqrt(2.0 * _ACCELERATION * abs(self.left)), change))
        self._speed += float(np.clip(wanted - self._speed, -4.0 * change, change))
        return self._robot.move(self._axis, self.left, speed=max(self._speed, 0.0))

    def finish(self) -> None:
        """Move until the position is reached."""
        while not self.arrived:
            self.tick()


def raise_object(robot: Arm, law: GripLaw, height: float, *, speed: float) -> None:
    """Lift the held object while the grip follows the load; the motion halts when the object is about to slip.

    The wrist ends at a displacement `height` [m]; `speed` is its largest after the object has left the table [m/s].
    """
    start = robot.time
    # The first millimetres are slow, because the load increases until the object leaves the table.
    slow = Ride(robot, "z", robot.place["z"] + 2e-3, speed=6e-3)
    for ride, limit in ((slow, 3.0), (Ride(robot, "z", height, speed=speed), 6.0)):
        while not ride.arrived and robot.time < start + limit:
            felt = ride.tick(halt=not law.secure(robot.felt))
            robot.grip = law.step(robot.grip, felt)


def hold(robot: Arm, law: GripLaw, time: float) -> None:
    """Hold for a time [s] while the grip follows the load."""
    for _ in range(round(time / robot.period)):
        robot.grip = law.step(robot.grip, robot.tick())


def lower(robot: Arm, lowest: float, *, speed: float) -> bool:
    """Lower the held object, at rest, at most at a speed [m/s] until it lands. Returns whether it did.

    The attempt fails when the wrist's displacement is `lowest` [m].
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
    """Reduce the grip, open the gripper, and wait."""
    for _ in range(round(_OPENING_TIME / robot.period)):
        robot.grip += 0.15 * (_OPENING_GRIP - robot.grip)
        robot.tick()


#: Ratio of load to friction limit that triggers the alarm of `SlipReflex`, and factor of the grip at an alarm [-].
_USED, _JUMP = 0.97, 1.6
#: Relative decrease of the load that starts a squeeze [-]; time constant of the filtered load it is relative to [s].
_FALL, _USUAL_TIME = 0.1, 0.1
#: Relative growth rate of the grip during a squeeze [1/s]; least duration, a fourth of the largest [s]; number of ticks
#: over which it is evaluated, and least relative growth of the grip for that [-].
_SQUEEZE, _SQUEEZE_TIME, _JUDGED, _SQUEEZED = 25.0, 0.008, 8, 0.07
#: Least ratio of the growth of a sliding object's load to that of the grip [-]; fraction of the newly estimated
#: friction that is used, since it may still decrease [-].
_FOLLOWS, _LEFT = 0.5, 0.75


class SlipReflex:
    """Computes the commanded grip [N] at each tick, a period [s] apart, and increases it when the object slips."""

    def __init__(self, law: GripLaw, grip: float, period: float) -> None:
        self.law, self.grip = law, grip  #: the grip law, with the latest estimate of friction, and the command [N]
        self.alarmed = False  #: whether there was an alarm
        self._period = period
        self._usual: float | None = None
        self._before = grip
        self._suspected: list[tuple[float, float]] | None = None

    def step(self, felt: PadLoads) -> float:
        """Next commanded grip [N], given the present loads."""
        if not felt.both:
            return self.grip
        load, pressing = self.law.load(felt), float(felt.pressing.mean())
        if self.alarmed:
            self.grip = max(self.grip, min(self.law.wanted(felt), self.law.most))
        elif load > _USED * self.law.friction * pressing:
            self._alarm()
        elif self._suspected is not None:
            self._suspect(load, pressing)
        elif self._usual is not None and load < (1.0 - _FALL) * self._usual:
            self._before, self._suspected = self.grip, [(load, pressing)]
            self._squeeze()
        self._remember(load)
        return self.grip

    def _alarm(self) -> None:
        self.alarmed = True
        self.grip = min(max(self.grip, self._before * _JUMP), self.law.most)

    def _suspect(self, load: float, pressing: float) -> None:
        """During a squeeze, estimate whether the load follows the grip."""
        assert self._suspected is not None
        self._suspected.append((load, pressing))
        self._squeeze()
        if len(self._suspected) * self._period < _SQUEEZE_TIME:
            return
        # Fingers may bounce on a sliding object: the Theil-Sen slope is robust against single ticks.
        loads, grips = np.array(self._suspected[-_JUDGED:]).T
        grown = grips[-2:].mean() / grips[:2].mean() - 1.0
        slope = float(np.asarray(theilslopes(np.log(np.maximum(loads, 1e-3)), np.log(grips)))[0])
        if grown > _SQUEEZED and slope > _FOLLOWS:
            self.law = replace(self.law, friction=_LEFT * float(np.median(loads / grips)))
            self._alarm()
        elif len(self._suspected) * self._period > 4.0 * _SQUEEZE_TIME:
            # The object rests under a smaller load, which is the new reference.
            self._suspected, self._usual, self.grip = None, load, self._before

    def _squeeze(self) -> None:
        self.grip = min(self.grip * (1.0 + _SQUEEZE * self._period), self.law.most)

    def _remember(self, load: float) -> None:
        if self._suspected is None:
            share = self._period / _USUAL_TIME
            self._usual = load if self._usual is None else self._usual + share * (load - self._usual)
