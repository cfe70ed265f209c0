"""The surface's compliance between cells: symmetric, positive definite, and that of the finite elements."""

from __future__ import annotations

import numpy as np
import pytest
from core_cells import face_cells
from laws_on_cells import Cells, full_compliance, normal_compliance, placed
from scipy.interpolate import RegularGridInterpolator
from shapely import Point, Polygon
from small_pads import COARSE, in_double_precision

from mjtactile.contact.cells.compliance import SurfaceCompliance, surface_compliance
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad


def outline_cells(outline, count: int) -> Cells:
    made = face_cells(outline, count)
    assert made is not None
    return placed(made, np.zeros(3))


def dome(cells: Cells, centre: tuple[float, float], radius: float, component: int) -> np.ndarray:
    """Forces on cells whose traction falls to zero like a parabola, (cells, 3) [N]."""
    distance = np.linalg.norm(cells.centroids - centre, axis=1) / radius
    shares = cells.areas * np.maximum(1 - distance**2, 0.0)
    forces = np.zeros((len(cells.areas), 3))
    forces[:, component] = -0.1 * shares / shares.sum()
    return forces


def difference(influence: InfluenceMatrices, centre: tuple[float, float], radius: float, component: int) -> float:
    """Between displacements under a dome by compliance and by finite elements, relative, in the load's direction."""
    cells = outline_cells(Point(centre).buffer(radius, quad_segs=16), 300)
    forces = dome(cells, centre, radius, component)
    moved = np.einsum("aib,bi->a", full_compliance(surface_compliance(influence), cells)[component], forces)
    surface = influence.surface
    tractions = np.concatenate([forces / cells.areas[:, None], np.zeros((1, 3))])
    nodal = surface.traction_forces(cells.edges, tractions[cells.sides[:, 0]] - tractions[cells.sides[:, 1]])
    field = influence.surface_displacement(SurfaceLoad(nodal, surface, Polygon()))
    lines = surface.y.nodes, surface.x.nodes
    expected = RegularGridInterpolator(lines, field[..., component], method="cubic")(cells.centroids[:, ::-1])
    return float(np.linalg.norm(moved - expected) / np.linalg.norm(expected))


@pytest.mark.parametrize(
    ("centre", "radius", "bound"),
    [
        ((0.0, 0.0), 3e-3, 0.012),
        ((-2e-3, 1.5e-3), 3e-3, 0.012),
        ((3e-3, 1e-3), 2e-3, 0.02),
        # Close to the free rim the remainder is not smooth over a patch.
        ((5.5e-3, 0.0), 1.5e-3, 0.03),
        ((6.5e-3, 0.0), 1e-3, 0.1),
    ],
)
@pytest.mark.parametrize("component", [0, 2])
def test_smooth_loads_sink_as_in_the_finite_elements(default_influence, centre, radius, bound, component):
    assert difference(default_influence, centre, radius, component) <= bound


def whole_sheet(influence: InfluenceMatrices, count: int = 150) -> Cells:
    return outline_cells(influence.surface.sheet, count)


@pytest.mark.parametrize("which", ["default_influence", "layered", "thin_skin"])
def test_compliance_is_symmetric_and_positive_definite(which, request):
    influence = request.getfixturevalue(which)
    compliance = surface_compliance(influence)
    for cells in (whole_sheet(influence), outline_cells(indenter_outline("star", scale=0.5), 200)):
        normal = normal_compliance(compliance, cells)
        full = full_compliance(compliance, cells).reshape(3 * len(cells.areas), -1)
        # Under a thin skin shear is felt less well than pressing: a little of it may seem to give energy back.
        for matrix, least in ((normal, 0.0), (full, -0.02 if which == "thin_skin" else 0.0)):
            np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * np.abs(matrix).max())
            values = np.linalg.eigvalsh((matrix + matrix.T) / 2)
            assert values[0] > least * values[-1]


def test_compliance_has_the_sheets_mirrors(default_influence):
    cells = outline_cells(Point(4e-3, 2e-3).buffer(1e-3), 60)
    mirror = np.array([-1.0, 1.0])
    mirrored = cells._replace(
        centroids=cells.centroids * mirror,
        edges=cells.edges * mirror,
        sides=cells.sides[:, ::-1],
        quadrature=cells.quadrature * mirror,
    )
    here, there = (full_compliance(surface_compliance(default_influence), one) for one in (cells, mirrored))
    signs = np.array([-1, 1, 1])
    np.testing.assert_allclose(
        there, signs[:, None, None, None] * signs[:, None] * here, atol=1e-7 * np.abs(here).max()
    )


def test_half_space_is_that_of_the_top_layer(layered):
    compliance, top = surface_compliance(layered), layered.pad.layers[0]
    assert compliance.poisson == top.poisson
    assert compliance.normal_factor == pytest.approx((1 - top.poisson**2) / (np.pi * top.young), rel=1e-12)


def test_layered_pad_sinks_as_in_the_finite_elements(layered):
    assert difference(layered, (0.4e-3, -0.3e-3), 2.2e-3, 2) <= 0.1  # three elements per half width


@pytest.fixture(scope="module")
def thin_skin() -> InfluenceMatrices:
    """A stiff film of 10 um on a soft sheet."""
    layers = (Layer(thickness=10e-6, young=50e6, poisson=0.4), Layer(thickness=4.99e-3, young=1e6, poisson=0.49))
    return in_double_precision(Pad(layers=layers), COARSE)


def test_thin_skin_is_not_what_the_surface_feels_like(thin_skin):
    """From the distance of a patch the soft sheet below counts; the skin's own half space is 50 times stiffer."""
    compliance, (skin, sheet) = surface_compliance(thin_skin), thin_skin.pad.layers
    soft, stiff = ((1 - one.poisson**2) / (np.pi * one.young) for one in (sheet, skin))
    assert stiff < compliance.normal_factor <= 1.5 * soft
    assert compliance.normal_factor > 0.5 * soft
    assert difference(thin_skin, (0.0, 0.0), 5e-3, 2) <= 0.05


def test_made_once_per_influence_matrices(layered):
    assert isinstance(surface_compliance(layered), SurfaceCompliance)
    assert surface_compliance(layered) is surface_compliance(layered)
