"""The robot of the grasp experiments: a simulation that is stepped from tick to tick."""

from __future__ import annotations

from collections.abc import Callable

import mujoco

from mjtactile.errors import quiet_contacts
from mjtactile.experiments.grasp.known import PadLoads
from mjtactile.experiments.grasp.scene import open_gripper
from mjtactile.experiments.grasp.touch import TouchSense
from mjtactile.experiments.hands.gripper import GRIP_LIMIT

#: Default number of MuJoCo steps per tick: control and touch at 250 Hz.
STEPS_PER_TICK = 4
_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)


class Robot:
    """A gripper and its wrist, with commands and loads at each tick.

    Args:
        model: from `grasp_spec`.
        touch: the sense of touch.
        opening: initial opening of the gripper [m].
        watch: called after each MuJoCo step, for judges and disturbances.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        touch: TouchSense,
        *,
        opening: float,
        watch: Callable[[Robot], None],
    ) -> None:
        # An object that rocks for a moment presses with an edge. The nearest load that a face carries is read then.
        with quiet_contacts():
            self.model, self.data = model, mujoco.MjData(model)
        self.steps_per_tick = STEPS_PER_TICK  #: number of MuJoCo steps between ticks
        self.grip = 0.0  #: commanded force of each finger [N]
        drives = {one: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, f"wrist_{one}") for one in "xyz"}
        self._wrist = {axis: actuator for axis, actuator in drives.items() if actuator >= 0}
        #: Commanded displacement of the wrist by driven axis [m].
        self.place = dict.fromkeys(self._wrist, 0.0)
        self._touch, self._watch = touch, watch
        self._grip = model.actuator("grip").id
        open_gripper(model, self.data, opening)
        self.felt = touch(model, self.data)  #: loads on the pads at the last tick

    @property
    def period(self) -> float:
        """Time between ticks [s]."""
        return self.steps_per_tick * float(self.model.opt.timestep)

    @property
    def time(self) -> float:
        """Simulated time since the beginning [s]."""
        return float(self.data.time)

    def tick(self) -> PadLoads:
        """Advance one period with the present commands and return the loads on the pads."""
        self.data.ctrl[self._grip] = min(self.grip, GRIP_LIMIT)
        for step in range(self.steps_per_tick):
            reads = self._touch.reads and step == self.steps_per_tick - 1
            self.model.opt.disableflags = 0 if reads else _NO_SENSORS
            for axis, actuator in self._wrist.items():
                # The target moves evenly: with one jump per tick, a servo as stiff as an arm's would cause jerks.
                left = self.place[axis] - self.data.ctrl[actuator]
                self.data.ctrl[actuator] += left / (self.steps_per_tick - step)
            mujoco.mj_step(self.model, self.data)
            self._watch(self)
        self.felt = self._touch(self.model, self.data)
        return self.felt

    def move(self, axis: str, by: float, *, speed: float) -> PadLoads:
        """Move an axis for one tick at a speed [m/s], but by no more than `by` [m], and return the loads."""
        step = min(abs(by), speed * self.period)
        self.place[axis] += step if by > 0.0 else -step
        return self.tick()
