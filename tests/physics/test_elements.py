"""The stiffness matrix by itself: patch test, rigid-body modes, definiteness, energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from closed_forms import confined_modulus
from quadratic_bricks import ELEMENT, degrees_of_freedom
from skfem import Basis, BilinearForm, Functional, LinearForm, MeshHex, MeshHex2
from skfem.helpers import ddot, div, sym_grad

from mjtactile._types import Array
from mjtactile.fem.dissection import DissectedPad
from mjtactile.fem.elements import SweptElements
from mjtactile.fem.line import Line
from mjtactile.fem.mesh import SheetMesh
from mjtactile.fem.stress import stress_tensor
from mjtactile.fem.stress_rows import StressRows
from mjtactile.fem.symmetry import BOTH, free_in_plane
from mjtactile.pad import Layer
from mjtactile.pad_shape.surfaces import EllipsoidCap

POISSONS = (0.0, 0.3, 0.49, 0.4999)
#: Unequal elements in every direction.
X, Y, Z = (
    Line(np.array(v) * 1e-3) for v in ([-3.0, -1.2, 0.0, 1.2, 3.0], [-2.0, -0.7, 0.0, 0.7, 2.0], [-2.5, -1.6, -0.9, 0])
)


def uniform_mesh(poisson: float) -> SheetMesh:
    return SheetMesh(X, Y, Z, (Layer(thickness=2.5e-3, young=3e6, poisson=poisson),) * 3)


def layered_mesh() -> SheetMesh:
    materials = [(2e6, 0.3), (5e6, 0.49), (1e6, 0.1)]
    layers = zip(Z.sizes, materials, strict=True)
    return SheetMesh(X, Y, Z, tuple(Layer(thickness=t, young=e, poisson=nu) for t, (e, nu) in layers))


def positions(mesh: SheetMesh) -> Array:
    """Of all nodes, in the order (plane, y, x), shape (planes, nodes y, nodes x, 3)."""
    z, y, x = np.meshgrid(mesh.z.nodes, mesh.y.nodes, mesh.x.nodes, indexing="ij")
    return np.stack([x, y, z], axis=-1)


def stiffness(mesh: SheetMesh) -> scipy.sparse.csr_array:
    return SweptElements(mesh).matrix()


def on_the_boundary(mesh: SheetMesh) -> np.ndarray:
    inside = np.zeros((mesh.z.node_count, mesh.y.node_count, mesh.x.node_count, 3))
    inside[1:-1, 1:-1, 1:-1] = 1.0
    return inside.ravel() == 0.0


def solve_with_prescribed_boundary(mesh: SheetMesh, field: Array) -> Array:
    matrix = stiffness(mesh)
    held = on_the_boundary(mesh)
    solution = field.ravel() * held
    load = -(matrix[~held][:, held] @ solution[held])
    solution[~held] = scipy.sparse.linalg.splu(matrix[~held][:, ~held].tocsc()).solve(load)
    return solution


GRADIENT = np.array([[1.0, -0.4, 0.7], [0.3, -0.8, 0.2], [-0.5, 0.9, 0.6]]) * 1e-3


@pytest.mark.parametrize("poisson", POISSONS)
def test_patch_any_linear_field_is_reproduced(poisson):
    mesh = uniform_mesh(poisson)
    field = positions(mesh) @ GRADIENT.T
    solution = solve_with_prescribed_boundary(mesh, field)
    # Rounding grows with the ratio of bulk to shear stiffness, 1 / (1 - 2 nu), here up to 5,000.
    np.testing.assert_allclose(solution, field.ravel(), atol=1e-14 / (1 - 2 * poisson) * np.abs(field).max())


def test_patch_layers_under_one_traction_are_reproduced():
    """In-plane strain is the same in all layers, and so is the traction on their interfaces; gradients differ."""
    mesh = layered_mesh()
    in_plane, traction = GRADIENT[:, :2], np.array([200.0, -300.0, -900.0])
    field, start = np.zeros((*positions(mesh).shape,)), np.zeros(3)
    for e, layer in enumerate(mesh.materials):
        mu, lame = layer.shear_modulus, layer.lame_lambda
        slope = np.array(
            [
                traction[0] / mu - in_plane[2, 0],
                traction[1] / mu - in_plane[2, 1],
                (traction[2] - lame * (in_plane[0, 0] + in_plane[1, 1])) / (lame + 2 * mu),
            ]
        )
        planes = slice(2 * e, 2 * e + 3)
        height = mesh.z.nodes[planes] - mesh.z.vertices[e]
        field[planes] = positions(mesh)[planes][..., :2] @ in_plane.T + start + height[:, None, None, None] * slope
        start = start + mesh.z.sizes[e] * slope
    solution = solve_with_prescribed_boundary(mesh, field)
    # Rounding, at a Poisson ratio of 0.49.
    np.testing.assert_allclose(solution, field.ravel(), atol=1e-12 * np.abs(field).max())


def test_patch_stress_is_read_exactly():
    """Stress of a linear field, sampled anywhere: the recovery must not disturb what is exact."""
    mesh = uniform_mesh(0.49)
    layer = mesh.materials[0]
    strain = (GRADIENT + GRADIENT.T) / 2
    expected = 2 * layer.shear_modulus * strain + layer.lame_lambda * np.trace(strain) * np.eye(3)
    points = np.array([[0.0, 0.0, -1.0], [2.9, 0.3, -2.5], [1.2, 2.0, 0.0], [0.4, 1.1, -0.9]]) * 1e-3
    rows = StressRows(mesh, points * [1.0, 1.0, -1.0])
    found = (rows._combined @ (rows._recovered @ (positions(mesh) @ GRADIENT.T).ravel())).reshape(-1, 6)
    total = stress_tensor(found[:, :5], found[:, 5])
    wanted = expected[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    # Rounding of a dilation that the bulk modulus multiplies by 50.
    np.testing.assert_allclose(
        total, np.broadcast_to(wanted, total.shape), rtol=1e-10, atol=1e-10 * np.abs(wanted).max()
    )


@pytest.mark.parametrize(
    "mesh", [uniform_mesh(0.3), uniform_mesh(0.4999), layered_mesh()], ids=["nu3", "nu4999", "layers"]
)
def test_unclamped_sheet_has_just_the_six_rigid_modes(mesh):
    matrix = stiffness(SheetMesh(Line(mesh.x.vertices[1:4]), Line(mesh.y.vertices[1:4]), mesh.z, mesh.materials))
    np.testing.assert_array_less(abs(matrix - matrix.T).max(), 1e-12 * abs(matrix).max())
    energies = np.linalg.eigvalsh(matrix.toarray())
    # Zero to rounding of the largest eigenvalue; the softest elastic mode is far above that.
    assert np.abs(energies[:6]).max() < 1e-12 * energies[-1]
    assert energies[6] > 1e-8 * energies[-1]


def test_rigid_motions_cost_no_energy():
    mesh = layered_mesh()
    matrix, place = stiffness(mesh), positions(mesh)
    for axis in range(3):
        rotation = np.cross(np.eye(3)[axis], place)
        for motion in (np.broadcast_to(np.eye(3)[axis], place.shape), rotation):
            vector = motion.ravel()
            # Rounding of the largest products that cancel.
            assert np.abs(matrix @ vector).max() < 1e-13 * abs(matrix).max() * np.abs(vector).max()


def test_clamped_sheet_is_positive_definite():
    matrix = stiffness(layered_mesh()).toarray()
    held = 3 * X.node_count * Y.node_count
    assert np.linalg.eigvalsh(matrix[held:, held:])[0] > 0


@pytest.mark.parametrize("mesh", [uniform_mesh(0.3), layered_mesh()], ids=["one layer", "three layers"])
def test_stored_energy_of_a_linear_field_is_that_of_continuum_elasticity(mesh):
    place = positions(mesh)
    vector = (place @ GRADIENT.T).ravel()
    strain = (GRADIENT + GRADIENT.T) / 2
    area = (X.vertices[-1] - X.vertices[0]) * (Y.vertices[-1] - Y.vertices[0])
    density = [
        layer.shear_modulus * (strain**2).sum() + layer.lame_lambda / 2 * np.trace(strain) ** 2
        for layer in mesh.materials
    ]
    expected = area * (mesh.z.sizes @ np.array(density))
    assert vector @ (stiffness(mesh) @ vector) / 2 == pytest.approx(expected, rel=1e-12)  # rounding


@pytest.mark.parametrize("mesh", [uniform_mesh(0.49), layered_mesh()], ids=["one layer", "three layers"])
def test_stored_energy_of_a_quadratic_field_is_that_of_continuum_elasticity(mesh):
    """Elements hold quadratics; their divergence is linear, as the pressure is: its projection loses nothing."""
    curvature = np.random.default_rng(0).standard_normal((3, 3, 3))  # u_i = c_ijk x_j x_k
    place = positions(mesh)
    vector = np.einsum("ijk,zyxj,zyxk->zyxi", curvature, place, place).ravel()
    # Two Gauss points per element and axis integrate the squares of linear strains exactly.
    gauss, lengths = zip(*(two_points(line) for line in (mesh.z, mesh.y, mesh.x)), strict=True)
    z, y, x = np.meshgrid(*gauss, indexing="ij")
    gradient = np.einsum("ijk,zyxk->zyxij", curvature + curvature.transpose(0, 2, 1), np.stack([x, y, z], axis=-1))
    strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2
    layer = np.repeat(np.arange(len(mesh.materials)), 2)[:, None, None]
    dilation = np.trace(strain, axis1=-2, axis2=-1)
    density = mesh.shear_modulus[layer] * (strain**2).sum(axis=(-2, -1)) + mesh.lame_lambda[layer] / 2 * dilation**2
    expected = np.einsum("zyx,z,y,x->", density, *lengths)
    assert vector @ (stiffness(mesh) @ vector) / 2 == pytest.approx(expected, rel=1e-11)  # rounding


def two_points(line: Line) -> tuple[Array, Array]:
    """Gauss points and weights of all elements of a line."""
    middles = (line.vertices[1:] + line.vertices[:-1]) / 2
    offsets = line.sizes[:, None] / 2 * np.array([-1.0, 1.0]) / np.sqrt(3)
    return (middles[:, None] + offsets).ravel(), np.repeat(line.sizes / 2, 2)


@pytest.mark.parametrize(
    "mesh", [*map(uniform_mesh, POISSONS), layered_mesh()], ids=[*(f"nu {nu}" for nu in POISSONS), "layers"]
)
def test_confined_compression_is_exact(mesh):
    """Nothing moves sideways: sigma_zz = -p everywhere and each layer shortens by p h / M."""
    pressure, quarter = 1000.0, mesh.quarter()
    only_z = free_in_plane(quarter, None)
    only_z[: 2 * only_z.size // 3] = False
    equations = DissectedPad(SweptElements(quarter), only_z)
    displacements = np.zeros((equations.count, 1))
    displacements[equations.surface, 0] = -pressure * quarter.surface.nodal_integrals(quarter.surface.sheet)[0].ravel()
    equations.solve(displacements)
    points = np.array([[0.1, 0.2, -0.1], [2.9, 1.9, -0.89], [1.0, 0.6, -0.91], [2.0, 1.2, -2.4]]) * 1e-3
    combine, recover = StressRows(mesh, points * [1.0, 1.0, -1.0]).rows(BOTH.classes[0], equations.number)
    found = (combine @ (recover @ displacements)).reshape(-1, 6)
    poisson = max(material.poisson for material in mesh.materials)
    sinking = pressure * sum(t / confined_modulus(m) for t, m in zip(mesh.z.sizes, mesh.materials, strict=True))
    # Rounding, grown by the ratio of bulk to shear stiffness: 5e-12 at 0.49.
    tolerance = 1e-13 / (1 - 2 * poisson)
    np.testing.assert_allclose(displacements[equations.surface], -sinking, rtol=tolerance)
    stress = stress_tensor(found[:, :5], found[:, 5])
    np.testing.assert_allclose(stress[:, 2], -pressure, rtol=10 * tolerance)


@pytest.mark.parametrize("surface", [None, EllipsoidCap((11e-3, 8e-3, 9e-3))], ids=["flat", "dome"])
def test_elements_are_those_that_scikit_fem_assembles(surface):
    """The same energy, integrated over scikit-fem's quadratic hexahedra with the same nodes, and five Gauss points."""
    middle = SheetMesh(Line(X.vertices[1:4]), Line(Y.vertices[1:4]), Z, layered_mesh().materials)
    mesh = middle if surface is None else replace(middle, outer=surface)
    lines = (mesh.x.vertices, mesh.y.vertices, mesh.z.vertices)
    bricks = MeshHex.init_tensor(*lines)
    plain = MeshHex2.from_mesh(bricks)
    x, y, minus_depth = plain.doflocs
    curved = MeshHex2(mesh.outer.positions(x, y, -minus_depth).T, plain.t)
    number = np.arange(3 * mesh.z.node_count * mesh.y.node_count * mesh.x.node_count)
    number = number.reshape(mesh.z.node_count, mesh.y.node_count, mesh.x.node_count, 3)
    own = np.empty(number.size, dtype=int)  # our number of each of scikit-fem's degrees of freedom
    own[degrees_of_freedom(bricks, lines)] = number.transpose(2, 1, 0, 3)

    expected = np.zeros((number.size, number.size))
    middles = bricks.p[2][bricks.t].mean(axis=0)
    for cell in range(bricks.t.shape[1]):
        layer = mesh.materials[mesh.z.locate(middles[[cell]])[0][0]]
        basis = Basis(curved, ELEMENT, intorder=9, elements=np.array([cell]))
        shear = BilinearForm(lambda u, v, _: 2 * ddot(sym_grad(u), sym_grad(v))).assemble(basis)
        pressures = [np.ones(len(basis.W))[None], *(2 * basis.X - 1)[:, None]]
        moment, mass = LinearForm(lambda v, w: w["p"] * div(v)), Functional(lambda w: w["p"] * w["q"])
        moments = np.stack([moment.assemble(basis, p=p) for p in pressures])
        masses = np.array([[mass.assemble(basis, p=p, q=q) for q in pressures] for p in pressures])
        volume = moments.T @ np.linalg.solve(masses, moments)
        expected[np.ix_(own, own)] += layer.shear_modulus * shear.toarray() + layer.lame_lambda * volume
    found = stiffness(mesh).toarray()
    # Rounding where the surface is flat. Where it is not, three Gauss points are good for 1e-5 on elements so large.
    np.testing.assert_allclose(found, expected, rtol=0, atol=(1e-13 if surface is None else 3e-5) * expected.max())
