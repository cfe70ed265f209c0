"""mjtactile/EdgeFollow-v0: keep a pad on the edge of an unknown plate and follow it once around."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon, affinity

from mjtactile._types import Array, Mask
from mjtactile.envs.finger import HOVER, FingerTask, finger_spec, press_control, turn_and_press
from mjtactile.envs.options import TouchOptions
from mjtactile.envs.simulation import Rows
from mjtactile.envs.task import Channel, Told
from mjtactile.errors import EnvError, shortened
from mjtactile.geometry.outlines import turned

#: Speeds at full action [m/s, rad/s] and largest force [N].
SPEED, TURN_SPEED, FORCE = 0.025, 2.0, 1.0
#: Largest initial distance from the edge [m] and angle to its direction [rad].
OFFSET, HEADING = 2e-3, 0.4
#: Distance of the pad's centre from the edge at which the edge is lost [m].
LOST = 6e-3
#: Rewards: in total for the way around, per step and distance from the edge [1/m], for a complete lap, for losing the
#: edge.
LAP, DISTANCE, DONE, LOSING = 10.0, -2.0, 1.0, -1.0
_SPACING, _THICKNESS = 0.15, 6e-3
_FRICTION = 0.3


def _regular(corners: int, radius: float) -> Polygon:
    return Polygon(radius * turned(corners))


#: Outlines of the plates [m], convex, counter-clockwise.
PLATES: dict[str, Polygon] = {
    "triangle": _regular(3, 0.028),
    "rectangle": shapely.box(-0.024, -0.015, 0.024, 0.015),
    "hexagon": _regular(6, 0.022),
    "disc": _regular(48, 0.02),
    "ellipse": affinity.scale(_regular(48, 0.02), 1.3, 0.8),
}


#: Rims of the plates, and the rims' lengths [m].
_RIMS = np.array([outline.exterior for outline in PLATES.values()], dtype=object)
_LENGTHS = shapely.length(_RIMS)


class EdgeFollow(FingerTask):
    """A finger over the rim of one of five plates; plate, position on the rim and orientation are unknown.

    The rim is followed counter-clockwise, with the plate on the left. Success: one complete lap.

    Options of `reset`: `plate`, the name of the plate; by default it is drawn.
    """

    SUMMARY = "Follow the edge of an unknown plate with a pad, counter-clockwise, once around."
    EPISODE_STEPS = 300
    ACTIONS = (
        Channel("forward", "-", -1, 1, f"speed along the finger's x axis, up to {SPEED * 1e3:g} mm/s"),
        Channel("left", "-", -1, 1, f"speed along the finger's y axis, up to {SPEED * 1e3:g} mm/s"),
        *turn_and_press(TURN_SPEED, FORCE),
    )
    PROPRIOCEPTION = (
        Channel("x", "m", -0.1, 0.1, "displacement of the finger from its start, along its initial x axis"),
        Channel("y", "m", -0.1, 0.1, "displacement of the finger from its start, along its initial y axis"),
        Channel("turn", "rad", -20.0, 20.0, "rotation of the finger from its initial orientation"),
        Channel("height", "m", -2e-3, 5 * HOVER, "height of the pad over the plane of the plates' faces"),
        Channel("force", "N", 0.0, FORCE, "commanded pressing force"),
        Channel("time left", "-", 0.0, 1.0, "remaining fraction of the episode's steps"),
    )

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        count = self.simulation.count
        self._plate = np.zeros(count, dtype=int)
        # Arc length of the finger on the rim [m], its way along the rim since the start, and the largest way so far.
        self._arc, self._way, self._farthest = np.zeros(count), np.zeros(count), np.zeros(count)

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

    def _draw(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any]) -> None:
        names = list(PLATES)
        name = options.pop("plate", None)
        known = name is None or (isinstance(name, str) and name in PLATES)
        if not known or options:
            raise EnvError(f"reset options plate={shortened(name)}, {options}; expected only plate, one of {names}.")
        draws = np.array(
            [
                [one.integers(len(names)), one.random(), one.uniform(-OFFSET, OFFSET), one.uniform(-HEADING, HEADING)]
                for one in drawn
            ]
        )
        self._plate[rows] = plates = draws[:, 0].astype(int) if name is None else np.full(len(rows), names.index(name))
        begin, off, heading = draws[:, 1] * _LENGTHS[plates], draws[:, 2], draws[:, 3]
        here = rim_points(plates, begin)
        along = rim_points(plates, begin + 1e-5) - here
        across = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(along[:, 0], along[:, 1])[:, None]
        place = here + off[:, None] * across
        turn = np.arctan2(along[:, 1], along[:, 0]) + heading
        self._start[rows] = np.column_stack([place[:, 0] + plates * _SPACING, place[:, 1], turn])
        self._target[rows], self._force[rows] = self._start[rows], 0.0
        self._arc[rows], self._way[rows], self._farthest[rows] = begin, 0.0, 0.0

    def _act(self, actions: Array) -> None:
        heading = self._target[:, 2]
        forward = np.column_stack([np.cos(heading), np.sin(heading)])
        left = np.column_stack([-forward[:, 1], forward[:, 0]])
        self._target[:, :2] += self.period * SPEED * (actions[:, :1] * forward + actions[:, 1:2] * left)
        self._target[:, 2] += self.period * TURN_SPEED * actions[:, 2]
        self._force = FORCE * np.maximum(0.0, actions[:, 3])
        self.simulation.ctrl[:] = np.column_stack([self._target, press_control(self._force)])

    def _proprioception(self) -> Array:
        qpos, (x, y, turn) = self.simulation.qpos, self._start.T
        cosine, sine = np.cos(turn), np.sin(turn)
        dx, dy = qpos[:, 0] - x, qpos[:, 1] - y
        moved = [cosine * dx + sine * dy, cosine * dy - sine * dx, qpos[:, 2] - turn]
        return np.column_stack([*moved, qpos[:, 3], self._force, self._time_left()])

    def _judge(self) -> tuple[Array, Mask, Told]:
        qpos, rims, lengths = self.simulation.qpos, _RIMS[self._plate], _LENGTHS[self._plate]
        here = shapely.points(qpos[:, 0] - self._plate * _SPACING, qpos[:, 1])
        distance, arc = shapely.distance(rims, here), shapely.line_locate_point(rims, here)
        # The way since the last step is the shorter of the two ways around. Only new way is rewarded, so moving back
        # and forth does not pay.
        self._way = self._way + (arc - self._arc + lengths / 2) % lengths - lengths / 2
        self._arc = arc
        gained = np.maximum(self._way - self._farthest, 0.0)
        self._farthest = np.maximum(self._way, self._farthest)
        done, lost = self._farthest >= lengths, distance > LOST
        rewards = LAP * gained / lengths + DISTANCE * distance + DONE * done + LOSING * lost
        share = np.minimum(self._farthest / lengths, 1.0)
        return rewards, done | lost, {"success": done, "lost": lost, "share": share, "distance": distance}


def rim_points(plates: npt.NDArray[np.int_], arcs: Array) -> Array:
    """Points of plates' rims by arc length: x and y relative to the plates' centres [m], shape (k, 2).

    Args:
        plates: indices into PLATES, shape (k,).
        arcs: arc lengths from the rims' first points [m], shape (k,).
    """
    return shapely.get_coordinates(shapely.line_interpolate_point(_RIMS[plates], arcs % _LENGTHS[plates]))
