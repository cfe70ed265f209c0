"""Timing of repeated calls, and of MuJoCo's own tactile sensor, with which the benchmarks compare this one."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from mjtactile.errors import MjTactileError
from mjtactile.sim.pad_geom import contact_attributes

_STEPS = 2000
_SETTLING_STEPS = 200
#: A press on MuJoCo's own tactile sensor: a square punch, its best case, on a plate of 26 x 26 = 676 points. A plate
#: lies in its geom's plane x = 0, so the pad is a thin box that is turned into the world's horizontal plane.
_MUJOCO_TACTILE = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100" jacobian="dense"/>
  <asset><mesh name="plate" builtin="plate" params="26 26" scale="0.0075 0.0075 0.0001"/></asset>
  <worldbody>
    <geom name="pad" type="box" size="0.000001 0.0075 0.0075" quat="0.70710678 0 -0.70710678 0" priority="1"
          {contact}/>
    <body pos="0 0 0.0025" gravcomp="1">
      <joint name="press" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.005 0.005 0.0025" mass="0.015"/>
    </body>
  </worldbody>
  <actuator><motor joint="press"/></actuator>
  {sensor}
</mujoco>
"""
_TACTILE_SENSOR = '<sensor><tactile geom="pad" mesh="plate"/></sensor>'


def median_time(work: Callable[[], Any], repeats: int) -> float:
    """Median wall time of `repeats` calls [s], after one call that is not counted."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def mujoco_tactile_time() -> float:
    """Time that MuJoCo's own tactile sensor with 676 points adds to a step under a square punch [s].

    Raises:
        MjTactileError: the sensor reads nothing under the punch.
    """
    return _step_time(_TACTILE_SENSOR) - _step_time("")


def _step_time(sensor: str) -> float:
    contact = " ".join(f'{key}="{value}"' for key, value in contact_attributes("press", "solref", "solimp").items())
    model = mujoco.MjModel.from_xml_string(_MUJOCO_TACTILE.format(sensor=sensor, contact=contact))
    data = mujoco.MjData(model)
    data.ctrl[:] = -1.0
    mujoco.mj_step(model, data, _SETTLING_STEPS)
    if sensor and not data.sensordata[: model.nsensordata // 3].any():
        raise MjTactileError("MuJoCo's tactile sensor reads nothing under the punch: its timing would be meaningless.")
    return median_time(lambda: mujoco.mj_step(model, data, _STEPS), 5) / _STEPS
