"""Tractions on a footprint that carry a given contact wrench.

Tractions act on the pad, in the pad frame. They are returned as consistent nodal forces of the surface grid, which
have the resultant force and moment of the tractions to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.linear_range import beyond_linear_range
from mjtactile.contact.options import ContactOptions, Wrench, contact_options, wanted_wrench
from mjtactile.contact.ready import solved_bodies
from mjtactile.errors import ContactError, warn_of_contact
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import ContactState, SurfaceLoad

#: A residual larger than this fraction of the wrench counts as not carried [-].
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

    Laws. "uniform": the pressure is constant plus a linear gradient that carries the moment, and zero where it would be
    negative; a curved body presses with its lowest part. "foundation": independent springs under the body's true shape,
    as stiff as the pad is under a face of the same area. "elastic": unilateral contact of the rigid body with the
    elastic pad, with pressure where they touch and a gap elsewhere.

    Shear. "proportional": shear proportional to the pressure, as in sliding, or with law "uniform" constant over the
    pressed area, plus a rotational part for the torsion.
    "stick": the surface does not move relative to the body. "coulomb": the surface sticks where |t| < mu p and slips
    elsewhere, without history of loading. Laws "uniform" and "foundation" allow "proportional" only.

    Args:
        influence: of the pad.
        footprint: of the body, made with the same influence matrices.
        force: on the pad [N], pad frame, shape (3,); it presses if it points into the surface.
        moment: about the pad's origin [N m], shape (3,); by default the force acts at the footprint's centroid.
        law: name of the contact law; by default that of the influence matrices' fidelity.
        tangential: how shear is distributed.
        friction: coefficient [-] that bounds shear and torsion; None: no bound. "coulomb" needs one.
        tilt: "free": the body tilts until it carries the given moments. "fixed": it keeps its orientation, so that the
            moments about x and y follow from the contact; the residual is the difference to given ones. Law "uniform"
            ignores this option.
        cells: number of contact cells of laws "foundation" and "elastic"; by default that of the fidelity. A flat face
            that is wide for the pad's thickness gets more, up to 200, unless shear sticks or slips.

    Returns:
        The load, computed by the compiled core; sensors of the plugin have the same load for the same contact. The
        pressure on a cell is at most the top layer's modulus. If the contact cannot carry the wrench, the load carries
        one near it, and the residual is the rest.

    Raises:
        ContactError: an unknown name, a friction or number of cells out of range, a force or moment that is not three
            finite numbers, a footprint of another pad or mesh, or no contact was found.
        Exception: any exception of the footprint's gap function.

    Warns:
        ContactWarning: the wrench cannot be carried, the law's solution was not found, or strains are not small.
    """
    options = contact_options(
        influence, law=law, tangential=tangential, friction=friction, tilt=tilt, cells=cells
    ).with_friction()
    wrench = wanted_wrench(footprint, force, moment)
    (load,) = solved_loads(influence, [footprint], [wrench], options)
    return reported(influence, footprint, load, wrench, options)


def solved_loads(
    influence: InfluenceMatrices, footprints: Sequence[Footprint], wrenches: Sequence[Wrench], options: ContactOptions
) -> list[SurfaceLoad]:
    """Loads of bodies that press on one pad at once, in their order; an empty load for a wrench that does not press.

    Raises:
        ContactError: no contact was found.
    """
    pressing = [k for k, wrench in enumerate(wrenches) if wrench.normal > 0.0]
    bodies, wanted = [footprints[k] for k in pressing], [wrenches[k] for k in pressing]
    pressed = dict(zip(pressing, _pressed_loads(influence, bodies, wanted, options), strict=True)) if pressing else {}
    return [
        pressed[k] if k in pressed else SurfaceLoad.none(influence.surface, wrench.force, wrench.moment)
        for k, wrench in enumerate(wrenches)
    ]


def _pressed_loads(
    influence: InfluenceMatrices, footprints: Sequence[Footprint], wrenches: Sequence[Wrench], options: ContactOptions
) -> list[SurfaceLoad]:
    """`solved_loads` of bodies that all press."""
    bodies = footprints if options.contact_law.shapes else [footprint.lowest_part for footprint in footprints]
    solved = solved_bodies(influence, bodies, wrenches, options)
    for one in solved:
        if one.approximated:
            warn_of_contact(
                "the contact law has no solution here: the pressure is spread over as much area around the line of the "
                "force as it needs instead.",
            )
        elif one.simplified:
            warn_of_contact(
                "no pressure and shear were found that agree with each other, which can happen with few cells or high "
                "friction: the pressure is that without friction.",
            )
    return [one.load for one in solved]


def reported(
    influence: InfluenceMatrices, footprint: Footprint, load: SurfaceLoad, wrench: Wrench, options: ContactOptions
) -> SurfaceLoad:
    """A load after warnings about a wrench that it does not carry and about large strains.

    If the moments about x and y are results, they are not part of its residual.

    Warns:
        ContactWarning: the load does not carry the wrench, or strains are not small.
    """
    gives_moment = options.gives_moment
    if gives_moment and not wrench.moment_given:
        # For a body of fixed orientation without a given moment, the moment is a result, not a residual.
        left = wrench.moment_about_place(load.residual_force, load.residual_moment)
        load = replace(load, residual_moment=load.residual_moment - left + wrench.torsion(left))
    _warn_unless_carried(load, wrench, footprint, options)
    warn_beyond_linear_range(influence, wrench.force - load.residual_force, wrench.outward, load.state)
    return load


