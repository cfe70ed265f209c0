"""Simulations of one model as arrays with a row for each simulation: one MjData, or many in a `mujoco.batch`.

Tasks read and write these arrays only, so the same code gives identical results with both.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import quiet_contacts

#: Indices of some of the simulations, shape (k,).
Rows = npt.NDArray[np.int32]

#: Flag of MjOption that disables sensors. Of several steps, only the last one computes them, to save time.
SENSORS_OFF = mujoco.mjtDisableBit.mjDSBL_SENSOR.value


class SingleSimulation:
    """One simulation, in an MjData of its own.

    Order of a reset: write model fields, `reset`, write the state, `forward`.

    Attributes:
        model: names and sizes; for values that differ between simulations use `field`.
        count: number of simulations, n.
        qpos, qvel, act: joint positions, joint velocities and activations of actuators, to read and write, shapes
            (n, nq), (n, nv) and (n, na).
        ctrl: controls, to write, shape (n, nu).
        sensordata: sensor data of the last step or forward pass, shape (n, nsensordata).
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.count = model, 1
        with quiet_contacts():
            self.data = data = mujoco.MjData(model)
        self.qpos, self.qvel, self.act, self.ctrl, self.sensordata = (
            array[None] for array in (data.qpos, data.qvel, data.act, data.ctrl, data.sensordata)
        )
        self._flags = int(model.opt.disableflags)

    def field(self, name: str) -> Array:
        """A field of the model by its name, to read and write, shape (1, ...)."""
        return getattr(self.model, name)[None]

    def reset(self, rows: Rows) -> None:
        """Reset to the model's initial state; call it after writing model fields."""
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)

    def forward(self, rows: Rows) -> None:
        """Run the forward pass, including sensors."""
        mujoco.mj_forward(self.model, self.data)

    def step(self, rows: Rows, count: int) -> None:
        """Advance by `count` MuJoCo steps; sensor data is that of the last step."""
        if count > 1:
            self.model.opt.disableflags = self._flags | SENSORS_OFF
            mujoco.mj_step(self.model, self.data, count - 1)
            self.model.opt.disableflags = self._flags
        mujoco.mj_step(self.model, self.data)

    def state(self, row: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """Model and data of the simulation, for rendering."""
        return self.model, self.data


class BatchSimulations:
    """Many simulations that advance together, on threads; attributes and methods are those of `SingleSimulation`.

    Args:
        model: model of all simulations.
        count: number of simulations.
        threads: simulation threads, including the calling one; 0 for the number of processors.

    Raises:
        ImportError: this MuJoCo has no `mujoco.batch`.
    """

    def __init__(self, model: mujoco.MjModel, count: int, threads: int) -> None:
        from mujoco.batch import Batch

        self.model, self.count = model, count
        with quiet_contacts():
            self.batch = Batch(model, nsim=count, nthread=threads)
        self.qpos, self.qvel, self.act, self.ctrl, self.sensordata = (
            self.batch.bind(name) for name in ("qpos", "qvel", "act", "ctrl", "sensordata")
        )
        self._flags = self.batch.expand("opt.disableflags")
        self._sensing = int(model.opt.disableflags)
        self._drawn: dict[int, tuple[mujoco.MjModel, mujoco.MjData]] = {}

    def field(self, name: str) -> Array:
        """A field of the simulations' models by its name, to read and write, shape (n, ...)."""
        return self.batch.expand(name)

    def reset(self, rows: Rows) -> None:
        """Reset some simulations to their model's initial state; call it after writing model fields."""
        self.batch.set_const(rows)
        self.batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE.value)

    def forward(self, rows: Rows) -> None:
        """Run the forward pass of some simulations, including sensors."""
        self.batch.forward(rows)

    def step(self, rows: Rows, count: int) -> None:
        """Advance some simulations by `count` MuJoCo steps; sensor data is that of the last step."""
        if count > 1:
            self._flags[:] = self._sensing | SENSORS_OFF
            self.batch.step(rows, nstep=count - 1)
            self._flags[:] = self._sensing
        self.batch.step(rows)

    def state(self, row: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """Model and data of one simulation for rendering; the same objects each time, updated."""
        model, data = self._drawn.get(row, (None, None))
        with quiet_contacts():
            model, data = self.batch.get_model(row, model), self.batch.get_data(row, data)
        self._drawn[row] = model, data
        mujoco.mj_forward(model, data)
        return model, data


#: The simulations of a task.
Simulations = SingleSimulation | BatchSimulations
