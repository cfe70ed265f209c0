"""The base class of tasks: options, spaces, beginning of episodes and steps, for n environments at once.

Row k of every array belongs to environment k. A single environment is the case n = 1 of the same code, so its results
are identical to those in a vector environment.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import gymnasium
import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Mask
from mjtactile.envs.options import TouchOptions, refuse_unknown, reset_options
from mjtactile.envs.simulation import Rows, Simulations, SingleSimulation
from mjtactile.envs.touch import PadObserver
from mjtactile.errors import EnvError, shortened
from mjtactile.units import real_numbers

Observation = dict[str, npt.NDArray[np.float32]]
#: Infos by name, each of shape (n,).
Told = dict[str, npt.NDArray[Any]]

#: Largest relative variation of actuators' gains and joints' damping under full randomisation [-].
ACTUATOR_SPREAD, DAMPING_SPREAD = 0.1, 0.2


@dataclass(frozen=True)
class Channel:
    """One component of actions or observations; spaces and documentation are made from these.

    Attributes:
        name: name of the component.
        unit: unit of its value, "-" for none.
        low: least value; smaller ones are clipped.
        high: largest value; larger ones are clipped.
        meaning: description of the component; for an action, the meaning of -1 to 1.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str


class Task(ABC):
    """n environments of one kind.

    A task is a subclass in a file of its own with its constants, its model and the abstract methods below, which work
    on arrays of all environments. It accesses its simulations only through `self.simulation` and draws only from the
    given generators, so that the seed determines everything.

    `_act` and `_judge` are called for all environments at each step. The simulation of an environment that waits for
    its reset does not advance, and the values that they wrote for it are overwritten at the reset.

    Args:
        simulate: function that makes the simulations of a model; by default a single one.
        noise: see `TouchOptions`; None for the task's default.
        options: the other arguments of `TouchOptions`.

    Attributes:
        options: observation of the pads.
        simulation: the simulations of all environments.
        touch: observer of the environments' pads.
        steps: number of steps since the episode began, shape (n,); -1 before the first reset, and after a refused one.
        action_space: space of the actions of one environment.
        observation_space: space of the observations of one environment.

    Raises:
        EnvError: an option is invalid.
    """

    #: Description of the task in a sentence.
    SUMMARY: ClassVar[str]
    #: Components of actions, each from -1 to 1, and of the observation `proprioception`.
    ACTIONS: ClassVar[tuple[Channel, ...]]
    PROPRIOCEPTION: ClassVar[tuple[Channel, ...]]
    #: Names of the pads' sensors.
    PADS: ClassVar[tuple[str, ...]]
    #: MuJoCo's time step [s], MuJoCo steps per environment step, and environment steps per episode.
    TIMESTEP: ClassVar[float]
    SUBSTEPS: ClassVar[int]
    EPISODE_STEPS: ClassVar[int]
    #: Name of the camera for rendering.
    CAMERA: ClassVar[str] = "task"
    #: Default noise [-], see `TouchOptions`.
    NOISE: ClassVar[float] = 0.01

    def __init__(
        self,
        *,
        simulate: Callable[[mujoco.MjModel], Simulations] = SingleSimulation,
        noise: float | None = None,
        **options: Any,
    ) -> None:
        refuse_unknown(options, type(self).__name__)
        self.options = TouchOptions(noise=self.NOISE if noise is None else noise, **options)
        self.simulation = simulate(self.model(self.options))
        model, count = self.simulation.model, self.simulation.count
        self.touch = PadObserver(model, self.PADS, self.options, count)
        self.steps = np.full(count, -1)
        self.action_space = _box(self.ACTIONS)
        self._own = _box(self.PROPRIOCEPTION)
        spaces: dict[str, gymnasium.Space[Any]] = {"proprioception": self._own}
        if self.touch.space is not None:
            spaces["tactile"] = self.touch.space
        self.observation_space = gymnasium.spaces.Dict(spaces)
        self._nominal = {
            name: np.array(getattr(model, name)) for name in ("actuator_gainprm", "actuator_biasprm", "dof_damping")
        }

    @property
    def period(self) -> float:
        """Duration of an environment step [s]."""
        return self.TIMESTEP * self.SUBSTEPS

    @classmethod
    @abstractmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """The task's model; episodes differ in some fields and the state only."""

    @abstractmethod
    def _draw(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any]) -> None:
        """Draw the random quantities of the next episodes of some environments, and write fields of the model.

        Args:
            rows: indices of the environments, shape (k,).
            drawn: k generators to draw from.
            options: options of `reset`; remove those that are used: any that are left are refused afterwards.

        Raises:
            EnvError: an option of `reset` is invalid.
        """

    @abstractmethod
    def _place(self, rows: Rows) -> None:
        """Write the initial state of the episodes of some environments."""

    @abstractmethod
    def _act(self, actions: Array) -> None:
        """Write controls for actions (n, number of actions), which are within their space."""

    @abstractmethod
    def _proprioception(self) -> Array:
        """Values of PROPRIOCEPTION in its order, shape (n, their number); without side effects."""

    @abstractmethod
    def _judge(self) -> tuple[Array, Mask, Told]:
        """Rewards of the step, (n,), whether it ends the episodes, (n,), and infos; called once per step."""

    def told(self) -> Told:
        """Infos at the beginning of an episode."""
        return {}

    def felt(self) -> Told:
        """Infos on the last observation; they exist for recognised touch only."""
        return {} if self.touch.unfamiliar is None else {"unfamiliar": self.touch.unfamiliar.copy()}

    def begin(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any] | None = None) -> None:
        """Begin episodes in some environments; generators in the same state begin the same episodes.

        Args:
            rows: indices of the environments, shape (k,).
            drawn: k generators to draw from.
            options: options of `reset`, the same for all; see the tasks.

        Raises:
            EnvError: the task does not know an option: the environments must be reset again then. Or the options are no
                mapping: the episodes go on.
        """
        asked = reset_options(options)
        self.steps[rows] = -1  # until all is done: a reset that is refused has begun nothing
        self._randomise(rows, drawn)
        self._draw(rows, drawn, asked)
        if asked:
            name = next(iter(asked))
            raise EnvError(f"{type(self).__name__} knows no reset option {shortened(name)}. Leave it out.")
        # Separate streams: random numbers of later episodes must not depend on the number of observations in this one.
        noise = [np.random.default_rng(one.integers(2**63)) for one in drawn]
        self.simulation.reset(rows)
        self._place(rows)
        self.simulation.forward(rows)
        self.touch.begin(rows, noise)
        self.steps[rows] = 0

    def step(self, actions: npt.NDArray[np.float32], rows: Rows) -> tuple[Array, Mask, Mask, Told]:
        """Act for one control period.

        Args:
            actions: actions of all environments, shape (n, number of actions).
            rows: indices of the environments that advance, shape (k,).

        Returns:
            Rewards, terminated, truncated, each of shape (n,), and infos; values of environments that do not advance
            are undefined.

        Raises:
            EnvError: actions do not have the space's shape, or are not finite for an environment that advances; or an
                environment was never reset, or its last reset was refused.
        """
        if self.steps.min() < 0:
            raise EnvError("no episode has begun, or the last reset was refused: reset first.")
        shape = (self.simulation.count, len(self.ACTIONS))
        given = real_numbers(actions)
        if given is None or given.shape != shape or not np.isfinite(given[rows]).all():
            raise EnvError(
                f"action = {actions}; expected {shape[1]} finite numbers from -1 to 1: "
                f"{', '.join(channel.name for channel in self.ACTIONS)}"
                f"{f', for each of {shape[0]} environments' if shape[0] > 1 else ''}."
            )
        given = given.astype(float)
        if len(rows) < len(given):
            # Environments that do not advance get valid numbers.
            running = np.zeros_like(given)
            running[rows] = given[rows]
            given = running
        self._act(within(given, -1.0, 1.0))
        self.simulation.step(rows, self.SUBSTEPS)
        self.steps += 1
        rewards, terminated, told = self._judge()
        return rewards, terminated, ~terminated & (self.steps >= self.EPISODE_STEPS), told

    def observe(self, rows: Rows) -> Observation:
        """Observations of some environments by name, (k, ...); call it once per step, since it draws new noise."""
        own = self._proprioception()[rows].astype(np.float32, order="C")
        own = np.minimum(np.maximum(own, self._own.low), self._own.high)
        if not self.options.touches:
            return {"proprioception": own}
        return {"proprioception": own, "tactile": self.touch.observe(self.simulation.sensordata, rows)}

    def _time_left(self) -> Array:
        """Remaining fraction of the episode's steps [-], shape (n,)."""
        return 1.0 - self.steps / self.EPISODE_STEPS

    def _randomise(self, rows: Rows, drawn: Sequence[np.random.Generator]) -> None:
        """Vary actuators and joints for domain randomisation; always draws, so that seeds are comparable."""
        actuators, joints = self.simulation.model.nu, self.simulation.model.nv
        draws = np.array([one.uniform(-1.0, 1.0, actuators + joints) for one in drawn])
        if self.options.randomise == 0.0:
            return
        strength = 1.0 + ACTUATOR_SPREAD * self.options.randomise * draws[:, :actuators, None]
        damping = 1.0 + DAMPING_SPREAD * self.options.randomise * draws[:, actuators:]
        for name, factor in (("actuator_gainprm", strength), ("actuator_biasprm", strength), ("dof_damping", damping)):
            self.simulation.field(name)[rows] = self._nominal[name] * factor


def within(values: Array, low: Array | float, high: Array | float) -> Array:
    """Values clipped to a range, as by `np.clip`, which is several times slower for single numbers."""
    return np.minimum(np.maximum(values, low), high)


def _box(channels: Sequence[Channel]) -> gymnasium.spaces.Box:
    """The float32 space of some components."""
    low, high = (np.array([getattr(channel, end) for channel in channels], np.float32) for end in ("low", "high"))
    return gymnasium.spaces.Box(low, high, dtype=np.float32)
