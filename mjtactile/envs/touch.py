"""From a simulation's sensors to the observation `tactile`: readings, wrenches or what was recognised of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import gymnasium
import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile.attach import add_pad_sensor, pad_table
from mjtactile.envs.options import TouchOptions
from mjtactile.pad import Array, Pad
from mjtactile.transducer import TYPICAL, CapacitiveCell, PiezoresistiveElement, Transducer

if TYPE_CHECKING:
    from mjtactile.recognition import ForceRecogniser

#: Largest reading shown [Pa], force [N] and moment [N m]; what is beyond is cut off.
LARGEST_READING, LARGEST_FORCE, LARGEST_MOMENT = 4e6, 100.0, 1.0
#: Of transducers that readings go through [Pa]: a grip of 20 N reads some hundred kPa.
FULL_SCALE = 200e3
#: Nothing is recognised while the mean of a pad's readings is below this [Pa], some 3 gf.
CONTACT_THRESHOLD = 50.0
#: Pads' sensitivities differ by up to this under full randomisation [-].
GAIN_SPREAD = 0.1
#: What is recognised of each pad: force (3) [N], position (2) [m], confidence [-].
RECOGNISED = 6
_WRENCH_LIMITS = np.array([LARGEST_FORCE] * 3 + [LARGEST_MOMENT] * 3)
_RECOGNISED_LIMITS = np.array([LARGEST_FORCE] * 3 + [0.02, 0.02, 1.0])
#: MuJoCo's contact sensor, reduce="netforce".
_NET_FORCE = 3
_OUTPUTS = {"readings": "von_mises", "recognised": "von_mises", "wrench": "wrench"}


def observe_pad(spec: mujoco.MjSpec, name: str, options: TouchOptions) -> None:
    """Give the pad on geom `<name>_pad` the sensor that the options ask for, in place of one it may have.

    The physics is the same either way: what a blind agent touches behaves as what a feeling one does.
    """
    for sensor in [sensor for sensor in spec.sensors if sensor.name == name]:
        spec.delete(sensor)
    if options.touches:
        table, _ = pad_table(options.pad)
        add_pad_sensor(
            spec, name, {"pad": table, "fidelity": options.fidelity, "output": _OUTPUTS[options.observation]}
        )


def feel_force(spec: mujoco.MjSpec, name: str, geom: str) -> None:
    """A sensor of MuJoCo's own: total contact force of a geom, world frame [N], for the examiner alone."""
    spec.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname=geom,
        # Which data (bits), which reduction, how many contacts: one net force.
        intprm=[1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, _NET_FORCE, 1],
        needstage=mujoco.mjtStage.mjSTAGE_ACC,
        datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
    )


def sensor_slice(model: mujoco.MjModel, name: str) -> slice:
    """Where a sensor's values stand in `sensordata`."""
    sensor = model.sensor(name)
    return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))


class Touch:
    """The pads of one environment, as it observes them.

    Args:
        model: compiled.
        names: of the pads' sensors, in the order of the observation.
        options: what is seen of them.
    """

    def __init__(self, model: mujoco.MjModel, names: Sequence[str], options: TouchOptions) -> None:
        self.options = options
        self.shape = (len(names), *(options.pad or Pad()).reading_shape)
        self._sensors = [sensor_slice(model, name) for name in names] if options.touches else []
        self._gains = np.ones(len(names))
        self._transducers: list[Transducer] = []
        self._recognise = self._recogniser() if options.observation == "recognised" else None

    @property
    def space(self) -> gymnasium.spaces.Box | None:
        """Of the observation `tactile`; None where there is none."""
        pads = len(self._sensors)
        if self.options.observation == "readings":
            return gymnasium.spaces.Box(-LARGEST_READING, LARGEST_READING, self.shape, np.float32)
        if self.options.observation == "none":
            return None
        most = _WRENCH_LIMITS if self.options.observation == "wrench" else _RECOGNISED_LIMITS
        high = np.tile(most, (pads, 1)).astype(np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    def begin(self, drawn: np.random.Generator) -> None:
        """A new episode: sensitivities, and transducers with what is wrong with them."""
        spread = GAIN_SPREAD * self.options.randomise
        self._gains = 1.0 + spread * drawn.uniform(-1.0, 1.0, len(self._gains))
        if self.options.transducer is not None:
            seeds = drawn.integers(2**31, size=len(self._sensors))
            self._transducers = [_transducer(self.options.transducer, self.shape[1:], int(seed)) for seed in seeds]

    def observe(self, sensordata: Array, drawn: np.random.Generator) -> npt.NDArray[np.float32]:
        """What is seen now, of the space's shape."""
        if self.options.observation == "wrench":
            wrenches = np.array([sensordata[where] for where in self._sensors]) * self._gains[:, None]
            return np.clip(self._noisy_wrenches(wrenches, drawn), -_WRENCH_LIMITS, _WRENCH_LIMITS).astype(np.float32)
        readings = np.array([sensordata[where] for where in self._sensors]).reshape(self.shape)
        readings *= self._gains[:, None, None, None]
        for transducer, pad in zip(self._transducers, readings, strict=False):
            pad[:] = transducer(pad)
        if self.options.noise > 0.0:
            peaks = self.options.noise * readings.max(axis=(1, 2, 3), keepdims=True)
            readings += peaks * drawn.standard_normal(readings.shape, dtype=np.float32)
        if self._recognise is not None:
            return np.array([self._recognised(pad) for pad in readings], np.float32)
        return np.clip(readings, -LARGEST_READING, LARGEST_READING).astype(np.float32)

    def _noisy_wrenches(self, wrenches: Array, drawn: np.random.Generator) -> Array:
        """Forces with noise relative to the largest of their components, and so moments."""
        parts = wrenches.reshape(-1, 2, 3)
        deviation = self.options.noise * np.abs(parts).max(axis=2, keepdims=True)
        return (parts + deviation * drawn.standard_normal(parts.shape)).reshape(-1, 6)

    def _recognised(self, readings: Array) -> Array:
        if self._recognise is None or readings.mean() < CONTACT_THRESHOLD:
            return np.zeros(RECOGNISED)
        found = self._recognise(readings)
        return np.clip([*found.force, *found.position, found.confidence], -_RECOGNISED_LIMITS, _RECOGNISED_LIMITS)

    def _recogniser(self) -> ForceRecogniser:
        from mjtactile import recognition

        return recognition.load("force", pad=self.options.pad or Pad())


def _transducer(kind: str, shape: tuple[int, ...], seed: int) -> Transducer:
    nominal = PiezoresistiveElement()
    element = (
        CapacitiveCell.with_range(FULL_SCALE)
        if kind == "capacitive"
        else PiezoresistiveElement(area=nominal.full_force / FULL_SCALE)
    )
    layers, rows, columns = shape
    return Transducer(element, TYPICAL, shape=(layers, rows, columns), seed=seed)
