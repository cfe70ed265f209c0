"""Rigid bodies whose parts stand out by unlike heights, pressed by the core, against the dense contact."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
from dataclasses import dataclass

import numpy as np
import pytest
import trimesh
from core_calls import pose_numbers, press_body, shape_numbers
from dense_contact import Body, dense_readings
from lower_surfaces import Box, Cylinder, Ellipsoid, Pose
from scipy.spatial.transform import Rotation
from shapely import Polygon

import mjtactile
from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.geometry.lower_surface import LowerSurface
from mjtactile.influence.surface_load import SurfaceLoad

MM = 1e-3
SMALL = mjtactile.Pad(
    size=(6e-3, 6e-3),
    layers=(mjtactile.Layer(thickness=2e-3, young=1e6, poisson=0.49),),
    taxels=mjtactile.TaxelGrid(rows=5, columns=5, pitch=(1e-3, 1e-3)),
    depths=(0.5e-3, 1.2e-3),
    sampling_radius=0.4e-3,
)


@dataclass(frozen=True)
class Case:
    """A body, its pose and the force on it.

    Attributes:
        parts: shapes [mm] and the places of their middles in the body's frame [mm].
        position: of the body's origin in the pad frame [mm].
        turn: rotation vector of its frame [rad].
        force: that presses it [N].
        through: point of the pad through which the force passes [mm].
        pad: that it presses; None for the default one.
    """

    parts: tuple[tuple[Box | Ellipsoid | Cylinder, tuple[float, float, float]], ...]
    position: tuple[float, float, float]
    turn: tuple[float, float, float]
    force: float
    through: tuple[float, float]
    pad: mjtactile.Pad | None = None

    @property
    def wrench(self) -> Array:
        x, y = np.array(self.through) * MM
        return np.array([0.0, 0.0, -self.force, -self.force * y, self.force * x, 0.0])

    @property
    def pose(self) -> Pose:
        return Pose(np.array(self.position) * MM, Rotation.from_rotvec(self.turn).as_matrix())

    def heights(self, x: Array, y: Array, floor: float) -> Array:
        at, rotation = self.pose
        return np.minimum.reduce(
            [
                shape.heights(Pose(at + rotation @ (np.array(middle) * MM), rotation), x, y, floor)
                for shape, middle in self.parts
            ]
        )


def ball(radius: float) -> Ellipsoid:
    return Ellipsoid((radius * MM, radius * MM, radius * MM))


def block(length: float, width: float, height: float) -> Box:
    return Box((length / 2 * MM, width / 2 * MM, height / 2 * MM))


def frame(side: float, width: float) -> tuple[tuple[Box, tuple[float, float, float]], ...]:
    """Four bars around a square, 2 mm high, with their middles. `side`: of the square of their middle lines."""
    along, across = block(width, side + width, 2.0), block(side, width, 2.0)
    half = side / 2
    return (
        (along, (half, 0.0, 1.0)),
        (along, (-half, 0.0, 1.0)),
        (across, (0.0, half, 1.0)),
        (across, (0.0, -half, 1.0)),
    )


def turned_square(x: float, y: float) -> tuple[tuple[float, float], ...]:
    """The corners of a square about the origin, from one of them."""
    return (x, y), (-y, x), (-x, -y), (y, -x)


CASES = {
    # The ball lies within the frame's rectangle.
    "ball in a frame": Case(
        (*frame(3.5098, 0.4214), (ball(1.4884), (0.0, 0.0, 1.4166))),
        (-1.17388, 1.09819, 0.05181),
        (0.000617, 0.012334, 3.041666),
        0.161,
        (-1.1739, 1.0982),
        SMALL,
    ),
    # All parts come down; most of the force is the plates'.
    "ball on a plate": Case(
        ((block(5.092, 5.092, 2.0), (0.0, 0.0, 1.0182)), (ball(1.0591), (-0.5066, -0.7475, 1.0591))),
        (0.47313, -1.38763, -0.02159),
        (-0.002018, 0.000855, -0.801606),
        0.05047,
        (0.4731, -1.3876),
    ),
    "two balls on a plate": Case(
        (
            (block(8.5624, 10.5362, 2.0), (0.0, 0.0, 1.0)),
            (ball(0.7198), (2.3854, -2.8844, 0.6949)),
            (ball(0.4308), (-1.4444, 2.1246, 0.4196)),
        ),
        (-2.40145, -3.36633, 0.00376),
        (-0.000395, 0.000169, -0.808449),
        0.07383,
        (-2.3153, -3.4921),
    ),
    # The force passes by the lower block's edge, closer than half a cell.
    "two blocks": Case(
        ((block(3.0812, 4.6684, 2.0), (-1.5406, 0.0, 1.0)), (block(1.3802, 4.6684, 2.0), (0.6901, 0.0, 1.0473))),
        (0.0, 0.0, -0.02),
        (0.0, 0.0, 1.021115),
        0.05974,
        (0.0328, -0.209),
    ),
    # One of the feet is at the disc's rim, beside cells that end there.
    "four balls under a disc": Case(
        (
            (Cylinder(3.9311 * MM, 0.5 * MM), (0.0, 0.0, 0.5598)),
            *((ball(0.4247), (x, y, 0.4247)) for x, y in turned_square(1.8992, 2.9475)),
        ),
        (0.0, 0.0, -0.02),
        (0.0, 0.0, -0.482594),
        0.23164,
        (0.0544, -0.2218),
    ),
    # A stretch of the frame is too level to be a ridge, and has no cells at first.
    "wide ball in a wide frame": Case(
        (*frame(6.1094, 0.4952), (ball(2.7033), (0.0, 0.0, 2.7348))),
        (-0.45324, -1.54838, -0.00445),
        (0.004207, 0.002631, 1.117653),
        0.3055,
        (-0.444, -1.629),
    ),
    # The contact ends at the disc's rim, within the cells that are laid under the plate.
    "disc under a plate": Case(
        ((Cylinder(1.5544 * MM, 1.0 * MM), (0.0, 0.0, 1.0)), (block(5.2628, 5.2628, 2.0), (0.0, 0.0, 1.0147))),
        (3.63989, -1.69951, 0.01129),
        (0.008026, 0.021092, 2.414277),
        0.18213,
        (3.7439, -1.6301),
    ),
    # The rods are closer to each other than the cells of a few along each.
    "ten parallel rods": Case(
        tuple((Cylinder(0.4 * MM, 4.0 * MM), (0.0, y, 0.0)) for y in np.arange(-3.6, 3.7, 0.8).tolist()),
        (0.1, -0.2, 0.38),
        (-0.94606, 1.352592, 0.950122),
        0.4,
        (0.2, -0.1),
    ),
}
#: Largest relative L2 error by number of cells, and of bodies that few cells tell less well.
BOUNDS = {20: 0.10, 60: 0.07, 300: 0.07}
HARDER = {("ball on a plate", 20): 0.12, ("four balls under a disc", 20): 0.14}


@functools.cache
def influence_of(pad: mjtactile.Pad | None) -> mjtactile.InfluenceMatrices:
    return mjtactile.influence_matrices(pad, fidelity="fast", progress=False)


def readings(case: Case, body: ctypes.c_void_p, cells: int) -> Array:
    """Readings of the core with some number of contact cells [Pa]."""
    influence = influence_of(case.pad)
    strength, wrench = influence.pad.layers[0].young, case.wrench
    forces, carried = press_body(influence, body, case.pose, wrench, cells=cells, sunk=2e-5, strength=strength)
    np.testing.assert_allclose(carried, wrench, rtol=0.0, atol=1e-9 * case.force)
    return influence.readings(SurfaceLoad(forces, influence.surface, Polygon()))


def pressed(case: Case, cells: int) -> Array:
    core = library()
    body = ctypes.c_void_p(core.mjt_body_new())
    for shape, middle in case.parts:
        kind, size = shape_numbers(shape)
        size, place = contiguous(size), pose_numbers(Pose(np.array(middle) * MM, np.eye(3)))
        core.mjt_body_add_shape(body, ctypes.c_int(kind), pointer(size), pointer(place))
    found = readings(case, body, cells)
    core.mjt_body_free(body)
    return found


def relative(one: Array, other: Array) -> float:
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


@functools.cache
def expected(name: str) -> Array:
    case = CASES[name]
    influence = influence_of(case.pad)
    floor, wrench = -influence.pad.thickness, case.wrench
    return dense_readings(
        influence,
        [Body(lambda x, y: case.heights(x.ravel(), y.ravel(), floor).reshape(x.shape), wrench[:3], wrench[3:])],
        cap=influence.pad.layers[0].young,
    ).readings


@pytest.mark.slow
@pytest.mark.parametrize("cells", BOUNDS)
@pytest.mark.parametrize("name", CASES)
def test_parts_of_unlike_heights_are_pressed_as_by_the_dense_contact(name, cells):
    error = relative(pressed(CASES[name], cells), expected(name))
    assert error <= HARDER.get((name, cells), BOUNDS[cells]), f"{100 * error:.1f} %"


def hollow_block(half: float, radius: float) -> trimesh.Trimesh:
    """A block whose lower side is hollow like a sphere, so that it stands on its four corners [mm]."""
    block = trimesh.creation.box((2 * half, 2 * half, 4.0))
    for _ in range(5):
        block = block.subdivide()
    corners = block.vertices + np.array([0.0, 0.0, 2.0])
    low = corners[:, 2] < 1e-9
    corners[low, 2] = (2 * half**2 - (corners[low, :2] ** 2).sum(axis=1)) / (2 * radius)
    return trimesh.Trimesh(corners * MM, block.faces, process=False)


#: A block that hangs over the pad's edge, so that it stands on three corners and an edge.
HOLLOW = Case((), (-1.83081, -1.81799, 0.0097), (-0.005944, -0.001339, 0.443139), 0.41916, (-2.0862, -1.7035))


@pytest.mark.slow
@pytest.mark.parametrize("cells", BOUNDS)
def test_a_block_on_its_corners_is_pressed_on_all_of_them_wherever_it_is(cells):
    body = LowerSurface.of_solid(hollow_block(4.93817, 90.4538))
    influence, slid = influence_of(None), np.array([0.000157, 0.000988, 0.0])
    at, turn, wrench = *HOLLOW.pose, HOLLOW.wrench

    def heights(x: Array, y: Array) -> Array:
        found = body.heights(at, turn, x.ravel(), y.ravel(), floor=-influence.pad.thickness)
        return found.reshape(x.shape)

    pressing = [Body(heights, wrench[:3], wrench[3:])]
    dense = dense_readings(influence, pressing, cap=influence.pad.layers[0].young).readings
    errors = []
    for steps in range(4):
        moved = dataclasses.replace(
            HOLLOW,
            position=tuple(HOLLOW.position + 2 * steps * slid),
            through=tuple(HOLLOW.through + 2 * steps * slid[:2]),
        )
        errors.append(relative(readings(moved, body.handle, cells), dense))
    assert max(errors) <= BOUNDS[cells], ", ".join(f"{100 * error:.1f} %" for error in errors)
