"""Readings under uniform tractions against CalculiX, an independent quadratic finite-element code.

Where the data come from stands in benchmarks/calculix.json, which the benchmark of fidelities reads too.

CalculiX's own meshes differ from one another by 0.2 to 0.5 % on these cases (error_bar in the data).
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from bonded_layer import ball_rule
from quarter_pad import Ball, IsotropicSolid, QuarterPad, graded
from shapely import Polygon, affinity
from small_pads import without_tables

from mjtactile.cli.benchmarks.direct import relative_difference, solve
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.fidelity import MESHES, MeshDensity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad

DATA = Path(__file__).parents[2] / "benchmarks"
CASES = json.loads((DATA / "calculix.json").read_text())["cases"]
GRAM_FORCE = 9.80665e-3  # [N]
#: Relative L2 error over the 676 readings that each mesh promises, per group of cases.
BOUNDS = {
    "draft": {"A": 0.05, "B1": 0.05, "D": 0.05},
    "default": {"A": 0.008, "B1": 0.012, "D": 0.010},
    "fine": {"A": 0.004, "B1": 0.008, "D": 0.008},
}
#: Of the default pad.
RUBBER, PITCH = IsotropicSolid(3e6, 0.49), 1.25e-3
UNIFORM_ON_THE_PAPERS_PAD = [name for name in CASES if name.startswith(("A", "B1"))]


def true_ellipse(semi_x: float, semi_y: float, corners: int = 720) -> Polygon:
    """An ellipse as a polygon of the same area."""
    step = 2 * math.pi / corners
    angles = step * np.arange(corners)
    same_area = math.sqrt(step / math.sin(step))
    return Polygon(same_area * np.column_stack([semi_x * np.cos(angles), semi_y * np.sin(angles)]))


def outline_of(case: dict, corners: int = 720) -> Polygon:
    """The loaded area in the pad frame [m]."""
    geometry = case["geometry"]
    if geometry["kind"] == "ellipse":
        millimetres = affinity.translate(true_ellipse(geometry["a"], geometry["b"], corners), *geometry["c"])
    else:
        millimetres = Polygon(geometry["v"])
    return affinity.scale(millimetres, 1e-3, 1e-3, origin=(0, 0))


def pad_of(case: dict) -> Pad:
    heights = [0.0, *(layer[0] for layer in case["layers_zbottom_young_poisson"])]
    layers = [
        Layer(thickness=(top - bottom) * 1e-3, young=young * 1e6, poisson=poisson)
        for top, (bottom, young, poisson) in zip(heights, case["layers_zbottom_young_poisson"], strict=False)
    ]
    return Pad(layers=tuple(layers))


def load_of(case: dict, influence: InfluenceMatrices) -> SurfaceLoad:
    footprint = Footprint.from_outline(outline_of(case), influence.surface)
    force = np.array(case["direction"]) * case["total_force_gf"] * GRAM_FORCE
    # The force acts at the loaded area's centroid, so the traction is uniform.
    return contact_load(influence, footprint, force)


def expected_readings(name: str) -> np.ndarray:
    with np.load(DATA / "calculix.npz") as file:
        return file[name] * 1e6


def bound(mesh: str, name: str) -> float:
    return BOUNDS[mesh][name.split("_")[0]]


def test_data_holds_every_kind_of_case():
    assert {name.split("_")[0] for name in CASES} == {"A", "B1", "B2", "B3", "C", "D"}
    assert len(UNIFORM_ON_THE_PAPERS_PAD) == 6
    assert len(CASES) == 15


@pytest.mark.parametrize("name", UNIFORM_ON_THE_PAPERS_PAD)
@pytest.mark.parametrize("mesh", ["draft", "default", pytest.param("fine", marks=pytest.mark.slow)])
def test_readings_agree_with_calculix(name, mesh, request):
    influence = request.getfixturevalue("default_influence" if mesh == "default" else mesh)
    readings = influence.readings(load_of(CASES[name], influence))
    assert relative_difference(readings, expected_readings(name)) <= bound(mesh, name)


@pytest.mark.parametrize(
    "mesh", ["draft", pytest.param("default", marks=pytest.mark.slow), pytest.param("fine", marks=pytest.mark.slow)]
)
def test_layered_stack_agrees_with_calculix(mesh):
    name = "D_stack_disc3_theta0"
    pad, density = pad_of(CASES[name]), MESHES[mesh]
    load = load_of(CASES[name], without_tables(pad, density))
    readings = solve(pad, density, [load]).readings[0]
    assert relative_difference(readings, expected_readings(name)) <= bound(mesh, name)


@pytest.mark.slow
@pytest.mark.parametrize(("along", "least", "most"), [("ball", 0.0, 0.005), ("pad", 0.015, 1.0)])
def test_calculix_presses_along_the_balls_normals(flat_quarter, along, least, most):
    """By other elements: what they read is CalculiX's only where the ball pushes along its own radii."""
    case = CASES["C_sphere_R6_50gf"]
    ball, surface = Ball(case["geometry"]["R"] * 1e-3), flat_quarter.nodes[:, :, 0]
    normals = {"ball": ball.radii(surface), "pad": np.broadcast_to([0.0, 0.0, 1.0], surface.shape)}
    flat_quarter.press(case["total_force_gf"] * GRAM_FORCE, 1.2e-3, normals[along], ball.gap)
    rule, weights = ball_rule(4)
    pad, expected = Pad(), expected_readings("C_sphere_R6_50gf")[:, 6:9, 6:9]
    readings = np.empty_like(expected)
    for layer, row, column in np.ndindex(readings.shape):
        middle = np.array([column * PITCH, row * PITCH, pad.depths[layer]])
        readings[layer, row, column] = weights @ [
            flat_quarter.mises(np.abs(foot)) for foot in middle + pad.sampling_radius * rule
        ]
    assert least < relative_difference(readings, expected) < most


