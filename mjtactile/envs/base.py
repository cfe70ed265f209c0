"""What all environments share: spaces, seeds, options, the step, drawing."""

from __future__ import annotations

import os
import sys
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import gymnasium
import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile.envs.channel import Channel, box
from mjtactile.envs.drawing import Drawing
from mjtactile.envs.options import EnvError, TouchOptions
from mjtactile.envs.simulation import Simulation, SingleSimulation
from mjtactile.envs.touch import Touch
from mjtactile.pad import Array, Pad

Observation = dict[str, npt.NDArray[np.float32]]

#: Actuators' gains and joints' damping differ by up to this under full randomisation [-].
ACTUATOR_SPREAD, DAMPING_SPREAD = 0.1, 0.2


def render_modes() -> list[str]:
    """Ways to draw that there are here: a window only where there is a screen."""
    window = not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return ["rgb_array", "human"] if window else ["rgb_array"]


class TactileEnv(gymnasium.Env[Observation, npt.NDArray[np.float32]], ABC):
    """An environment with pads, in MuJoCo.

    A task is a subclass: its constants, its model, and what happens at a reset and after a step. It sees its simulation
    through `self.simulation` and draws from `self.np_random`, nothing else, so that a seed decides everything, and one
    environment of many (many.py) goes through the same states as one alone.

    Args:
        observation, fidelity, transducer, noise, randomise, pad: see `TouchOptions`.
        render_mode: "rgb_array", "human" where there is a screen, or None.
        width, height: of pictures [pixels].
        simulation: where it runs; by default in a simulation of its own.

    Raises:
        EnvError: for an option that does not exist.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": render_modes(), "render_fps": 25}  # type: ignore[misc]

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
        observation: str = "readings",
        fidelity: str = "fast",
        transducer: str | None = None,
        noise: float | None = None,
        randomise: float = 0.0,
        pad: Pad | None = None,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 360,
        simulation: Simulation | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise EnvError(
                f"render_mode = {render_mode!r} is not to be had here. Available: "
                f"{', '.join(self.metadata['render_modes'])}, or None. 'human' needs a screen."
            )
        self.options = TouchOptions(
            observation=observation,
            fidelity=fidelity,
            transducer=transducer,
            noise=self.NOISE if noise is None else noise,
            randomise=randomise,
            pad=pad,
        )
        self.render_mode = render_mode
        self.simulation = SingleSimulation(self.model(self.options)) if simulation is None else simulation
        self.touch = Touch(self.simulation.model, self.PADS, self.options)
        self.action_space: gymnasium.Space[Any] = box(self.ACTIONS)
        spaces: dict[str, gymnasium.Space[Any]] = {"proprioception": box(self.PROPRIOCEPTION)}
        if self.touch.space is not None:
            spaces["tactile"] = self.touch.space
        self.observation_space: gymnasium.Space[Any] = gymnasium.spaces.Dict(spaces)
        self.steps = 0
        self._drawing = Drawing(self.CAMERA, width, height)
        self._nominal = {
            name: np.array(self.simulation.field(name))
            for name in ("actuator_gainprm", "actuator_biasprm", "dof_damping")
        }
        self._low, self._high = (getattr(spaces["proprioception"], end) for end in ("low", "high"))

    @classmethod
    @abstractmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """The task's model; the same for every episode but for fields and state."""

    @abstractmethod
    def _draw_episode(self, options: dict[str, Any]) -> None:
        """Draw what differs in this episode, and write what of it are fields of the model.

        Raises:
            EnvError: for an option of `reset` that makes no sense.
        """

    @abstractmethod
    def _place(self) -> None:
        """Write the state the episode begins in."""

    @abstractmethod
    def _act(self, action: Array) -> None:
        """Write controls; the action is within its space."""

    @abstractmethod
    def _proprioception(self) -> Array:
        """What is felt of the own body, in the order of PROPRIOCEPTION."""

    @abstractmethod
    def _judge(self) -> tuple[float, bool, dict[str, Any]]:
        """Reward of the step, whether it ends the episode, and what else there is to say; called once a step."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; the same seed begins the same one.

        Raises:
            EnvError: for options the task does not know.
        """
        super().reset(seed=seed)
        self.steps = 0
        self._randomise()
        self._draw_episode(dict(options or {}))
        # A stream of its own: what is drawn for later episodes must not depend on how much was observed in this one.
        self._noise = np.random.default_rng(self.np_random.integers(2**63))
        self.simulation.reset()
        self._place()
        self.simulation.forward()
        self.touch.begin(self._noise)
        self._drawn()
        return self._observation(), self._info()

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Act for one control period."""
        self.begin_step(action)
        self.simulation.step(self.SUBSTEPS)
        return self.end_step()

    def begin_step(self, action: npt.NDArray[np.float32]) -> None:
        """The part of a step before the simulation's.

        Raises:
            EnvError: the action is not of the space's shape, or not finite.
        """
        given = np.asarray(action, dtype=float)
        if given.shape != self.action_space.shape or not np.isfinite(given).all():
            raise EnvError(
                f"action = {action}; expected {len(self.ACTIONS)} finite numbers from -1 to 1: "
                f"{', '.join(channel.name for channel in self.ACTIONS)}."
            )
        self._act(np.clip(given, -1.0, 1.0))

    def end_step(self) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """The part of a step after the simulation's."""
        self.steps += 1
        reward, terminated, info = self._judge()
        self._drawn()
        truncated = not terminated and self.steps >= self.EPISODE_STEPS
        return self._observation(), float(reward), bool(terminated), truncated, info

    def render(self) -> Any:
        """A picture (height, width, 3) uint8 of "rgb_array"; of "human", None.

        Raises:
            RenderError: there is no working OpenGL.
        """
        if self.render_mode == "rgb_array":
            return self._drawing.picture(*self.simulation.state())
        if self.render_mode is None:
            gymnasium.logger.warn("render() without a render_mode draws nothing: make(..., render_mode='rgb_array').")
        return None

    def close(self) -> None:
        """Free what drawing took."""
        self._drawing.close()

    def _info(self) -> dict[str, Any]:
        """What else there is to say at a reset."""
        return {}

    def _observation(self) -> Observation:
        own = np.clip(self._proprioception().astype(np.float32), self._low, self._high)
        if not self.options.touches:
            return {"proprioception": own}
        return {
            "proprioception": own,
            "tactile": self.touch.observe(self.simulation.sensordata, self._noise),
        }

    def _randomise(self) -> None:
        """Actuators and joints a little off, under domain randomisation; drawn always, so that seeds mean the same."""
        actuators, joints = self.simulation.model.nu, self.simulation.model.nv
        strength = 1.0 + ACTUATOR_SPREAD * self.options.randomise * self.np_random.uniform(-1.0, 1.0, (actuators, 1))
        damping = 1.0 + DAMPING_SPREAD * self.options.randomise * self.np_random.uniform(-1.0, 1.0, joints)
        for name, factor in (("actuator_gainprm", strength), ("actuator_biasprm", strength), ("dof_damping", damping)):
            self.simulation.field(name)[...] = self._nominal[name] * factor

    def _drawn(self) -> None:
        if self.render_mode == "human":
            self._drawing.show(*self.simulation.state())
