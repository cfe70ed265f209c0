"""mjtactile/PressIdentify-v0: touch an unknown shape at several places and answer which one it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.envs.finger import HOVER, FingerTask, finger_spec, press_control, turn_and_press
from mjtactile.envs.options import TouchOptions
from mjtactile.envs.simulation import Rows
from mjtactile.envs.task import Channel, Told, within
from mjtactile.errors import EnvError, shortened
from mjtactile.geometry.indenter import punch
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.sim.mjcf import indenter_mjcf

#: Speeds at full action [m/s, rad/s], range of the finger about its start [m, rad], and largest force [N].
SPEED, TURN_SPEED, REACH, TURN_REACH, FORCE = 0.02, 3.0, 1e-3, math.pi / 2, 1.0
#: Size of the punches over the paper's 10 mm [-], and largest initial offset of the finger from their centre along x
#: and y [m]. The whole face stays on the pad, because feet beside the pad would not carry load (mjcf.py).
SIZE, OFFSET = 0.75, 1e-3
#: Cost of each step; rewards of a correct and a wrong answer.
STEP_COST, RIGHT, WRONG = 0.01, 1.0, -1.0
#: Distance between shapes [m]; only one is touched in an episode.
_SPACING = 0.05


class PressIdentify(FingerTask):
    """A finger over one of seven punches; shape, position and orientation are unknown.

    Options of `reset`: `shape`, the name of the punch; by default it is drawn.
    """

    SUMMARY = "Touch an unknown punch, shifted and turned at random, until sure; then answer which of seven it is."
    EPISODE_STEPS = 100
    NOISE = 0.05
    ACTIONS = (
        Channel("move x", "-", -1, 1, f"speed of the finger along x, up to {SPEED * 1e3:g} mm/s"),
        Channel("move y", "-", -1, 1, f"speed of the finger along y, up to {SPEED * 1e3:g} mm/s"),
        *turn_and_press(TURN_SPEED, FORCE),
        Channel("answer", "-", -1, 1, "above 0, the agent answers, which ends the episode"),
        *(
            Channel(
                f"score {name}", "-", -1, 1, f"score of shape {name}; the shape with the largest score is the answer"
            )
            for name in INDENTER_NAMES
        ),
    )
    PROPRIOCEPTION = (
        Channel("x", "m", -2 * REACH, 2 * REACH, "displacement of the finger along x from its start"),
        Channel("y", "m", -2 * REACH, 2 * REACH, "displacement of the finger along y from its start"),
        Channel("turn", "rad", -2 * TURN_REACH, 2 * TURN_REACH, "rotation of the finger from its start"),
        Channel("height", "m", -1e-3, 5 * HOVER, "height of the pad over the plane of the punches' faces"),
        Channel("force", "N", 0.0, FORCE, "commanded pressing force"),
        Channel("time left", "-", 0.0, 1.0, "remaining fraction of the episode's steps"),
    )

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        count = self.simulation.count
        # Index of the shape.
        self._shape = np.zeros(count, dtype=int)
        # Index of the answered shape; -1 for none.
        self._answer = np.full(count, -1)

    @classmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """The finger, and seven punches in a row, their faces up."""
        spec = finger_spec(options, timestep=cls.TIMESTEP, friction=1.0)
        for k, name in enumerate(INDENTER_NAMES):
            station = spec.worldbody.add_frame(pos=[k * _SPACING, 0.0, 0.0], quat=[0.0, 1.0, 0.0, 0.0])
            face_up = mujoco.MjSpec.from_string(indenter_mjcf(punch(name, scale=SIZE), pad=options.finger_pad))
            spec.attach(face_up, prefix="on_table_", frame=station)
        return spec.compile()

    def _draw(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any]) -> None:
        name = options.pop("shape", None)
        known = name is None or (isinstance(name, str) and name in INDENTER_NAMES)
        if not known or options:
            raise EnvError(
                f"reset options shape={shortened(name)}, {options}; expected only shape, one of "
                f"{', '.join(INDENTER_NAMES)}."
            )
        for row, one in zip(rows, drawn, strict=True):
            self._shape[row] = one.integers(len(INDENTER_NAMES))
            self._start[row] = [*one.uniform(-OFFSET, OFFSET, 2), one.uniform(-np.pi, np.pi)]
        if name is not None:
            self._shape[rows] = INDENTER_NAMES.index(name)
        self._start[rows, 0] += self._shape[rows] * _SPACING
        self._target[rows], self._force[rows], self._answer[rows] = 0.0, 0.0, -1

    def _act(self, actions: Array) -> None:
        reach = np.array([REACH, REACH, TURN_REACH])
        moved = self._target + self.period * np.array([SPEED, SPEED, TURN_SPEED]) * actions[:, :3]
        self._target = within(moved, -reach, reach)
        self._force = FORCE * np.maximum(0.0, actions[:, 3])
        self.simulation.ctrl[:] = np.column_stack([self._start + self._target, press_control(self._force)])
        self._answer = np.where(actions[:, 4] > 0.0, actions[:, 5:].argmax(axis=1), -1)

    def _proprioception(self) -> Array:
        qpos = self.simulation.qpos
        return np.column_stack([qpos[:, :3] - self._start, qpos[:, 3], self._force, self._time_left()])

    def _judge(self) -> tuple[Array, Mask, Told]:
        answered, right = self._answer >= 0, self._answer == self._shape
        rewards = np.where(answered, np.where(right, RIGHT, WRONG), 0.0) - STEP_COST
        return rewards, answered, {"shape": self._shape, "success": right}
