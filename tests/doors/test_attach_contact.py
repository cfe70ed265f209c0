"""Contacts of attached pads in grippers that cannot align themselves: docs/hands.md, "Rigid grippers"."""

import math

import mujoco
import numpy as np
import pytest

import mjtactile

GRIPPER = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10" gravity="0 0 0">
    <flag multiccd="enable" sensor="disable"/>
  </option>
  <asset><mesh name="cube" vertex="{corners}"/></asset>
  <default>
    <position kp="1000" forcerange="-{force} {force}"/>
    <joint type="slide" damping="20" armature="0.1"/>
  </default>
  <worldbody>
    <body name="left" pos="0 -0.022 0"><joint name="left" axis="0 1 0"/></body>
    <body name="right" pos="0 0.022 0"><joint name="right" axis="0 -1 0"/></body>
    <body name="cube" euler="{roll} 0 {yaw}"><freejoint/><geom {cube} mass="{mass}"/></body>
  </worldbody>
  <equality><joint joint1="left" joint2="right" solref="0.005 1"/></equality>
  <actuator><position joint="left"/><position joint="right"/></actuator>
</mujoco>
"""
HALF = math.sqrt(0.5)
CORNERS = " ".join(f"{x} {y} {z}" for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.02, 0.02))
CUBE = 'type="box" size=".02 .02 .02"'
MESH = 'type="mesh" mesh="cube"'


def grip(contact, *, yaw=0.0, roll=0.0, force=10.0, mass=0.1, cube=CUBE, seconds=0.3):
    """A 40 mm cube between two pads, after some time under a grip."""
    text = GRIPPER.format(yaw=yaw, roll=roll, force=force, mass=mass, cube=cube, corners=CORNERS)
    spec = mujoco.MjSpec.from_string(text)
    for body, sign in (("left", -1.0), ("right", 1.0)):
        quat = (HALF, sign * HALF, 0.0, 0.0)
        mjtactile.attach_pad(spec, body=body, name=body, quat=quat, contact=contact, fidelity="fast", output="wrench")
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.05
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    return model, data


def points(model, data, pad):
    """Where contacts with a pad press, in its frame [m], their normal forces [N] and distances [m]."""
    geom = model.geom(f"{pad}_pad").id
    found, forces, distances = [], [], []
    for index in range(data.ncon):
        if geom in data.contact.geom[index]:
            force = np.empty(6)
            mujoco.mj_contactForce(model, data, index, force)
            if force[0] > 1e-4:
                found.append((data.contact.pos[index] - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3))
                forces.append(force[0])
                distances.append(data.contact.dist[index])
    return np.array(found), np.array(forces), np.array(distances)


@pytest.mark.parametrize(("yaw", "roll"), [(0, 0), (1, 0), (2, 0), (3, 0), (5, 0), (1, 2), (3, 2)])
def test_what_is_gripped_askew_presses_with_a_patch(yaw, roll):
    model, data = grip("soft", yaw=yaw, roll=roll)
    for pad in ("left", "right"):
        places, forces, distances = points(model, data, pad)
        assert np.ptp(places[:, :2], axis=0) == pytest.approx([0.015, 0.015], abs=1e-3)
        # The middle of pressure stands in the pad, where a real one of 5 mm could carry it.
        assert np.abs(forces @ places[:, :2] / forces.sum()).max() < 7.3e-3
        assert forces.sum() == pytest.approx(10.0, rel=0.05)
        # From a margin of 1 mm to the greatest depth that docs/hands.md tells.
        assert -0.7e-3 < distances.min() <= distances.max() < 1e-3


def test_a_stiff_contact_has_an_edge_or_a_corner_there():
    for roll, count in ((0, 2), (2, 1)):
        places, _, _ = points(*grip("stiff", yaw=3, roll=roll), "left")
        assert len(places) == count
        assert np.abs(places[:, 0]).min() > 7.4e-3


def test_what_is_gripped_askew_turns_towards_the_pads():
    _, data = grip("soft", yaw=5, seconds=1.0)
    quat = data.body("cube").xquat
    assert abs(math.degrees(2 * math.atan2(quat[3], quat[0]))) < 2.0


def test_a_mesh_presses_as_a_box_does():
    places, forces, _ = points(*grip("soft", cube=MESH), "left")
    assert np.ptp(places[:, :2], axis=0) == pytest.approx([0.015, 0.015], abs=1e-3)
    assert forces.sum() == pytest.approx(10.0, rel=0.05)


@pytest.mark.parametrize(("force", "mass"), [(2.0, 0.01), (2.0, 1.0), (20.0, 0.01), (20.0, 1.0)])
def test_light_and_heavy_things_sink_in_by_tenths_of_a_millimetre(force, mass):
    places, _, distances = points(*grip("soft", force=force, mass=mass, seconds=0.5), "left")
    assert len(places) == 4
    assert np.abs(distances).max() < 0.8e-3


WEIGHT = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"><flag sensor="disable"/></option>
  <worldbody>
    <body name="weight" pos="0 0 {gap}">
      <freejoint/><geom type="box" size=".004 .005 .005" pos="0 0 .005" mass="{mass}"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(("contact", "milliseconds"), [("stiff", 100), ("soft", 160)])
@pytest.mark.parametrize("mass", [0.01, 0.05, 0.2])
def test_weights_of_10_to_200_gf_settle(contact, milliseconds, mass):
    gap = 1.1e-3 if contact == "soft" else 1e-4
    spec = mujoco.MjSpec.from_string(WEIGHT.format(mass=mass, gap=gap))
    mjtactile.attach_pad(spec, body="world", name="pad", contact=contact, fidelity="fast", output="wrench")
    model = spec.compile()
    data = mujoco.MjData(model)
    carried = []
    for _ in range(500):
        mujoco.mj_step(model, data)
        carried.append(points(model, data, "pad")[1].sum())
    assert np.array(carried[milliseconds:]) == pytest.approx(mass * 9.81, rel=1e-3)
    assert abs(data.body("weight").xpos[2]) < 5e-5
