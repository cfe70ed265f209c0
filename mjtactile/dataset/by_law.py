"""Presses computed by the contact laws alone, without MuJoCo; further forces at the same pose take little time.

Under a flat face, the load is linear in the force if shear is proportional to the pressure or sticks. So three loads
give the response to every force at a pose. The contact of a curved body grows with the pressing force, and its load is
linear only among forces with the same pressing component. So all forces at a pose have the same pressing component. For
curved pads see on_surface.py.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from shapely import Point

from mjtactile._types import Array
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.dataset.on_surface import curved_pose_readings
from mjtactile.dataset.sampling import OutlinePresses, PosePresses
from mjtactile.dataset.shapes import SPHERE_RADIUS, placed, shape_face, sized_face, sphere_height
from mjtactile.dataset.spec import ContactSpec
from mjtactile.errors import DatasetError, FootprintError, SceneError, quiet_contacts
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad
from mjtactile.units import MILLIMETRE

#: Ratio of tangential to pressing force of the probe loads, from which the other loads are combined [-].
_PROBE = 0.3


def physics_readings(influence: InfluenceMatrices, presses: OutlinePresses) -> tuple[Array, Array, Array]:
    """Readings of all presses that share an outline, from influence matrices at their fidelity.

    Returns:
        Readings [Pa], (presses, *reading_shape); forces on the pad [N], (presses, 3); and points (x, y) where their
        lines of action meet the surface [m], (presses, 2); in the pad frame.
    """
    pose_readings = _pose_readings if influence.pad.surface.is_flat else curved_pose_readings
    made = [pose_readings(influence, presses, pose) for pose in presses.poses]
    readings, forces, points = zip(*made, strict=True)
    return np.concatenate(readings), np.concatenate(forces), np.concatenate(points)


def pose_footprint(influence: InfluenceMatrices, presses: OutlinePresses, pose: PosePresses) -> Footprint:
    """Footprint of the body at a pose on a flat pad."""
    if presses.shape == "sphere":
        radius = SPHERE_RADIUS * presses.size
        ball = sphere_height(radius, np.array([*pose.shift, radius]))
        return Footprint.from_gap(ball, influence.surface, lowest=0.0)
    return Footprint.from_outline(
        placed(sized_face(presses.shape, presses.size), pose.shift, pose.rotation), influence.surface
    )


def always_on_pad(contact: ContactSpec, pad: Pad) -> bool:
    """Whether it is plain that bodies of this kind of contact are on the pad at every pose."""
    return all(_is_on_pad(shape, contact.size[1], contact.shift, pad) for shape in contact.shapes)


def check_on_pad(pad: Pad, presses: OutlinePresses, touch: Callable[[PosePresses], object]) -> None:
    """Refuse poses at which a body misses the pad.

    Args:
        pad: the pad.
        presses: the presses.
        touch: puts the body on the pad at a pose; raises FootprintError or SceneError if it misses the pad.

    Raises:
        DatasetError: a body misses the pad; the message names the press and the entry.
    """
    for number, pose in enumerate(presses.poses):
        if _is_on_pad(presses.shape, presses.size, pose.shift, pad):
            continue
        try:
            touch(pose)
        except (FootprintError, SceneError) as error:
            (x, y), (width, depth) = np.array(pose.shift) / MILLIMETRE, np.array(pad.size) / MILLIMETRE
            raise DatasetError(
                f"press {presses.first + number * len(pose.magnitudes)}, a {Path(presses.shape).stem} of size "
                f"{presses.size:.3g}, misses the pad of {width:g} x {depth:g} mm: [[contact]] shift puts it at "
                f"({x:.3g}, {y:.3g}) mm from the middle. Give a smaller shift."
            ) from error


def _is_on_pad(shape: str, size: float, shift: tuple[float, float], pad: Pad) -> bool:
    """Whether it is plain that a body is on the pad; a body at an edge may be on it without that."""
    face = shape_face(shape)
    # Whatever the rotation, the body has a point no further than this from its origin.
    nearest = 0.0 if face is None else size * face.distance(Point(0.0, 0.0))
    return max(map(abs, shift)) + nearest < min(pad.size) / 2


def _pose_readings(
    influence: InfluenceMatrices, presses: OutlinePresses, pose: PosePresses
) -> tuple[Array, Array, Array]:
    footprint = pose_footprint(influence, presses, pose)
    curved = footprint.gap is not None
    through = np.array(pose.shift if presses.free or curved else footprint.centroid)
    forces = pose.directions * pose.magnitudes[:, None]
    if curved:
        # One pressing component for the pose, under which no force exceeds the magnitude drawn first.
        down = pose.directions[:, 2]
        forces = pose.directions * (pose.magnitudes[0] * np.abs(down).min() / np.abs(down))[:, None]
    pressing = -float(forces[0, 2])
    probes = pressing * np.array([(0.0, 0.0, -1.0), (_PROBE, 0.0, -1.0), (0.0, _PROBE, -1.0)])
    # Small hard spheres leave the range of small strains; the readings stay those of the linear model.
    with quiet_contacts():
        loads = [
            contact_load(
                influence,
                footprint,
                force,
                moment=np.cross([*through, 0.0], force),
                law=presses.law,
                tangential=presses.tangential,
            )
            for force in probes
        ]
    down, with_x, with_y = influence.point_response(loads) / pressing
    parts = np.stack([(with_x - down) / _PROBE, (with_y - down) / _PROBE, -down]).astype(np.float32)
    # In single precision, as influence matrices store stress: half the memory traffic of a batch.
    response: Array = np.tensordot(forces.astype(np.float32), parts, 1)  # type: ignore[assignment]
    return influence.readings_of(response), forces, np.broadcast_to(through, (len(forces), 2))
