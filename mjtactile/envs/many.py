"""Vector environments, which run on `mujoco.batch` if this MuJoCo has it, otherwise one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space

from mjtactile._types import Array, Mask
from mjtactile.envs.drawing import Drawing
from mjtactile.envs.options import check_picture, reset_options
from mjtactile.envs.registration import task_of
from mjtactile.envs.simulation import BatchSimulations, Rows
from mjtactile.envs.single import TactileEnv, check_render_mode
from mjtactile.envs.task import Observation, Task, Told
from mjtactile.errors import EnvError, shortened
from mjtactile.units import is_whole


def make_vec(
    task: str | type[Task],
    num_envs: int = 1,
    *,
    threads: int = 0,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    copy: bool = True,
    batched: bool | None = None,
    **options: Any,
) -> VectorEnv[Any, Any, Any]:
    """A vector environment with exactly the results of single environments.

    Environment i after `reset(seed=s)` equals `gymnasium.make(name)` after `reset(seed=s + i)`, bit by bit.

    Args:
        task: id of an environment of this package, or a `Task` subclass.
        num_envs: number of environments.
        threads: simulation threads on `mujoco.batch`; 0 for the number of processors.
        autoreset_mode: see `gymnasium.vector.AutoresetMode`; a mode or its name.
        copy: whether returned observations are copies; if not, the next step may overwrite them.
        batched: whether to use `mujoco.batch`; None: if it exists.
        options: options of the environments, see `TactileEnv`.

    Returns:
        The environments. For an id, their `spec` has all of these arguments, so that `gymnasium.make_vec(envs.spec)`
        makes the same again.

    Raises:
        EnvError: there is no such environment, option or autoreset mode, `mujoco.batch` was requested but does not
            exist, `num_envs` is no whole number of at least one, `threads` none of at least zero, or `copy` no bool.
    """
    kind = task_of(task)
    if not (is_whole(num_envs) and num_envs >= 1):
        raise EnvError(f"num_envs = {num_envs!r}; expected at least one environment, a whole number.")
    if not (is_whole(threads) and threads >= 0):
        raise EnvError(f"threads = {threads!r}; expected a whole number, or 0 for as many as there are processors.")
    if not isinstance(copy, bool):
        raise EnvError(f"copy = {copy!r}; expected True or False.")
    mode = _autoreset(autoreset_mode)
    there = find_spec("mujoco.batch") is not None
    if batched and not there:
        raise EnvError("this MuJoCo has no mujoco.batch: update it, or leave out batched=True.")
    many: VectorEnv[Any, Any, Any]
    if there if batched is None else batched:
        many = TactileVectorEnv(kind, num_envs, threads=threads, autoreset_mode=mode, copy=copy, **options)
    else:
        many = SyncVectorEnv([partial(TactileEnv, kind, **options)] * num_envs, copy=copy, autoreset_mode=mode)
    if isinstance(task, str) and task in gymnasium.registry:
        # The mode by its name, because a spec may be written as JSON.
        own = {"threads": threads, "autoreset_mode": mode.value, "copy": copy, "batched": batched, **options}
        many.spec = replace(gymnasium.spec(task), kwargs={"task": task, "num_envs": num_envs, **own})
    return many


class TactileVectorEnv(VectorEnv[Observation, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """Many environments of one task on `mujoco.batch`: simulations run on threads, everything else on arrays.

    Seeds, infos and autoreset are those of `gymnasium.vector.SyncVectorEnv`.

    Args:
        kind: the task.
        num_envs: number of environments.
        threads: simulation threads, including the calling one; 0 for the number of processors.
        autoreset_mode: when a finished environment is reset: a mode of gymnasium, or its name.
        copy: whether returned observations are copies; if not, the next step may overwrite them.
        render_mode: see `TactileEnv`.
        width: of images [pixels].
        height: of images [pixels].
        options: options of the task.

    Attributes:
        task: the task with the simulations of all environments.

    Raises:
        EnvError: an option is invalid, or the task is none.
    """

    def __init__(
        self,
        kind: type[Task],
        num_envs: int,
        *,
        threads: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 360,
        **options: Any,
    ) -> None:
        check_render_mode(render_mode)
        check_picture(width, height)
        kind, mode = task_of(kind), _autoreset(autoreset_mode)
        self.task = kind(simulate=lambda model: BatchSimulations(model, num_envs, threads), **options)
        self.num_envs, self.autoreset_mode, self.render_mode = num_envs, mode, render_mode
        self.metadata = {**TactileEnv.metadata, "autoreset_mode": mode}
        self.single_action_space: gymnasium.Space[Any] = self.task.action_space
        self.single_observation_space: gymnasium.Space[Any] = self.task.observation_space
        self.action_space: gymnasium.Space[Any] = batch_space(self.single_action_space, num_envs)
        self.observation_space: gymnasium.Space[Any] = batch_space(self.single_observation_space, num_envs)
        self._drawn = [seeding.np_random()[0] for _ in range(num_envs)]
        self._copy = copy
        self._seen: Observation = {
            name: np.zeros((num_envs, *(space.shape or ())), np.float32)
            for name, space in self.task.observation_space.items()
        }
        self._ended = np.zeros(num_envs, dtype=bool)
        self._drawings = [Drawing(kind.CAMERA, width, height) for _ in range(num_envs)]

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | npt.NDArray[np.integer[Any]] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin episodes; the same seed begins the same episode.

        Args:
            seed: seed of environment 0, incremented by one for each further environment; or a sequence of seeds. None
                continues the present random streams.
            options: options of the task for all environments. `reset_mask`, shape (num_envs,) bool, selects those that
                begin; by default all.

        Raises:
            EnvError: an option is unknown, the mask or the seeds have the wrong length, or a seed is no whole number.
                Environments whose options were refused must be reset again.
        """
        seeds = self._seeds(seed)
        options = reset_options(options)
        mask = np.asarray(options.pop("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise EnvError(
                f"reset_mask = {mask}; expected an array of {self.num_envs} bool, at least one of them True."
            )
        for k, one in enumerate(seeds):
            if one is not None and mask[k]:
                self._drawn[k] = seeding.np_random(one)[0]
        infos: dict[str, Any] = {}
        self._begin(mask, infos, options)
        self._look(mask)
        _add(infos, self.task.felt(), mask)
        self._ended[mask] = False
        self._show()
        return self._shown(), infos

    def step(self, actions: npt.NDArray[np.float32]) -> tuple[Observation, Array, Mask, Mask, dict[str, Any]]:
        """Act in every environment for one control period; results are those of `gymnasium.vector.VectorEnv.step`.

        Args:
            actions: actions from -1 to 1, shape (num_envs, number of actions).

        Raises:
            EnvError: the actions do not have the space's shape or are not finite; or an environment was never reset,
                its last reset was refused, or it has ended and autoreset is disabled.
        """
        waiting = self._ended
        if self.autoreset_mode == AutoresetMode.DISABLED and waiting.any():
            raise EnvError(
                f"environments {np.flatnonzero(waiting)} have ended. Reset them: reset(options={{'reset_mask': ...}})."
            )
        rewards, terminated, truncated, told = self.task.step(actions, _rows(~waiting))
        rewards, terminated, truncated = np.where(waiting, 0.0, rewards), terminated & ~waiting, truncated & ~waiting
        ended, infos = terminated | truncated, {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            self._look(~waiting)
            told |= self.task.felt()
            _add(infos, told, ~ended)
            if ended.any():
                _add_final(infos, self._seen, told, ended)
                self._begin(ended, infos, {})
                self._look(ended)
                _add(infos, self.task.felt(), ended)
            self._ended = np.zeros_like(ended)
        else:
            _add(infos, told, ~waiting)
            if waiting.any():
                self._begin(waiting, infos, {})
            self._look(np.ones_like(waiting))
            _add(infos, self.task.felt(), np.ones_like(waiting))
            self._ended = ended
        self._show()
        return self._shown(), rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """An image (height, width, 3) uint8 of each environment; None for render mode "human".

        Raises:
            RenderError: OpenGL does not work.
        """
        if self.render_mode != "rgb_array":
            return None
        return tuple(one.picture(*self.task.simulation.state(k)) for k, one in enumerate(self._drawings))

    def close_extras(self, **kwargs: Any) -> None:
        """Free the renderers."""
        for drawing in self._drawings:
            drawing.close()

    def _seeds(self, seed: Any) -> list[int | None]:
        """A seed for each environment, or None."""
        seeds = seed if isinstance(seed, list | tuple | np.ndarray) else [seed] * self.num_envs
        step = 1 if is_whole(seed) else 0
        if not all(one is None or (is_whole(one) and one >= 0) for one in seeds):
            raise EnvError(
                f"seed = {shortened(seed)}; expected a whole number of at least 0, or a sequence of one for each "
                "environment."
            )
        if len(seeds) != self.num_envs:
            raise EnvError(f"{len(seeds)} seeds; expected one for each of {self.num_envs} environments.")
        return [None if one is None else int(one) + step * k for k, one in enumerate(seeds)]

    def _begin(self, mask: Mask, infos: dict[str, Any], options: dict[str, Any]) -> None:
        """Begin episodes in the environments of a mask, and add the task's infos of them."""
        rows = _rows(mask)
        self.task.begin(rows, [self._drawn[k] for k in rows], options)
        _add(infos, self.task.told(), mask)

    def _look(self, mask: Mask) -> None:
        """Update the observations of the environments of a mask."""
        seen = self.task.observe(_rows(mask))
        if mask.all():
            self._seen = seen
            return
        for name, values in seen.items():
            self._seen[name][mask] = values

    def _shown(self) -> Observation:
        return {name: values.copy() for name, values in self._seen.items()} if self._copy else self._seen

    def _show(self) -> None:
        if self.render_mode == "human":
            for k, drawing in enumerate(self._drawings):
                drawing.show(*self.task.simulation.state(k))


def _autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    """A mode, or the mode of a name."""
    try:
        return AutoresetMode(mode)
    except ValueError:
        known = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise EnvError(f"autoreset_mode = {shortened(mode)} does not exist. Available: {known}.") from None


def _rows(mask: Mask) -> Rows:
    return np.flatnonzero(mask).astype(np.int32)


def _add(infos: dict[str, Any], told: Told, mask: Mask) -> None:
    """Add infos of some environments in gymnasium's form: the mask `_name` is True where `name` is set."""
    if not mask.any():
        return
    for name, values in told.items():
        infos.setdefault(name, np.zeros_like(values))[mask] = values[mask]
        infos.setdefault(f"_{name}", np.zeros_like(mask))[mask] = True


def _add_final(infos: dict[str, Any], seen: Observation, told: Told, ended: Mask) -> None:
    """Add final observations and final infos of the episodes that ended and are reset in the same step."""
    final = np.full(len(ended), None, dtype=object)
    for k in np.flatnonzero(ended):
        final[k] = {name: values[k].copy() for name, values in seen.items()}
    last: dict[str, Any] = {}
    _add(last, told, ended)
    infos.update(final_obs=final, _final_obs=ended.copy(), final_info=last, _final_info=ended.copy())
