"""Pads under boxes that are pressed as hard as a test says."""

from __future__ import annotations

import mujoco

import mjtactile
from mjtactile.plugin.registration import ensure_registered

#: Weight of a box [N].
WEIGHT = 0.05 * 9.81


def boxes_on_pads(pads: int) -> mujoco.MjModel:
    """Pads `pad0`, ... on the floor, a box `box0`, ... of 8 mm by 6 mm on each."""
    ensure_registered()
    spec = mujoco.MjSpec()
    spec.option.timestep = 2e-3
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    for k in range(pads):
        x = 0.03 * (k - (pads - 1) / 2)
        spec.worldbody.add_body(name=f"tip{k}", pos=[x, 0.0, 0.0])
        mjtactile.attach_pad(spec, body=f"tip{k}", name=f"pad{k}", fidelity="fast")
        box = spec.worldbody.add_body(name=f"box{k}", pos=[x, 0.0, 0.005])
        box.add_freejoint(name=f"box{k}")
        box.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.004, 0.003, 0.005], mass=0.05)
    return spec.compile()


def pressed(model: mujoco.MjModel, box: int, force: float) -> mujoco.MjData:
    """At rest, one box pressed down by a force [N] besides its weight."""
    data = mujoco.MjData(model)
    data.xfrc_applied[model.body(f"box{box}").id, 2] = -force
    mujoco.mj_step(model, data, 300)
    return data
