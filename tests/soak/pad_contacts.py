"""Contact wrenches on a pad by what touches it: contact by contact, from MuJoCo's forces."""

from __future__ import annotations

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.sim.pad_geom import pad_pieces
from mjtactile.sim.wrench import PadFrame, geom_frame


def wrenches_by_geom(
    model: mujoco.MjModel, data: mujoco.MjData, pad_geom: int, frame: PadFrame | None = None
) -> dict[int, Array]:
    """Wrench on the pad of each touching geom, pad frame [N, N m], (6,), by id; -1 for all flexes together.

    Their sum is `mjtactile.sim.wrench.contact_wrench`, which has the arguments.
    """
    pieces, sums = set(np.array(pad_pieces(model, pad_geom)).tolist()), {}
    for number, pair in enumerate(data.contact.geom.tolist()):
        if pieces.isdisjoint(pair):
            continue
        origin, rotation = geom_frame(model, data, pad_geom) if frame is None else frame
        contact, local = data.contact[number], np.empty(6)
        mujoco.mj_contactForce(model, data, number, local)
        other, sign = (pair[0], 1.0) if pair[1] in pieces else (pair[1], -1.0)
        force, torque = sign * local.reshape(2, 3) @ contact.frame.reshape(3, 3)
        moment = torque + np.cross(contact.pos - origin, force)
        sums[other] = sums.get(other, np.zeros(6)) + np.concatenate([force @ rotation, moment @ rotation])
    return dict(sorted(sums.items()))


def wrenches_by_body(
    model: mujoco.MjModel, data: mujoco.MjData, pad_geom: int, frame: PadFrame | None = None
) -> dict[int, Array]:
    """The same, by body id; -1 for flexes."""
    sums: dict[int, Array] = {}
    for geom, wrench in wrenches_by_geom(model, data, pad_geom, frame).items():
        body = int(model.geom_bodyid[geom]) if geom >= 0 else -1
        sums[body] = sums.get(body, np.zeros(6)) + wrench
    return sums
