"""Our own hands: what they press with is what they were told to, and pads feel it."""

import mujoco
import numpy as np
import pytest

from mjtactile.errors import SceneError
from mjtactile.experiments.grasp.scene import GraspObject, grasp_mjcf, grasp_spec, open_gripper
from mjtactile.experiments.hands.gripper import CLOSED_GAP, GRIPPER_PADS
from mjtactile.experiments.hands.hand import HAND_JOINTS, HAND_PADS
from mjtactile.sim.wrench import contact_wrench, site_frame


def without_sensors(model):
    model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    return model


def felt(model, data, name):
    return contact_wrench(model, data, model.geom(f"{name}_pad").id)


@pytest.fixture(scope="module")
def gripped():
    """A box held by 6 N and lifted."""
    model = without_sensors(grasp_spec(GraspObject(mass=0.3, friction=0.8), pose=(0.0, 0.0, 0.02)).compile())
    data = mujoco.MjData(model)
    open_gripper(model, data, 0.05)
    for step in range(1600):
        data.ctrl[model.actuator("grip").id] = 0.6 if step < 300 else 6.0
        data.ctrl[model.actuator("wrist_z").id] = np.clip((step - 600) * 5e-5, 0.0, 0.02)
        mujoco.mj_step(model, data)
    return model, data


def test_each_finger_presses_with_the_force_commanded(gripped):
    model, data = gripped
    for name in GRIPPER_PADS:
        assert felt(model, data, name)[2] == pytest.approx(-6.0, rel=1e-3)


def test_a_held_object_hangs_on_both_pads_downwards(gripped):
    model, data = gripped
    weight = 0.3 * 9.81
    pulls = [felt(model, data, name)[1] for name in GRIPPER_PADS]
    assert sum(pulls) == pytest.approx(-weight, rel=1e-3)
    assert data.body("object").xpos[2] == pytest.approx(0.03 + 0.02, abs=1e-3)


def test_fingertips_align_with_what_they_hold(gripped):
    model, data = gripped
    box = data.body("object").xmat.reshape(3, 3)
    for name in GRIPPER_PADS:
        normal = site_frame(data, model.site(f"{name}_surface").id).rotation[:, 2]
        assert np.abs(box[:, 0] @ normal) == pytest.approx(1.0, abs=1e-5)


def test_pads_look_at_each_other_and_stand_upright():
    model = grasp_spec(GraspObject()).compile()
    data = mujoco.MjData(model)
    open_gripper(model, data, 0.05)
    frames = [site_frame(data, model.site(f"{name}_surface").id) for name in GRIPPER_PADS]
    for frame, towards in zip(frames, (1.0, -1.0), strict=True):
        np.testing.assert_allclose(frame.rotation[:, 2], (towards, 0.0, 0.0), atol=1e-12)
        np.testing.assert_allclose(frame.rotation[:, 1], (0.0, 0.0, 1.0), atol=1e-12)
    assert frames[1].position[0] - frames[0].position[0] == pytest.approx(0.05 + CLOSED_GAP)


def test_an_empty_gripper_closes_without_its_pads_touching():
    model = without_sensors(grasp_spec(GraspObject(), pose=(0.0, 0.2, 0.0)).compile())
    data = mujoco.MjData(model)
    open_gripper(model, data, 0.02)
    data.ctrl[model.actuator("grip").id] = 40.0
    mujoco.mj_step(model, data, 800)
    assert all(felt(model, data, name)[2] == 0.0 for name in GRIPPER_PADS)


def test_three_fingers_lift_a_cylinder():
    grasped = GraspObject(shape="cylinder", size=(0.04, 0.04, 0.09), mass=0.1, friction=0.8)
    model = without_sensors(mujoco.MjModel.from_xml_string(grasp_mjcf(grasped, hand="hand")))
    data = mujoco.MjData(model)
    for step in range(1500):
        for finger in HAND_PADS:
            for joint, angle in zip(HAND_JOINTS, (0.55, -0.3), strict=True):
                data.ctrl[model.actuator(f"{finger}_{joint}").id] = angle * min(step / 500, 1.0)
        data.ctrl[model.actuator("wrist_z").id] = np.clip((step - 700) * 5e-5, 0.0, 0.03)
        mujoco.mj_step(model, data)
    assert data.body("object").xpos[2] == pytest.approx(0.045 + 0.03, abs=1.5e-3)
    assert all(felt(model, data, finger)[2] < -1.0 for finger in HAND_PADS)


@pytest.mark.parametrize("fields", [{"shape": "cone"}, {"mass": 0.0}, {"friction": float("nan")}, {"size": (1, 0, 1)}])
def test_objects_that_cannot_be_are_refused(fields):
    with pytest.raises(SceneError, match="object"):
        GraspObject(**fields)


def test_unknown_axes_are_refused():
    with pytest.raises(SceneError, match="x, y and z"):
        grasp_mjcf(GraspObject(), wrist="zz")
