"""The sorting experiment: blocks are carried to the bin of their recognised shape.

Each block has a punch on both gripped sides. Blocks differ in the punch's shape, in mass, friction and place.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.control import ShapeBelief
from mjtactile.experiments.grasp.control import GripLaw, Ride, close, hold, let_go, lower, raise_object, rub
from mjtactile.experiments.grasp.judge import CRUSHING, Judge
from mjtactile.experiments.grasp.punch_touch import PunchTouch, punch_recognisers
from mjtactile.experiments.grasp.robot import STEPS_PER_TICK, Robot
from mjtactile.experiments.grasp.scene import OBJECT_PRIORITY, GraspObject, grasp_spec
from mjtactile.experiments.grasp.statistics import Bound, Report, median, share
from mjtactile.experiments.grasp.touch import TouchSense, TrueTouch
from mjtactile.experiments.grasp.trials import Experiment, Result, TrialSettings
from mjtactile.experiments.hands.fingertip import FingertipPads
from mjtactile.experiments.hands.gripper import GRIPPER_PADS
from mjtactile.geometry.indenter import indenter_outline, indenter_solid
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.geometry.planar import support_points
from mjtactile.sim.mjcf import FOOT_RADIUS, SHOWN

#: Ranges of mass [kg] and friction [-].
MASSES, FRICTIONS = (0.03, 0.15), (0.3, 1.0)
#: Largest offset of a block between the fingers and along the pads [m], and of the height at which it is gripped [m].
OFFSETS, HEIGHT_OFFSET = (3e-3, 1e-3), 1e-3
#: Size of a block between the gripped faces, along them and upwards [m], and height of the punches [m]. The first size
#: includes the punches.
SIZE, PROUD = (0.028, 0.024, 0.04), 4e-3
#: Distance of neighbouring bins along y, distance of the bins from the start along x, and largest distance of a block
#: from the middle of its bin [m].
SPACING, DISTANCE, MOST_OFF = 0.028, 0.08, 0.01
#: Height to which blocks are lifted [m], speeds of lifting, carrying and lowering [m/s].
_RISE, _SPEED, _CARRYING, _LOWERING = 0.04, 0.08, 0.15, 0.02
#: Number of new grips that centre a shape on the pads; number of looks that locate it; and ratio of the recognised
#: offset to the true one after compliant fingertips have turned until the force acts at their centre [-].
_GRIPS, _PLACE_LOOKS, _SEEMING = 2, 5, -0.55
#: Simulation steps between ticks while a block is carried. That makes 100 Hz, which is enough there.
_CARRYING_STEPS = 10


@dataclass(frozen=True, kw_only=True)
class SortTask:
    """One trial: a block and its pose."""

    shape: str  #: name of the punch
    mass: float  #: [kg]
    friction: float  #: coefficient between block and pads [-]
    pose: tuple[float, float, float]  #: (x, y) on the table [m] and the turn about the vertical [rad]
    grasp_height: float  #: height of the grip above the table [m]


def sort_task(drawn: np.random.Generator) -> SortTask:
    """A trial drawn uniformly over the ranges of this module."""
    x, y = (float(drawn.uniform(-most, most)) for most in OFFSETS)
    return SortTask(
        shape=str(drawn.choice(INDENTER_NAMES)),
        mass=float(drawn.uniform(*MASSES)),
        friction=float(drawn.uniform(*FRICTIONS)),
        pose=(x, y, 0.0),
        grasp_height=float(SIZE[2] / 2 + drawn.uniform(-HEIGHT_OFFSET, HEIGHT_OFFSET)),
    )


def sort_block(task: SortTask, touch: TouchSense, *, fidelity: str, told: str | None = None) -> dict[str, Any]:
    """Recognise a block's shape, lift the block and carry it to the bin of that shape.

    The controller recognises shapes if its sense of touch is a `PunchTouch`, and none if it is told one.

    Returns:
        The task's values; "taken_for", the recognised or told shape; "looks", the number of looks; "right", whether the
        shape is the true one; and "success", whether the block stands upright in its bin and was not crushed. If it was
        gripped, also "confidence" of the recognition [-], "peak", the largest grip [N], and "time" taken [s].
    """
    model = sort_model(task, fidelity)
    judge = Judge(model)
    robot = Robot(model, touch, opening=SIZE[0] + 2.0 * OFFSETS[0] + 4e-3, watch=judge)
    result = {**asdict(task), "taken_for": None, "looks": 0, "right": False, "success": False}
    if not close(robot):
        return result
    belief = ShapeBelief()
    if told is None and isinstance(touch, PunchTouch):
        for _ in range(_GRIPS):
            if not grip_in_the_middle(robot, touch):
                return result
        # Shapes are recognised before the lift: the weight of a lifted block pulls and turns the pads.
        while not belief.settled and robot.felt.both:
            belief.look(INDENTER_NAMES, touch.look(robot.felt)[0])
            robot.tick()
    law = GripLaw(friction=rub(robot))
    raise_object(robot, law, _RISE, speed=_SPEED)
    hold(robot, law, 0.1)
    name = told or belief.shape or INDENTER_NAMES[0]
    place = bin_place(name)
    robot.steps_per_tick = _CARRYING_STEPS
    for axis, to in zip("yx", (place[1], place[0]), strict=True):
        ride = Ride(robot, axis, to, speed=_CARRYING)
        while not ride.arrived:
            robot.grip = law.step(robot.grip, ride.tick())
    hold(robot, law, 0.15)
    robot.steps_per_tick = STEPS_PER_TICK
    lower(robot, -3e-3, speed=_LOWERING)
    let_go(robot)
    stands, upright = robot.data.body("object").xpos, robot.data.body("object").xmat[8]
    nearest = min(INDENTER_NAMES, key=lambda one: float(np.hypot(*(stands[:2] - bin_place(one)))))
    inside = float(np.hypot(*(stands[:2] - bin_place(nearest)))) < MOST_OFF and upright > 0.98
    return {
        **result,
        "taken_for": name,
        "looks": belief.looks,
        "confidence": belief.confidence,
        "right": name == task.shape,
        "peak": judge.peak,
        "success": bool(inside and nearest == task.shape and judge.peak <= CRUSHING),
        "time": robot.time,
    }


def grip_in_the_middle(robot: Robot, touch: PunchTouch) -> bool:
    """Grip again with the pads' centres closer to that of the shape. Returns whether both pads touch.

    Fingertips on compliant joints rotate until the force acts at their centre. An eccentric shape then presses harder
    on one side, which it never does in the training data. Its position is then recognised on the other side, at about
    half the distance, and its shape may be confused with another. A centred shape is recognised reliably.
    """
    places = []
    while len(places) < _PLACE_LOOKS and robot.felt.both:
        places.append(touch.look(robot.felt)[1])
        robot.tick()
    if places:
        # The x axis of the left pad points along the world's y axis, that of the right pad against it; both y axes
        # point up.
        left, right = np.mean(places, axis=0) / _SEEMING
        let_go(robot)
        for axis, offset in (("y", (left[0] - right[0]) / 2), ("z", (left[1] + right[1]) / 2)):
            Ride(robot, axis, robot.place[axis] + float(offset), speed=_SPEED).finish()
    return close(robot)


def bin_place(name: str) -> tuple[float, float]:
    """Middle of a shape's bin on the table, (x, y) [m]."""
    return DISTANCE, (INDENTER_NAMES.index(name) - (len(INDENTER_NAMES) - 1) / 2) * SPACING


