"""Law "elastic" on curved surfaces and on thin layers, against closed forms of contact mechanics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rigid_bodies import YOUNG, contact_modulus

from mjtactile.contact.cells import compliance as compliances
from mjtactile.contact.cells.compliance import SurfaceCompliance
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import ContactOptions, Wrench
from mjtactile.contact.ready import new_press
from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import build_influence
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import CylinderSector, SphereCap, Surface

#: Nearly incompressible: pressing does not shear the surface, which Hertz leaves out.
POISSON = 0.4999
MODULUS = contact_modulus(POISSON)
SIDE, PAD_RADIUS, BALL = 20e-3, 20e-3, 10e-3


def half_space(surface: Surface) -> InfluenceMatrices:
    """A curved pad without tables whose surface has no remainder: all its compliance is that of the tangent plane."""
    pad = Pad(
        size=(SIDE, SIDE),
        layers=(Layer(thickness=0.9 * PAD_RADIUS, young=YOUNG, poisson=POISSON),),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=(5e-3,),
        surface=surface,
    )
    influence = InfluenceMatrices(pad, Fidelity(mesh="draft"), {})
    ends = np.array([-SIDE / 2, SIDE / 2])
    factor = (1 - POISSON**2) / (math.pi * YOUNG)
    compliances._known[influence] = SurfaceCompliance(factor, POISSON, np.zeros((3, 1, 3, 1)), (ends, ends))
    return influence


def pressed(influence: InfluenceMatrices, height, place: np.ndarray, force: float) -> SurfaceLoad:
    """A body pressed along the surface's normal above a place (x, y)."""
    outer = influence.surface.outer
    vector = -force * outer.normals(*place)
    at = outer.positions(*place)
    options = ContactOptions(law="elastic", tangential="proportional", friction=None, tilting=False, cells=600)
    press = new_press(influence, options, strength=0.0, narrowest=1e-9)
    footprint = Footprint.from_height(height, influence.surface)
    return press.loads([footprint], [Wrench(vector, np.cross(at, vector))])[0].load


def ball(outer: Surface, place: np.ndarray, radius: float):
    """Height of a ball that touches a surface above a place."""
    centre = outer.positions(place[0], place[1], -radius)

    def height(x, y):
        square = radius**2 - (x - centre[0]) ** 2 - (y - centre[1]) ** 2
        return np.where(square > 0, centre[2] - np.sqrt(np.maximum(square, 0.0)), np.inf)

    return height


@pytest.mark.parametrize("place", [(0.0, 0.0), (5e-3, 0.0), (-4e-3, 3e-3)])
def test_a_ball_on_a_ball_is_hertzs(place):
    """a^3 = 3 F R / (4 E*), delta = a^2 / R, p0 = 3 F / (2 pi a^2), 1/R = 1/R1 + 1/R2 (Johnson 1985, section 4.2)."""
    influence, radius = half_space(SphereCap(PAD_RADIUS)), 1 / (1 / PAD_RADIUS + 1 / BALL)
    contact = 0.3e-3
    force = 4 * MODULUS * contact**3 / (3 * radius)
    load = pressed(influence, ball(SphereCap(PAD_RADIUS), np.array(place), BALL), np.array(place), force)
    assert load.indentation == pytest.approx(contact**2 / radius, rel=0.02)
    assert math.sqrt(load.contact_area / math.pi) == pytest.approx(contact, rel=0.02)
    assert load.peak_pressure == pytest.approx(3 * force / (2 * math.pi * contact**2), rel=0.02)


@pytest.mark.parametrize("x", [0.0, 6e-3])
def test_crossed_cylinders_are_hertzs(x):
    """Equal cylinders at right angles touch in a circle, as a ball of their radius does a plane (section 4.2)."""
    outer = CylinderSector(PAD_RADIUS)
    influence, place = half_space(outer), np.array([x, 0.0])
    # Its axis lies across the pad's, along the tangent there.
    normal, touch = outer.normals(*place), outer.positions(*place)
    centre = touch + PAD_RADIUS * normal

    def height(along, across):
        below = np.sqrt(np.maximum(PAD_RADIUS**2 - across**2, 0.0))
        return centre[2] - (normal[0] * (along - centre[0]) + below) / normal[2]

    contact = 0.4e-3
    force = 4 * MODULUS * contact**3 / (3 * PAD_RADIUS)
    load = pressed(influence, height, place, force)
    assert load.indentation == pytest.approx(contact**2 / PAD_RADIUS, rel=0.02)
    assert math.sqrt(load.contact_area / math.pi) == pytest.approx(contact, rel=0.02)
    assert load.peak_pressure == pytest.approx(3 * force / (2 * math.pi * contact**2), rel=0.02)


@pytest.fixture(scope="module")
def thin() -> InfluenceMatrices:
    thickness = 2e-3
    pad = Pad(
        size=(6 * thickness, 6 * thickness),
        layers=(Layer(thickness=thickness, young=YOUNG, poisson=0.4995),),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=(thickness / 2,),
    )
    return build_influence(pad, Fidelity(mesh="draft", law="elastic", cells=400), progress=False)


def dimitriadis(chi: float) -> float:
    """Force over Hertz's on a bonded incompressible layer, chi = sqrt(R delta) / h (Biophys. J. 82, 2002, eq. 13)."""
    return 1 + 1.133 * chi + 1.283 * chi**2 + 0.769 * chi**3 + 0.0975 * chi**4


def long(chi: float) -> float:
    """The same for 2 < R / h < 12.7, by finite elements (Long et al., Biophys. J. 101, 2011)."""
    omega = chi**3
    return (1 + 1.15 * chi + 9.5 * omega + 4.212 * omega**2) / (1 + 2.3 * omega)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::mjtactile.MeshWarning")
@pytest.mark.parametrize(
    ("chi", "correction"), [(0.1, dimitriadis), (0.25, dimitriadis), (0.4, dimitriadis), (0.5, long), (0.7, long)]
)
def test_a_bonded_layer_gives_way_as_thin_ones_do(thin, chi, correction):
    thickness, radius = thin.pad.thickness, 4 * thin.pad.thickness
    depth = (chi * thickness) ** 2 / radius
    force = 16 / 9 * YOUNG * math.sqrt(radius) * depth**1.5 * correction(chi)
    options = ContactOptions(law="elastic", tangential="proportional", friction=None, tilting=False, cells=400)
    footprint = Footprint.from_gap(
        lambda x, y: radius - np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0.0)), thin.surface
    )
    press = new_press(thin, options, strength=0.0)
    load = press.loads([footprint], [Wrench(np.array([0.0, 0.0, -force]), np.zeros(3))])[0].load
    assert load.indentation == pytest.approx(depth, rel=0.03)
