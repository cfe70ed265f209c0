"""mjtactile/EdgeFollow-v0: keep a pad on the edge of an unknown plate and follow it once around."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import shapely
from shapely import Polygon, affinity

from mjtactile.envs.base import TactileEnv
from mjtactile.envs.channel import Channel
from mjtactile.envs.finger import HOVER, PAD, finger_spec, press_control
from mjtactile.envs.options import EnvError, TouchOptions
from mjtactile.pad import Array

#: Speeds at full action [m/s, rad/s] and the most force [N].
SPEED, TURN_SPEED, FORCE = 0.025, 2.0, 1.0
#: Where it starts: this far off the edge [m] and turned out of its direction [rad] at most.
OFFSET, HEADING = 2e-3, 0.4
#: The edge is lost when the pad's middle is this far from it [m].
LOST = 6e-3
#: Rewards: for the whole way around, for each step by its distance from the edge [1/m], for a lap done, for losing it.
LAP, DISTANCE, DONE, LOSING = 10.0, -2.0, 1.0, -1.0
_SPACING, _THICKNESS = 0.15, 6e-3
_FRICTION = 0.3


def _regular(corners: int, radius: float) -> Polygon:
    turns = 2.0 * np.pi * np.arange(corners) / corners
    return Polygon(radius * np.column_stack([np.cos(turns), np.sin(turns)]))


#: Outlines of the plates [m], convex, counter-clockwise.
PLATES: dict[str, Polygon] = {
    "triangle": _regular(3, 0.028),
    "rectangle": shapely.box(-0.024, -0.015, 0.024, 0.015),
    "hexagon": _regular(6, 0.022),
    "disc": _regular(48, 0.02),
    "ellipse": affinity.scale(_regular(48, 0.02), 1.3, 0.8),
}


class EdgeFollow(TactileEnv):
    """A finger over the rim of one of five plates, which one, where on it and how turned unknown.

    The plate lies to the left of its way: the rim is followed counter-clockwise. Success: once around.

    Options of `reset`: `plate`, its name, in place of a drawn one.
    """

    SUMMARY = "Follow the edge of an unknown plate with a pad, counter-clockwise, once around."
    PADS = (PAD,)
    TIMESTEP, SUBSTEPS, EPISODE_STEPS = 2e-3, 20, 300
    ACTIONS = (
        Channel("forward", "-", -1, 1, f"speed along the finger's x, up to {SPEED * 1e3:g} mm/s"),
        Channel("left", "-", -1, 1, f"speed along the finger's y, up to {SPEED * 1e3:g} mm/s"),
        Channel("turn", "-", -1, 1, f"speed of its turn about the vertical, up to {TURN_SPEED:g} rad/s"),
        Channel("press", "-", -1, 1, f"pressing force: up to 0 none, the finger lifts; at 1, {FORCE:g} N"),
    )
    PROPRIOCEPTION = (
        Channel("x", "m", -0.1, 0.1, "of the finger, from where and as turned as it started"),
        Channel("y", "m", -0.1, 0.1, "of the finger, from where and as turned as it started"),
        Channel("turn", "rad", -20.0, 20.0, "of the finger, from how it started"),
        Channel("height", "m", -2e-3, 5 * HOVER, "of the pad over the plane of the plates' faces"),
        Channel("force", "N", 0.0, FORCE, "commanded"),
        Channel("time left", "-", 0.0, 1.0, "share of the episode's steps"),
    )

    @classmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """The finger, and the plates in a row."""
        spec = finger_spec(options, timestep=cls.TIMESTEP, friction=_FRICTION)
        for k, (name, outline) in enumerate(PLATES.items()):
            rim = shapely.get_coordinates(outline.exterior)[:-1]
            ends = [np.column_stack([rim, np.full(len(rim), z)]) for z in (-_THICKNESS, 0.0)]
            spec.add_mesh(name=name, uservert=np.vstack(ends).ravel())
            plate = spec.worldbody.add_body(name=name, pos=[k * _SPACING, 0.0, 0.0])
            plate.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, rgba=[0.85, 0.55, 0.3, 1.0])
        return spec.compile()

    def _draw_episode(self, options: dict[str, Any]) -> None:
        drawn, names = self.np_random, list(PLATES)
        chosen = int(drawn.integers(len(names)))
        name = options.pop("plate", names[chosen])
        if name not in PLATES or options:
            raise EnvError(f"reset options plate={name!r}, {options}; expected none but plate, one of {names}.")
        self._plate = names.index(name)
        self._rim = PLATES[name].exterior
        begin = drawn.random() * self._rim.length
        off, heading = drawn.uniform(-OFFSET, OFFSET), drawn.uniform(-HEADING, HEADING)
        here = self._at(begin)
        along = self._at(begin + 1e-5) - here
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        place = here + off * across
        self._start = np.array([place[0] + self._plate * _SPACING, place[1], math.atan2(along[1], along[0]) + heading])
        self._target, self._force = self._start.copy(), 0.0
        self._arc, self._way, self._farthest = begin, 0.0, 0.0

    def _place(self) -> None:
        self.simulation.qpos[:] = [*self._start, HOVER]
        self.simulation.ctrl[:] = [*self._start, 0.0]

    def _act(self, action: Array) -> None:
        period = self.TIMESTEP * self.SUBSTEPS
        heading = self._target[2]
        forward = np.array([math.cos(heading), math.sin(heading)])
        left = np.array([-forward[1], forward[0]])
        self._target[:2] += period * SPEED * (action[0] * forward + action[1] * left)
        self._target[2] += period * TURN_SPEED * action[2]
        self._force = FORCE * max(0.0, float(action[3]))
        self.simulation.ctrl[:] = [*self._target, press_control(self._force)]

    def _proprioception(self) -> Array:
        x, y, turn, height = self.simulation.qpos
        cosine, sine = math.cos(self._start[2]), math.sin(self._start[2])
        dx, dy = x - self._start[0], y - self._start[1]
        moved = [cosine * dx + sine * dy, cosine * dy - sine * dx]
        return np.array([*moved, turn - self._start[2], height, self._force, 1.0 - self.steps / self.EPISODE_STEPS])

    def _judge(self) -> tuple[float, bool, dict[str, Any]]:
        x, y = self.simulation.qpos[:2]
        here = shapely.Point(x - self._plate * _SPACING, y)
        distance = float(self._rim.distance(here))
        arc, length = float(self._rim.project(here)), self._rim.length
        # The way along the rim since the last step, the short way round; back and forth pays once.
        self._way += (arc - self._arc + length / 2) % length - length / 2
        self._arc = arc
        gained, self._farthest = max(self._way - self._farthest, 0.0), max(self._way, self._farthest)
        done, lost = self._farthest >= length, distance > LOST
        reward = LAP * gained / length + DISTANCE * distance + (DONE if done else 0.0) + (LOSING if lost else 0.0)
        share = min(self._farthest / length, 1.0)
        return reward, done or lost, {"success": done, "lost": lost, "share": share, "distance": distance}

    def _at(self, arc: float) -> Array:
        """The point of the rim after so much of its length [m]."""
        point = self._rim.interpolate(arc % self._rim.length)
        return np.array([point.x, point.y])
