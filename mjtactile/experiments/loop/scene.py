"""The scene of the loop: a pad, a rack of seven punches, each on its own arm, and seven bins.

Lengths are metres, forces newtons, in the pad frame: z out of the pad.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import mujoco
import numpy as np
import shapely

from mjtactile._types import Array
from mjtactile.errors import SceneError
from mjtactile.experiments.loop.known import ARM_STIFFNESS, SPACING, bin_place, home
from mjtactile.geometry.indenter import indenter_outline, punch
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.pad import Pad
from mjtactile.sim.mjcf import OPTION, indenter_mjcf, pad_mjcf, text_of
from mjtactile.sim.press_scene import EDGE_MARGIN

TIMESTEP = float(OPTION["timestep"])
#: Mass of an arm without its punch [kg], and its damping [N s/m], which is critical.
ARM_MASS = 0.05
_PUNCH_MASS = 15e-3
ARM_DAMPING = 2.0 * math.sqrt(ARM_STIFFNESS * (ARM_MASS + _PUNCH_MASS))
#: Largest shift of a punch from its arm's axis [m], in any direction.
LARGEST_SHIFT = 2e-3
#: Number of random poses that are tried before a punch is refused as too large for the pad.
_MOST_DRAWS = 1000
AXES = "xyz"


@dataclass(frozen=True, eq=False)
class LoopScene:
    """A model, and the facts about it that the controller must not know."""

    model: mujoco.MjModel  #: compiled model
    truth: tuple[str, ...]  #: name of the punch that each arm holds
    shifts: Array  #: shift (x, y) of each punch from its arm's axis [m], (arms, 2)
    rotations: Array  #: counter-clockwise rotation of each punch [rad], (arms,)


def loop_scene(seed: int, *, pad: Pad | None = None) -> LoopScene:
    """Make a scene with punches in random order and poses on a pad. The same seed gives the same scene.

    Raises:
        SceneError: the pad is too small for a punch.
    """
    pad = pad or Pad()
    drawn = np.random.default_rng(seed)
    truth = tuple(INDENTER_NAMES[k] for k in drawn.permutation(len(INDENTER_NAMES)))
    poses = np.array([_pose(name, pad, drawn) for name in truth])
    shifts, turns = poses[:, :2], poses[:, 2]
    root = ET.fromstring(pad_mjcf(pad))
    root.insert(1, ET.Element("option", OPTION))
    root.insert(2, ET.Element("statistic", center="0 0 0", extent="0.08"))
    spec = mujoco.MjSpec.from_string(text_of(root))
    _add_view(spec)
    for arm, name in enumerate(truth):
        _add_arm(spec, arm, name, shifts[arm], float(turns[arm]))
        _add_bin(spec, arm)
    return LoopScene(spec.compile(), truth, shifts, turns)


def _pose(name: str, pad: Pad, drawn: np.random.Generator) -> tuple[float, float, float]:
    """Draw a punch's shift (x, y) from the arm's axis [m] and rotation [rad] such that its whole face is on the pad.

    Parts of a face beyond the pad's edge carry no load, see mjcf.py.
    """
    half_x, half_y = (size / 2 - EDGE_MARGIN for size in pad.size)
    sheet = shapely.box(-half_x, -half_y, half_x, half_y)
    for _ in range(_MOST_DRAWS):
        radius, towards, turn = LARGEST_SHIFT * math.sqrt(drawn.random()), *drawn.uniform(0.0, 2.0 * np.pi, 2)
        shift = (radius * math.cos(towards), radius * math.sin(towards))
        if sheet.contains(indenter_outline(name, shift=shift, rotate_deg=math.degrees(turn))):
            return *shift, float(turn)
    raise SceneError(
        f"no pose was found in which punch '{name}' is wholly on a pad of {pad.size[0] * 1e3:.4g} x "
        f"{pad.size[1] * 1e3:.4g} mm. The loop's punches are 10 mm wide: use a larger pad."
    )


def _add_view(spec: mujoco.MjSpec) -> None:
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.55, 0.55, 0.55]
    spec.worldbody.add_light(pos=[0.0, -0.05, 0.15], dir=[0.0, 0.3, -1.0], diffuse=[0.4, 0.4, 0.4])
    spec.worldbody.add_camera(name="loop", pos=[0.0, -0.125, 0.125], xyaxes=[1, 0, 0, 0, 0.72, 0.69], fovy=38.0)


def _add_arm(spec: mujoco.MjSpec, arm: int, name: str, shift: Array, turn: float) -> None:
    body = spec.worldbody.add_body(name=f"arm_{arm}", pos=home(arm), gravcomp=1.0)
    body.mass, body.inertia, body.explicitinertial = ARM_MASS, [1e-6] * 3, True
    for axis, direction in zip(AXES, np.eye(3), strict=True):
        joint = f"arm_{arm}_{axis}"
        body.add_joint(name=joint, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
        actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=ARM_STIFFNESS, kv=ARM_DAMPING)
    frame = body.add_frame(pos=[*shift, 0.0], quat=[math.cos(turn / 2), 0.0, 0.0, math.sin(turn / 2)])
    child = mujoco.MjSpec.from_string(indenter_mjcf(punch(name)))
    spec.attach(child, prefix=f"held_{arm}_", frame=frame)


def _add_bin(spec: mujoco.MjSpec, k: int) -> None:
    """A plate that marks a bin. It does not collide."""
    x, y, _ = bin_place(k)
    spec.worldbody.add_geom(
        name=f"bin_{INDENTER_NAMES[k]}",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[SPACING * 0.46, SPACING * 0.46, 0.5e-3],
        pos=[x, y, -1e-3],
        rgba=[0.35, 0.45, 0.6, 1.0],
        contype=0,
        conaffinity=0,
    )
