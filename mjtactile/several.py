"""Several bodies on one pad: each presses into a surface that the others have already bent.

Bodies are solved in turn against the surface as the others leave it, until no force changes. What a body does to the
surface some way off is smooth, so the point forces of its cells' quadrature points stand for it there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from mjtactile.cell_contact import CellContact
from mjtactile.cell_laws import CellLoad, cell_load
from mjtactile.compliance import SurfaceCompliance, surface_compliance
from mjtactile.contact import cell_surface_load, reported, solved_load
from mjtactile.errors import ContactError
from mjtactile.footprint import Footprint
from mjtactile.influence import InfluenceMatrices
from mjtactile.load import SurfaceLoad
from mjtactile.options import ContactOptions, Wrench, contact_options, wanted_wrench
from mjtactile.pad import Array

#: Rounds over all bodies, and the change of forces, over the normal force, at which they agree.
_ROUNDS = 50
_AGREED = 1e-9


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
    if options.law != "elastic" or sum(wrench.normal > 0.0 for wrench in wrenches) < 2:
        pairs = zip(footprints, wrenches, strict=True)
        loads = [solved_load(influence, footprint, wrench, options)[0] for footprint, wrench in pairs]
    else:
        solved = _coupled(surface_compliance(influence), footprints, wrenches, options)
        loads = [cell_surface_load(influence, one, wrench) for one, wrench in zip(solved, wrenches, strict=True)]
    return [
        reported(influence, footprint, load, wrench, options)
        for footprint, load, wrench in zip(footprints, loads, wrenches, strict=True)
    ]


def _coupled(
    compliance: SurfaceCompliance, footprints: Sequence[Footprint], wrenches: Sequence[Wrench], options: ContactOptions
) -> list[CellLoad | None]:
    """Forces on the cells of each body; None for those that do not press."""
    pairs = list(zip(footprints, wrenches, strict=True))
    solved = [cell_load(compliance, *pair, options) if pair[1].normal > 0.0 else None for pair in pairs]
    # Heights of each body above the unbent surface.
    unbent = [None if one is None else one.pressed.at for one in solved]
    for _ in range(_ROUNDS):
        change = 0.0
        for k, (footprint, wrench) in enumerate(pairs):
            before, at = solved[k], unbent[k]
            if before is None or at is None:
                continue
            others = [one for j, one in enumerate(solved) if one is not None and j != k]
            sunk = sum(compliance.sinking(at.cells.centroids, one.cells, one.forces) for one in others)
            known = replace(before, pressed=replace(before.pressed, at=_lifted(at, np.asarray(sunk))))
            after = cell_load(compliance, footprint, wrench, options, known)
            if after.cells is not at.cells:  # the contact grew or shrank: its cells were chosen anew
                unbent[k], change = after.pressed.at, np.inf
            else:
                change = max(change, float(np.abs(after.forces - before.forces).max()) / wrench.normal)
            solved[k] = after
        if change <= _AGREED:
            return solved
    raise ContactError(
        "the bodies on the pad did not come to rest beside each other. Are their footprints apart? Overlapping ones "
        "are parts of one body: give their union."
    )


def _lifted(at: CellContact, sunk: Array) -> CellContact:
    """The same cells under a body that is further above the surface where that has sunk."""
    return replace(at, heights=at.heights + sunk)
