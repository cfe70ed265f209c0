"""Demonstrations: scenes with periodic commands of their actuators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from mjtactile.errors import ViewError
from mjtactile.sim.assets import asset_path


@dataclass(frozen=True)
class Demonstration:
    """A scene with its actuators' values at points in time, linearly interpolated and repeated."""

    scene: str  #: name of the scene's file, see `sim.assets`
    times: tuple[float, ...]  #: the points in time [s], from 0 to the period
    values: Mapping[str, tuple[float, ...]]  #: values at these points, by name of the actuator

    def control(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Write the actuators' values at the current time to `data.ctrl`."""
        for name, values in self.values.items():
            data.ctrl[model.actuator(name).id] = np.interp(data.time % self.times[-1], self.times, values)


_TIMES = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 4.5, 5.0)
#: The fingers close. The hand rises, grips harder, and comes down again. The fingers open.
_RISE = (0.0, 0.0, 0.0, 0.06, 0.06, 0.0, 0.0, 0.0)
DEMONSTRATIONS = {
    "grasp": Demonstration(
        "scenes/grasp.xml",
        _TIMES,
        {"grip": (-2.0, 2.0, 3.0, 3.0, 6.0, 3.0, 3.0, -4.0), "wrist_z": _RISE},
    ),
}


def demonstration(name: str) -> tuple[Demonstration, mujoco.MjModel]:
    """A demonstration by name, and its compiled scene.

    Raises:
        ViewError: there is no demonstration of that name.
    """
    from mjtactile.plugin.registration import ensure_registered

    if name not in DEMONSTRATIONS:
        raise ViewError(f"scene {name!r} does not exist. Available: {', '.join(DEMONSTRATIONS)}, or a model's file.")
    ensure_registered()
    found = DEMONSTRATIONS[name]
    return found, mujoco.MjModel.from_xml_path(str(asset_path(found.scene)))
