"""Rigid bodies whose parts stand out by unlike heights, pressed by the core, against the dense contact."""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass

import numpy as np
import pytest
from core_calls import pose_numbers, press_body, shape_numbers
from dense_contact import Body, dense_readings
from lower_surfaces import Box, Ellipsoid, Pose
from scipy.spatial.transform import Rotation
from shapely import Polygon

import mjtactile
from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
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

    parts: tuple[tuple[Box | Ellipsoid, tuple[float, float, float]], ...]
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


CASES = {
    # The ball lies within the frame's rectangle.
    "ball in a frame": Case(
        (
            (block(0.4214, 3.9312, 2.0), (1.7549, 0.0, 1.0)),
            (block(0.4214, 3.9312, 2.0), (-1.7549, 0.0, 1.0)),
            (block(3.5098, 0.4214, 2.0), (0.0, 1.7549, 1.0)),
            (block(3.5098, 0.4214, 2.0), (0.0, -1.7549, 1.0)),
            (ball(1.4884), (0.0, 0.0, 1.4166)),
        ),
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
}


@functools.cache
def influence_of(pad: mjtactile.Pad | None) -> mjtactile.InfluenceMatrices:
    return mjtactile.influence_matrices(pad, fidelity="fast", progress=False)


def pressed(case: Case, cells: int) -> Array:
    """Readings of the core with some number of contact cells [Pa]."""
    influence, core, strength = influence_of(case.pad), library(), influence_of(case.pad).pad.layers[0].young
    body = ctypes.c_void_p(core.mjt_body_new())
    for shape, middle in case.parts:
        kind, size = shape_numbers(shape)
        size, place = contiguous(size), pose_numbers(Pose(np.array(middle) * MM, np.eye(3)))
        core.mjt_body_add_shape(body, ctypes.c_int(kind), pointer(size), pointer(place))
    wrench = case.wrench
    forces, carried = press_body(influence, body, case.pose, wrench, cells=cells, sunk=2e-5, strength=strength)
    core.mjt_body_free(body)
    np.testing.assert_allclose(carried, wrench, rtol=0.0, atol=1e-9 * case.force)
    return influence.readings(SurfaceLoad(forces, influence.surface, Polygon()))


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
@pytest.mark.parametrize(("cells", "bound"), [(20, 0.10), (60, 0.12)])
@pytest.mark.parametrize("name", CASES)
def test_parts_of_unlike_heights_are_pressed_as_by_the_dense_contact(name, cells, bound):
    error = np.linalg.norm(pressed(CASES[name], cells) - expected(name)) / np.linalg.norm(expected(name))
    assert error <= bound, f"{100 * error:.1f} %"
