"""The presses that the benchmarks measure: those of benchmarks/trade.toml, and those that CalculiX solved."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from scipy.spatial.transform import Rotation
from shapely import Polygon, affinity

from mjtactile._types import Array
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint, GapFunction
from mjtactile.contact.laws import BY_NAME
from mjtactile.errors import MjTactileError
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.lower_surface import LowerSurface
from mjtactile.geometry.outlines import INDENTER_NAMES, ellipse
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import Area, SurfaceLoad
from mjtactile.pad import force_vector
from mjtactile.sim.assets import asset_path
from mjtactile.units import GRAM_FORCE, MILLIMETRE

#: The readings in calculix.npz are in MPa.
_MEGA = 1e6
#: Titles of the groups of CalculiX cases by the beginning of their names: B2 are frictionless punches, B3 are punches
#: that stick, C is a sphere.
CALCULIX_GROUPS = {"B2": "B2", "B3": "B3", "C": "sphere"}
_RIGID = tuple(f"{group}_" for group in CALCULIX_GROUPS)


@dataclass(frozen=True)
class Body:
    """The lower side of a rigid body over the pad: a flat face, or a gap function."""

    outline: Area | None  #: outline of the face in the pad frame [m]; None if the body covers the whole pad
    gap: GapFunction | None = None  #: height of the body over points (x, y) of the pad frame [m]; None for a flat face

    def moved(self, x: float, y: float) -> Body:
        """The body shifted by (x, y) [m]."""
        outline = None if self.outline is None else affinity.translate(self.outline, x, y)
        gap = self.gap
        return Body(outline, None if gap is None else lambda px, py: gap(px - x, py - y))

    def footprint(self, surface: SurfaceGrid) -> Footprint:
        """The body's footprint on a pad's surface grid."""
        if self.gap is not None:
            return Footprint.from_gap(self.gap, surface, outline=self.outline)
        assert self.outline is not None
        return Footprint.from_outline(self.outline, surface)


@dataclass(frozen=True, eq=False)
class PressCase:
    """One body pressed with one force, with the readings of an independent code if there are any."""

    name: str
    body: Body
    force: Array  #: on the pad at the centroid of the first contact, in the pad frame [N], shape (3,)
    tilt: str = "free"  #: see contact_load
    tangential: str = "proportional"  #: see contact_load; a law that does not offer it uses its own first choice
    readings: Array | None = None  #: (layers, rows, columns) [Pa]

    @property
    def reference(self) -> Array:
        """Readings of the independent code [Pa], (layers, rows, columns).

        Raises:
            MjTactileError: the case has no such readings.
        """
        if self.readings is None:
            raise MjTactileError(f"case {self.name!r} has no readings of an independent code.")
        return self.readings

    @property
    def is_flat(self) -> bool:
        """Whether a flat face presses."""
        return self.body.gap is None

    def contact(self, law: str) -> dict[str, Any]:
        """Arguments `tilt` and `tangential` of contact_load under a contact law."""
        return {
            "tilt": self.tilt,
            "tangential": self.tangential
            if self.tangential in BY_NAME[law].tangentials
            else BY_NAME[law].tangentials[0],
        }

    def load(self, influence: InfluenceMatrices, body: Body | None = None) -> SurfaceLoad:
        """The tractions of this press, or of `body` in place of its own, by the law of the matrices' fidelity."""
        footprint = (self.body if body is None else body).footprint(influence.surface)
        return contact_load(influence, footprint, self.force, **self.contact(influence.fidelity.law))


def press_case(case: dict[str, Any]) -> PressCase:
    """The press that an entry `[[case]]` of benchmarks/trade.toml or benchmarks/mesh.toml describes.

    Args:
        case: the entry: `name`, `shape`, `force` [gf]; where they differ from 0, place `at` (x, y) [mm], `turn` about
            the fixed axes x, y and z [deg], `tilt` and `azimuth` of the force [deg]; `scale` of a punch [-]; `radius`,
            `length` or `size` of a solid [mm]; `orientation`, "free" or "fixed".

    Raises:
        MjTactileError: the case names a shape that does not exist.
    """
    x, y = case.get("at", (0.0, 0.0))
    rotation = Rotation.from_euler("xyz", case.get("turn", (0.0, 0.0, 0.0)), degrees=True)
    body = _punch(case, rotation) if case["shape"] in INDENTER_NAMES else _solid(case, rotation)
    return PressCase(
        name=case["name"],
        body=body.moved(x * MILLIMETRE, y * MILLIMETRE),
        force=force_vector(case["force"] * GRAM_FORCE, case.get("tilt", 0.0), case.get("azimuth", 0.0)),
        tilt=case.get("orientation", "free"),
    )


