"""Recording of the lift experiment: each trial is an episode, with readings at a higher rate than frames."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._progress import progress_bar
from mjtactile._types import Array
from mjtactile.errors import DatasetError
from mjtactile.experiments.grasp.known import PadLoads
from mjtactile.experiments.grasp.lift import lift, lift_task
from mjtactile.experiments.grasp.robot import STEPS_PER_TICK
from mjtactile.experiments.grasp.touch import TouchSense, make_touch
from mjtactile.experiments.grasp.trials import TrialSettings
from mjtactile.experiments.hands.gripper import GRIPPER_PADS
from mjtactile.lerobot.features import Feature, tactile_columns, tactile_features, vector
from mjtactile.lerobot.writer import LeRobotWriter
from mjtactile.pad import Pad
from mjtactile.sim.mjcf import OPTION

#: Components of the gripper's state and of its commands.
_STATE = ("opening", "opening_rate", "wrist_x", "wrist_z")
_ACTIONS = ("grip", "wrist_x", "wrist_z")
#: Rate of readings, one per tick of the experiment [Hz].
TOUCH_RATE = round(1.0 / (STEPS_PER_TICK * float(OPTION["timestep"])))


#: Readings of both pads, (pads, layers, rows, columns) [Pa]; state, (4,); commands, (3,).
Tick = tuple[npt.NDArray[np.float32], Array, Array]


class RecordedTouch:
    """A controller's sense of touch that records readings of both pads, state and commands at every tick."""

    reads = True

    def __init__(self, inner: TouchSense) -> None:
        self._inner = inner
        self.ticks: list[Tick] = []

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> PadLoads:
        """Loads from the inner sense of touch, after recording the state."""
        readings = np.array([data.sensor(name).data.reshape(Pad().reading_shape) for name in GRIPPER_PADS])
        state = np.array([data.sensor(name).data[0] for name in _STATE])
        commands = np.array([data.ctrl[model.actuator(name).id] for name in _ACTIONS])
        self.ticks.append((readings.astype(np.float32), state, commands))
        return self._inner(model, data)


def record_lifts(
    folder: str | Path,
    *,
    episodes: int,
    settings: TrialSettings,
    condition: str = "true",
    fps: int = 50,
    flat: bool = False,
) -> list[dict[str, Any]]:
    """Record trials of the lift experiment; return the judge's results for each.

    Args:
        folder: folder of the new dataset; it must not exist.
        episodes: number of trials.
        settings: settings of the trials.
        condition: loads that the controller gets: "true" or "recognised".
        fps: frames per second [Hz]; it must divide `TOUCH_RATE`.
        flat: whether readings are stored as vectors; see `tactile_features`.

    Raises:
        DatasetError: `fps` does not divide `TOUCH_RATE`, there is no such condition, or the folder exists.
    """
    if fps < 1 or TOUCH_RATE % fps:
        raise DatasetError(f"fps = {fps} does not divide the {TOUCH_RATE} readings per second; try 10, 25, 50 or 125.")
    if condition not in ("true", "recognised"):
        raise DatasetError(f"condition = {condition!r}; expected 'true' or 'recognised'.")
    per_frame = TOUCH_RATE // fps
    features = {
        "observation.state": Feature(shape=(len(_STATE),), names=list(_STATE), info={"units": ["m", "m/s", "m", "m"]}),
        "action": Feature(shape=(len(_ACTIONS),), names=list(_ACTIONS), info={"units": ["N", "m", "m"]}),
        "label.object": vector(["mass", "friction"], "kg, -"),
        "next.success": Feature(dtype="bool"),
        "next.done": Feature(dtype="bool"),
    }
    for name in GRIPPER_PADS:
        features |= tactile_features(name, Pad(), rate=float(TOUCH_RATE), per_frame=per_frame, flat=flat)
    results = []
    with (
        LeRobotWriter(folder, fps=fps, features=features, robot="mjtactile gripper") as writer,
        progress_bar("lifting", episodes) as advance,
    ):
        for number in range(episodes):
            task = lift_task(np.random.default_rng([settings.seed, number]))
            seed = (settings.seed, number, 1)
            touch = RecordedTouch(make_touch(condition, noise=settings.noise, seed=seed, weights=settings.weights))
            result = lift(task, touch, fidelity=settings.fidelity)
            columns = _columns(touch.ticks, per_frame, flat)
            frames = len(columns["action"])
            columns |= {"label.object": np.tile([task.mass, task.friction], (frames, 1))}
            last = np.arange(frames) == frames - 1
            columns |= {"next.success": last & bool(result["success"]), "next.done": last}
            writer.add_episode(columns, "lift the object with the least grip that holds")
            results.append(result)
            advance(1)
    return results


def _columns(ticks: list[Tick], per_frame: int, flat: bool) -> dict[str, Any]:
    """Frames of an episode; remaining ticks at its end that do not fill a frame are dropped.

    A frame's state is that at the frame's end, the time of its last reading. Its action is the next command.
    """
    frames = (len(ticks) - 1) // per_frame
    whole = ticks[1 : 1 + frames * per_frame]  # the first tick is recorded before the robot moves
    readings = np.array([tick[0] for tick in whole]).reshape(frames, per_frame, *ticks[0][0].shape)
    ends = [(frame + 1) * per_frame for frame in range(frames)]
    columns: dict[str, Any] = {
        "observation.state": np.array([ticks[end][1] for end in ends]),
        "action": np.array([ticks[min(end + 1, len(ticks) - 1)][2] for end in ends]),
    }
    for place, name in enumerate(GRIPPER_PADS):
        columns |= tactile_columns(name, readings[:, :, place], flat=flat)
    return columns
