"""Scenes on which readings are measured against the dense contact.

    PYTHONPATH=tests/reference/bodies python tests/reference/measured_scenes.py fast balanced

prints a table of the plugin's errors.
"""

from __future__ import annotations

import sys
import warnings

import mujoco
import numpy as np
import trimesh

import mjtactile
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.units import GRAM_FORCE

#: Steps until a body has come to rest [ms].
_STEPS = 200
NARROW = Pad(
    size=(30e-3, 6e-3),
    layers=(Layer(thickness=3e-3, young=3e6, poisson=0.49),),
    taxels=TaxelGrid(rows=4, columns=22, pitch=(1.25e-3, 1.25e-3)),
    depths=(0.75e-3, 1.5e-3),
    sampling_radius=0.625e-3,
)

_LYING = 'quat=".70710678 0 .70710678 0"'
_TORUS = trimesh.creation.torus(major_radius=5.25e-3, minor_radius=1.75e-3, major_sections=96, minor_sections=48)


def _mesh(solid: trimesh.Trimesh) -> str:
    vertices = " ".join(f"{value:.9g}" for value in np.asarray(solid.vertices).ravel())
    return f'<mesh name="solid" vertex="{vertices}" face="{" ".join(map(str, np.asarray(solid.faces).ravel()))}"/>'


def _balls(*places: tuple[float, float]) -> str:
    return "".join(f'<geom type="sphere" size=".002" pos="{x} {y} .002"/>' for x, y in places)


def _rods(*places: float) -> str:
    return "".join(f'<geom type="capsule" size=".001 .004" pos="{x} 0 .001" euler="90 0 0"/>' for x in places)


_EDGE = '<geom type="box" size=".004 .004 .004" pos="0 0 .0056568" euler="0 45 0"/>'
#: By name: geoms of a body whose lowest point is at z = 0, its turn about z [degrees], and the force on it [gf].
BODIES: dict[str, tuple[str, float, float]] = {
    "ball": ('<geom type="sphere" size=".005" pos="0 0 .005"/>', 0.0, 50.0),
    "box flat": ('<geom type="box" size=".004 .003 .0025" pos="0 0 .0025"/>', 0.0, 50.0),
    "box leaning 2 degrees": (
        '<geom type="box" size=".004 .004 .0025" pos="0 0 .00264" euler="0 2 0"/>',
        0.0,
        50.0,
    ),
    "cylinder lying": (f'<geom type="cylinder" size=".003 .005" pos="0 0 .003" {_LYING}/>', 0.0, 50.0),
    "capsule lying": (f'<geom type="capsule" size=".003 .004" pos="0 0 .003" {_LYING}/>', 0.0, 50.0),
    "capsule lying, yaw 30": (f'<geom type="capsule" size=".003 .004" pos="0 0 .003" {_LYING}/>', 30.0, 50.0),
    "capsule lying, yaw 90": (f'<geom type="capsule" size=".003 .004" pos="0 0 .003" {_LYING}/>', 90.0, 50.0),
    "torus 7 mm, mesh": ('<geom type="mesh" mesh="solid" pos="0 0 .00175"/>', 0.0, 50.0),
    "two balls": (_balls((-0.003, 0.0), (0.003, 0.0)), 0.0, 50.0),
    "four rods": (_rods(-0.0045, -0.0015, 0.0015, 0.0045), 0.0, 50.0),
    **{f"edge at 45 degrees, {force} gf": (_EDGE, 0.0, force) for force in (1.5, 3.0, 6.0)},
}
PLANE = "30 x 6 x 3 mm pad on a plane"
NAMES = (*BODIES, PLANE)


def pressed(name: str, fidelity: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A scene at rest, with sensor "touch" of one fidelity."""
    spec = mujoco.MjSpec.from_string(_on_plane() if name == PLANE else _on_pad(*BODIES[name]))
    pad = NARROW if name == PLANE else None
    flipped = (0.0, 1.0, 0.0, 0.0) if name == PLANE else (1.0, 0.0, 0.0, 0.0)
    mjtactile.attach_pad(
        spec, body="hand" if name == PLANE else "world", name="touch", quat=flipped, pad=pad, fidelity=fidelity
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = -(50.0 if name == PLANE else BODIES[name][2]) * GRAM_FORCE
    for _ in range(_STEPS):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return model, data


def _on_pad(geoms: str, yaw: float, force: float) -> str:
    del force
    return f"""<mujoco>
      <option timestep=".001" integrator="implicitfast" cone="elliptic" gravity="0 0 0"/>
      <default><geom mass=".01"/></default>
      <asset>{_mesh(_TORUS)}</asset>
      <worldbody><body name="body" euler="0 0 {yaw}">
        <joint name="press" type="slide" axis="0 0 1" damping="1"/>{geoms}
      </body></worldbody>
      <actuator><motor joint="press"/></actuator></mujoco>"""


def _on_plane() -> str:
    return """<mujoco>
      <option timestep=".001" integrator="implicitfast" cone="elliptic" gravity="0 0 0"/>
      <worldbody><geom type="plane" size="1 1 1"/>
        <body name="hand"><joint name="press" type="slide" axis="0 0 1" damping="1"/></body></worldbody>
      <actuator><motor joint="press"/></actuator></mujoco>"""


def _main(fidelities: list[str]) -> None:
    from bodies_of_model import compare

    print(f"{'scene':32} fidelity   error % asymmetry %  dense s  area mm2  left %")
    for fidelity in fidelities:
        for name in NAMES:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = compare(*pressed(name, fidelity))
            size = max(float(np.linalg.norm(found.readings)), np.finfo(float).tiny)
            mirrored = np.linalg.norm(found.readings - found.readings[:, :, ::-1]) / size
            force = np.linalg.norm(found.dense.wrench[:3])
            left = np.linalg.norm(found.dense.left[3:]) / (force * np.sqrt(found.dense.pressed_area))
            print(
                f"{name:32} {fidelity:9} {100 * found.error:8.2f} {100 * mirrored:11.3f} {found.seconds:8.2f} "
                f"{found.dense.pressed_area * 1e6:9.4f} {100 * left:7.2f}",
                flush=True,
            )


if __name__ == "__main__":
    _main(sys.argv[1:] or ["fast", "balanced"])
