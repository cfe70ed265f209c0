"""Several bodies on one pad: each presses into a surface that the others have already bent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from mjtactile.contact.contact_load import reported, solved_loads
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import contact_options, wanted_wrench
from mjtactile.errors import ContactError
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad


def contact_loads(
    influence: InfluenceMatrices,
    footprints: Sequence[Footprint],
    forces: npt.ArrayLike,
    *,
    moments: npt.ArrayLike | None = None,
    law: str | None = None,
    tangential: str = "proportional",
    friction: float | None = None,
    tilt: str = "free",
    cells: int | None = None,
) -> list[SurfaceLoad]:
    """Loads of several rigid bodies that press on one pad at once.

    Under law "elastic" each body feels how the others bend the surface; under the other laws, and where only one body
    presses, the loads are those of `contact_load`. They add up: `influence.readings(sum(loads[1:], loads[0]))`.

    Args:
        influence: of the pad.
        footprints: of the bodies.
        forces: on the pad [N], pad frame, shape (bodies, 3).
        moments: about the pad's origin [N m], shape (bodies, 3); by default each force acts at its centroid.
        law: as in `contact_load`.
        tangential: as in `contact_load`.
        friction: as in `contact_load`.
        tilt: as in `contact_load`.
        cells: for each body, as in `contact_load`.

    Raises:
        ContactError: as `contact_load`, or when there are not as many forces or moments as footprints.

    Warns:
        ContactWarning: as `contact_load`.
    """
    options = contact_options(influence, law=law, tangential=tangential, friction=friction, tilt=tilt, cells=cells)
    given = [None] * len(footprints) if moments is None else list(np.asarray(moments, dtype=float))
    wanted_forces = list(np.asarray(forces, dtype=float))
    if not len(wanted_forces) == len(given) == len(footprints):
        raise ContactError(
            f"{len(footprints)} footprints, {len(wanted_forces)} forces and {len(given)} moments; expected one force "
            "and, if any, one moment per footprint."
        )
    triples = zip(footprints, wanted_forces, given, strict=True)
    wrenches = [wanted_wrench(footprint, force, moment) for footprint, force, moment in triples]
    loads = solved_loads(influence, footprints, wrenches, options)
    return [
        reported(influence, footprint, load, wrench, options)
        for footprint, load, wrench in zip(footprints, loads, wrenches, strict=True)
    ]
