"""The judge: evaluates trials from MuJoCo's state, which controllers cannot access."""

from __future__ import annotations

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.grasp.robot import Robot
from mjtactile.experiments.hands.gripper import GRIPPER_PADS

#: Force on a pad above which the object is crushed [N].
CRUSHING = 20.0


class Judge:
    """Records what happens at each step to an object on the geom `support`; pass it to `Robot` as `watch`."""

    def __init__(self, model: mujoco.MjModel, *, support: str = "table") -> None:
        self.peak = 0.0  #: largest force on a pad so far [N]
        self.table = 0.0  #: largest force of the support on the object since `begin` [N]
        self.slid = 0.0  #: largest displacement of the object along the pads since `begin` [m]
        self.tilt = 0.0  #: largest tilt of the object since `begin` [deg]
        self._pads = [int(model.geom(f"{name}_pad").id) for name in GRIPPER_PADS]
        self._table = int(model.geom(support).id)
        self._watched = {*self._pads, self._table}
        self._object, self._grasp = model.body("object").id, model.site("grasp").id
        self._force = np.zeros(6)
        self._start: tuple[Array, Array] | None = None

    def __call__(self, robot: Robot) -> None:
        """Record the state after a step."""
        model, data = robot.model, robot.data
        on_pad, on_table = [0.0] * len(self._pads), 0.0
        for k, pair in enumerate(data.contact.geom.tolist()):
            for geom in pair:
                if geom in self._watched:
                    mujoco.mj_contactForce(model, data, k, self._force)
                    if geom == self._table:
                        on_table += float(self._force[0])
                    else:
                        on_pad[self._pads.index(geom)] += float(self._force[0])
        self.peak = max(self.peak, *on_pad)
        if self._start is not None:
            self.table = max(self.table, on_table)
            place, axis = self._held(robot)
            self.slid = max(self.slid, float(np.linalg.norm(place - self._start[0])))
            self.tilt = max(self.tilt, float(np.degrees(np.arccos(np.clip(axis @ self._start[1], -1.0, 1.0)))))

    def begin(self, robot: Robot) -> None:
        """Start recording the object's slip and tilt in the gripper, and the force on the support."""
        self._start, self.slid, self.tilt, self.table = self._held(robot), 0.0, 0.0, 0.0

    def height(self, robot: Robot) -> float:
        """Height of the object's centre above the table [m]."""
        return float(robot.data.xpos[self._object, 2])

    def _held(self, robot: Robot) -> tuple[Array, Array]:
        """Position (y, z) of the object relative to the grasp site, in the world [m], and the object's z axis there."""
        data = robot.data
        across = data.xpos[self._object, 1:] - data.site_xpos[self._grasp, 1:]
        return across, data.xmat[self._object, 2::3].copy()
