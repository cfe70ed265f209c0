"""The observation `tactile` from a simulation's sensors: readings, wrenches, or results of recognition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import gymnasium
import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.attach import add_pad_sensor, pad_table
from mjtactile.envs.options import TouchOptions
from mjtactile.envs.simulation import Rows
from mjtactile.fidelity import fidelity_text
from mjtactile.transducer.array import ELEMENTS, Transducer
from mjtactile.transducer.imperfections import TYPICAL

if TYPE_CHECKING:
    from mjtactile.recognition import ForceRecogniser


#: Limits of observed readings [Pa], forces [N] and moments [N m]; larger values are clipped.
LARGEST_READING, LARGEST_FORCE, LARGEST_MOMENT = 4e6, 100.0, 1.0
#: Scale of observed readings [Pa]; contacts of the tasks, from a light touch to a firm grip, give about 0.1 to 10.
READING_SCALE = 10e3
#: Full scale of transducers [Pa]; readings under a grip of 20 N are a few hundred kPa.
FULL_SCALE = 200e3
#: Least mean of a pad's readings for recognition [Pa], about 3 gf.
CONTACT_THRESHOLD = 50.0
#: Largest relative variation of pads' sensitivities under full randomisation [-].
GAIN_SPREAD = 0.1
#: Number of recognised values of each pad: force (3) [N], position (2) [m], confidence [-].
RECOGNISED = 6
_WRENCH_LIMITS = np.array([LARGEST_FORCE] * 3 + [LARGEST_MOMENT] * 3)
_RECOGNISED_LIMITS = np.array([LARGEST_FORCE] * 3 + [0.02, 0.02, 1.0])
#: MuJoCo's contact sensor, reduce="netforce".
_NET_FORCE = 3
_OUTPUTS = {"readings": "von_mises", "pascals": "von_mises", "recognised": "von_mises", "wrench": "wrench"}


def observe_pad(spec: mujoco.MjSpec, name: str, options: TouchOptions) -> None:
    """Add the sensor for the observation to the pad on geom `<name>_pad`, replacing an existing one.

    The sensor does not affect the physics.
    """
    for sensor in [sensor for sensor in spec.sensors if sensor.name == name]:
        plugin, count = sensor.plugin, len(spec.plugins)
        spec.delete(sensor)
        # MuJoCo before 3.17 does not delete the sensor's plugin instance, which would abort the process at compile.
        if len(spec.plugins) == count:
            spec.delete(plugin)
    if options.touches:
        table, _ = pad_table(options.pad)
        add_pad_sensor(
            spec,
            name,
            {"pad": table, "fidelity": fidelity_text(options.fidelity), "output": _OUTPUTS[options.observation]},
        )


def feel_force(spec: mujoco.MjSpec, name: str, body: str) -> None:
    """Add a MuJoCo sensor of the total contact force on a pad, world frame [N], for rewards only.

    Only the pad collides on the body; a pad with hollows has several geoms.
    """
    spec.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        objname=body,
        # Which data (bits), which reduction, how many contacts: one net force.
        intprm=[1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, _NET_FORCE, 1],
        needstage=mujoco.mjtStage.mjSTAGE_ACC,
        datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
    )


def sensor_slice(model: mujoco.MjModel, name: str) -> slice:
    """The slice of `sensordata` with a sensor's values."""
    sensor = model.sensor(name)
    return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))


