"""Presses on curved pads by the contact laws alone.

A body touches the surface at the point above its shift and is oriented along the surface there. A flat punch lies in
the tangent plane at that point. The force acts at that point; its tilt and azimuth are relative to the normal there.
Contacts on a curved pad are not linear in the force, so every force is solved separately.
"""

from __future__ import annotations

import math

import numpy as np
from shapely import affinity

from mjtactile._types import Array
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.dataset.sampling import OutlinePresses, PosePresses
from mjtactile.dataset.shapes import SPHERE_RADIUS, placed, sized_face, sphere_height
from mjtactile.errors import quiet_contacts
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.influence.matrices import InfluenceMatrices


def curved_pose_readings(
    influence: InfluenceMatrices, presses: OutlinePresses, pose: PosePresses
) -> tuple[Array, Array, Array]:
    """Readings of one pose on a curved pad.

    Returns:
        Readings [Pa], (presses, *reading_shape); forces on the pad in the pad frame [N], (presses, 3); and points
        (x, y) of the surface where they act [m], (presses, 2). Readings are NaN for a force that points out of the pad,
        which is possible for tilted forces on steep slopes.
    """
    outer = influence.surface.outer
    forces = (pose.directions * pose.magnitudes[:, None]) @ outer.frames(*pose.shift)
    through = outer.positions(*pose.shift)
    footprint = footprint_on(influence.surface, presses, pose)
    readings = np.full((len(forces), *influence.pad.reading_shape), math.nan)
    # Small hard bodies leave the range of small strains; the readings stay those of the linear model.
    with quiet_contacts():
        for one, force in zip(readings, forces, strict=True):
            if force[2] < 0.0:
                moment = np.cross(through, force)
                load = contact_load(
                    influence, footprint, force, moment=moment, law=presses.law, tangential=presses.tangential
                )
                one[...] = influence.readings(load)
    return readings, forces, np.broadcast_to(through[:2], (len(forces), 2))


def footprint_on(surface: SurfaceGrid, presses: OutlinePresses, pose: PosePresses) -> Footprint:
    """Footprint of a body that touches a curved surface at a pose, oriented along the surface."""
    outer = surface.outer
    point, axes = outer.positions(*pose.shift), outer.frames(*pose.shift)
    if presses.shape == "sphere":
        radius = SPHERE_RADIUS * presses.size
        return Footprint.from_height(sphere_height(radius, point + radius * axes[2]), surface)
    slopes = -axes[2, :2] / axes[2, 2]

    def plane(x: Array, y: Array) -> Array:
        return point[2] + slopes[0] * (x - point[0]) + slopes[1] * (y - point[1])

    face = placed(sized_face(presses.shape, presses.size), (0.0, 0.0), pose.rotation)
    seen = affinity.affine_transform(face, [*axes[:2, 0], *axes[:2, 1], *point[:2]])
    return Footprint.from_height(plane, surface, outline=seen)
