"""The bodies that press on a pad of a MuJoCo model, for `dense_contact`: heights of what collides, and wrenches."""

from __future__ import annotations

import time
from typing import NamedTuple

import mujoco
import numpy as np
from dense_cells import Heights
from dense_contact import Body, DenseContact, dense_readings
from lower_surfaces import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose, triangle_heights

from mjtactile._types import Array
from mjtactile.sensor import TactileSensor
from mjtactile.sim.wrench import PadFrame, geom_frame

#: Contacts whose normal leans more than this from the pad's press beside the surface, not on it [rad].
MOST_LEAN = np.pi / 4


class Comparison(NamedTuple):
    """What a sensor reads beside what the dense contact does."""

    error: float  #: relative L2 difference [-]
    seconds: float  #: that the dense contact took
    readings: Array  #: of the sensor, (layers, rows, columns) [Pa]
    dense: DenseContact


def compare(
    model: mujoco.MjModel, data: mujoco.MjData, sensor: str | None = None, *, cells: int = 2500, bounded: bool = True
) -> Comparison:
    """Measure the plugin's reading against the dense contact on the same influence matrices.

    Args:
        model: with a sensor of the plugin "mjtactile.pad" under law "elastic" and shear "proportional".
        data: after `mj_forward` or a step.
        sensor: name; may be left out where the model has one sensor only.
        cells: see `dense_readings`.
        bounded: whether pressure is bounded by the Young's modulus of the pad's top layer.
    """
    name = model.sensor(0).name if sensor is None else sensor
    pad = TactileSensor(model, name)
    readings = pad.read(data)
    start = time.perf_counter()
    bodies = bodies_on_pad(model, data, pad.geom, pad.pad.thickness)
    cap = pad.pad.layers[0].young if bounded else None
    dense = dense_readings(pad.influence, bodies, cells=cells, tilting=pad.tilt == "free", cap=cap)
    seconds = time.perf_counter() - start
    error = np.linalg.norm(readings - dense.readings) / np.linalg.norm(dense.readings)
    return Comparison(float(error), seconds, readings, dense)


def bodies_on_pad(model: mujoco.MjModel, data: mujoco.MjData, pad_geom: int, thickness: float) -> list[Body]:
    """Every body that presses on a pad's sensing surface, with what all its pressing contacts do together.

    Args:
        model: compiled.
        data: after `mj_forward` or a step.
        pad_geom: id of the pad's box.
        thickness: of the pad [m]; what of a body is lower than that below the surface is not above the pad.
    """
    frame = geom_frame(model, data, pad_geom)
    wrenches: dict[int, Array] = {}
    links: dict[int, set[int]] = {}  # bodies without a joint between them
    for number in range(data.ncon):
        contact = data.contact[number]
        geoms = [int(geom) for geom in contact.geom]
        if pad_geom not in geoms or min(geoms) < 0:
            continue
        local = np.zeros(6)
        mujoco.mj_contactForce(model, data, number, local)
        # MuJoCo gives what the first geom does to the second, in axes that are the rows of `frame`.
        axes = np.array(contact.frame).reshape(3, 3) * (1.0 if geoms[1] == pad_geom else -1.0)
        force, torque = frame.rotation.T @ axes.T @ local[:3], frame.rotation.T @ axes.T @ local[3:]
        if not on_surface(frame.rotation.T @ axes[0], force):
            continue
        arm = frame.rotation.T @ (np.array(contact.pos) - frame.position)
        other = geoms[0] if geoms[1] == pad_geom else geoms[1]
        body = int(model.geom_bodyid[other])
        wrench = np.concatenate([force, torque + np.cross(arm, force)])
        welded = int(model.body_weldid[body])
        wrenches[welded] = wrenches.get(welded, np.zeros(6)) + wrench
        links.setdefault(welded, set()).add(body)
    return [
        Body(
            body_heights(model, data, links[welded], pad_geom, frame, -thickness),
            wrench[:3],
            wrench[3:],
            f"body '{model.body(min(links[welded])).name or min(links[welded])}'",
        )
        for welded, wrench in wrenches.items()
        if wrench[2] < 0.0
    ]