@pytest.fixture(scope="module")
def flat_quarter() -> QuarterPad:
    """A quarter of the default pad, with small elements below a small contact."""
    line, depths = graded(0.3e-3, 0.9e-3, 7.5e-3), graded(0.3e-3, 1.2e-3, 5e-3)
    return QuarterPad((line, line, depths), lambda x, y, depth: np.stack([x, y, -depth], axis=-1), RUBBER)


#: Radius, and place as far as a disc of that radius goes [m], or on the way there.
CORNER_DISCS = [
    (1.25e-3, (6.25e-3, 6.25e-3)),
    (1.25e-3, (5.0e-3, 6.25e-3)),
    (1.25e-3, (-6.0e-3, 5.5e-3)),
    (1.5e-3, (6.0e-3, -6.0e-3)),
    (1.5e-3, (-5.6e-3, -5.2e-3)),
]
TILT = math.radians(25.0)
#: Crowded toward the rim, where elements are 0.6 of those of "fine", and toward the surface; more sample points.
NEAR_RIM = MeshDensity(
    in_plane_size=1.5 / 11, through_size=1 / 12, rim_grading=5.0, base_grading=0.7, points_per_axis=(4, 3)
)


def corner_loads(influence: InfluenceMatrices) -> list[SurfaceLoad]:
    force = 20 * GRAM_FORCE * np.array([math.sin(TILT), 0.0, -math.cos(TILT)])
    discs = [affinity.translate(true_ellipse(radius, radius), *place) for radius, place in CORNER_DISCS]
    return [contact_load(influence, Footprint.from_outline(disc, influence.surface), force) for disc in discs]


def worst_difference(readings: np.ndarray, reference: np.ndarray) -> float:
    return max(relative_difference(one, other) for one, other in zip(readings, reference, strict=True))


@pytest.mark.slow
def test_small_tilted_disc_in_a_corner_is_right_on_default(default_influence, fine):
    readings = default_influence.readings(corner_loads(default_influence))
    assert worst_difference(readings, fine.readings(corner_loads(fine))) <= 0.02


@pytest.mark.slow
def test_small_tilted_disc_in_a_corner_is_right_on_fine(fine):
    finer = without_tables(fine.pad, NEAR_RIM)
    reference = solve(fine.pad, NEAR_RIM, corner_loads(finer)).readings
    assert worst_difference(fine.readings(corner_loads(fine)), reference) <= 0.01
