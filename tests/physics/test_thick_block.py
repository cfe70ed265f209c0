"""Law "elastic" on a block from the finite elements, so thick that small bodies feel a half space."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rigid_bodies import YOUNG, contact_modulus, disc

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import contact_options, wanted_wrench
from mjtactile.contact.press import Press
from mjtactile.fidelity import Fidelity, MeshDensity
from mjtactile.influence.build import build_tables
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid

SIDE = 30e-3
POISSON = 0.49
MODULUS = contact_modulus(POISSON)
CURVATURE = 6e-3
COARSE = MeshDensity(
    in_plane_size=0.1,
    through_size=1 / 8,
    rim_grading=1 / 3,
    base_grading=1 / 4,
    points_per_axis=(1,),
    reference_length=SIDE,
)


@pytest.fixture(scope="module")
def block() -> InfluenceMatrices:
    """Ten elements a side, of 1.6 mm in the middle: closed forms do what is smaller."""
    pad = Pad(
        size=(SIDE, SIDE),
        layers=(Layer(thickness=SIDE, young=YOUNG, poisson=POISSON),),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=(2e-3,),
    )
    tables = {}
    for of_class in build_tables(pad, COARSE):
        tables |= of_class
    return InfluenceMatrices(pad, Fidelity(mesh=COARSE, law="elastic", cells=400), tables)


def sphere(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x**2 + y**2) / (2 * CURVATURE)


def finely_pressed(influence: InfluenceMatrices, footprint: Footprint, force, **options) -> SurfaceLoad:
    """On cells as narrow as the contact asks for, whatever taxels tell apart."""
    press = Press(influence, contact_options(influence, **options), narrowest=1e-9)
    return press.loads([footprint], [wanted_wrench(footprint, force, None)])[0].load


@pytest.mark.parametrize("radius", [0.1e-3, 0.3e-3, 0.6e-3])
def test_flat_round_punch_is_as_stiff_as_on_a_half_space(block, radius):
    force = 1e3 * radius**2
    load = contact_load(block, Footprint.from_outline(disc(radius), block.surface), (0.0, 0.0, -force))
    assert force / load.indentation == pytest.approx(2 * radius * MODULUS, rel=0.01)


@pytest.mark.parametrize("force", [1e-4, 1e-3, 1e-2])
def test_sphere_is_hertzs(block, force):
    footprint = Footprint.from_gap(sphere, block.surface)
    load = finely_pressed(block, footprint, (0.0, 0.0, -force), cells=800)
    radius = (3 * force * CURVATURE / (4 * MODULUS)) ** (1 / 3)
    assert force == pytest.approx(4 / 3 * MODULUS * math.sqrt(CURVATURE * load.indentation**3), rel=0.01)
    assert load.peak_pressure == pytest.approx(3 * force / (2 * math.pi * radius**2), rel=0.01)
    assert math.sqrt(load.contact_area / math.pi) == pytest.approx(radius, rel=0.02)  # whole cells


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_stick_radius_is_cattaneos_and_mindlins(block, share):
    force, friction = 1e-3, 0.5
    shear = share * friction * force
    load = finely_pressed(
        block,
        Footprint.from_gap(sphere, block.surface),
        (shear, 0.0, -force),
        tangential="coulomb",
        friction=friction,
        tilt="fixed",
    )
    radius = (3 * force * CURVATURE / (4 * MODULUS)) ** (1 / 3)
    stick = radius * (1 - share) ** (1 / 3)
    assert math.sqrt(load.state.stick_area / math.pi) == pytest.approx(stick, rel=0.03)
    np.testing.assert_allclose(load.resultant()[0], [shear, 0.0, -force], atol=1e-9 * force)
