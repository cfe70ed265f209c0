"""Simulations of one model as arrays, row k of each for simulation k: one in an MjData, or many in a `mujoco.batch`.

Tasks read and write nothing but these arrays, so that the same code, and the same bits, come out of both.
"""

from __future__ import annotations

import warnings
from typing import Any, Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import ContactWarning

#: Simulations meant, shape (k,).
Rows = npt.NDArray[np.int32]

#: Flag of MjOption that leaves sensors out; only the last of several steps is read.
SENSORS_OFF = mujoco.mjtDisableBit.mjDSBL_SENSOR.value


class Simulations(Protocol):
    """What tasks see of n simulations.

    Order of a reset: write model fields, `reset`, write the state, `forward`.

    Attributes:
        model: with the names and sizes; values that differ between simulations are those of `field`.
        count: of simulations, n.
    """

    model: mujoco.MjModel
    count: int

    @property
    def qpos(self) -> Array:
        """Joint positions, to read and write, shape (n, nq)."""
        ...

    @property
    def qvel(self) -> Array:
        """Joint velocities, to read and write, shape (n, nv)."""
        ...

    @property
    def act(self) -> Array:
        """Activations of actuators, to read and write, shape (n, na)."""
        ...

    @property
    def ctrl(self) -> Array:
        """Controls, to write, shape (n, nu)."""
        ...

    @property
    def sensordata(self) -> Array:
        """Sensors as of the last step or forward pass, shape (n, nsensordata)."""
        ...

    def field(self, name: str) -> Array:
        """A field of the simulations' own models, to read and write, shape (n, ...)."""
        ...

    def reset(self, rows: Rows) -> None:
        """Some simulations to their model's rest, after its fields were written."""
        ...

    def forward(self, rows: Rows) -> None:
        """Compute what follows from the state of some, sensors included."""
        ...

    def step(self, rows: Rows, count: int) -> None:
        """Advance some by `count` steps of MuJoCo; sensors are those of the last one."""
        ...

    def state(self, row: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """Model and data of one, to draw; the same objects each time, brought up to date."""
        ...


class SingleSimulation:
    """One simulation, in an MjData of its own; see `Simulations`."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.count = model, 1
        self.data = mujoco.MjData(model)
        self._flags = int(model.opt.disableflags)

    @property
    def qpos(self) -> Array:
        """See `Simulations`."""
        return self.data.qpos[None]

    @property
    def qvel(self) -> Array:
        """See `Simulations`."""
        return self.data.qvel[None]

    @property
    def act(self) -> Array:
        """See `Simulations`."""
        return self.data.act[None]

    @property
    def ctrl(self) -> Array:
        """See `Simulations`."""
        return self.data.ctrl[None]

    @property
    def sensordata(self) -> Array:
        """See `Simulations`."""
        return self.data.sensordata[None]

    def field(self, name: str) -> Array:
        """See `Simulations`."""
        return getattr(self.model, name)[None]

    def reset(self, rows: Rows) -> None:
        """See `Simulations`."""
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)

    def forward(self, rows: Rows) -> None:
        """See `Simulations`."""
        with quiet_contacts():
            mujoco.mj_forward(self.model, self.data)

    def step(self, rows: Rows, count: int) -> None:
        """See `Simulations`."""
        with quiet_contacts():
            if count > 1:
                self.model.opt.disableflags = self._flags | SENSORS_OFF
                mujoco.mj_step(self.model, self.data, count - 1)
                self.model.opt.disableflags = self._flags
            mujoco.mj_step(self.model, self.data)

    def state(self, row: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """See `Simulations`."""
        return self.model, self.data


class BatchSimulations:
    """Many simulations that advance together, on threads; see `Simulations`.

    Args:
        model: of all.
        count: how many.
        threads: that simulate, the calling one included; 0 for as many as there are processors.

    Raises:
        ImportError: this MuJoCo has no `mujoco.batch`.
    """

    def __init__(self, model: mujoco.MjModel, count: int, threads: int = 0) -> None:
        from mujoco.batch import Batch

        self.model, self.count = model, count
        self.batch = Batch(model, nsim=count, nthread=threads)
        self.qpos, self.qvel, self.act, self.ctrl, self.sensordata = (
            self.batch.bind(name) for name in ("qpos", "qvel", "act", "ctrl", "sensordata")
        )
        self._flags = self.batch.expand("opt.disableflags")
        self._sensing = int(model.opt.disableflags)
        self._drawn: dict[int, tuple[mujoco.MjModel, mujoco.MjData]] = {}

    def field(self, name: str) -> Array:
        """See `Simulations`."""
        return self.batch.expand(name)

    def reset(self, rows: Rows) -> None:
        """See `Simulations`."""
        self.batch.set_const(rows)
        self.batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE.value)

    def forward(self, rows: Rows) -> None:
        """See `Simulations`."""
        with quiet_contacts():
            self.batch.forward(rows)

    def step(self, rows: Rows, count: int) -> None:
        """See `Simulations`."""
        with quiet_contacts():
            if count > 1:
                self._flags[:] = self._sensing | SENSORS_OFF
                self.batch.step(rows, nstep=count - 1)
                self._flags[:] = self._sensing
            self.batch.step(rows)

    def state(self, row: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """See `Simulations`."""
        model, data = self._drawn.get(row, (None, None))
        model, data = self.batch.get_model(row, model), self.batch.get_data(row, data)
        self._drawn[row] = model, data
        mujoco.mj_forward(model, data)
        return model, data


class quiet_contacts:  # noqa: N801  a context manager, named as one
    """Suppress warnings about contacts beyond the linear range: agents that explore press too hard at times."""

    def __init__(self) -> None:
        self._caught: Any = warnings.catch_warnings()

    def __enter__(self) -> None:
        self._caught.__enter__()
        warnings.simplefilter("ignore", ContactWarning)

    def __exit__(self, *error: object) -> None:
        self._caught.__exit__(*error)
