"""Frames: the state of a simulation at one time for the page, with bodies' poses and pads' readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import ViewError, of_type, quiet_contacts
from mjtactile.sensor import TactileSensor
from mjtactile.sim.mujoco_library import is_data_of, pad_sensor_names
from mjtactile.sim.wrench import geom_frame
from mjtactile.view.outline import pressed_outline


@dataclass(frozen=True, eq=False)
class ShownPad:
    """One pad at one time."""

    #: Von Mises stress (layers, rows, columns) [Pa], float32; (taxels,) for free taxels.
    readings: npt.NDArray[np.float32]
    wrench: Array  #: contact force [N] and moment about the pad's origin [N m], pad frame, (6,)
    position: Array  #: position of the pad frame's origin in the world [m], (3,)
    quat: Array  #: orientation of the pad frame in the world, (w, x, y, z)
    outline: Array  #: line segments around the contact, pad frame [m], (segments, 2, 2); empty without contact


@dataclass(frozen=True, eq=False)
class Frame:
    """The state of a simulation at one time."""

    time: float  #: simulated time [s]
    xpos: Array  #: bodies' positions in the world [m], (nbody, 3)
    xmat: Array  #: bodies' rotation matrices, (nbody, 3, 3)
    mocap_pos: Array  #: positions of mocap bodies [m], (nmocap, 3)
    mocap_quat: Array  #: orientations of mocap bodies, (nmocap, 4)
    pads: dict[str, ShownPad]  #: the pads by name, in the order of the model's sensors


def pads_of(model: mujoco.MjModel) -> dict[str, TactileSensor]:
    """Every sensor of the plugin in a model, by name.

    Raises:
        ViewError: the model has no such sensor.
    """
    found = {name: TactileSensor(model, name) for name in pad_sensor_names(model)}
    if not found:
        raise ViewError(
            "the model has no pad: no named sensor of the plugin mjtactile.pad. Add one with mjtactile.attach_pad, or "
            'pass sensors of your own: Viewer(model, data, pads={"pad": mjtactile.TactileSensor(model)}).'
        )
    return found


def checked_pads(
    model: mujoco.MjModel, data: mujoco.MjData, pads: Mapping[str, TactileSensor] | None
) -> dict[str, TactileSensor]:
    """The pads to show, by name.

    Args:
        model: compiled model.
        data: an MjData of this model.
        pads: sensors by name; None for all sensors of the plugin in the model.

    Raises:
        ViewError: `model` is not an MjModel, `data` or a pad belongs to another model, or there is no pad.
    """
    of_type(mujoco.MjModel, "model", model, ViewError, "MjModel.from_xml_path(...) makes one")
    if not is_data_of(model, data):
        raise ViewError("data does not belong to the model; expected mujoco.MjData(model) of the same model.")
    if pads is None:
        return pads_of(model)
    if not isinstance(pads, Mapping) or not all(isinstance(pad, TactileSensor) for pad in pads.values()) or not pads:
        raise ViewError('pads is not a dict of sensors by name; expected {"pad": mjtactile.TactileSensor(model)}.')
    if strange := [name for name, pad in pads.items() if not is_data_of(pad.model, data)]:
        raise ViewError(f"pad {strange[0]!r} belongs to another model. Make its TactileSensor with the viewer's model.")
    return dict(pads)


def take_frame(data: mujoco.MjData, pads: Mapping[str, TactileSensor]) -> Frame:
    """A frame with a copy of the simulation's current state, after a step or a forward pass, and pads by name."""
    # Contacts are solved a second time for the outlines; the plugin has already issued their warnings.
    with quiet_contacts():
        felt = {name: _shown_pad(data, sensor) for name, sensor in pads.items()}
    return Frame(
        float(data.time),
        np.array(data.xpos),
        np.array(data.xmat).reshape(-1, 3, 3),
        np.array(data.mocap_pos),
        np.array(data.mocap_quat),
        felt,
    )


def _shown_pad(data: mujoco.MjData, sensor: TactileSensor) -> ShownPad:
    frame = geom_frame(sensor.model, data, sensor.geom)
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(frame.rotation).ravel())
    load = sensor.load(data)
    return ShownPad(
        sensor.read(data).astype(np.float32), sensor.wrench(data), np.array(frame.position), quat, pressed_outline(load)
    )
