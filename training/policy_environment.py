"""GraspLift as stable-baselines3 takes it: many at once, observations flat and scaled, with their latest changes."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv

from mjtactile.envs import make_vec
from mjtactile.envs.touch import moments

Array = npt.NDArray[np.float32]

#: Scaled observations stay within this.
_LIMIT = 5.0
#: Numbers that hardly vary are not blown up beyond this.
_LEAST_VARIANCE = 1e-8


class StackedLifts(VecEnv):
    """Environments of GraspLift on `make_vec`.

    An observation is proprioception and, with touch, the readings' moments, the mean of both pads; how these changed in
    the last step, and in the one before; each number less its mean over its standard deviation, as seen so far while
    training.

    Args:
        count: environments at once.
        observation: "readings" or "none".
        split: bands of masses and frictions, "train" or "test".
    """

    def __init__(self, count: int, observation: str, split: str) -> None:
        self._envs = make_vec(
            "mjtactile/GraspLift-v0",
            count,
            threads=1,
            autoreset_mode=AutoresetMode.SAME_STEP,
            copy=False,
            # Moments are of readings in Pa.
            observation="pascals" if observation == "readings" else observation,
            split=split,
            fidelity="fast",  # that of the recorded policies
        )
        space = self._envs.single_observation_space
        assert isinstance(space, gymnasium.spaces.Dict)
        zeros = {name: np.zeros((1, *one.shape), np.float32) for name, one in space.items() if one.shape is not None}
        width = self._flat(zeros).shape[1]
        self.scale, self._learning = RunningMeanStd(shape=(3 * width,)), True
        #: Of each environment: what is seen, its change in the last step, and in the one before.
        self._seen = np.zeros((count, 3, width), np.float32)
        self._seed: int | None = None
        self._actions: Array = np.zeros(0, np.float32)
        self._steps = 0
        self._counts = np.zeros(count, int)
        #: Every episode that ended: steps of all environments until then, how many its environment had ended before,
        #: and whether it succeeded, dropped, crushed.
        self.ended: list[dict[str, Any]] = []
        flat = gymnasium.spaces.Box(-_LIMIT, _LIMIT, (3 * width,), np.float32)
        super().__init__(count, flat, self._envs.single_action_space)

    def scale_as(self, other: StackedLifts) -> None:
        """Scale as another one learnt to, and learn no more."""
        self.scale, self._learning = other.scale, False

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Of the next reset: environment k has this plus k."""
        self._seed = seed
        return [None if seed is None else seed + k for k in range(self.num_envs)]

    def reset(self) -> Array:
        """Begin everywhere."""
        seen, _ = self._envs.reset(seed=self._seed)
        self._seed = None
        self._seen[:] = 0.0
        self._seen[:, 0] = self._flat(seen)
        return self._shown(self._seen)

    def step_async(self, actions: np.ndarray) -> None:
        """Take actions."""
        self._actions = actions.astype(np.float32)

    def step_wait(self) -> tuple[Array, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """What came of them; who ended has begun anew."""
        seen, rewards, terminated, truncated, info = self._envs.step(self._actions)
        self._steps += self.num_envs
        done = terminated | truncated
        now = self._flat(seen)
        after = self._after(self._seen, now)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for k in np.flatnonzero(done):
            last = {name: values[None] for name, values in info["final_obs"][k].items()}
            infos[k] = {
                "terminal_observation": self._shown(self._after(self._seen[k : k + 1], self._flat(last)))[0],
                "TimeLimit.truncated": bool(truncated[k] and not terminated[k]),
            }
            told = info["final_info"]
            how = {name: bool(told[name][k]) for name in ("success", "dropped", "crushed")}
            self.ended.append({"steps": self._steps, "count": int(self._counts[k]), **how})
            self._counts[k] += 1
        after[done] = 0.0
        after[done, 0] = now[done]
        self._seen = after
        if self._learning:
            self.scale.update(after.reshape(len(after), -1))
        return self._shown(after), rewards.astype(np.float32), done, infos

    def close(self) -> None:
        """Free everything."""
        self._envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of each environment."""
        return [getattr(self._envs, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not needed here."""
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **options: Any) -> list[Any]:
        """Not needed here."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No wrapper of stable-baselines3 is."""
        return [False] * self.num_envs

    def _flat(self, seen: dict[str, Any]) -> Array:
        """Proprioception, and moments if there is touch, (environments, numbers)."""
        own = seen["proprioception"]
        if "tactile" not in seen:
            return own
        # Both pads' y axes point up: what they feel of weight and slip is the same.
        felt = moments(seen["tactile"]).mean(axis=1)
        return np.concatenate([own, felt.reshape(len(own), -1)], axis=1)

    def _after(self, before: Array, now: Array) -> Array:
        """What is known one step on."""
        change = now - before[:, 0]
        return np.stack([now, change, before[:, 1]], axis=1)

    def _shown(self, seen: Array) -> Array:
        flat = seen.reshape(len(seen), -1)
        scaled = (flat - self.scale.mean) / np.sqrt(self.scale.var + _LEAST_VARIANCE)
        return np.clip(scaled, -_LIMIT, _LIMIT).astype(np.float32)
