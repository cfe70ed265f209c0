"""Pads under boxes that are pressed as hard as a test says."""

from __future__ import annotations

import mujoco

import mjtactile
from mjtactile.plugin.registration import ensure_registered

#: Weight of a box [N].
WEIGHT = 0.05 * 9.81


def boxes_on_pads(pads: int, pad: mjtactile.Pad | None = None) -> mujoco.MjModel:
    """Pads `pad0`, ... on the floor, a box `box0`, ... of 8 mm by 6 mm on each."""
    return spec_of_boxes_on_pads(pads, pad).compile()


def spec_of_boxes_on_pads(pads: int, pad: mjtactile.Pad | None = None) -> mujoco.MjSpec:
    """What `boxes_on_pads` compiles."""
    ensure_registered()
    spec = mujoco.MjSpec()
    spec.option.timestep = 2e-3
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    for k in range(pads):
        x = 0.03 * (k - (pads - 1) / 2)
        spec.worldbody.add_body(name=f"tip{k}", pos=[x, 0.0, 0.0])
        mjtactile.attach_pad(spec, body=f"tip{k}", name=f"pad{k}", pad=pad, fidelity="fast")
        box = spec.worldbody.add_body(name=f"box{k}", pos=[x, 0.0, 0.005])
        box.add_freejoint(name=f"box{k}")
        box.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.004, 0.003, 0.005], mass=0.05)
    return spec


def pad_with_free_taxels() -> mjtactile.Pad:
    """The default sheet with six taxels where they please: four below the box, two far from it, at two depths."""
    points = [(x, y, -1e-3) for x in (-2e-3, 2e-3) for y in (-1e-3, 1e-3)] + [(6e-3, 6e-3, -1e-3), (-6e-3, 5e-3, -2e-3)]
    return mjtactile.Pad(taxels=mjtactile.FreeTaxels(tuple(points)))


def pressed(model: mujoco.MjModel, box: int, force: float) -> mujoco.MjData:
    """At rest, one box pressed down by a force [N] besides its weight."""
    data = mujoco.MjData(model)
    data.xfrc_applied[model.body(f"box{box}").id, 2] = -force
    mujoco.mj_step(model, data, 300)
    return data
