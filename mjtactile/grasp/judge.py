"""The judge: looks at MuJoCo's state, which controllers may not, and says what really happened."""

from __future__ import annotations

import mujoco
import numpy as np

from mjtactile.grasp.robot import Robot
from mjtactile.gripper import GRIPPER_PADS
from mjtactile.pad import Array

#: More than this on a pad crushes [N].
CRUSHING = 20.0


class Judge:
    """Watches a robot from step to step; pass it as `watch`.

    Attributes:
        peak: largest force on a pad so far [N].
        table: largest force of the table on the object since `begin` [N].
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.peak = self.table = 0.0
        self._pads = np.array([model.geom(f"{name}_pad").id for name in GRIPPER_PADS])
        self._table, self._object = model.geom("table").id, model.geom("object").id
        self._force = np.zeros(6)
        self._start: tuple[Array, Array] | None = None
        self.slid = self.tilt = 0.0

    def __call__(self, robot: Robot) -> None:
        """After a step."""
        model, data = robot.model, robot.data
        on_pad, on_table = np.zeros(len(self._pads)), 0.0
        pairs = data.contact.geom
        for k in range(data.ncon):
            pads = np.isin(self._pads, pairs[k])
            if pads.any() or self._table in pairs[k]:
                mujoco.mj_contactForce(model, data, k, self._force)
                on_pad += np.where(pads, self._force[0], 0.0)
                on_table += 0.0 if pads.any() else float(self._force[0])
        self.peak = max(self.peak, float(on_pad.max()))
        if self._start is not None:
            self.table = max(self.table, on_table)
            place, axis = self._held(robot)
            self.slid = max(self.slid, float(np.linalg.norm(place - self._start[0])))
            self.tilt = max(self.tilt, float(np.degrees(np.arccos(np.clip(axis @ self._start[1], -1.0, 1.0)))))

    def begin(self, robot: Robot) -> None:
        """From now on, note how far the object slides and tilts in the gripper, and what the table bears."""
        self._start, self.slid, self.tilt, self.table = self._held(robot), 0.0, 0.0, 0.0

    @staticmethod
    def height(robot: Robot) -> float:
        """Of the object's middle above the table [m]."""
        return float(robot.data.body("object").xpos[2])

    @staticmethod
    def _held(robot: Robot) -> tuple[Array, Array]:
        """Where the object's middle stands from the gripper's grasp site along the pads [m], and its upright axis."""
        body = robot.data.body("object")
        across = (body.xpos - robot.data.site("grasp").xpos)[1:]
        return np.array(across), np.array(body.xmat.reshape(3, 3)[:, 2])
