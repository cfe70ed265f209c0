"""What all tasks share: their options and spaces, how episodes begin, and the step; for n environments at once.

Row k of every array is environment k's. A single environment is n = 1: whatever is computed for it is computed by the
same code, element by element, so that its bits are those of one among many.
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
from mjtactile.envs.options import EnvError, TouchOptions
from mjtactile.envs.simulation import Rows, Simulations, SingleSimulation
from mjtactile.envs.touch import PadObserver

Observation = dict[str, npt.NDArray[np.float32]]
#: What there is to say besides, by name, each of shape (n,).
Told = dict[str, npt.NDArray[Any]]

#: Actuators' gains and joints' damping differ by up to this under full randomisation [-].
ACTUATOR_SPREAD, DAMPING_SPREAD = 0.1, 0.2


@dataclass(frozen=True)
class Channel:
    """One number that goes in or out, described where it is defined: spaces and documentation come from here.

    Attributes:
        name: what it is.
        unit: of the number, "-" for none.
        low, high: its range; what would lie outside is cut off.
        meaning: in a sentence; for an action, what -1 to 1 stand for.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str


class Task(ABC):
    """n environments of one kind.

    A task is a subclass in a file of its own: its constants, its model, and the methods below that are abstract, each
    written once on arrays of all environments. It sees its simulations through `self.simulation` and draws from the
    generators it is given, nothing else, so that a seed decides everything.

    `_act` and `_judge` are called for all environments at each step. Where one waits to begin anew, its simulation
    stands still, and what they wrote is overwritten when it begins.

    Args:
        simulate: makes the simulations of a model; by default one.
        noise: see `TouchOptions`; None for the task's own.
        options: the others of `TouchOptions`.

    Attributes:
        options: what is seen of the pads.
        simulation: of all environments.
        touch: their pads.
        steps: since the episode began, shape (n,); -1 where none ever did.
        action_space, observation_space: of one environment.

    Raises:
        EnvError: for an option that makes no sense.
    """

    #: What the task is, in a sentence.
    SUMMARY: ClassVar[str]
    #: What goes in, each from -1 to 1, and what comes out besides touch.
    ACTIONS: ClassVar[tuple[Channel, ...]]
    PROPRIOCEPTION: ClassVar[tuple[Channel, ...]]
    #: Names of the pads' sensors.
    PADS: ClassVar[tuple[str, ...]]
    #: Of MuJoCo [s], its steps in one of the environment, and the latter's in an episode.
    TIMESTEP: ClassVar[float]
    SUBSTEPS: ClassVar[int]
    EPISODE_STEPS: ClassVar[int]
    #: Name of the camera that draws.
    CAMERA: ClassVar[str] = "task"
    #: Noise where none is asked for [-].
    NOISE: ClassVar[float] = 0.01

    def __init__(
        self,
        *,
        simulate: Callable[[mujoco.MjModel], Simulations] = SingleSimulation,
        noise: float | None = None,
        **options: Any,
    ) -> None:
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
        """Of a step [s]."""
        return self.TIMESTEP * self.SUBSTEPS

    @classmethod
    @abstractmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """The task's model; the same for every episode but for fields and state."""

    @abstractmethod
    def _draw(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any]) -> None:
        """Draw what differs in the next episode of some environments, and write what of it are fields of the model.

        Args:
            rows: of the environments, shape (k,).
            drawn: from, k generators.
            options: of `reset`, to empty.

        Raises:
            EnvError: for an option of `reset` that makes no sense.
        """

    @abstractmethod
    def _place(self, rows: Rows) -> None:
        """Write the state in which episodes of some environments begin."""

    @abstractmethod
    def _act(self, actions: Array) -> None:
        """Write controls; actions (n, number of actions) are within their space."""

    @abstractmethod
    def _proprioception(self) -> Array:
        """What is felt of the own body, in the order of PROPRIOCEPTION, shape (n, their number); changes nothing."""

    @abstractmethod
    def _judge(self) -> tuple[Array, Mask, Told]:
        """Rewards of the step, which episodes it ends, and what else there is to say; called once a step."""

    def told(self) -> Told:
        """What else there is to say when an episode begins."""
        return {}

    def begin(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any] | None = None) -> None:
        """Begin episodes in some environments; generators in the same state begin the same ones.

        Args:
            rows: of the environments, shape (k,).
            drawn: from, k generators.
            options: of the task, the same for all; what they may be is said by each task.

        Raises:
            EnvError: for options the task does not know.
        """
        self.steps[rows] = 0
        self._randomise(rows, drawn)
        self._draw(rows, drawn, dict(options or {}))
        # Streams of their own: what is drawn for later episodes must not depend on how much was observed in this one.
        noise = [np.random.default_rng(one.integers(2**63)) for one in drawn]
        self.simulation.reset(rows)
        self._place(rows)
        self.simulation.forward(rows)
        self.touch.begin(rows, noise)

    def step(self, actions: npt.NDArray[np.float32], rows: Rows) -> tuple[Array, Mask, Mask, Told]:
        """Act for one control period.

        Args:
            actions: of all environments, shape (n, number of actions).
            rows: that run, shape (k,); the others stand still.

        Returns:
            Rewards, whether terminated, whether truncated, each of shape (n,), and what else there is to say; of rows
            that do not run, nothing of it means anything.

        Raises:
            EnvError: actions are not of the space's shape, or not finite where something runs; or there is an
                environment that was never reset.
        """
        if self.steps.min() < 0:
            raise EnvError("no episode has begun: reset first.")
        given = np.asarray(actions, dtype=float)
        shape = (self.simulation.count, len(self.ACTIONS))
        if given.shape != shape or not np.isfinite(given[rows]).all():
            raise EnvError(
                f"action = {actions}; expected {shape[1]} finite numbers from -1 to 1: "
                f"{', '.join(channel.name for channel in self.ACTIONS)}"
                f"{', for each of so many environments: ' + str(shape[0]) if shape[0] > 1 else ''}."
            )
        if len(rows) < len(given):
            # What stands still is given numbers that nothing stumbles over.
            running = np.zeros_like(given)
            running[rows] = given[rows]
            given = running
        self._act(within(given, -1.0, 1.0))
        self.simulation.step(rows, self.SUBSTEPS)
        self.steps += 1
        rewards, terminated, told = self._judge()
        return rewards, terminated, ~terminated & (self.steps >= self.EPISODE_STEPS), told

    def observe(self, rows: Rows) -> Observation:
        """What some environments see now, (k, ...) by name; once a step of each, as each look has noise of its own."""
        own = self._proprioception()[rows].astype(np.float32, order="C")
        own = np.minimum(np.maximum(own, self._own.low), self._own.high)
        if not self.options.touches:
            return {"proprioception": own}
        return {"proprioception": own, "tactile": self.touch.observe(self.simulation.sensordata, rows)}

    def _time_left(self) -> Array:
        """Share of the episode's steps, shape (n,)."""
        return 1.0 - self.steps / self.EPISODE_STEPS

    def _randomise(self, rows: Rows, drawn: Sequence[np.random.Generator]) -> None:
        """Actuators and joints a little off, under domain randomisation; drawn always, so that seeds mean the same."""
        actuators, joints = self.simulation.model.nu, self.simulation.model.nv
        draws = np.array([one.uniform(-1.0, 1.0, actuators + joints) for one in drawn])
        if self.options.randomise == 0.0:
            return
        strength = 1.0 + ACTUATOR_SPREAD * self.options.randomise * draws[:, :actuators, None]
        damping = 1.0 + DAMPING_SPREAD * self.options.randomise * draws[:, actuators:]
        for name, factor in (("actuator_gainprm", strength), ("actuator_biasprm", strength), ("dof_damping", damping)):
            self.simulation.field(name)[rows] = self._nominal[name] * factor


def within(values: Array, low: Array | float, high: Array | float) -> Array:
    """Values cut off at the ends of a range; `np.clip`, which takes several times as long for one number."""
    return np.minimum(np.maximum(values, low), high)


def _box(channels: Sequence[Channel]) -> gymnasium.spaces.Box:
    """The space of so many numbers, float32."""
    low, high = (np.array([getattr(channel, end) for channel in channels], np.float32) for end in ("low", "high"))
    return gymnasium.spaces.Box(low, high, dtype=np.float32)