class PadObserver:
    """Observations of the pads of n environments, in the order of the names of the pads' sensors."""

    def __init__(self, model: mujoco.MjModel, names: Sequence[str], options: TouchOptions, count: int) -> None:
        self.options = options
        self.shape = (len(names), *options.finger_pad.reading_shape)
        # Indices of all pads' values in `sensordata`, one pad after the other.
        sensors = [sensor_slice(model, name) for name in names] if options.touches else []
        self._columns = np.array([column for where in sensors for column in range(where.start, where.stop)], dtype=int)
        self._gains = np.ones((count, len(names)))
        # For each environment: the generator of its noise, and its pads' transducers.
        self._drawn = [np.random.default_rng(0) for _ in range(count)]
        self._transducers: list[list[Transducer]] = [[] for _ in range(count)]
        self._recognise = self._recogniser() if options.observation == "recognised" else None
        #: Number of each environment's pads whose readings looked like nothing that the recogniser was taught when they
        #: were last observed, (count,); None if nothing is recognised, or the weights do not say.
        self.unfamiliar = np.zeros(count, int) if self._recognise is not None and self._recognise.taught else None

    @property
    def space(self) -> gymnasium.spaces.Box | None:
        """Space of the observation `tactile` of one environment; None for observation "none"."""
        observation = self.options.observation
        if observation == "none":
            return None
        if observation in ("readings", "pascals"):
            most = LARGEST_READING / (READING_SCALE if observation == "readings" else 1.0)
            return gymnasium.spaces.Box(-most, most, self.shape, np.float32)
        limits = _WRENCH_LIMITS if observation == "wrench" else _RECOGNISED_LIMITS
        high = np.tile(limits, (self.shape[0], 1)).astype(np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    def begin(self, rows: Rows, drawn: Sequence[np.random.Generator]) -> None:
        """Draw sensitivities and transducers for new episodes of some environments.

        Args:
            rows: indices of the environments, shape (k,).
            drawn: k generators, from which noise is drawn as well from now on.
        """
        spread = GAIN_SPREAD * self.options.randomise
        for row, one in zip(rows, drawn, strict=True):
            self._drawn[row] = one
            self._gains[row] = 1.0 + spread * one.uniform(-1.0, 1.0, self._gains.shape[1])
            if self.options.transducer is not None:
                seeds = one.integers(2**31, size=self.shape[0])
                self._transducers[row] = [
                    _transducer(self.options.transducer, self.shape[1:], int(seed)) for seed in seeds
                ]

    def observe(self, sensordata: Array, rows: Rows) -> npt.NDArray[np.float32]:
        """Current observations (k, *space.shape) of k environments, from the sensor data (n, nsensordata) of all."""
        sensed = sensordata[rows[:, None], self._columns].reshape(len(rows), self.shape[0], -1)
        if self.options.observation == "wrench":
            wrenches = self._noisy_wrenches(sensed * self._gains[rows, :, None], rows)
            return np.clip(wrenches, -_WRENCH_LIMITS, _WRENCH_LIMITS).astype(np.float32)
        readings = self._readings(sensed.reshape(len(rows), *self.shape), rows)
        if self._recognise is not None:
            return np.array([self._recognised(pads, row) for row, pads in zip(rows, readings, strict=True)], np.float32)
        seen = readings.astype(np.float32)
        np.minimum(np.maximum(seen, -LARGEST_READING, out=seen), LARGEST_READING, out=seen)
        if self.options.observation == "readings":
            seen /= READING_SCALE
        return seen

    def _readings(self, readings: Array, rows: Rows) -> Array:
        """Readings (k, pads, *reading_shape) [Pa] with sensitivities, transducers and noise; modified in place."""
        of_pad = tuple(range(2, readings.ndim))
        readings *= np.expand_dims(self._gains[rows], of_pad)
        if self.options.transducer is not None:
            for row, pads in zip(rows, readings, strict=True):
                for transducer, pad in zip(self._transducers[row], pads, strict=True):
                    pad[:] = transducer(pad)
        if self.options.noise > 0.0:
            peaks = self.options.noise * readings.max(axis=of_pad, keepdims=True)
            readings += peaks * self._normal(rows, self.shape, np.float32)
        return readings

    def _noisy_wrenches(self, wrenches: Array, rows: Rows) -> Array:
        """Wrenches with noise, relative to the largest component of each force and of each moment."""
        parts = wrenches.reshape(len(rows), -1, 2, 3)
        deviation = self.options.noise * np.abs(parts).max(axis=3, keepdims=True)
        return (parts + deviation * self._normal(rows, parts.shape[1:], np.float64)).reshape(wrenches.shape)

    def _normal(self, rows: Rows, shape: tuple[int, ...], kind: type[np.floating[Any]]) -> npt.NDArray[Any]:
        """Standard normal numbers (k, *shape), from the generator of each environment."""
        numbers = np.empty((len(rows), *shape), kind)
        for row, out in zip(rows, numbers, strict=True):
            self._drawn[row].standard_normal(dtype=kind, out=out)
        return numbers

    def _recognised(self, pads: Array, row: int) -> Array:
        """Recognised values (pads, 6) from readings (pads, *reading_shape) [Pa] of one environment."""
        assert self._recognise is not None
        values, unfamiliar = np.zeros((len(pads), RECOGNISED)), 0
        for readings, out in zip(pads, values, strict=True):
            if readings.mean() < CONTACT_THRESHOLD:
                continue
            found = self._recognise(readings)
            out[:] = [*found.force, *found.position, found.confidence]
            unfamiliar += found.familiarity is not None and not found.familiarity.familiar
        if self.unfamiliar is not None:
            self.unfamiliar[row] = unfamiliar
        return np.clip(values, -_RECOGNISED_LIMITS, _RECOGNISED_LIMITS)

    def _recogniser(self) -> ForceRecogniser:
        from mjtactile import recognition

        return recognition.load("force", pad=self.options.finger_pad, folder=self.options.weights)


def _transducer(kind: str, shape: tuple[int, ...], seed: int) -> Transducer:
    # Free taxels have no neighbours, so there is no crosstalk between them.
    imperfections = replace(TYPICAL, crosstalk=0.0) if len(shape) == 1 else TYPICAL
    return Transducer(ELEMENTS[kind].with_range(FULL_SCALE), imperfections, shape=shape, seed=seed)


#: Least mean reading for a centroid [Pa].
_LEAST = 20.0


def moments(readings: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Statistical moments of readings along the pad's y axis, for each layer of each pad.

    Slip along y moves the pattern or, under a self-aligning fingertip, changes its width. Shear along y makes the
    pattern asymmetric, more so in deeper layers. The normal force scales the pattern.

    Args:
        readings: (..., layers, rows, columns) [Pa].

    Returns:
        (..., layers, 4) [-]: log(1 + mean / 1 kPa), centroid, standard deviation and cube root of the third moment. The
        last three are divided by half the pad's number of rows, and 0 for a mean below 20 Pa.
    """
    profile = readings.mean(axis=-1)
    rows = profile.shape[-1]
    place = (np.arange(rows) - (rows - 1) / 2.0) / (rows / 2.0)
    mean = profile.mean(axis=-1)
    felt = mean > _LEAST
    share = np.where(felt[..., None], profile / np.where(felt, mean * rows, 1.0)[..., None], 0.0)
    centroid = share @ place
    off = place - centroid[..., None]
    second, third = ((share * off**power).sum(axis=-1) for power in (2, 3))
    spread = np.sqrt(np.maximum(second, 0.0)) * felt
    size = np.log1p(np.maximum(mean, 0.0) / 1e3)
    return np.stack([size, centroid, spread, np.cbrt(third) * felt], axis=-1).astype(np.float32)
