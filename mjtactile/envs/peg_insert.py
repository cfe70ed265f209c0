"""mjtactile/PegInsert-v0: insert a peg that is held between two pads into a hole at an uncertain position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.envs.grasp_scene import HANDLE, gripper_spec
from mjtactile.envs.options import TouchOptions
from mjtactile.envs.simulation import Rows
from mjtactile.envs.task import Channel, Task, Told, within
from mjtactile.envs.touch import sensor_slice
from mjtactile.errors import EnvError, shortened
from mjtactile.experiments.hands.gripper import CLOSED_GAP, GRIPPER_PADS
from mjtactile.units import real_numbers

#: Half the peg's width, its length below the handle's middle, and the clearance of the hole [m].
PEG, LENGTH, CLEARANCE = 4e-3, 0.03, 6e-4
#: Largest offset of the hole's centre along x and y, and initial height of the peg over it [m].
OFFSET, ABOVE = 2e-3, 2e-3
#: Speed at full action [m/s], and range of the hand sideways and down [m].
SPEED, REACH, DEEP = 0.03, 5e-3, 0.02
#: Grip at action -1 and 1 [N], its initial value [N], and the number of steps for a change over the whole range.
GRIPS, FIRST_GRIP, GRIP_STEPS = (2.0, 20.0), 6.0, 10
#: Depth of the tip for success [m]; displacement and rotation in the hand at which it is lost [m, rad].
INSERTED, LOST, TILTED = 8e-3, 4e-3, 0.35
#: Rewards: for progress downwards over the whole way, for each step, for success, for losing the peg.
WAY, STEP_COST, SUCCESS, LOSING = 1.0, 0.005, 1.0, -0.5
_FRICTION, _WALL, _TOP, _MASS = 0.8, 0.012, 0.03, 0.03
_AXES = ("wrist_x", "wrist_y", "wrist_z")


class PegInsert(Task):
    """A gripper holds a square peg over a block with a square hole, whose position varies by 2 mm along x and y.

    Success: the peg's tip is 8 mm deep in the hole.

    Options of `reset`: `hole`, the position (x, y) of the hole [m]; by default it is drawn.
    """

    SUMMARY = (
        f"Put a square peg, {2e3 * PEG:g} mm wide and held by two pads, into a hole {CLEARANCE * 1e3:g} mm wider whose "
        f"position is known to {OFFSET * 1e3:g} mm along each axis."
    )
    PADS = GRIPPER_PADS
    TIMESTEP, SUBSTEPS, EPISODE_STEPS = 2e-3, 20, 150
    ACTIONS = (
        Channel("x", "-", -1, 1, f"speed of the hand along x, up to {SPEED * 1e3:g} mm/s"),
        Channel("y", "-", -1, 1, f"speed of the hand along y, up to {SPEED * 1e3:g} mm/s"),
        Channel("z", "-", -1, 1, f"speed of the hand upwards, up to {SPEED * 1e3:g} mm/s"),
        Channel("grip", "-", -1, 1, f"change of the grip, which stays between {GRIPS[0]:g} and {GRIPS[1]:g} N"),
    )
    PROPRIOCEPTION = (
        Channel("x", "m", -2 * REACH, 2 * REACH, "displacement of the hand along x from its start"),
        Channel("y", "m", -2 * REACH, 2 * REACH, "displacement of the hand along y from its start"),
        Channel("z", "m", -2 * DEEP, DEEP, "displacement of the hand upwards from its start"),
        Channel("opening", "m", -0.001, 0.1, "distance between the pads"),
        Channel("grip", "N", 0.0, GRIPS[1], "commanded grip of each finger"),
        Channel("time left", "-", 0.0, 1.0, "remaining fraction of the episode's steps"),
    )

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        model = self.simulation.model
        self._block = model.body("block").id
        self._peg = int(model.joint("object").qposadr[0])
        self._wrist = [int(model.joint(axis).qposadr[0]) for axis in _AXES]
        self._fingers = [int(model.joint(f"{name}_finger").qposadr[0]) for name in GRIPPER_PADS]
        self._drives = [model.actuator(axis).id for axis in _AXES]
        self._grip_drive = model.actuator("grip").id
        self._grip_force = int(model.actuator("grip").actadr[0])
        self._opening = sensor_slice(model, "opening").start
        count = self.simulation.count
        # Commanded displacement of the hand [m] and grip [N]; largest depth of the peg so far [m].
        self._target, self._grip, self._deepest = np.zeros((count, 3)), np.full(count, FIRST_GRIP), np.zeros(count)

    @classmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """Gripper, peg and block; the block is moved at each reset."""
        height = _TOP + ABOVE + LENGTH
        spec = gripper_spec(options, wrist="xyz", grasp_height=height, timestep=cls.TIMESTEP, friction=_FRICTION)
        body, handle = spec.body("object"), spec.geom("object")
        box = mujoco.mjtGeom.mjGEOM_BOX
        contact = {name: getattr(handle, name) for name in ("condim", "solref", "solimp", "friction", "priority")}
        middle = (LENGTH + HANDLE[2] / 2) / 2
        body.add_geom(
            name="peg",
            type=box,
            size=[PEG, PEG, (LENGTH - HANDLE[2] / 2) / 2],
            pos=[0, 0, -middle],
            mass=_MASS,
            rgba=handle.rgba,
            **contact,
        )
        block = spec.worldbody.add_body(name="block", pos=[0, 0, _TOP / 2])
        inner = PEG + CLEARANCE / 2
        for k, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
            # Two walls are as wide as the block; the other two fit between them.
            size = [_WALL / 2, inner + _WALL, _TOP / 2] if x else [inner, _WALL / 2, _TOP / 2]
            off = inner + _WALL / 2
            block.add_geom(
                name=f"wall_{k}", type=box, size=size, pos=[off * x, off * y, 0], rgba=[0.55, 0.6, 0.65, 1], condim=4
            )
        return spec.compile()

    def _draw(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any]) -> None:
        holes = np.array([one.uniform(-OFFSET, OFFSET, 2) for one in drawn])
        asked = options.pop("hole", None)
        hole = holes if asked is None else real_numbers(asked)
        right = hole is not None and (asked is None or (hole.shape == (2,) and (np.abs(hole) <= REACH).all()))
        if not right or options:
            raise EnvError(
                f"reset options hole={shortened(asked)}, {options}; expected only hole, (x, y) within {REACH} m."
            )
        self.simulation.field("body_pos")[rows, self._block, :2] = hole
        self._target[rows], self._grip[rows], self._deepest[rows] = 0.0, FIRST_GRIP, 0.0

    def _place(self, rows: Rows) -> None:
        simulation = self.simulation
        simulation.qpos[rows[:, None], self._fingers] = (HANDLE[0] - CLOSED_GAP) / 2
        simulation.act[rows, self._grip_force] = FIRST_GRIP
        simulation.ctrl[rows, self._grip_drive] = FIRST_GRIP

    def _act(self, actions: Array) -> None:
        low, high = np.array([-REACH, -REACH, -DEEP]), np.array([REACH, REACH, DEEP / 2])
        target = within(self._target + self.period * SPEED * actions[:, :3], low, high)
        step = (GRIPS[1] - GRIPS[0]) / GRIP_STEPS
        self._grip = within(self._grip + step * actions[:, 3], *GRIPS)
        self.simulation.ctrl[:, self._drives] = (target - self._target) / self.period
        self.simulation.ctrl[:, self._grip_drive] = self._grip
        self._target = target

    def _proprioception(self) -> Array:
        opening = self.simulation.sensordata[:, self._opening]
        return np.column_stack([self.simulation.qpos[:, self._wrist], opening, self._grip, self._time_left()])

    def _judge(self) -> tuple[Array, Mask, Told]:
        qpos = self.simulation.qpos
        place, turn = qpos[:, self._peg : self._peg + 3], qpos[:, self._peg + 3 : self._peg + 7]
        start = np.array([0.0, 0.0, _TOP + ABOVE + LENGTH])
        slip = np.linalg.norm(place - start - qpos[:, self._wrist], axis=1)
        # The angle between the peg's axis and the vertical.
        tilt = 2.0 * np.arcsin(np.minimum(1.0, np.hypot(turn[:, 1], turn[:, 2])))
        depth = _TOP + LENGTH - place[:, 2]
        lost = (slip > LOST) | (tilt > TILTED)
        deeper = within(depth, self._deepest, INSERTED)
        inserted = (depth >= INSERTED) & ~lost
        rewards = WAY * (deeper - self._deepest) / INSERTED - STEP_COST + SUCCESS * inserted + LOSING * lost
        self._deepest = deeper
        told = {"success": inserted, "lost": lost, "depth": depth, "slip": slip, "tilt": tilt}
        return rewards, inserted | lost, told
