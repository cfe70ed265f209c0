"""The two tasks: press with commanded forces, and sort punches by their recognised shape.

The controller's outputs are position targets; its inputs are results of recognition. Between contacts, targets move
along straight lines in a given time, without feedback.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.control import ForceServo, ShapeBelief
from mjtactile.experiments.loop.known import ARM_STIFFNESS, Arms, bin_place
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.pad import force_vector
from mjtactile.units import GRAM_FORCE

#: Height of a punch's face over the pad while it travels, and height at which the search for the surface begins [m].
TRAVEL_HEIGHT, SEARCH_HEIGHT = 12e-3, 1e-3
#: Speed of travel [m/s] and time for an arm to come to rest after it [s].
SPEED, REST = 0.25, 0.1
#: Pressing force for the recognition of a shape [N], and time to settle before the first recognition [s].
FEELING_FORCE, SETTLING_TIME = 100.0 * GRAM_FORCE, 0.15
#: Time for which a commanded force is held [s].
HOLDING_TIME = 0.4
#: A search for the surface is given up after this [s].
SEARCH_TIME = 0.6


@dataclass(frozen=True, eq=False)
class HeldForce:
    """One commanded force, and the time over which it was held."""

    commanded: Array  #: commanded force on the pad [N], shape (3,)
    start: int  #: index of its first tick
    stop: int  #: index one past its last tick


@dataclass(frozen=True)
class Sorted:
    """One punch that was recognised and put into a bin."""

    arm: int  #: index of the arm
    shape: str | None  #: recognised shape; None without contact
    confidence: float  #: mean probability of that shape [-]
    looks: int  #: number of recognitions
    position: tuple[float, float]  #: recognised position (x, y) of the punch on the pad at the last recognition [m]


def commanded_forces(count: int, seed: int) -> list[Array]:
    """Draw forces of 20 to 150 gf, tilted by 5 to 30 degrees at any azimuth [N]."""
    drawn = np.random.default_rng([seed, 3])
    return [
        force_vector(drawn.uniform(20.0, 150.0) * GRAM_FORCE, drawn.uniform(5.0, 30.0), drawn.uniform(0.0, 360.0))
        for _ in range(count)
    ]


def press_forces(loop: Arms, arm: int, forces: Sequence[Array]) -> list[HeldForce]:
    """Press the pad with the punch of one arm, with one commanded force on the pad [N], (3,), after another."""
    servo = ForceServo(stiffness=ARM_STIFFNESS)
    rack = loop.targets[arm].copy()
    _over_pad(loop, arm)
    held = []
    for force in forces:
        start = loop.ticks
        _hold(loop, arm, servo, force, HOLDING_TIME if held else HOLDING_TIME + SEARCH_TIME / 4)
        held.append(HeldForce(force, start, loop.ticks))
    _lift(loop, arm)
    _travel(loop, arm, rack)
    return held


def sort_punches(loop: Arms) -> list[Sorted]:
    """Press each arm's punch on the pad, and carry it to the bin of the shape that is recognised."""
    return [_sort_one(loop, arm) for arm in range(len(loop.targets))]


def _sort_one(loop: Arms, arm: int) -> Sorted:
    servo, belief = ForceServo(stiffness=ARM_STIFFNESS), ShapeBelief()
    pressing = np.array([0.0, 0.0, -FEELING_FORCE])
    _over_pad(loop, arm)
    position = (np.nan, np.nan)
    _hold(loop, arm, servo, pressing, SEARCH_TIME, until_felt=True)
    _hold(loop, arm, servo, pressing, SETTLING_TIME)
    for _ in range(belief.most):
        felt = loop.tick(arm, pressing)
        loop.targets[arm] += servo.step(None if felt is None else felt.force.force, pressing, loop.period)
        if felt is not None:
            belief.look(felt.shape.shapes, felt.shape.probabilities)
            position = (float(felt.shape.position[0]), float(felt.shape.position[1]))
        if belief.settled:
            break
    _lift(loop, arm)
    if belief.shape is not None:
        place = bin_place(INDENTER_NAMES.index(belief.shape))
        _travel(loop, arm, np.array([place[0], place[1], TRAVEL_HEIGHT]))
        _travel(loop, arm, place)
    return Sorted(arm, belief.shape, belief.confidence, belief.looks, position)


def _hold(loop: Arms, arm: int, servo: ForceServo, force: Array, duration: float, *, until_felt: bool = False) -> None:
    """Press with a commanded force for a time, or until contact is felt."""
    for _ in range(round(duration / loop.period)):
        felt = loop.tick(arm, force)
        loop.targets[arm] += servo.step(None if felt is None else felt.force.force, force, loop.period)
        if until_felt and felt is not None:
            return


def _over_pad(loop: Arms, arm: int) -> None:
    rack = loop.targets[arm]
    _travel(loop, arm, np.array([rack[0], rack[1], TRAVEL_HEIGHT]))
    _travel(loop, arm, np.array([0.0, 0.0, TRAVEL_HEIGHT]))
    _travel(loop, arm, np.array([0.0, 0.0, SEARCH_HEIGHT]))


def _lift(loop: Arms, arm: int) -> None:
    """Move straight up from the present target, which lies below the surface."""
    loop.targets[arm, 2] = SEARCH_HEIGHT
    target = loop.targets[arm].copy()
    target[2] = TRAVEL_HEIGHT
    _travel(loop, arm, target)


def _travel(loop: Arms, arm: int, place: Array) -> None:
    """Move along a straight line at constant speed, then rest."""
    start = loop.targets[arm].copy()
    ticks = max(1, int(np.ceil(np.linalg.norm(place - start) / SPEED / loop.period)))
    for k in range(1, ticks + 1):
        loop.targets[arm] = start + (place - start) * (k / ticks)
        loop.tick(arm)
    for _ in range(round(REST / loop.period)):
        loop.tick(arm)
