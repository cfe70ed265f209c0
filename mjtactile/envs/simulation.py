"""One simulation, wherever it runs: alone in an MjData, or as a row of a `mujoco.batch.Batch`.

Environments read and write nothing but these arrays, so that the same code, and the same bits, come out of both.
"""

from __future__ import annotations

import warnings
from typing import Any, Protocol

import mujoco

from mjtactile.errors import ContactWarning
from mjtactile.pad import Array

#: Flag of MjOption that leaves sensors out; only the last of several steps is read.
SENSORS_OFF = mujoco.mjtDisableBit.mjDSBL_SENSOR.value


class Simulation(Protocol):
    """What an environment sees of its simulation.

    Order of a reset: write model fields, `reset`, write the state, `forward`.

    Attributes:
        model: with the names and sizes; values that differ between simulations are those of `field`.
    """

    model: mujoco.MjModel

    @property
    def qpos(self) -> Array:
        """Joint positions, to read and write, shape (nq,)."""
        ...

    @property
    def qvel(self) -> Array:
        """Joint velocities, to read and write, shape (nv,)."""
        ...

    @property
    def act(self) -> Array:
        """Activations of actuators, to read and write, shape (na,)."""
        ...

    @property
    def ctrl(self) -> Array:
        """Controls, to write, shape (nu,)."""
        ...

    @property
    def sensordata(self) -> Array:
        """Sensors as of the last step or forward pass, shape (nsensordata,)."""
        ...

    def field(self, name: str) -> Array:
        """A field of this simulation's own model, to read and write."""
        ...

    def reset(self) -> None:
        """To the model's rest, after its fields were written."""
        ...

    def forward(self) -> None:
        """Compute what follows from the state, sensors included."""
        ...

    def step(self, count: int) -> None:
        """Advance by steps of MuJoCo; sensors are those of the last one."""
        ...

    def state(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """Model and data to draw."""
        ...


class SingleSimulation:
    """A simulation in an MjData of its own."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        self._flags = int(model.opt.disableflags)

    @property
    def qpos(self) -> Array:
        """See `Simulation`."""
        return self.data.qpos

    @property
    def qvel(self) -> Array:
        """See `Simulation`."""
        return self.data.qvel

    @property
    def act(self) -> Array:
        """See `Simulation`."""
        return self.data.act

    @property
    def ctrl(self) -> Array:
        """See `Simulation`."""
        return self.data.ctrl

    @property
    def sensordata(self) -> Array:
        """See `Simulation`."""
        return self.data.sensordata

    def field(self, name: str) -> Array:
        """See `Simulation`."""
        return getattr(self.model, name)

    def reset(self) -> None:
        """See `Simulation`."""
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)

    def forward(self) -> None:
        """See `Simulation`."""
        with quiet_contacts():
            mujoco.mj_forward(self.model, self.data)

    def step(self, count: int) -> None:
        """See `Simulation`."""
        with quiet_contacts():
            if count > 1:
                self.model.opt.disableflags = self._flags | SENSORS_OFF
                mujoco.mj_step(self.model, self.data, count - 1)
                self.model.opt.disableflags = self._flags
            mujoco.mj_step(self.model, self.data)

    def state(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """See `Simulation`."""
        return self.model, self.data


class quiet_contacts:  # noqa: N801  a context manager, named as one
    """Pads stay quiet about contacts beyond their linear range: what explores, presses too hard at times."""

    def __init__(self) -> None:
        self._caught: Any = warnings.catch_warnings()

    def __enter__(self) -> None:
        self._caught.__enter__()
        warnings.simplefilter("ignore", ContactWarning)

    def __exit__(self, *error: object) -> None:
        self._caught.__exit__(*error)
