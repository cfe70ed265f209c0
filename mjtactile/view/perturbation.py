"""A spring that pulls a body to where a user drags it, as in MuJoCo's own viewer but stiffer."""

from __future__ import annotations

import mujoco
import numpy as np

from mjtactile._types import Array

#: Stiffness relative to that of MuJoCo's spring [-]. It is higher because forces on pads are newtons over millimetres.
_FIRMNESS = 10.0
_LEAST_INVERSE = 1e-9


class Perturbation:
    """The spring between one body and a point; its stiffness scales with the model's `vis.map.stiffness`."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._spring = mujoco.MjvPerturb()
        self._before = np.zeros(6)

    @property
    def pulls(self) -> bool:
        """Whether a user is dragging a body."""
        return bool(self._spring.active)

    def grab(self, data: mujoco.MjData, body: int) -> None:
        """Begin to drag a body; `release` restores the forces that were applied to it before."""
        inverse = max(float(self._model.body_invweight0[body, 0]), _LEAST_INVERSE)
        self._before = np.array(data.xfrc_applied[body])
        self._spring.select, self._spring.localmass, self._spring.scale = body, _FIRMNESS / inverse, 1.0
        self.drag(np.array(data.xpos[body]))
        self._spring.active = int(mujoco.mjtPertBit.mjPERT_TRANSLATE)

    def drag(self, to: Array) -> None:
        """Set the target of the body in the world [m], (3,)."""
        self._spring.refpos[:] = self._spring.refselpos[:] = to

    def apply(self, data: mujoco.MjData) -> None:
        """Write the spring's force for the next step into `xfrc_applied`."""
        mujoco.mjv_applyPerturbForce(self._model, data, self._spring)

    def release(self, data: mujoco.MjData) -> None:
        """Stop dragging and restore the forces applied before."""
        if self.pulls:
            self._spring.active = 0
            data.xfrc_applied[self._spring.select] = self._before


def movable_bodies(model: mujoco.MjModel) -> dict[str, int]:
    """Ids of the bodies that a force can move, by name; bodies without a name are left out."""
    movable = (body for body in range(1, model.nbody) if model.body_weldid[body] != 0 and model.body(body).name)
    return {model.body(body).name: body for body in movable}