def calculix_cases() -> list[PressCase]:
    """Rigid punches and a sphere that CalculiX solved, with its readings; benchmarks/calculix.json describes them."""
    cases = json.loads(asset_path("benchmarks/calculix.json").read_text())["cases"]
    with np.load(asset_path("benchmarks/calculix.npz")) as readings:
        return [
            PressCase(
                name=name,
                body=_calculix_body(case["geometry"]),
                force=np.array(case["direction"], dtype=float) * case["total_force_gf"] * GRAM_FORCE,
                tilt="fixed",
                tangential="stick" if name.startswith("B3") else "proportional",
                readings=readings[name].astype(float) * _MEGA,
            )
            for name, case in cases.items()
            if name.startswith(_RIGID)
        ]


def moved_bodies(case: PressCase, count: int, shift: float, seed: int) -> Sequence[Body]:
    """`count` copies of the case's body, each shifted at random along x and y by at most `shift` [m]."""
    shifts = np.random.default_rng(seed).uniform(-shift, shift, (count, 2))
    return [case.body.moved(float(x), float(y)) for x, y in shifts]


def _punch(case: dict[str, Any], rotation: Rotation) -> Body:
    """A flat punch turned about the pad's normal. A punch that leans becomes an inclined plane over its outline."""
    matrix = rotation.as_matrix()
    outline = indenter_outline(case["shape"], scale=case.get("scale", 1.0))
    turned = affinity.rotate(outline, np.arctan2(matrix[1, 0], matrix[0, 0]), (0, 0), use_radians=True)
    normal = matrix[:, 2]
    if np.hypot(normal[0], normal[1]) < 1e-12:
        return Body(turned)
    return Body(turned, lambda x, y: -(normal[0] * x + normal[1] * y) / normal[2])


def _solid(case: dict[str, Any], rotation: Rotation) -> Body:
    """A sphere, cylinder or box above the pad, its centre over the origin."""
    sizes = {name: np.array(case[name]) * MILLIMETRE for name in ("radius", "length", "size") if name in case}
    match case["shape"]:
        case "sphere":
            extent = float(sizes["radius"])
            surface = LowerSurface.of_sphere(extent)
        case "cylinder":
            radius, length = float(sizes["radius"]), float(sizes["length"])
            surface, extent = LowerSurface.of_cylinder(radius, length), float(np.hypot(radius, length / 2))
        case "box":
            surface, extent = LowerSurface.of_box(sizes["size"]), float(np.linalg.norm(sizes["size"])) / 2
        case other:
            known = (*INDENTER_NAMES, "sphere", "cylinder", "box")
            raise MjTactileError(f"shape {other!r} of a case does not exist. Available: {', '.join(known)}.")
    centre, matrix = np.array([0.0, 0.0, extent]), rotation.as_matrix()

    def heights(x: Array, y: Array) -> Array:
        return surface.heights(centre, matrix, np.ravel(x), np.ravel(y), floor=0.0).reshape(np.shape(x))

    return Body(None, heights)


def _calculix_body(geometry: dict[str, Any]) -> Body:
    match geometry["kind"]:
        case "sphere":
            return _solid({"shape": "sphere", "radius": geometry["R"]}, Rotation.identity())
        case "ellipse":
            outline = ellipse(geometry["a"] * MILLIMETRE, geometry["b"] * MILLIMETRE)
            x, y = geometry["c"]
            return Body(affinity.translate(outline, x * MILLIMETRE, y * MILLIMETRE))
        case _:
            return Body(shapely.transform(Polygon(geometry["v"]), lambda points: points * MILLIMETRE))
