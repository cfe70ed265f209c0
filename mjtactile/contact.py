"""Contact laws: which tractions on the footprint make up a given contact wrench.

Tractions are what the indenter does to the pad, in the pad frame. They are returned as consistent nodal forces of the
surface grid; these reproduce the traction's resultant force and moment to rounding.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from shapely import Polygon

from mjtactile.cell_laws import CellLoad, cell_load
from mjtactile.compliance import surface_compliance
from mjtactile.errors import ContactWarning
from mjtactile.footprint import Footprint
from mjtactile.influence import InfluenceMatrices
from mjtactile.load import ContactState, SurfaceLoad
from mjtactile.options import LAWS, TANGENTIALS, TILTS, ContactOptions, Wrench, contact_options, wanted_wrench
from mjtactile.pad import Array, Pad
from mjtactile.uniform import uniform_load_within

__all__ = ["LAWS", "TANGENTIALS", "TILTS", "ContactState", "SurfaceLoad", "contact_load"]

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
    options = contact_options(influence, law=law, tangential=tangential, friction=friction, tilt=tilt, cells=cells)
    wrench = wanted_wrench(footprint, force, moment)
    load, _ = solved_load(influence, footprint, wrench, options)
    return reported(influence, footprint, load, wrench, options)


def solved_load(
    influence: InfluenceMatrices,
    footprint: Footprint,
    wrench: Wrench,
    options: ContactOptions,
    known: CellLoad | None = None,
) -> tuple[SurfaceLoad, CellLoad | None]:
    """The load by the law asked for, and its contact cells; None where there are none.

    Raises:
        ContactError: when no contact was found.
    """
    if options.law == "uniform":
        return uniform_load_within(footprint.facing, wrench, options.friction), None
    solved = None
    if wrench.normal > 0.0:
        solved = cell_load(surface_compliance(influence), footprint, wrench, options, known)
    return cell_surface_load(influence, solved, wrench), solved


def cell_surface_load(influence: InfluenceMatrices, solved: CellLoad | None, wrench: Wrench) -> SurfaceLoad:
    """Forces on contact cells as a load of the pad's surface; of a wrench that does not press, nothing."""
    surface = influence.surface
    if solved is None:
        nothing = np.zeros((*surface.node_shape, 3))
        return SurfaceLoad(nothing, surface, Polygon(), wrench.force, wrench.moment, ContactState(stick_area=0.0))
    nodal = solved.cells.nodal_forces(surface, solved.forces)
    force, moment = SurfaceLoad(nodal, surface, Polygon()).resultant()
    return SurfaceLoad(nodal, surface, solved.touching, wrench.force - force, wrench.moment - moment, solved.state)


def reported(
    influence: InfluenceMatrices, footprint: Footprint, load: SurfaceLoad, wrench: Wrench, options: ContactOptions
) -> SurfaceLoad:
    """The load, after warnings about what it does not carry and where it is out of range."""
    answers = not options.tilting and options.law != "uniform"
    if answers and not wrench.moment_given:
        # The moment is what a body that keeps its orientation answers with; none was asked for.
        load = replace(load, residual_moment=load.residual_moment * np.array([0.0, 0.0, 1.0]))
    _warn_unless_carried(load, wrench, footprint, options, answers)
    warn_beyond_linear_range(influence, wrench, load.state)
    return load


def _warn_unless_carried(
    load: SurfaceLoad, wrench: Wrench, footprint: Footprint, options: ContactOptions, answers: bool
) -> None:
    length = np.sqrt(footprint.area)
    size = np.linalg.norm(wrench.force) + np.linalg.norm(wrench.moment) / length
    left_force = load.residual_force
    left_moment = load.residual_moment * np.array([0.0, 0.0, 1.0]) if answers else load.residual_moment
    if np.linalg.norm(left_force) + np.linalg.norm(left_moment) / length <= _RESIDUAL_TOLERANCE * size:
        return
    pressing_left = abs(left_force[2]) + np.linalg.norm(left_moment[:2]) / length
    if wrench.normal < 0.0:
        reason = "the force pulls the indenter off the pad"
    elif wrench.normal == 0.0:
        reason = "there is a moment or shear but no force pressing"
    elif pressing_left > _RESIDUAL_TOLERANCE * size:
        x, y = np.round(wrench.through * 1e3, 6) + 0.0
        reason = f"the force passes through ({x:.4g}, {y:.4g}) mm, outside the area it spans"
    else:
        reason = f"it slips: friction {options.friction} does not hold the shear and torsion"
    warnings.warn(
        f"the footprint cannot carry this wrench: {reason}. The nearest load that it can carry is used; "
        f"force {_format(left_force, size)} N and moment {_format(left_moment, size * length)} N m "
        "are left over.",
        ContactWarning,
        stacklevel=4,
    )


def _format(vector: Array, size: float) -> str:
    """Three digits each; what is rounding beside `size` as 0."""
    shown = np.where(np.abs(vector) <= _RESIDUAL_TOLERANCE * size, 0.0, vector)
    return "(" + ", ".join(f"{v:.3g}" for v in shown) + ")"


def warn_beyond_linear_range(influence: InfluenceMatrices, wrench: Wrench, state: ContactState) -> None:
    """Warn where strains are no longer small under a contact."""
    if state.contact_area == 0.0 or wrench.normal <= 0.0:
        return
    reason = beyond_linear_range(influence.pad, wrench.normal / state.contact_area, state.approach)
    if reason is not None:
        warnings.warn(reason, ContactWarning, stacklevel=4)


def linear_range(pad: Pad) -> tuple[float, float]:
    """Mean pressure [Pa] and indentation [m] up to which strains count as small."""
    return LINEAR_RANGE * pad.layers[0].young, LINEAR_INDENTATION * pad.thickness


def beyond_linear_range(pad: Pad, pressure: float, approach: float) -> str | None:
    """What is wrong with a contact of this mean pressure [Pa] and indentation [m]; None within the linear range."""
    most_pressure, most_approach = linear_range(pad)
    if pressure > most_pressure:
        limit = f"{LINEAR_RANGE:.0%} of the top layer's modulus, {pad.layers[0].young:.3g} Pa"
        reason = f"the mean pressure, {pressure:.3g} Pa, is over {limit}"
    elif approach > most_approach:
        limit = f"{LINEAR_INDENTATION:.0%} of the pad's thickness, {pad.thickness * 1e3:.3g} mm"
        reason = f"the indentation, {approach * 1e3:.3g} mm, is over {limit}"
    else:
        return None
    return f"{reason}: strains are no longer small and the readings of this linear model are too simple there."