def _warn_unless_carried(load: SurfaceLoad, wrench: Wrench, footprint: Footprint, options: ContactOptions) -> None:
    length = math.sqrt(footprint.area)
    size = _size(wrench.force, wrench.moment_about_place(wrench.force, wrench.moment), length)
    left_force = load.residual_force
    left_moment = wrench.moment_about_place(left_force, load.residual_moment)
    if options.gives_moment:  # moments that tilt the body are results, not loads
        left_moment = wrench.torsion(left_moment)
    if _size(left_force, left_moment, length) <= _RESIDUAL_TOLERANCE * size:
        return
    lost, tilting_left = abs(float(left_force @ wrench.outward)), left_moment - wrench.torsion(left_moment)
    if wrench.normal < 0.0:
        reason = "the force pulls the indenter off the pad"
    elif wrench.normal == 0.0:
        reason = "there is a moment or shear but no force pressing"
    elif lost > _RESIDUAL_TOLERANCE * size:
        reason = "the force is more than its area can bear at a pressure of the top layer's modulus"
    elif lost + math.hypot(*tilting_left) / length > _RESIDUAL_TOLERANCE * size:
        x, y = np.round(wrench.through * 1e3, 6) + 0.0
        reason = f"the force passes through ({x:.4g}, {y:.4g}) mm, outside its contact cells or too near their rim"
    elif options.friction is None:
        reason = "the area under pressure cannot carry its shear and torsion"
    else:
        reason = f"it slips: friction {options.friction} cannot carry the shear and torsion"
    about = "" if wrench.place is None else " about the place where the force presses"
    warn_of_contact(
        f"the footprint cannot carry this wrench: {reason}. A load near it is used; "
        f"force {_format(left_force, size)} N and moment {_format(left_moment, size * length)} N m{about} "
        "are left over.",
    )


def _size(force: Array, moment: Array, length: float) -> float:
    """Size of a wrench as a force [N], with the moment over a length [m]."""
    return math.hypot(*force.tolist()) + math.hypot(*moment.tolist()) / length


def _format(vector: Array, size: float) -> str:
    """A vector as text with three digits; components that are rounding errors relative to `size` become 0."""
    shown = np.where(np.abs(vector) <= _RESIDUAL_TOLERANCE * size, 0.0, vector)
    return "(" + ", ".join(f"{v:.3g}" for v in shown) + ")"


def warn_beyond_linear_range(influence: InfluenceMatrices, force: Array, outward: Array, state: ContactState) -> None:
    """Warn if the strains under a contact are not small.

    Args:
        influence: of the pad.
        force: that the contact carries [N], pad frame, shape (3,); without pressure there is no warning.
        outward: unit normal of the surface where it presses, out of the pad, shape (3,).
        state: of the contact; without an area there is no warning.

    Warns:
        ContactWarning: the mean pressure, with its shear, or the indentation is beyond the linear range.
    """
    normal = float(force @ outward)
    if state.contact_area == 0.0 or normal >= 0.0:
        return
    pressing = math.sqrt(normal**2 + 3.0 * max(float(force @ force) - normal**2, 0.0))
    reason = beyond_linear_range(influence.pad, pressing / state.contact_area, state.indentation)
    if reason is not None:
        warn_of_contact(reason)


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
    """Loads of several rigid bodies that press on one pad at the same time.

    Under law "elastic" each body is affected by the surface's deflection under the others. Under the other laws, and if
    only one body presses, the loads are those of `contact_load`. Loads add up:
    `influence.readings(sum(loads[1:], loads[0]))`.

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

    Returns:
        One load for each footprint, in the same order.

    Raises:
        ContactError: as `contact_load`, or the numbers of forces, moments and footprints differ.

    Warns:
        ContactWarning: as `contact_load`.
    """
    options = contact_options(
        influence, law=law, tangential=tangential, friction=friction, tilt=tilt, cells=cells
    ).with_friction()
    bodies, wanted = _listed("footprints", footprints), _listed("forces", forces)
    given = [None] * len(bodies) if moments is None else _listed("moments", moments)
    if not len(wanted) == len(given) == len(bodies):
        raise ContactError(
            f"{len(bodies)} footprints, {len(wanted)} forces and {len(given)} moments; expected one force and, if any, "
            "one moment per footprint."
        )
    wrenches = [wanted_wrench(*triple) for triple in zip(bodies, wanted, given, strict=True)]
    loads = solved_loads(influence, bodies, wrenches, options)
    return [
        reported(influence, footprint, load, wrench, options)
        for footprint, load, wrench in zip(bodies, loads, wrenches, strict=True)
    ]


def _listed(name: str, values: Any) -> list[Any]:
    """One value for each footprint, as a list."""
    try:
        return list(values)
    except TypeError:
        raise ContactError(f"{name} = {values!r}; expected a sequence with one entry for each footprint.") from None
