"""Random sampling of a dataset's presses from its specification.

Presses that share an outline are drawn together, because a moved outline reuses its contact cells. Every outline, pose
and press has its own stream of random numbers, seeded by the dataset's seed and its index. So a press does not depend
on the number of workers or on interruptions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.dataset.spec import ContactSpec, DatasetSpec

#: Streams of random numbers.
_OUTLINE, _POSE, _PRESS, NOISE = range(4)


@dataclass(frozen=True, kw_only=True)
class PosePresses:
    """One pose of a body, and the forces on it there."""

    shift: tuple[float, float]  #: position (x, y) of the body's origin in the pad frame [m]
    rotation: float  #: counter-clockwise about the body's origin, before the shift [rad]
    directions: Array  #: unit vectors of the forces, pad frame, (presses, 3); pressing is -z
    magnitudes: Array  #: magnitudes of the forces [N], (presses,)


@dataclass(frozen=True, kw_only=True)
class OutlinePresses:
    """Presses that share one outline."""

    first: int  #: index of the first press
    shape: str  #: name of the body's shape, or a mesh file
    size: float  #: size relative to the shape's own [-]
    preset: str  #: fidelity by name
    law: str  #: contact law
    tangential: str  #: distribution of shear
    free: bool  #: whether the body may tilt; the force then acts at its origin
    poses: tuple[PosePresses, ...]


def stream(seed: int, kind: int, index: int) -> np.random.Generator:
    """Random generator of one outline, pose or press.

    Args:
        seed: seed of the dataset.
        kind: kind of the stream, such as `NOISE`.
        index: index of the outline, pose or press in the dataset.
    """
    return np.random.default_rng([seed, kind, index])


def outline_presses(spec: DatasetSpec, index: int) -> OutlinePresses:
    """The presses of one outline of a dataset."""
    rng = stream(spec.seed, _OUTLINE, index)
    contact = spec.contacts[rng.choice(len(spec.contacts), p=_shares(spec.contacts))]
    first = index * spec.presses_per_outline
    return OutlinePresses(
        first=first,
        shape=str(rng.choice(contact.shapes)),
        size=float(rng.uniform(*contact.size)),
        preset=str(rng.choice(spec.presets)),
        law=str(rng.choice(spec.laws)),
        tangential=str(rng.choice(spec.tangential)),
        free=bool(rng.random() < spec.free),
        poses=tuple(_pose(spec, contact, index * spec.poses + k) for k in range(spec.poses)),
    )


def _shares(contacts: tuple[ContactSpec, ...]) -> Array:
    """Share of each kind of contact among the presses [-], (kinds,)."""
    weights = np.array([contact.weight for contact in contacts])
    with np.errstate(over="ignore"):
        total = weights.sum()
    if not np.isfinite(total):  # only then, since the division rounds, and presses must stay what they were
        weights = weights / weights.max()
        total = weights.sum()
    return weights / total


def _pose(spec: DatasetSpec, contact: ContactSpec, index: int) -> PosePresses:
    rng = stream(spec.seed, _POSE, index)
    x, y = rng.uniform(*contact.shift, 2).tolist()
    rotation = float(rng.uniform(*contact.rotation))
    presses = range(index * spec.forces, (index + 1) * spec.forces)
    drawn = [_force(contact, stream(spec.seed, _PRESS, press)) for press in presses]
    return PosePresses(
        shift=(x, y),
        rotation=rotation,
        directions=np.array([direction for direction, _ in drawn]),
        magnitudes=np.array([magnitude for _, magnitude in drawn]),
    )


def _force(contact: ContactSpec, rng: np.random.Generator) -> tuple[Array, float]:
    """Direction and magnitude [N] of one force."""
    magnitude, tilt, azimuth = (rng.uniform(*bounds) for bounds in (contact.force, contact.tilt, contact.azimuth))
    if rng.random() < contact.upright:
        tilt = 0.0
    across = np.sin(tilt)
    return np.array([across * np.cos(azimuth), across * np.sin(azimuth), -np.cos(tilt)]), float(magnitude)
