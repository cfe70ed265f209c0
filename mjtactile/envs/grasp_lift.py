"""mjtactile/GraspLift-v0: lift an object of unknown mass and friction with little more grip than it needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.envs.grasp_scene import HANDLE, PAD_FORCES, gripper_spec
from mjtactile.envs.options import Bands, TouchOptions
from mjtactile.envs.simulation import Rows
from mjtactile.envs.task import Channel, Task, Told, within
from mjtactile.envs.touch import sensor_slice
from mjtactile.errors import EnvError, shortened
from mjtactile.experiments.hands.gripper import CLOSED_GAP, GRIPPER_PADS, STROKE
from mjtactile.units import finite_number

#: Ranges of the random mass [kg], which is uniform in its logarithm, and of the random friction [-], which is uniform.
MASSES, FRICTIONS = (0.02, 0.5), (0.2, 1.2)
#: Largest mass [kg] and friction [-] that `reset` accepts: 20 and 8 times the largest that are drawn, which no gripper
#: of 25 N lifts and no dry surface has. With absurd ones, MuJoCo diverges.
MOST_MASS, MOST_FRICTION = 10.0, 10.0
#: Least of both: a twentieth and a two-hundredth of the least that are drawn. Below 1e-4 kg the contacts no longer
#: carry the commanded grip, below 1e-7 kg the object flies off, at 1e-12 kg MuJoCo's inertia is singular. MuJoCo raises
#: frictions below 1e-5 silently.
LEAST_MASS, LEAST_FRICTION = 1e-3, 1e-3
#: Initial grip [N], range of the grip [N], and largest factor of its change in a step [-].
FIRST_GRIP, GRIPS, GRIP_FACTOR = 0.1, (0.1, 25.0), 1.35
#: Lifting speed at full action [m/s], and largest height of the hand [m].
LIFT_SPEED, REACH = 0.02, 0.02
#: Rise at which the object is lifted [m], and slip in the hand at which it is dropped [m].
LIFTED, SLIPPED = 0.01, 0.003
#: The object breaks at the first value times the least grip [-], and always at the second value [N], but never below
#: the third [N].
FRAGILITY, CRUSHING, HARMLESS = 2.5, 20.0, 0.5
#: Rewards: for progress of the grip (logarithmic) towards the least grip, for progress of the object upwards, each paid
#: once; for success.
GRIP_WAY, WAY, SUCCESS = 0.5, 1.0, 1.0
#: Resolution of the wrist's encoder [m], and of the gripper's opening [m]: eight bits of its stroke, as in real
#: grippers. With exact values an agent could weigh the object by the servo's deflection of some micrometres.
RESOLUTION, OPENING_RESOLUTION = 1e-4, STROKE / 255
#: Largest offset of the object along y and z [m].
OFFSET = 5e-4
_GRAVITY = 9.81
#: Height of the pads over the table [m], and half extents of the block below the handle [m].
_HEIGHT, _BASE = 0.055, (0.0055, 0.03, 0.0185)
_GAP = 1e-4


def least_grip(mass: Array, friction: Array) -> Array:
    """Least grip of each finger that holds objects at rest [N], by their mass [kg] and friction on two pads [-]."""
    return mass * _GRAVITY / (2.0 * friction)


def crushing_grip(mass: Array, friction: Array) -> Array:
    """Grip of each finger at which an object of a mass [kg] and friction [-] breaks [N], all (n,)."""
    return within(FRAGILITY * least_grip(mass, friction), HARMLESS, CRUSHING)


class GraspLift(Task):
    """A gripper around the handle of an object that breaks under too large a grip; no single grip suits all objects.

    Success: at the episode's end the object has risen by 10 mm, and was neither dropped nor crushed.

    The grip is the contact force on either pad at the end of each step, every 40 ms. A higher peak between two ends
    crushes nothing, and is not in the info `peak_grip`.

    Args:
        split: "all" masses and frictions, or the alternating bands of them for "train" or "test".
        options: other options, see `Task`.

    Options of `reset`: `mass` [kg] and `friction` [-], from 0.001 to 10 each; by default they are drawn.
    """

    SUMMARY = (
        "Lift an object of unknown mass (20 to 500 g) and friction (0.2 to 1.2) by 10 mm and hold it, with less than "
        f"{FRAGILITY:g} times the grip that just holds it (and less than {CRUSHING:g} N; below {HARMLESS:g} N nothing "
        "breaks)."
    )
    PADS = GRIPPER_PADS
    TIMESTEP, SUBSTEPS, EPISODE_STEPS = 2e-3, 20, 40
    ACTIONS = (
        Channel("grip", "-", -1, 1, f"change of the commanded grip: 1 multiplies it by {GRIP_FACTOR:g}, -1 divides"),
        Channel("lift", "-", -1, 1, f"speed of the hand upwards, up to {LIFT_SPEED * 1e3:g} mm/s"),
    )
    PROPRIOCEPTION = (
        Channel("opening", "m", -0.001, 0.1, f"distance between the pads, in steps of {OPENING_RESOLUTION:.3g} m"),
        Channel("closing", "m/s", -0.5, 0.5, "rate of the opening over the last step"),
        Channel("height", "m", -0.01, 2 * REACH, f"height of the hand above its start, in steps of {RESOLUTION:g} m"),
        Channel("target", "m", 0.0, REACH, "commanded height of the hand above its start"),
        Channel("grip", "-", -3.0, 4.0, "natural logarithm of each finger's commanded grip over 1 N"),
        Channel("time left", "-", 0.0, 1.0, "remaining fraction of the episode's steps"),
    )

    def __init__(self, *, split: str = "all", **options: Any) -> None:
        self._masses = Bands(*(math.log(end) for end in MASSES), split=split)
        self._frictions = Bands(*FRICTIONS, split=split)
        super().__init__(**options)
        model = self.simulation.model
        self._object = model.body("object").id
        self._geoms = [model.geom(name).id for name in ("object", "base")]
        self._forces = [sensor_slice(model, name).start for name in PAD_FORCES]
        self._places = {name: sensor_slice(model, name).start for name in ("opening", "wrist_z")}
        self._height = int(model.joint("object").qposadr[0]) + 2
        self._wrist = int(model.joint("wrist_z").qposadr[0])
        self._fingers = [int(model.joint(f"{name}_finger").qposadr[0]) for name in GRIPPER_PADS]
        self._controls = [model.actuator(name).id for name in ("grip", "wrist_z")]
        self._activation = int(model.actuator("wrist_z").actadr[0])
        self._shape = np.array(model.body_inertia[self._object]) / model.body_mass[self._object]
        count = self.simulation.count
        # Mass [kg] and friction of the objects, and their offsets along y and z [m].
        self._mass, self._friction, self._off = np.ones(count), np.ones(count), np.zeros((count, 2))
        # Logarithm of the least grip over FIRST_GRIP, and grip that crushes the object [N].
        self._needed, self._crushing = np.ones(count), np.ones(count)
        # Commanded height [m], upward speed [m/s] and grip [N]; sensed opening [m] and its rate [m/s].
        self._target, self._speed, self._grip = np.zeros(count), np.zeros(count), np.full(count, FIRST_GRIP)
        self._opening, self._closing = np.zeros(count), np.zeros(count)
        # Largest values so far: grip [N], rise [m], and progress towards the least grip [-].
        self._most, self._risen, self._firm = np.zeros(count), np.zeros(count), np.zeros(count)

    @classmethod
    def model(cls, options: TouchOptions) -> mujoco.MjModel:
        """Gripper and object; its mass and friction are written at each reset."""
        spec = gripper_spec(options, wrist="z", grasp_height=_HEIGHT, timestep=cls.TIMESTEP, friction=0.6)
        body, handle = spec.body("object"), spec.geom("object")
        box = mujoco.mjtGeom.mjGEOM_BOX
        low = _BASE[2] - _HEIGHT
        contact = {name: getattr(handle, name) for name in ("condim", "solref", "solimp", "friction", "priority")}
        body.add_geom(name="base", type=box, size=_BASE, pos=[0, 0, low], mass=0.1, rgba=[0.55, 0.4, 0.3, 1], **contact)
        # The neck joins handle and base, and collides as they do.
        neck = [0.004, 0.003, (-low - _BASE[2]) / 2]
        body.add_geom(name="neck", type=box, size=neck, pos=[0, 0, -neck[2]], mass=0.0, rgba=handle.rgba, **contact)
        return spec.compile()

    def _draw(self, rows: Rows, drawn: Sequence[np.random.Generator], options: dict[str, Any]) -> None:
        draws = np.array(
            [[self._masses.draw(one), self._frictions.draw(one), *one.uniform(-OFFSET, OFFSET, 2)] for one in drawn]
        )
        mass, friction = options.pop("mass", None), options.pop("friction", None)
        limited = ((mass, LEAST_MASS, MOST_MASS), (friction, LEAST_FRICTION, MOST_FRICTION))
        right = all(value is None or least <= finite_number(value) <= most for value, least, most in limited)
        if options or not right:
            raise EnvError(
                f"reset options mass={shortened(mass)}, friction={shortened(friction)}, {options}; expected only mass "
                f"[kg] and friction [-], numbers from {LEAST_MASS:g} to {MOST_MASS:g} and from {LEAST_FRICTION:g} to "
                f"{MOST_FRICTION:g}."
            )
        self._mass[rows] = np.exp(draws[:, 0]) if mass is None else mass
        self._friction[rows] = draws[:, 1] if friction is None else friction
        self._off[rows] = draws[:, 2:]
        self._needed[rows] = np.log(least_grip(self._mass[rows], self._friction[rows]) / FIRST_GRIP)
        self._crushing[rows] = crushing_grip(self._mass[rows], self._friction[rows])
        self._target[rows] = self._speed[rows] = self._closing[rows] = 0.0
        self._grip[rows] = FIRST_GRIP
        self._opening[rows] = _rounded(np.array(HANDLE[0] + 2 * _GAP - CLOSED_GAP), OPENING_RESOLUTION)
        self._most[rows] = self._risen[rows] = self._firm[rows] = 0.0
        simulation, object_mass, each = self.simulation, self._mass[rows], rows[:, None]
        simulation.field("body_mass")[rows, self._object] = object_mass
        simulation.field("body_inertia")[rows, self._object] = self._shape * object_mass[:, None]
        simulation.field("geom_friction")[each, self._geoms, 0] = self._friction[each]
        simulation.field("geom_friction")[each, self._geoms, 1] = 5e-4 * self._friction[each]

    def _place(self, rows: Rows) -> None:
        qpos, off = self.simulation.qpos, self._off[rows]
        # The object stands on the table, so an offset in height is one of the hand.
        qpos[rows, self._height - 1] = off[:, 0]
        qpos[rows, self._wrist] = self.simulation.act[rows, self._activation] = off[:, 1]
        qpos[rows[:, None], self._fingers] = (HANDLE[0] - CLOSED_GAP) / 2 + _GAP
        self._command()

    def _act(self, actions: Array) -> None:
        self._grip = within(self._grip * GRIP_FACTOR ** actions[:, 0], *GRIPS)
        target = within(self._target + self.period * LIFT_SPEED * actions[:, 1], 0.0, REACH)
        self._speed, self._target = (target - self._target) / self.period, target
        self._command()

    def _command(self) -> None:
        ctrl, (grip, lift) = self.simulation.ctrl, self._controls
        ctrl[:, grip], ctrl[:, lift] = self._grip, self._speed

    def _proprioception(self) -> Array:
        height = _rounded(self.simulation.sensordata[:, self._places["wrist_z"]] - self._off[:, 1], RESOLUTION)
        own = [self._opening, self._closing, height, self._target, np.log(self._grip), self._time_left()]
        return np.array(own).T

    def _judge(self) -> tuple[Array, Mask, Told]:
        qpos, sensed = self.simulation.qpos, self.simulation.sensordata
        opening = _rounded(sensed[:, self._places["opening"]], OPENING_RESOLUTION)
        self._closing, self._opening = (opening - self._opening) / self.period, opening
        for force in self._forces:
            self._most = np.maximum(self._most, np.abs(sensed[:, force]))
        risen = qpos[:, self._height] - _HEIGHT
        slipped = qpos[:, self._wrist] - self._off[:, 1] - risen
        crushed = self._most > self._crushing
        dropped = slipped > SLIPPED
        last = self.steps >= self.EPISODE_STEPS
        success = last & (risen >= LIFTED) & ~crushed & ~dropped
        higher, firmer = within(risen, self._risen, LIFTED), self._share_of_grip()
        rewards = WAY * (higher - self._risen) / LIFTED + GRIP_WAY * (firmer - self._firm) + SUCCESS * success
        self._risen, self._firm = higher, firmer
        told = {**self.told(), "success": success, "crushed": crushed, "dropped": dropped, "slip": slipped}
        return rewards, crushed | dropped | last, told

    def _share_of_grip(self) -> Array:
        """Progress of the grip's logarithm towards that of the least grip [-], from 0 to 1."""
        come = np.log(np.maximum(self._most, FIRST_GRIP) / FIRST_GRIP)
        share, needed = np.ones(len(come)), self._needed
        return np.divide(np.minimum(come, needed), needed, out=share, where=needed > 0.0)

    def told(self) -> Told:
        """Mass [kg] and friction of the objects, and the largest grip at the end of a step so far [N], (n,) each."""
        return {"mass": self._mass, "friction": self._friction, "peak_grip": self._most}


def _rounded(values: Array, step: float) -> Array:
    return step * np.rint(values / step)
