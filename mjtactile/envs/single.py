"""A single environment with gymnasium's interface."""

from __future__ import annotations

import os
import sys
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import EzPickle

from mjtactile.envs.drawing import Drawing
from mjtactile.envs.options import check_picture
from mjtactile.envs.registration import task_of
from mjtactile.envs.task import Observation, Task
from mjtactile.errors import EnvError

_ROW = np.zeros(1, dtype=np.int32)


def render_modes() -> list[str]:
    """Render modes that work on this machine; "human" only with a display."""
    window = not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return ["rgb_array", "human"] if window else ["rgb_array"]


def check_render_mode(render_mode: str | None) -> None:
    """Refuse a render mode that does not work on this machine.

    Raises:
        EnvError: the mode does not exist or does not work here.
    """
    if render_mode is not None and not (isinstance(render_mode, str) and render_mode in render_modes()):
        raise EnvError(
            f"render_mode = {render_mode!r} does not work here. Available: {', '.join(render_modes())}, or None. "
            "'human' needs a display."
        )


class TactileEnv(EzPickle, gymnasium.Env[Observation, npt.NDArray[np.float32]]):
    """A single environment of a task; `gymnasium.make` returns it.

    A copy, by `copy.deepcopy` or `pickle`, is a new environment with the same arguments: reset it first.

    Args:
        task: id of the environment, such as "mjtactile/GraspLift-v0", or a `Task` subclass.
        render_mode: "rgb_array", "human" (with a display), or None.
        width: of images [pixels].
        height: of images [pixels].
        options: options of the task, see `TouchOptions` and the task.

    Attributes:
        task: the task with its simulation.

    Raises:
        EnvError: the id or an option does not exist.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": render_modes(), "render_fps": 25}  # type: ignore[misc]

    def __init__(
        self,
        task: str | type[Task],
        *,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 360,
        **options: Any,
    ) -> None:
        EzPickle.__init__(self, task, render_mode=render_mode, width=width, height=height, **options)
        check_render_mode(render_mode)
        check_picture(width, height)
        self.task = task_of(task)(**options)
        self.action_space: gymnasium.Space[Any] = self.task.action_space
        self.observation_space: gymnasium.Space[Any] = self.task.observation_space
        self.render_mode = render_mode
        self._drawing = Drawing(self.task.CAMERA, width, height)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; the same seed begins the same episode.

        Args:
            seed: seed of the episode; None continues the present random stream.
            options: options of the task by name; see the task's class.

        Returns:
            The first observation, and infos.

        Raises:
            EnvError: the task does not know an option: the environment must be reset again then. Or the options are no
                mapping: the episode goes on.
        """
        super().reset(seed=seed)
        self.task.begin(_ROW, [self.np_random], options)
        self._show()
        seen, told = self._seen(), self.task.told() | self.task.felt()
        return seen, {name: values[0].item() for name, values in told.items()}

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Act for one control period.

        Args:
            action: values from -1 to 1, shape (number of actions,).

        Returns:
            Observation, reward, whether the episode terminated, whether it was truncated, and infos.

        Raises:
            EnvError: the action does not have the space's shape or is not finite; or the environment was never reset,
                or its last reset was refused.
        """
        rewards, terminated, truncated, told = self.task.step(np.asarray(action)[None], _ROW)
        self._show()
        seen = self._seen()
        info = {name: values[0].item() for name, values in (told | self.task.felt()).items()}
        return seen, float(rewards[0]), bool(terminated[0]), bool(truncated[0]), info

    def render(self) -> Any:
        """An image (height, width, 3) uint8 for render mode "rgb_array"; None for "human".

        Raises:
            RenderError: OpenGL does not work.
        """
        if self.render_mode == "rgb_array":
            return self._drawing.picture(*self.task.simulation.state(0))
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() draws nothing without a render_mode. Use make(..., render_mode='rgb_array')."
            )
        return None

    def close(self) -> None:
        """Free the renderer."""
        self._drawing.close()

    def _seen(self) -> Observation:
        return {name: values[0] for name, values in self.task.observe(_ROW).items()}

    def _show(self) -> None:
        if self.render_mode == "human":
            self._drawing.show(*self.task.simulation.state(0))