def sort_model(task: SortTask, fidelity: str) -> mujoco.MjModel:
    """The model of a trial: the gripper, a block with punches on both sides, and plates that show the bins."""
    core = GraspObject(size=(SIZE[0] - 2.0 * PROUD, *SIZE[1:]), mass=task.mass, friction=task.friction)
    pads = FingertipPads(fidelity=fidelity)
    spec = grasp_spec(core, wrist="xyz", pose=task.pose, grasp_height=task.grasp_height, pads=pads)
    body, block = spec.body("object"), spec.geom("object")
    solid = indenter_solid(task.shape, height=PROUD)
    for side, pad in zip((-1.0, 1.0), GRIPPER_PADS, strict=True):
        # The boss does not collide. Because of its name, it presses in place of what does (sim/mjcf.py).
        name = f"{pad}_boss{SHOWN}"
        spec.add_mesh(name=name, uservert=_boss(solid.vertices, side).ravel(), userface=np.ravel(solid.faces))
        boss = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, mass=1e-4)
        boss.contype, boss.conaffinity, boss.group, boss.rgba = 0, 0, 2, [0.7, 0.4, 0.25, 1.0]
        # Small feet spread over the boss's face collide in its place, as for other punches (sim/mjcf.py).
        for number, (u, v) in enumerate(support_points(indenter_outline(task.shape))):
            foot = body.add_geom(name=f"{pad}_foot_{number}", type=mujoco.mjtGeom.mjGEOM_SPHERE, mass=0.0, group=3)
            foot.size, foot.pos = [FOOT_RADIUS, 0.0, 0.0], [side * (SIZE[0] / 2 - FOOT_RADIUS), -side * u, v]
            foot.priority, foot.condim, foot.friction = OBJECT_PRIORITY, block.condim, block.friction
            foot.solref, foot.solimp = block.solref, block.solimp
    for name in INDENTER_NAMES:
        plate = spec.worldbody.add_geom(
            name=f"bin_{name}", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.013, 0.013, 2e-4], contype=0, conaffinity=0
        )
        plate.pos, plate.rgba = [*bin_place(name), 0.0], [0.35, 0.45, 0.6, 1.0]
    return spec.compile()


