"""The clock of the loop: MuJoCo steps at 1 kHz; at every tick, a few steps apart, the pad is read and recognised.

The controller gets only a `Recognised`. The true wrench is logged for evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.errors import MjTactileError, quiet_contacts
from mjtactile.experiments.loop.known import Recognised, home
from mjtactile.experiments.loop.scene import AXES, TIMESTEP, LoopScene
from mjtactile.fidelity import DEFAULT
from mjtactile.recognition import ForceRecogniser, ShapeRecogniser
from mjtactile.sensor import TactileSensor
from mjtactile.transducer.array import Transducer

#: There is contact if the mean of all readings is above this [Pa]. Three gram-force give a larger mean. The noise of
#: single taxels is a few hundred pascals at most, and less than a tenth of it remains in the mean.
CONTACT_THRESHOLD = 50.0


def steps_between(rate: int) -> int:
    """Number of MuJoCo steps between ticks, for a rate of ticks [Hz].

    Raises:
        MjTactileError: the rate does not divide 1000 Hz.
    """
    every = round(1.0 / (TIMESTEP * rate)) if 0 < rate <= 1.0 / TIMESTEP else 0
    if every < 1 or abs(every * TIMESTEP * rate - 1.0) > 1e-9:
        raise MjTactileError(f"rate = {rate} Hz does not divide 1000 Hz; expected for example 200, 250 or 500.")
    return every


@dataclass(eq=False)
class Log:
    """Record of a run: one row for each tick."""

    time: list[float] = field(default_factory=list)  #: simulated time [s]
    commanded: list[Array] = field(default_factory=list)  #: commanded force on the pad [N], (3,); NaN without one
    recognised: list[Array] = field(default_factory=list)  #: recognised force [N], (3,); NaN without contact
    true: list[Array] = field(default_factory=list)  #: MuJoCo's contact force on the pad [N], (3,)
    arm: list[int] = field(default_factory=list)  #: index of the moving arm
    seen: list[str] = field(default_factory=list)  #: recognised shape; "" without contact
    read_time: list[float] = field(default_factory=list)  #: real time for reading the sensor [s]
    force_time: list[float] = field(default_factory=list)  #: for recognising the force [s]; NaN without contact
    shape_time: list[float] = field(default_factory=list)  #: for recognising the shape [s]; NaN without contact
    step_time: list[float] = field(default_factory=list)  #: for MuJoCo's steps [s]


@dataclass(frozen=True, kw_only=True)
class LoopSettings:
    """Settings of a run."""

    seed: int = 0  #: seed of the order and poses of the punches, of the commanded forces and of the noise
    presses: int = 4  #: number of commanded forces
    sort: bool = True  #: whether the punches are sorted
    rate: int = 200  #: rate of readings and recognition in simulated time [Hz]
    noise: float = 0.01  #: standard deviation of noise over the largest reading [-]
    fidelity: str = DEFAULT  #: fidelity of the readings
    layers: str = "all"  #: recognisers that use "all" sensing layers, or the "top" one alone


class Loop:
    """Steps a scene, and recognises force and shape from its pad's readings.

    Args:
        scene: the scene.
        sensor: sensor of its pad.
        recognisers: recognisers of force and of shape.
        settings: the rate, the noise and its seed are used here.
        transducer: transducers that report the readings; None for ideal readings.
        watch: function that is called with this loop after each tick, for example to draw a frame.

    Raises:
        MjTactileError: the rate does not divide 1000 Hz.
    """

    def __init__(
        self,
        scene: LoopScene,
        sensor: TactileSensor,
        recognisers: tuple[ForceRecogniser, ShapeRecogniser],
        settings: LoopSettings,
        *,
        transducer: Transducer | None,
        watch: Callable[[Loop], None],
    ) -> None:
        every = steps_between(settings.rate)
        self.scene, self.sensor = scene, sensor
        self.data = mujoco.MjData(scene.model)  #: state of the simulation
        self.period = every * TIMESTEP  #: time between ticks [s]
        #: Position target of each arm [m], (arms, 3).
        self.targets = np.array([home(arm) for arm in range(len(scene.truth))])
        self.log = Log()  #: record of all ticks
        #: Readings of the last tick [Pa], (layers, rows, columns).
        self.readings = np.zeros(sensor.pad.reading_shape)
        self.felt: Recognised | None = None  #: recognised contact of the last tick; None without contact
        self._homes = self.targets.copy()
        self._every = every
        self._force, self._shape = recognisers
        self._noise, self._transducer = settings.noise, transducer
        self._drawn = np.random.default_rng([settings.seed, 7])
        self._watch = watch
        names = [f"arm_{arm}_{axis}" for arm in range(len(scene.truth)) for axis in AXES]
        self._actuators = np.array([scene.model.actuator(name).id for name in names])

    @property
    def ticks(self) -> int:
        """Number of ticks that have passed."""
        return len(self.log.time)

    def tick(self, arm: int, commanded: Array | None = None) -> Recognised | None:
        """Step the simulation by one tick and return the recognised contact, None without contact; see `Arms.tick`."""
        start = perf_counter()
        self.data.ctrl[self._actuators] = (self.targets - self._homes).ravel()
        for _ in range(self._every):
            mujoco.mj_step(self.scene.model, self.data)
        stepped = perf_counter()
        # A punch that rocks for a moment may press with an edge. The nearest load that its face carries is read.
        with quiet_contacts():
            readings = self.sensor.read(self.data)
        read = perf_counter()
        self.readings = self._as_reported(readings)
        self.felt = None
        force_time = shape_time = np.nan
        if self.readings.mean() > CONTACT_THRESHOLD:
            before = perf_counter()
            force = self._force(self.readings)
            between = perf_counter()
            self.felt = Recognised(force, self._shape(self.readings, among=tuple(sorted(self.scene.truth))))
            force_time, shape_time = between - before, perf_counter() - between
        self._note(arm, commanded, (stepped - start, read - stepped, force_time, shape_time))
        self._watch(self)
        return self.felt

    def _as_reported(self, readings: Array) -> Array:
        """The pad's readings after transducer and noise [Pa]."""
        if self._transducer is not None:
            readings = self._transducer(readings)
        return readings + self._noise * readings.max() * self._drawn.standard_normal(readings.shape)

    def _note(self, arm: int, commanded: Array | None, times: tuple[float, float, float, float]) -> None:
        nothing = np.full(3, np.nan)
        log = self.log
        log.time.append(self.data.time)
        log.commanded.append(nothing if commanded is None else np.asarray(commanded, dtype=float))
        log.recognised.append(nothing if self.felt is None else self.felt.force.force)
        log.true.append(self.sensor.wrench(self.data)[:3])
        log.arm.append(arm)
        log.seen.append("" if self.felt is None else str(self.felt.shape.shape))
        step, read, force, shape = times
        log.step_time.append(step)
        log.read_time.append(read)
        log.force_time.append(force)
        log.shape_time.append(shape)
