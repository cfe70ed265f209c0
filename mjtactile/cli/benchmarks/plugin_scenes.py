"""Scenes of `mjtactile bench plugin`: one punch, pressed by one force, on our pad or on MuJoCo's tactile sensor.

Both kinds of scene have the same punch, joints, forces and solver settings, so that what a sensor adds to a step is
the difference to the same scene without it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from trimesh.creation import icosphere

from mjtactile.geometry.indenter import convex_pieces, indenter_outline

#: Height of punches [m], and the force pressing on them [N].
_HEIGHT, _FORCE = 5e-3, 0.5
#: A moving punch goes to and fro at this speed [m/s], for this many steps each way.
SPEED, STEPS_EACH_WAY = 0.01, 100

_SCENE = """
<mujoco>
  {extension}
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10" jacobian="dense"/>
  <default><geom solref="0.005 1" condim="4" friction="0.5 0.005 0.0001"/></default>
  <asset>{assets}</asset>
  <worldbody>{pads}{punches}</worldbody>
  <actuator>{actuators}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>
"""
_PUNCH = """
<body name="punch{n}" pos="{x} 0 {z}" gravcomp="1">
  {slide}<joint name="press{n}" type="slide" axis="0 0 1" damping="0.05"/>
  {geoms}
</body>
"""
_SLIDE = '<joint name="slide{n}" type="slide" axis="1 0 0"/>'
_PAD = '<geom name="pad{n}" type="box" size="0.0075 0.0075 0.0025" pos="{x} 0 -0.0025" priority="1"/>'
# A plate lies in its geom's plane x = 0, so MuJoCo's pad is a thin box standing in the world's horizontal plane.
_PLATE = (
    '<geom name="pad{n}" type="box" size="0.000001 0.0075 0.0075" quat="0.70710678 0 -0.70710678 0" pos="{x} 0 0" '
    'priority="1"/>'
)
_OURS = (
    '<plugin name="touch{n}" plugin="mjtactile.pad" objtype="geom" objname="pad{n}">'
    '<config key="pad" value="{table}"/><config key="fidelity" value="{fidelity}"/></plugin>'
)
_THEIRS = '<tactile name="touch{n}" geom="pad{n}" mesh="plate"/>'
_PITCH = 0.03


def _ball_mesh() -> str:
    vertices = " ".join(f"{value:.9g}" for value in icosphere(subdivisions=2, radius=5e-3).vertices.ravel())
    return f'<mesh name="ball" vertex="{vertices}"/>'


#: Bodies that touch with a small part of themselves, by name: assets, and geoms whose lowest point is at z = 0.
BODIES = {
    "ball": ("", '<geom type="sphere" size="0.005" pos="0 0 0.005" mass="0.015"/>'),
    "ball of 320 triangles": (_ball_mesh(), '<geom type="mesh" mesh="ball" pos="0 0 0.005" mass="0.015"/>'),
    "box leaning 2 degrees": (
        "",
        '<geom type="box" size="0.004 0.004 0.0025" pos="0 0 0.00264" euler="0 2 0" mass="0.015"/>',
    ),
}


@dataclass(frozen=True, kw_only=True)
class PluginScene:
    """One scene.

    Attributes:
        shape: of the punch, "box", one of the seven, or one of `BODIES`.
        sensor: "ours", "theirs" or None.
        fidelity: of our sensor; empty for a table's own.
        table: pad or file of our sensor.
        moving: whether the punch may slide.
        pads: how many pads there are.
        touched: how many of them have a punch on them; the others' hover.
    """

    shape: str = "box"
    sensor: str | None = None
    fidelity: str = "balanced"
    table: str = "default"
    moving: bool = False
    pads: int = 1
    touched: int = 1
    ground: str = "ours"

    def xml(self) -> str:
        """The scene."""
        places = [(n, _PITCH * n) for n in range(self.pads)]
        assets, geoms = _punch(self.shape)
        theirs = self.ground == "theirs"
        plate = '<mesh name="plate" builtin="plate" params="26 26" scale="0.0075 0.0075 0.0001"/>' if theirs else ""
        ground = _PLATE if theirs else _PAD
        sensor = {"ours": _OURS, "theirs": _THEIRS, None: ""}[self.sensor]
        actuators = [f'<motor joint="press{n}"/>' for n, _ in places]
        if self.moving:
            actuators += [f'<velocity joint="slide{n}" kv="200"/>' for n, _ in places]
        return _SCENE.format(
            extension='<extension><plugin plugin="mjtactile.pad"/></extension>' if self.sensor == "ours" else "",
            assets=assets + plate,
            pads="".join(ground.format(n=n, x=x) for n, x in places),
            punches="".join(
                _PUNCH.format(
                    n=n,
                    x=x,
                    z=0.0 if n < self.touched else 0.005,
                    slide=_SLIDE.format(n=n) if self.moving else "",
                    geoms=geoms,
                )
                for n, x in places
            ),
            actuators="".join(actuators),
            sensors="".join(sensor.format(n=n, table=self.table, fidelity=self.fidelity) for n, _ in places),
        )

    def controls(self, step: int) -> np.ndarray:
        """Controls at one step: punches that touch are pressed, and pushed to and fro."""
        pressing = np.where(np.arange(self.pads) < self.touched, -_FORCE, 0.0)
        if not self.moving:
            return pressing
        speed = SPEED if (step // STEPS_EACH_WAY) % 2 == 0 else -SPEED
        return np.concatenate([pressing, np.full(self.pads, speed)])


def _punch(shape: str) -> tuple[str, str]:
    """Assets and geoms of a punch whose face is at z = 0."""
    if shape in BODIES:
        return BODIES[shape]
    if shape == "box":
        return "", f'<geom type="box" size="0.005 0.005 {_HEIGHT / 2}" pos="0 0 {_HEIGHT / 2}" mass="0.015"/>'
    pieces = convex_pieces(shape) if shape in ("star", "doughnut") else [indenter_outline(shape)]
    assets, geoms = [], []
    for number, piece in enumerate(pieces):
        rim = shapely.get_coordinates(piece)[:-1]
        vertices = np.vstack([np.column_stack([rim, np.full(len(rim), z)]) for z in (0.0, _HEIGHT)])
        text = " ".join(f"{value:.9g}" for value in vertices.ravel())
        assets.append(f'<mesh name="piece{number}" vertex="{text}"/>')
        geoms.append(f'<geom type="mesh" mesh="piece{number}" mass="{0.015 / len(pieces):.6g}"/>')
    return "".join(assets), "".join(geoms)