def _boss(vertices: Array, side: float) -> Array:
    """Vertices of a punch on a block's left (side -1) or right (side 1) face, in the block's frame, (n, 3) [m].

    The given vertices (n, 3) [m] are those of the punch with its pressing face at z = 0.
    """
    u, v, above = vertices.T
    return np.column_stack([side * (SIZE[0] / 2 - above), -side * u, v])


def trial(settings: TrialSettings, condition: str, number: int) -> Result:
    """Run one trial of the experiment.

    In condition "recognised" the controller recognises force and shape from readings. In the others it holds by true
    forces, and is told the true shape ("true") or guesses one ("blind").
    """
    drawn = np.random.default_rng([settings.seed, number, 7])
    task = sort_task(drawn)
    if condition == "recognised":
        touch = PunchTouch(noise=settings.noise, seed=(settings.seed, number, 8), weights=settings.weights)
        return sort_block(task, touch, fidelity=settings.fidelity)
    told = task.shape if condition == "true" else str(drawn.choice(INDENTER_NAMES))
    return sort_block(task, TrueTouch(), fidelity=settings.fidelity, told=told)


def report(results: dict[str, list[Result]]) -> Report:
    """The table of the experiment and its bound, from trials by condition."""
    rows = []
    for condition, trials in results.items():
        rows.append(
            (
                condition,
                share([one["right"] for one in trials]).percent,
                share([one["success"] for one in trials]).percent,
                median([one["looks"] for one in trials]).text(digits=0) if condition == "recognised" else "-",
                median([one["peak"] for one in trials if "peak" in one]).text(" N", digits=2),
            )
        )
    felt = share([one["success"] for one in results["recognised"]])
    return Report(
        title=f"Sort: {len(results['true'])} blocks of {len(INDENTER_NAMES)} shapes; 95 % confidence intervals.",
        head=("touch", "shape right", "stands in its bin", "looks, median", "peak grip, median"),
        rows=rows,
        bounds=[Bound(what="in its bin, recognised", bound=">= 95 %", found=felt.percent, met=felt.value >= 0.95)],
        figures={"success": asdict(felt)},
    )


SORT = Experiment(
    name="sort", conditions=("recognised", "true", "blind"), trial=trial, report=report, recognisers=punch_recognisers
)
