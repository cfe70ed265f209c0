"""Layered elastic finite elements of the pad: stiffness as a short sum of Kronecker products.

Elements are Q2/P-1 hexahedra: 27-node displacements with a discontinuous linear pressure that is condensed out
inside each element, which neither locks nor oscillates as the Poisson ratio approaches 1/2 (Bathe, Finite Element
Procedures, 2014, section 4.4.3). With strain eps, the energy is

    1/2 integral of  2 mu eps : eps  +  lambda (P div u)^2,

where P is the projection onto {1, x, y, z} on each element. The sheet is uniform in its plane and its mesh is a
tensor product, so the stiffness is  K = sum_k  Z_k (x) P_k:  small matrices Z_k across the thickness, which contain
the materials, times matrices P_k in the plane.

Planes of nodes are numbered from the clamped base (0) to the surface; within a plane, degrees of freedom are
ordered (component, y, x).
"""

from __future__ import annotations

import functools
import operator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sparse

from mjtactile._types import Array, Mask
from mjtactile.fem.line import Line
from mjtactile.fem.mesh import SheetMesh

#: Legendre orders (in-plane x, in-plane y) of the pressure terms that are constant across an element's thickness.
_IN_PLANE_PRESSURES = ((0, 0), (1, 0), (0, 1))


@dataclass(frozen=True)
class Parity:
    """Symmetry class of a deformation under the sheet's two mirrors.

    +1: the deformation is symmetric (equal to its mirror image); -1: antisymmetric; 0: the body has no such mirror. The
    mirror x -> -x changes the sign of u_x, so in the class x = +1 u_x is odd in x, while u_y and u_z are even.
    """

    x: int
    y: int

    def component_signs(self, component: int) -> tuple[int, int]:
        """Parities of displacement component 0, 1 or 2 (x, y, z) in x and in y: +1 even, -1 odd."""
        return (-self.x if component == 0 else self.x, -self.y if component == 1 else self.y)


#: The four classes into which every load and every response splits.
PARITIES = (Parity(1, 1), Parity(1, -1), Parity(-1, 1), Parity(-1, -1))


@dataclass(frozen=True, eq=False)
class Stiffness:
    """K = sum_k Z_k (x) P_k of one sheet, on one mesh, before supports and symmetry planes are applied."""

    mesh: SheetMesh
    across: tuple[Array, ...]  #: Z_k, each (planes, planes) [Pa m] or [Pa] or [Pa / m]
    in_plane: tuple[sparse.csr_array, ...]  #: P_k, each (dofs of a plane, dofs of a plane)

    @property
    def plane_count(self) -> int:
        """Number of node planes, the clamped base included."""
        return self.mesh.z.node_count

    def block(self, row: int, column: int) -> sparse.csr_array:
        """Stiffness between two node planes of one element layer [N/m], shape (dofs of a plane, dofs of a plane)."""
        factors = [float(z[row, column]) for z in self.across]
        first, *others = [f * p for f, p in zip(factors, self.in_plane, strict=True) if f != 0.0]
        return functools.reduce(operator.add, others, first)

    def restricted(self, free: Mask) -> Stiffness:
        """The same stiffness on the plane's free degrees of freedom only, mask of shape (dofs of a plane,)."""
        kept = np.flatnonzero(free)
        return Stiffness(self.mesh, self.across, tuple(p[kept][:, kept] for p in self.in_plane))

    def matrix(self) -> sparse.csr_array:
        """The whole matrix [N/m], base plane included, ordered (plane, component, y, x)."""
        products = (
            sparse.kron(sparse.csr_array(z), p, format="csr") for z, p in zip(self.across, self.in_plane, strict=True)
        )
        return sparse.csr_array(sum(products))


def assemble(mesh: SheetMesh) -> Stiffness:
    """Stiffness of the mesh of a whole sheet or of its quarter."""
    x, y = _InPlaneFactors(mesh.x), _InPlaneFactors(mesh.y)
    shear = _shear_terms(mesh, x, y)
    volume = _volume_terms(mesh, x, y)
    across, in_plane = zip(*shear, *volume, strict=True)
    return Stiffness(mesh, tuple(z.toarray() for z in across), tuple(in_plane))


class _InPlaneFactors:
    """The matrices of one in-plane line."""

    def __init__(self, line: Line) -> None:
        self.line = line
        self.mass = line.mass()
        self.stiffness = line.stiffness()
        self.gradient = line.gradient()

    @cached_property
    def moments(self) -> tuple[tuple[sparse.csr_array, sparse.csr_array], ...]:
        return self.line.legendre_moments(0), self.line.legendre_moments(1)


_Term = tuple[sparse.csr_array, sparse.csr_array]


