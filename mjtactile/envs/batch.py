"""Many environments of one kind on `mujoco.batch`: their simulations advance together, on threads.

Each environment is the one of its id, with a row of the batch for a simulation; acting, observing and judging are its
own. What comes out are the bits of as many single environments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import mujoco
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from mujoco.batch import Batch

from mjtactile.envs.base import Observation, TactileEnv
from mjtactile.envs.simulation import SENSORS_OFF, quiet_contacts
from mjtactile.pad import Array

#: Field of the batch that leaves sensors out.
_FLAGS = "opt.disableflags"


class BatchRow:
    """One simulation of a batch; see `simulation.Simulation`."""

    def __init__(self, batch: Batch, row: int) -> None:
        self.model: mujoco.MjModel = batch.model
        self._batch, self._row, self._id = batch, row, np.array([row], dtype=np.int32)
        self._arrays = {name: batch.bind(name)[row] for name in ("qpos", "qvel", "act", "ctrl", "sensordata")}

    @property
    def qpos(self) -> Array:
        """See `Simulation`."""
        return self._arrays["qpos"]

    @property
    def qvel(self) -> Array:
        """See `Simulation`."""
        return self._arrays["qvel"]

    @property
    def act(self) -> Array:
        """See `Simulation`."""
        return self._arrays["act"]

    @property
    def ctrl(self) -> Array:
        """See `Simulation`."""
        return self._arrays["ctrl"]

    @property
    def sensordata(self) -> Array:
        """See `Simulation`."""
        return self._arrays["sensordata"]

    def field(self, name: str) -> Array:
        """See `Simulation`."""
        return self._batch.expand(name)[self._row]

    def reset(self) -> None:
        """See `Simulation`."""
        self._batch.set_const(self._id)
        self._batch.reset(self._id, stage=mujoco.mjtStage.mjSTAGE_NONE.value)

    def forward(self) -> None:
        """See `Simulation`."""
        with quiet_contacts():
            self._batch.forward(self._id)

    def step(self, count: int) -> None:
        """Refuse: rows advance together."""
        raise NotImplementedError("an environment of a batch is stepped with all others: call the vector environment")

    def state(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """See `Simulation`."""
        model, data = self._batch.get_model(self._row), self._batch.get_data(self._row)
        mujoco.mj_forward(model, data)
        return model, data


class _Stepped(gymnasium.Wrapper[Observation, npt.NDArray[np.float32], Observation, npt.NDArray[np.float32]]):
    """An environment whose simulation has been advanced already when its step is called."""

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """What came of the step; the action was taken before."""
        env = self.env.unwrapped
        assert isinstance(env, TactileEnv)
        return env.end_step()


class BatchVectorEnv(SyncVectorEnv):
    """Environments on a batch; a `gymnasium.vector.SyncVectorEnv` in every other respect.

    Args:
        kind: of the environments.
        count: how many.
        threads: that simulate, this one included; 0 for as many as there are processors.
        autoreset_mode: when an environment that has ended begins anew, see gymnasium.
        copy: whether observations are copies; if not, the next step overwrites them.
        options: of the environments.
    """

    def __init__(
        self,
        kind: Callable[..., TactileEnv],
        count: int,
        *,
        threads: int = 0,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        **options: Any,
    ) -> None:
        first = kind(**options)
        model = first.simulation.model
        self.batch = Batch(model, nsim=count, nthread=threads)
        self._flags = self.batch.expand(_FLAGS)
        self._sensing = int(model.opt.disableflags)
        self._tactile = [kind(**options, simulation=BatchRow(self.batch, row)) for row in range(count)]
        self._substeps = first.SUBSTEPS
        first.close()
        makers = [lambda env=env: _Stepped(env) for env in self._tactile]
        super().__init__(makers, copy=copy, autoreset_mode=autoreset_mode)

    def step(
        self, actions: npt.NDArray[np.float32]
    ) -> tuple[Observation, Array, npt.NDArray[np.bool_], npt.NDArray[np.bool_], dict[str, Any]]:
        """Act in every environment, advance all simulations, and say what came of it."""
        waiting = (
            self._autoreset_envs if self.autoreset_mode == AutoresetMode.NEXT_STEP else np.zeros(self.num_envs, bool)
        )
        for env, action, over in zip(self._tactile, actions, waiting, strict=True):
            if not over:
                env.begin_step(action)
        self._advance(np.flatnonzero(~waiting).astype(np.int32))
        return super().step(actions)

    def _advance(self, rows: npt.NDArray[np.int32]) -> None:
        """As `SingleSimulation.step`, for these rows."""
        with quiet_contacts():
            if self._substeps > 1:
                self._flags[:] = self._sensing | SENSORS_OFF
                self.batch.step(rows, nstep=self._substeps - 1)
                self._flags[:] = self._sensing
            self.batch.step(rows)
