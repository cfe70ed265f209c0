"""Hands of robosuite with their pads, in robosuite's environment; prints as JSON how they stand and what they read.

    PYTHONPATH=tests python tests/hands/grippers_of_robosuite.py

By hand: the pads' surfaces over the convex hulls that collide under them, least and most by shape [mm]; and what the
first pad carries of a ball that presses with .5 N.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import robosuite  # pyright: ignore[reportMissingImports]
import trimesh
from pads_on_bodies import add_ball, hold_all_but_the_ball, surface_in_body
from robosuite.models.grippers import gripper_factory  # pyright: ignore[reportMissingImports]

import mjtactile
import mjtactile.attach
from mjtactile.hands import HandPad, attach_hand, check_model, hand
from mjtactile.sim.pad_check import check_pad_geom

GRIPPERS = Path(str(robosuite.__file__)).parent / "models" / "assets" / "grippers"
#: By hand: the class of robosuite's, and its file.
FILES = {
    "panda": ("PandaGripper", "panda_gripper.xml"),
    "robotiq_85": ("Robotiq85Gripper", "robotiq_gripper_85.xml"),
    "inspire": ("InspireRightHand", "inspire_right_hand.xml"),
}
#: Joints of hands that are closed at zero, opened [m].
OPENED = {"panda": {"finger_joint1": 0.04, "finger_joint2": -0.04}}
#: What names begin with in robosuite's scenes.
PREFIX = "gripper0_right_"


def gripper(name: str) -> mujoco.MjSpec:
    """A gripper as robosuite names it; of meshes that its file names twice robosuite keeps the first, too."""
    root = ET.fromstring(gripper_factory(FILES[name][0], idn="0_right").get_xml())
    assets = root.find("asset")
    assert assets is not None
    seen: set[str] = set()
    for mesh in assets.findall("mesh"):
        if mesh.get("name", "") in seen:
            assets.remove(mesh)
        seen.add(mesh.get("name", ""))
    return mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))


def over_hulls(model: Any, one: HandPad) -> tuple[float, float]:
    """How far a pad stands over the hulls of the colliding geoms of its body along its normals, least and most [mm]."""
    points, normals = surface_in_body(one)
    body, found = model.body(PREFIX + one.body), np.full(len(points), np.inf)
    for geom in range(int(body.geomadr[0]), int(body.geomadr[0]) + int(body.geomnum[0])):
        if not model.geom_contype[geom] or model.geom(geom).name.endswith("_pad"):
            continue
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
        hull = geom_solid_hull(model, geom)
        planes = hull.face_normals @ axes.reshape(3, 3).T
        offsets = (planes * (hull.triangles_center @ axes.reshape(3, 3).T + model.geom_pos[geom])).sum(axis=1)
        # A ray into a convex hull enters where the last of the planes that it goes down through is crossed.
        slope = -normals @ planes.T
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = (offsets - points @ planes.T) / slope
        enters = np.where(slope < 0, crossed, -np.inf).max(axis=1)
        leaves = np.where(slope > 0, crossed, np.inf).min(axis=1)
        found = np.minimum(found, np.where(enters <= leaves, enters, np.inf))
    found = found[np.isfinite(found)]
    assert len(found) > 300, one.name
    return 1e3 * float(found.min()), 1e3 * float(found.max())


def geom_solid_hull(model: Any, geom: int) -> trimesh.Trimesh:
    """What MuJoCo collides of a geom."""
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return trimesh.creation.box(2 * size)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return trimesh.creation.cylinder(size[0], 2 * size[1])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return trimesh.creation.uv_sphere(size[0])
    assert kind == mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom(int(kind))
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_vertadr[mesh])
    return trimesh.convex.convex_hull(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(float))


def opened(name: str, model: Any) -> Any:
    """A simulation of a hand that is open, and stays so."""
    data = mujoco.MjData(model)
    for joint, position in OPENED.get(name, {}).items():
        data.joint(PREFIX + joint).qpos = position
        data.actuator(f"{PREFIX}gripper_{joint}").ctrl = position
    return data


def felt(name: str) -> float:
    """Force that the first pad of a gripper carries [N], pressed by a ball with .5 N; the gripper is held still."""
    spec = gripper(name)
    spec.option.gravity = (0, 0, 0)
    (first, *_) = attach_hand(spec, name, prefix=PREFIX, fidelity="fast", output="von_mises carried")
    data = opened(name, spec.compile())
    mujoco.mj_forward(data.model, data)
    surface = data.site(f"{first}_surface")
    add_ball(spec, surface.xpos, surface.xmat.reshape(3, 3)[:, 2], 6e-3, 1e-4)
    model = spec.compile()
    hold_all_but_the_ball(model)
    data = opened(name, model)
    data.joint("slide").qfrc_applied = 0.5
    mujoco.mj_step(model, data, 1000)
    mujoco.mj_forward(model, data)
    readings, carried = np.split(data.sensor(first).data, [-6])
    assert readings.max() > 1e3
    return -float(carried[2])


def main() -> None:
    """The command line."""
    answers: dict[str, Any] = {}
    with_sensor = mjtactile.attach.add_pad_sensor
    for name, (_, file) in FILES.items():
        check_model(name, GRIPPERS / file)
        mjtactile.attach.add_pad_sensor = lambda *_: None
        spec = gripper(name)
        attach_hand(spec, name, prefix=PREFIX)
        model, over = spec.compile(), {}
        for one in hand(name).pads:
            check_pad_geom(model, model.geom(f"{PREFIX}{one.name}_pad").id, one.pad)
            low, high = over_hulls(model, one)
            before = over.get(one.shape, (low, high))
            over[one.shape] = min(low, before[0]), max(high, before[1])
        answers[name] = {"over_mm": over}
        mjtactile.attach.add_pad_sensor = with_sensor
        answers[name]["carried"] = felt(name)
    print(json.dumps(answers))


if __name__ == "__main__":
    main()
