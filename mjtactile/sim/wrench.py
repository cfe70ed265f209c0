"""Contact wrenches on a pad: MuJoCo's contact forces in the pad frame, summed.

Forces are newtons, moments newton metres about the pad frame's origin. A wrench is (fx, fy, fz, mx, my, mz).
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.errors import SceneError
from mjtactile.pad import Pad
from mjtactile.pad_shape.core_surface import core_surface
from mjtactile.sim.pad_geom import pad_pieces

_BOX, _MESH = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_MESH)
_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])  # the axes that follow each axis, and those after them
#: Least pressing force for a centre of pressure [N].
_LEAST_FORCE = 1e-6


class PadFrame(NamedTuple):
    """Pose of the pad frame in the world."""

    position: Array  #: origin, the middle of the sensing surface [m], shape (3,)
    rotation: Array  #: columns are the pad's axes, z out of the pad, shape (3, 3)


def site_frame(data: mujoco.MjData, site: int) -> PadFrame:
    """The pad frame of a site on the sensing surface, z out of the pad, after a step or a forward pass."""
    return PadFrame(data.site_xpos[site], data.site_xmat[site].reshape(3, 3))


def geom_frame(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> PadFrame:
    """The pad frame of a pad's geom: at the centre of a box's +z face, or the original frame of a mesh's vertices.

    MuJoCo moves a mesh to its centre of mass and rotates it to its axes of inertia; that is undone here. The data are
    those after a step or a forward pass.

    Raises:
        SceneError: the geom is neither a box nor a mesh.
    """
    if model.geom_type[geom] == _MESH:
        mesh, turn = int(model.geom_dataid[geom]), np.empty(9)
        mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
        rotation = data.geom_xmat[geom].reshape(3, 3) @ turn.reshape(3, 3).T
        return PadFrame(data.geom_xpos[geom] - rotation @ model.mesh_pos[mesh], rotation)
    if model.geom_type[geom] != _BOX:
        raise SceneError(
            f"geom '{model.geom(geom).name}' is neither a box nor a mesh, so nothing says where its sensing surface "
            "is. Put a site there, z out of the pad, and pass site_frame(data, site id)."
        )
    rotation = data.geom_xmat[geom].reshape(3, 3)
    return PadFrame(data.geom_xpos[geom] + rotation[:, 2] * model.geom_size[geom, 2], rotation)


def contact_wrench(model: mujoco.MjModel, data: mujoco.MjData, pad_geom: int, frame: PadFrame | None = None) -> Array:
    """The wrench on the pad, pad frame [N, N m], (6,), from the contacts of the last forward pass; zeros without.

    MuJoCo gives the force and torque of the first geom on the second, in the contact's axes, the rows of
    `contact.frame`. The pad may be either geom, which determines the sign. With R the pad's rotation, C the contact's
    axes and p its point, f = +-R^T C^T f_c and m = +-R^T C^T t_c + R^T (p - origin) x f.

    Args:
        model: compiled model.
        data: its state after `mj_step` or `mj_forward`.
        pad_geom: id of the pad's geom. Contacts of other geoms of the same body are not included.
        frame: the pad frame; that of the pad's geom if None.

    Raises:
        SceneError: there is contact, `frame` is None, and the geom is neither a box nor a mesh.
    """
    contact = data.contact
    pairs = contact.geom.reshape(-1, 2)
    if len(pieces := pad_pieces(model, pad_geom)) == 1:
        pad_is_first, pad_is_second = (pairs == pad_geom).T
    else:
        pad_is_first, pad_is_second = np.isin(pairs, pieces).T
    touching = (pad_is_first | pad_is_second).nonzero()[0]
    if len(touching) == 0:
        return np.zeros(6)
    origin, rotation = geom_frame(model, data, pad_geom) if frame is None else frame

    local = np.empty((len(touching), 6))  # force and torque in the contact's axes
    for row, index in zip(local, touching.tolist(), strict=True):
        mujoco.mj_contactForce(model, data, index, row)
    pad_is_second = pad_is_second[touching]
    local[~pad_is_second] *= -1.0
    in_pad = local.reshape(-1, 2, 3) @ (contact.frame[touching].reshape(-1, 3, 3) @ rotation)
    force, moment = in_pad[:, 0], in_pad[:, 1]
    arms = (contact.pos[touching] - origin) @ rotation
    # The cross product arms x force, written out because np.cross takes as long as all the rest.
    moment += arms.take(_NEXT, 1) * force.take(_AFTER, 1) - arms.take(_AFTER, 1) * force.take(_NEXT, 1)
    return in_pad.reshape(-1, 6).sum(axis=0)


def centre_of_pressure(wrench: Array, pad: Pad | None = None) -> Array:
    """Centre of pressure of a wrench on the sensing surface, pad frame [m], (3,); the origin if nothing presses.

    The wrench's moment about this point is along the surface's normal. The centre of a wrench that is NaN is NaN.

    Args:
        wrench: force [N] and moment about the pad's origin [N m], pad frame, (6,).
        pad: gives the surface; the plane z = 0 if None.
    """
    _, _, fz, mx, my, _ = wrench
    if np.isnan(wrench).any():
        return np.full(3, np.nan)
    if not fz < -_LEAST_FORCE:
        return np.zeros(3)
    if pad is None or pad.surface.is_flat:
        return np.array([-my / fz, mx / fz, 0.0])
    found = core_surface(pad.surface, (pad.size[0] / 2, pad.size[1] / 2)).centre_of_pressure(wrench)
    return np.zeros(3) if found is None else found