def on_surface(normal: Array, force: Array) -> bool:
    """Whether a contact presses on the sensing surface rather than beside it.

    Args:
        normal: of the contact, pad frame, (3,); either sign.
        force: on the pad [N], pad frame, (3,).
    """
    return bool(abs(normal[2]) >= np.cos(MOST_LEAN) and force[2] < 0.0)


def body_heights(
    model: mujoco.MjModel, data: mujoco.MjData, links: set[int], pad_geom: int, frame: PadFrame, floor: float
) -> Heights:
    """Lower surface of what a body may collide with a pad.

    Args:
        model: compiled.
        data: its state.
        links: ids of the body, or of bodies that are welded to one another.
        pad_geom: id of the pad's box.
        frame: of the pad.
        floor: parts of the body below this height [m] are not above the pad.
    """
    own = np.flatnonzero(np.isin(model.geom_bodyid, list(links)))
    collides = (model.geom_contype[own] & model.geom_conaffinity[pad_geom]) != 0
    collides |= (model.geom_conaffinity[own] & model.geom_contype[pad_geom]) != 0
    paired = [
        other
        for pair in zip(model.pair_geom1, model.pair_geom2, strict=True)
        for geom, other in (pair, pair[::-1])
        if geom == pad_geom
    ]
    geoms = [int(geom) for geom in own[collides | np.isin(own, paired)] if geom != pad_geom]
    parts: list[Heights] = []
    for geom in geoms:
        position = frame.rotation.T @ (data.geom_xpos[geom] - frame.position)
        rotation = frame.rotation.T @ data.geom_xmat[geom].reshape(3, 3)
        parts.append(_geom_heights(model, geom, Pose(position, rotation), floor))

    def lowest(x: Array, y: Array) -> Array:
        return np.minimum.reduce([part(x, y) for part in parts])

    return lowest


def _geom_heights(model: mujoco.MjModel, geom: int, pose: Pose, floor: float) -> Heights:
    """Lower surface of one geom; meshes as they are, not their convex hulls."""
    kinds, kind, size = mujoco.mjtGeom, int(model.geom_type[geom]), [float(one) for one in model.geom_size[geom]]
    if kind in (kinds.mjGEOM_MESH, kinds.mjGEOM_SDF):
        mesh = int(model.geom_dataid[geom])
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        vertices = model.mesh_vert[first : first + count].astype(float)
        first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        return triangle_heights(pose.points(vertices)[model.mesh_face[first : first + count]], floor)
    if kind == kinds.mjGEOM_HFIELD:
        return triangle_heights(pose.points(_field_points(model, int(model.geom_dataid[geom]))), floor)
    if kind == kinds.mjGEOM_SPHERE:
        shape = Ellipsoid((size[0], size[0], size[0]))
    elif kind == kinds.mjGEOM_ELLIPSOID:
        shape = Ellipsoid((size[0], size[1], size[2]))
    elif kind == kinds.mjGEOM_CAPSULE:
        shape = Capsule(size[0], size[1])
    elif kind == kinds.mjGEOM_CYLINDER:
        shape = Cylinder(size[0], size[1])
    elif kind == kinds.mjGEOM_BOX:
        shape = Box((size[0], size[1], size[2]))
    elif kind == kinds.mjGEOM_PLANE:
        shape = HalfSpace()
    else:
        raise ValueError(f"geom {geom} is of type {kind}, whose lower surface is not known here.")
    return lambda x, y: shape.heights(pose, x, y, floor)


def _field_points(model: mujoco.MjModel, field: int) -> Array:
    """Triangles of a height field's top, counter-clockwise from above, (n, 3 corners, 3) [m].

    Seen from a pad that looks up at it the top faces down.
    """
    rows, columns, start = int(model.hfield_nrow[field]), int(model.hfield_ncol[field]), int(model.hfield_adr[field])
    half_x, half_y, scale, _ = model.hfield_size[field]
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    z = scale * model.hfield_data[start : start + rows * columns].astype(float).reshape(rows, columns)
    grid = np.stack([x, y, z], axis=-1)
    here, right, up, across = grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]
    both = [np.stack([here, right, across], axis=2), np.stack([here, across, up], axis=2)]
    return np.concatenate([one.reshape(-1, 3, 3) for one in both])
