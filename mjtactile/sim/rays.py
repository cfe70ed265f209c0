"""Lower surface of geoms with signed distance functions, by MuJoCo's ray casting.

Heights are as accurate as the ray casting, which takes 2 to 5 us per point.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.geometry.height_minimum import Rectangle, lowest_near
from mjtactile.geometry.primitives import Pose


class RaySurface:
    """A geom whose lower surface is sampled by rays, in a model that contains this geom alone.

    Args:
        model: compiled model.
        geom: id of the geom.
        vertices: points near its surface in its own frame [m], shape (n, 3). The search for its lowest point starts at
            one of them.
    """

    def __init__(self, model: mujoco.MjModel, geom: int, vertices: Array) -> None:
        self._model = copy.copy(model)
        self._data = mujoco.MjData(self._model)
        self._vertices = vertices
        self._radius = 1.01 * float(np.linalg.norm(vertices, axis=1).max())
        # Rays hit only visible geoms of the requested groups.
        self._model.geom_group[:] = 1
        self._model.geom_group[geom] = 0
        self._model.geom_matid[geom] = -1
        self._model.geom_rgba[geom] = 1.0
        self._data.geom_xpos[geom] = 0.0
        self._data.geom_xmat[geom] = np.eye(3).ravel()
        self._group = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame.

        Args:
            pose: pose of the geom in the pad frame.
            x: coordinates of the points [m], shape (n,).
            y: likewise.
            floor: the height is infinite where the first hit is below this [m].

        Returns:
            Heights [m], shape (n,); infinite also where no ray hits.
        """
        start = pose.position[2] - self._radius
        points = np.column_stack([x, y, np.full(len(x), start)]) - pose.position
        near = (points[:, :2] ** 2).sum(axis=1) <= self._radius**2
        height = np.full(len(points), np.inf)
        direction, hit = np.ascontiguousarray(pose.rotation[2]), np.zeros(1, np.int32)
        for index, point in zip(np.flatnonzero(near), points[near] @ pose.rotation, strict=True):
            distance = mujoco.mj_ray(self._model, self._data, point, direction, self._group, True, -1, hit)
            if hit[0] >= 0:
                height[index] = start + distance
        return np.where(height >= floor, height, np.inf)

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; infinite where no part of the geom is above it.

        Features much smaller than a thirtieth of the rectangle may be missed.

        Args:
            pose: pose of the geom in the pad frame.
            sheet: the rectangle.
            floor: as in `heights` [m].
        """
        points = pose.points(self._vertices)
        over = points[sheet.holds(points[:, 0], points[:, 1]) & (points[:, 2] >= floor - 0.1 * self._radius)]
        if len(over) == 0:
            return np.inf
        seed = over[[np.argmin(over[:, 2])] * 2]
        return lowest_near(lambda x, y: self.heights(pose, x, y, floor), sheet, floor, np.empty((0, 3)), seed)
