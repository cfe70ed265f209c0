"""Run an example, then compare every pad of its last state with MuJoCo's contacts; in whatever environment it needs.

    python tests/examples/check_readings.py examples/press.py

Prints what the example prints, and as the last line JSON: by pad, the force that MuJoCo's contacts put on it [N], how
far the load behind its readings is from that wrench, and how far its readings are from that load's.
"""

from __future__ import annotations

import json
import runpy
import sys
import warnings
from typing import Any

import mujoco
import numpy as np

import mjtactile
from mjtactile.sim.mujoco_library import pad_sensor_names


def wrench_on(model: Any, data: Any, geom: int) -> np.ndarray:
    """Force [N] and moment [N m] of all contacts on a pad about the origin of the pad frame, in its axes, (6,)."""
    turn = data.geom_xmat[geom].reshape(3, 3)
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:  # of a curved pad, moved to its centre of mass
        moved = np.empty(9)
        mujoco.mju_quat2Mat(moved, model.mesh_quat[model.geom_dataid[geom]])
        turn = turn @ moved.reshape(3, 3).T
        origin = data.geom_xpos[geom] - turn @ model.mesh_pos[model.geom_dataid[geom]]
    else:  # the middle of a box's +z face
        origin = data.geom_xpos[geom] + model.geom_size[geom, 2] * turn[:, 2]
    total = np.zeros(6)
    for number in range(data.ncon):
        contact, found = data.contact[number], np.zeros(6)
        if geom not in contact.geom:
            continue
        mujoco.mj_contactForce(model, data, number, found)
        axes = contact.frame.reshape(3, 3)
        sign = 1.0 if contact.geom[1] == geom else -1.0
        force, torque = sign * found[:3] @ axes, sign * found[3:] @ axes
        total += np.concatenate([force @ turn, (torque + np.cross(contact.pos - origin, force)) @ turn])
    return total


def check(sensor: mjtactile.TactileSensor, model: Any, data: Any) -> dict[str, float]:
    """How far apart the pad's wrench, its load and its readings are."""
    expected = wrench_on(model, data, sensor.geom)
    load = sensor.load(data)
    if load is None:
        return {"force": float(np.linalg.norm(expected)), "not_carried": 0.0, "load_off": 0.0, "readings_off": 0.0}
    force, moment = load.resultant()
    left = np.concatenate([load.residual_force, load.residual_moment])
    readings, by_load = sensor.read(data), sensor.influence.readings(load)
    return {
        "force": float(np.linalg.norm(expected[:3])),
        "not_carried": float(np.linalg.norm(load.residual_force)),
        # Moments as forces at the rim.
        "load_off": float(np.abs((np.concatenate([force, moment]) + left - expected) / ([1] * 3 + [7.5e-3] * 3)).max()),
        "readings_off": float(np.abs(readings - by_load).max() / max(by_load.max(), 1.0)),
    }


def main() -> None:
    """The command line."""
    found = runpy.run_path(sys.argv[1])
    answers = {}
    if "model" in found:
        model, data = found["model"], found["data"]
        names = pad_sensor_names(model)
        sensors = {name: mjtactile.TactileSensor(model, name) for name in names} or {"pad": found["sensor"]}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", mjtactile.ContactWarning)  # the example had them
            answers = {name: check(sensor, model, data) for name, sensor in sensors.items()}
    print(json.dumps(answers))


if __name__ == "__main__":
    main()