def _kron(y: sparse.csr_array, x: sparse.csr_array) -> sparse.csr_array:
    return sparse.csr_array(sparse.kron(y, x, format="csr"))


def _components(blocks: dict[tuple[int, int], sparse.csr_array]) -> sparse.csr_array:
    """A 3 x 3 block matrix over displacement components from its nonzero blocks."""
    size = next(iter(blocks.values())).shape
    empty = sparse.csr_array(size)
    return sparse.csr_array(sparse.block_array([[blocks.get((i, j), empty) for j in range(3)] for i in range(3)]))


def _shear_terms(mesh: SheetMesh, x: _InPlaneFactors, y: _InPlaneFactors) -> list[_Term]:
    """Terms of 2 mu eps : eps = mu (grad u : grad v + grad u : grad v^T)."""
    mu = mesh.shear_modulus
    mass = _kron(y.mass, x.mass)
    along_x, along_y = _kron(y.mass, x.stiffness), _kron(y.stiffness, x.mass)
    mixed = _kron(y.gradient.T, x.gradient)  # row u_x, column u_y: d_x u_y d_y v_x
    plane_strain = _components(
        {
            (0, 0): 2 * along_x + along_y,
            (1, 1): along_x + 2 * along_y,
            (2, 2): along_x + along_y,
            (0, 1): mixed,
            (1, 0): sparse.csr_array(mixed.T),
        }
    )
    through = _components({(0, 0): mass, (1, 1): mass, (2, 2): 2 * mass})
    tilting = _components({(0, 2): _kron(y.mass, x.gradient), (1, 2): _kron(y.gradient, x.mass)})
    gradient = mesh.z.gradient(mu)
    return [
        (mesh.z.mass(mu), plane_strain),
        (mesh.z.stiffness(mu), through),
        (sparse.csr_array(gradient.T), tilting),
        (gradient, sparse.csr_array(tilting.T)),
    ]


def _volume_terms(mesh: SheetMesh, x: _InPlaneFactors, y: _InPlaneFactors) -> list[_Term]:
    """Terms of lambda (P div u)^2, one pressure polynomial at a time, each over its own mass."""
    terms: list[_Term] = []
    for order_z, pressures in ((0, _IN_PLANE_PRESSURES), (1, ((0, 0),))):
        values, slopes = mesh.z.legendre_moments(order_z)
        per_mass = sparse.diags_array(mesh.lame_lambda * (2 * order_z + 1) / mesh.z.sizes)
        spread, lift = zip(*(_pressure_rows(x, y, orders) for orders in pressures), strict=True)
        spread, lift = sparse.vstack(spread, format="csr"), sparse.vstack(lift, format="csr")
        cross = sparse.csr_array(values.T @ per_mass @ slopes)
        coupling = sparse.csr_array(spread.T @ lift)
        terms += [
            (sparse.csr_array(values.T @ per_mass @ values), sparse.csr_array(spread.T @ spread)),
            (sparse.csr_array(slopes.T @ per_mass @ slopes), sparse.csr_array(lift.T @ lift)),
            (cross, coupling),
            (sparse.csr_array(cross.T), sparse.csr_array(coupling.T)),
        ]
    return terms


def _pressure_rows(
    x: _InPlaneFactors, y: _InPlaneFactors, orders: tuple[int, int]
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """In-plane moments of (d_x u_x + d_y u_y) and of u_z against one pressure, over the root of its mass."""
    (values_x, slopes_x), (values_y, slopes_y) = x.moments[orders[0]], y.moments[orders[1]]
    mass = np.kron(y.line.sizes, x.line.sizes) / ((2 * orders[0] + 1) * (2 * orders[1] + 1))
    scale = sparse.diags_array(1 / np.sqrt(mass))
    value = _kron(values_y, values_x)
    empty = sparse.csr_array(value.shape)
    spread = sparse.hstack([_kron(values_y, slopes_x), _kron(slopes_y, values_x), empty], format="csr")
    lift = sparse.hstack([empty, empty, value], format="csr")
    return sparse.csr_array(scale @ spread), sparse.csr_array(scale @ lift)


def free_in_plane(mesh: SheetMesh, parity: Parity | None) -> Mask:
    """Mask over a plane's degrees of freedom: False where a mirror plane holds a component at zero.

    Args:
        mesh: of the sheet, or of its quarter.
        parity: the quarter model's symmetry class, or None for a mesh of the whole sheet.
    """
    free = np.ones((3, mesh.y.node_count, mesh.x.node_count), dtype=bool)
    if parity is not None:
        for component in range(3):
            sign_x, sign_y = parity.component_signs(component)
            if sign_x < 0:
                free[component, :, 0] = False
            if sign_y < 0:
                free[component, 0, :] = False
    return free.ravel()
