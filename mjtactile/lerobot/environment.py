"""A wrapper that records every episode of an environment as an episode of a LeRobotDataset."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from mjtactile.envs.single import TactileEnv
from mjtactile.envs.task import Observation, within
from mjtactile.envs.touch import READING_SCALE
from mjtactile.errors import DatasetError
from mjtactile.lerobot.features import Feature, tactile_columns, tactile_features
from mjtactile.lerobot.writer import LeRobotWriter

_READINGS = {"readings": READING_SCALE, "pascals": 1.0}


class LeRobotRecorder(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Records observations, actions and rewards of an environment.

    A frame is an observation, the action taken on it, and the reward of that action. Readings are the observed ones,
    with noise and transducer, in pascals. Actions are the executed ones, clipped to their space. An episode begins with
    `reset()`. The dataset exists after `close()` and contains all finished episodes.

    Args:
        env: a `TactileEnv` that observes "readings" or "pascals"; its wrappers may not change its spaces.
        folder: folder of the new dataset; it must not exist.
        task: description of the task; by default that of the environment's task.
        flat: whether readings are stored as vectors; see `tactile_features`.

    Raises:
        DatasetError: the environment does not observe readings, a wrapper changes its spaces, its control rate is not
            an integer, or the folder exists or is being written.
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any], folder: str | Path, *, task: str | None = None, flat: bool = False
    ) -> None:
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, TactileEnv) or inner.task.options.observation not in _READINGS:
            raise DatasetError(
                "only environments of mjtactile that observe readings can be recorded. Make one with "
                "observation='readings' or 'pascals'."
            )
        for kind in ("observation_space", "action_space"):
            if getattr(env, kind) != getattr(inner, kind):
                raise DatasetError(
                    f"a wrapper in {env} changes the {kind} of the environment, so its channels are no longer those of "
                    f"the task. Wrap the recorder instead: {type(env).__name__}(LeRobotRecorder(env, folder), ...)."
                )
        self._inner, self._flat = inner, flat
        self._words = task or " ".join(inner.task.SUMMARY.split())
        self._scale = _READINGS[inner.task.options.observation]
        self._frames: list[dict[str, Any]] = []
        self._seen: dict[str, npt.NDArray[Any]] | None = None
        rate = 1.0 / inner.task.period
        if abs(rate - round(rate)) > 1e-6:
            raise DatasetError(f"the environment acts at {rate:.6g} Hz; LeRobotDataset needs a whole number of hertz.")
        self._writer = LeRobotWriter(
            folder, fps=round(rate), features=self._features(round(rate)), robot=type(inner.task).__name__
        )
        self._writer.__enter__()
        self._closed = False

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; an unfinished episode is dropped, also if the environment refuses the reset."""
        self._seen, self._frames = None, []
        seen, told = self.env.reset(**options)
        self._seen = self._kept(seen)
        return seen, told

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step the environment and record the previous observation, the executed action and the reward."""
        before, acted = self._seen, deepcopy(action)  # the caller's array may change
        seen, reward, terminated, truncated, told = self.env.step(action)
        if before is not None:
            ends = {"next.reward": float(reward), "next.done": terminated or truncated}
            ends |= {"next.success": bool(told.get("success", False))}
            executed = within(np.asarray(acted, float), -1.0, 1.0)  # as the task does
            self._frames.append({**before, "action": executed, **ends})
            self._seen = self._kept(seen)
        if terminated or truncated:
            self._save()
        return seen, reward, terminated, truncated, told

    def close(self) -> None:
        """Write the dataset and close the environment; further calls have no effect.

        Raises:
            DatasetError: no episode was finished; the environment is closed all the same.
        """
        try:
            if not self._closed:
                self._closed = True
                self._writer.__exit__(None, None, None)
        finally:
            self.env.close()

    def _kept(self, seen: Observation) -> dict[str, npt.NDArray[Any]]:
        """State and readings [Pa] of an observation; copies, because callers may write into their own arrays."""
        return {"observation.state": np.array(seen["proprioception"]), "tactile": seen["tactile"] * self._scale}

    def _features(self, rate: int) -> dict[str, Feature]:
        task = self._inner.task
        state, action = (
            Feature(
                shape=(len(channels),),
                names=[channel.name for channel in channels],
                info={"units": [channel.unit for channel in channels]},
            )
            for channels in (task.PROPRIOCEPTION, task.ACTIONS)
        )
        features = {"observation.state": state, "action": action, "next.reward": Feature()}
        features |= {"next.done": Feature(dtype="bool"), "next.success": Feature(dtype="bool")}
        for name in task.PADS:
            features |= tactile_features(name, task.options.finger_pad, rate=float(rate), flat=self._flat)
        return features

    def _save(self) -> None:
        frames, self._frames, self._seen = self._frames, [], None
        if not frames:
            return
        columns = {name: np.array([frame[name] for frame in frames]) for name in frames[0] if name != "tactile"}
        readings = np.array([frame["tactile"] for frame in frames])
        for number, name in enumerate(self._inner.task.PADS):
            columns |= tactile_columns(name, readings[:, number, None], flat=self._flat)
        self._writer.add_episode(columns, self._words)
