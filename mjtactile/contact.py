"""Contact laws: which tractions on the footprint make up a given contact wrench.

Tractions are what the indenter does to the pad, in the pad frame. They are returned as consistent nodal forces of the
surface grid; these reproduce the traction's resultant force and moment to rounding.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt
from shapely import Polygon

from mjtactile.cell_laws import CellLoad, ContactOptions, cell_load
from mjtactile.compliance import surface_compliance
from mjtactile.errors import ContactError, ContactWarning
from mjtactile.footprint import Footprint
from mjtactile.influence import InfluenceMatrices
from mjtactile.load import ContactState, SurfaceLoad
from mjtactile.pad import Array
from mjtactile.uniform import pressure_grip, uniform_load

__all__ = ["LAWS", "TANGENTIALS", "TILTS", "ContactState", "SurfaceLoad", "contact_load"]

#: Names of the contact laws, the cheapest first.
LAWS = ("uniform", "foundation", "elastic")
#: Names of the ways shear spreads over a contact.
TANGENTIALS = ("proportional", "stick", "coulomb")
#: Whether the body may tilt under its load.
TILTS = ("free", "fixed")
#: Mean pressure over the top layer's modulus above which strains are no longer small.
LINEAR_RANGE = 0.1
#: Indentation over the sheet's thickness above which they are not either.
LINEAR_INDENTATION = 0.1
#: A part of the wrench counts as not carried when it is larger than this fraction of the wrench.
_RESIDUAL_TOLERANCE = 1e-9


def contact_load(
    influence: InfluenceMatrices,
    footprint: Footprint,
    force: npt.ArrayLike,
    *,
    moment: npt.ArrayLike | None = None,
    law: str | None = None,
    tangential: str = "proportional",
    friction: float | None = None,
    tilt: str = "free",
    cells: int | None = None,
) -> SurfaceLoad:
    """Tractions that carry a contact wrench on a footprint.

    Laws: "uniform": pressure is constant over the footprint plus the linear gradient that carries the moment, and zero
    where that would pull; a curved body presses with its lowest part. "foundation": springs under the body's true
    shape, as stiff as the pad is under a face of the same area. "elastic": the pad's own compliance against the rigid
    body: pressure where they touch, a gap where they do not.

    Shear: "proportional" to the pressure, as in sliding, with a turn for the torsion; "stick": the surface does not
    move along the body; "coulomb": it sticks where |t| < mu p and slips elsewhere, after loading without history.
    Laws "uniform" and "foundation" know proportional shear only.

    Args:
        influence: of the pad.
        footprint: of the body, made with the same influence matrices.
        force: on the pad [N], pad frame, shape (3,); pressing is force[2] < 0.
        moment: about the pad's origin [N m], shape (3,); by default the force acts at the footprint's centroid.
        law: name of the contact law; by default the one the influence matrices' preset names.
        tangential: how shear spreads.
        friction: coefficient [-], which bounds shear and torsion; None: no bound. "coulomb" needs one.
        tilt: "free": the body tilts until its moments are the given ones; "fixed": it keeps its orientation, and the
            moments about x and y are what comes of that: the residual holds the difference to given ones. Law
            "uniform" takes no notice of it.
        cells: contact cells of laws "foundation" and "elastic"; by default as many as the preset says.

    Returns:
        The load. What the contact cannot carry is left out, nearest first, and stands in its residual.

    Raises:
        ContactError: for an unknown name, a wrench that is not three finite numbers each, or no contact found.

    Warns:
        ContactWarning: when the wrench cannot be carried, or the contact is beyond small strains.
    """
    options = _options(influence, law, tangential, friction, tilt, cells)
    wanted_force = _vector("force", force)
    if moment is None:
        wanted_moment = np.cross(np.array([*footprint.centroid, 0.0]), wanted_force)
    else:
        wanted_moment = _vector("moment", moment)
    if options.law == "uniform":
        load = _uniform(footprint.facing, wanted_force, wanted_moment, friction)
    else:
        load = _on_cells(influence, footprint, wanted_force, wanted_moment, options)
    _warn_unless_carried(load, wanted_force, wanted_moment, footprint, options)
    if moment is None and not options.tilting:
        load.residual_moment[:2] = 0.0  # no moment was asked for
    _warn_beyond_linear_range(load, wanted_force, influence)
    return load


def _options(
    influence: InfluenceMatrices,
    law: str | None,
    tangential: str,
    friction: float | None,
    tilt: str,
    cells: int | None,
) -> ContactOptions:
    law = influence.fidelity.law if law is None else law
    cells = influence.fidelity.cells if cells is None else cells
    for kind, name, known in (
        ("contact law", law, LAWS),
        ("tangential", tangential, TANGENTIALS),
        ("tilt", tilt, TILTS),
    ):
        if name not in known:
            raise ContactError(f"{kind} {name!r} does not exist. Available: {', '.join(known)}.")
    if tangential != "proportional" and law != "elastic":
        raise ContactError(f"tangential={tangential!r} needs law='elastic'; law {law!r} knows 'proportional' only.")
    if friction is not None and not (math.isfinite(friction) and friction >= 0.0):
        raise ContactError(f"friction = {friction}; expected a coefficient that is not negative, for example 0.8.")
    if tangential == "coulomb" and friction is None:
        raise ContactError("tangential='coulomb' needs a coefficient: pass friction=..., for example 0.8.")
    if isinstance(cells, bool) or not isinstance(cells, int) or cells < 1:
        raise ContactError(f"cells = {cells!r}; expected a whole number of contact cells from 1 on.")
    return ContactOptions(law=law, tangential=tangential, friction=friction, tilting=tilt == "free", cells=cells)


def _vector(name: str, value: npt.ArrayLike) -> Array:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ContactError(f"{name} = {value!r}; expected three finite numbers (x, y, z) in the pad frame, N or N m.")
    return vector


def _uniform(footprint: Footprint, force: Array, moment: Array, friction: float | None) -> SurfaceLoad:
    load = uniform_load(footprint, force, moment)
    if friction is None or force[2] > 0.0:
        return load
    held = uniform_load(footprint, *_held(load, force, moment, friction))
    carried_force, carried_moment = held.resultant()
    return replace(held, residual_force=force - carried_force, residual_moment=moment - carried_moment)


def _held(load: SurfaceLoad, force: Array, moment: Array, friction: float) -> tuple[Array, Array]:
    """The wrench with its shear and torsion reduced to what friction holds under this load's pressure."""
    grip = pressure_grip(load)
    if grip is None:
        return np.array([0.0, 0.0, force[2]]), np.array([*moment[:2], 0.0])
    across = grip.centre[0] * force[1] - grip.centre[1] * force[0]
    nearest, _ = grip.nearest(np.array([*force[:2], (moment[2] - across) / grip.length]), friction)
    across = grip.centre[0] * nearest[1] - grip.centre[1] * nearest[0]
    return np.array([*nearest[:2], force[2]]), np.array([*moment[:2], nearest[2] * grip.length + across])


