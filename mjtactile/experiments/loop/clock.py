"""The clock of the loop: MuJoCo steps at 1 kHz; at every tick, a few steps apart, the pad is read and recognised.

The controller gets a `Recognised` only. The true wrench goes into the log, for evaluation.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.errors import ContactWarning, MjTactileError
from mjtactile.experiments.loop.known import Recognised, home
from mjtactile.experiments.loop.scene import AXES, TIMESTEP, LoopScene
from mjtactile.recognition import ForceRecogniser, ShapeRecogniser
from mjtactile.sensor import TactileSensor
from mjtactile.transducer.array import Transducer

#: Nothing presses while the mean of all readings is below this [Pa]. Three gram-force read more; the noise of single
#: taxels, of a few hundred pascals at the worst, falls to a tenth of it in the mean.
CONTACT_THRESHOLD = 50.0


def steps_between(rate: int) -> int:
    """Number of MuJoCo steps between ticks, for a rate of ticks [Hz].

    Raises:
        MjTactileError: for a rate that does not divide 1000.
    """
    every = round(1.0 / (TIMESTEP * rate)) if 0 < rate <= 1.0 / TIMESTEP else 0
    if every < 1 or abs(every * TIMESTEP * rate - 1.0) > 1e-9:
        raise MjTactileError(f"rate = {rate} Hz does not divide 1000 Hz; expected for example 200, 250 or 500.")
    return every


@dataclass(eq=False)
class Log:
    """Record of a run: one row for each tick."""

    time: list[float] = field(default_factory=list)  #: simulated [s]
    commanded: list[Array] = field(default_factory=list)  #: force on the pad [N]; NaN where none
    recognised: list[Array] = field(default_factory=list)  #: the same, as recognised; NaN where nothing was felt
    true: list[Array] = field(default_factory=list)  #: MuJoCo's contact force on the pad [N]
    arm: list[int] = field(default_factory=list)  #: that is being moved
    seen: list[str] = field(default_factory=list)  #: shape recognised, "" where nothing was felt
    read_time: list[float] = field(default_factory=list)  #: reading the sensor [s]
    force_time: list[float] = field(default_factory=list)  #: recognising the force [s]; NaN where nothing was felt
    shape_time: list[float] = field(default_factory=list)  #: recognising the shape [s]
    step_time: list[float] = field(default_factory=list)  #: MuJoCo's steps [s]


@dataclass(frozen=True, kw_only=True)
class LoopSettings:
    """Settings of a run."""

    seed: int = 0  #: of the order and poses of the punches, the commanded forces and the noise
    presses: int = 4  #: commanded forces
    sort: bool = True  #: whether the punches are sorted
    rate: int = 200  #: of readings and recognition [Hz], in simulated time
    noise: float = 0.01  #: standard deviation over a reading's largest taxel [-]
    fidelity: str = "precise"  #: of the readings, which recognisers are taught on
    layers: str = "all"  #: recognisers that see "all" sensing layers or the "top" one


class Loop:
    """Steps a scene, and recognises force and shape from its pad's readings.

    Args:
        scene: what is stepped.
        sensor: of its pad.
        recognisers: of force and of shape.
        settings: rate, which divides 1000 Hz, noise and its seed are used.
        transducer: what the readings go through; None: ideal.
        watch: called after each tick with this loop: draws, shows.

    Raises:
        MjTactileError: for a rate that does not divide 1000.
    """

    def __init__(
        self,
        scene: LoopScene,
        sensor: TactileSensor,
        recognisers: tuple[ForceRecogniser, ShapeRecogniser],
        settings: LoopSettings,
        *,
        transducer: Transducer | None = None,
        watch: Callable[[Loop], None] = lambda loop: None,
    ) -> None:
        every = steps_between(settings.rate)
        self.scene, self.sensor = scene, sensor
        self.data = mujoco.MjData(scene.model)
        self.period = every * TIMESTEP
        self.targets = np.array([home(arm) for arm in range(len(scene.truth))])
        self.log = Log()
        self.readings = np.zeros(sensor.pad.reading_shape)
        self.felt: Recognised | None = None
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
        """Step the simulation by one tick and recognise the contact.

        Args:
            arm: index of the moving arm, for the log.
            commanded: force commanded to it [N], for the log.

        Returns:
            The recognised contact; None without contact.
        """
        start = perf_counter()
        self.data.ctrl[self._actuators] = (self.targets - self._homes).ravel()
        for _ in range(self._every):
            mujoco.mj_step(self.scene.model, self.data)
        stepped = perf_counter()
        with warnings.catch_warnings():
            # A punch that rocks for a moment may press on less than its face carries; the nearest load is right then.
            warnings.simplefilter("ignore", ContactWarning)
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