def _on_cells(
    influence: InfluenceMatrices, footprint: Footprint, force: Array, moment: Array, options: ContactOptions
) -> SurfaceLoad:
    surface = influence.surface
    if force[2] >= 0.0:
        nothing = np.zeros((*surface.node_shape, 3))
        return SurfaceLoad(nothing, surface, Polygon(), force, moment, ContactState(stick_area=0.0))
    through = np.array([moment[1], -moment[0]]) / -force[2]
    wrench = np.array([*force, moment[2]])
    solved = cell_load(surface_compliance(influence), footprint, wrench, through, options)
    nodal = solved.cells.nodal_forces(surface, solved.forces)
    load = SurfaceLoad(nodal, surface, Polygon())
    carried_force, carried_moment = load.resultant()
    return SurfaceLoad(
        nodal,
        surface,
        partial(_touching, solved),
        force - carried_force,
        moment - carried_moment,
        solved.state,
    )


def _touching(solved: CellLoad) -> Polygon:
    return solved.cells.outline(solved.forces[:, 2] < 0.0)  # type: ignore[return-value]


def _warn_unless_carried(
    load: SurfaceLoad, force: Array, moment: Array, footprint: Footprint, options: ContactOptions
) -> None:
    length = np.sqrt(footprint.area)
    size = np.linalg.norm(force) + np.linalg.norm(moment) / length
    left_moment = load.residual_moment.copy()
    if not options.tilting and options.law != "uniform":
        left_moment[:2] = 0.0  # a body that keeps its orientation answers with whatever moment that takes
    missing = np.linalg.norm(load.residual_force) + np.linalg.norm(left_moment) / length
    if missing <= _RESIDUAL_TOLERANCE * size:
        return
    through = np.round(np.array([moment[1], -moment[0]]) / (-force[2] or np.nan) * 1e3, 6) + 0.0
    if force[2] > 0:
        reason = "the force pulls the indenter off the pad"
    elif force[2] == 0:
        reason = "there is a moment or shear but no force pressing"
    elif abs(load.residual_force[2]) > _RESIDUAL_TOLERANCE * size or (
        np.linalg.norm(left_moment[:2]) / length > _RESIDUAL_TOLERANCE * size
    ):
        reason = f"the force passes through ({through[0]:.4g}, {through[1]:.4g}) mm, outside the area it spans"
    else:
        reason = f"it slips: friction {options.friction} does not hold the shear and torsion"
    warnings.warn(
        f"the footprint cannot carry this wrench: {reason}. The nearest load that it can carry is used; "
        f"force {_format(load.residual_force, size)} N and moment {_format(left_moment, size * length)} N m "
        "are left over.",
        ContactWarning,
        stacklevel=3,
    )


def _format(vector: Array, size: float) -> str:
    """Three digits each; what is rounding beside `size` as 0."""
    shown = np.where(np.abs(vector) <= _RESIDUAL_TOLERANCE * size, 0.0, vector)
    return "(" + ", ".join(f"{v:.3g}" for v in shown) + ")"


def _warn_beyond_linear_range(load: SurfaceLoad, force: Array, influence: InfluenceMatrices) -> None:
    young, thickness = influence.pad.layers[0].young, influence.pad.thickness
    if load.contact_area == 0.0 or force[2] >= 0:
        return
    pressure = -force[2] / load.contact_area
    if pressure > LINEAR_RANGE * young:
        limit = f"{LINEAR_RANGE:.0%} of the top layer's modulus, {young:.3g} Pa"
        reason = f"the mean pressure, {pressure:.3g} Pa, is over {limit}"
    elif load.approach > LINEAR_INDENTATION * thickness:
        reason = (
            f"the indentation, {load.approach * 1e3:.3g} mm, is over {LINEAR_INDENTATION:.0%} of the pad's thickness, "
            f"{thickness * 1e3:.3g} mm"
        )
    else:
        return
    warnings.warn(
        f"{reason}: strains are no longer small and the readings of this linear model are too simple there.",
        ContactWarning,
        stacklevel=3,
    )
