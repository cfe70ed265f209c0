"""Contact wrenches against balances of momentum that MuJoCo keeps by itself."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pad_contacts import wrenches_by_body, wrenches_by_geom

from mjtactile.errors import SceneError
from mjtactile.sim.wrench import PadFrame, centre_of_pressure, contact_wrench, geom_frame, site_frame

PAD_GEOM = 'name="pad" type="box" size="0.0075 0.0075 0.0025" pos="0 0 -0.0025"'
SPHERE = '<geom type="sphere" size="0.004" mass="0.01"/>'
BOX = '<geom type="box" size="0.004 0.003 0.004" mass="0.01"/>'


def option(cone: str = "elliptic", gravity: str = "0 0 -9.81") -> str:
    return f"""<option timestep="0.001" integrator="implicitfast" cone="{cone}" jacobian="dense" tolerance="1e-14"
        gravity="{gravity}"/>"""


def frame_of_pad(model: mujoco.MjModel, data: mujoco.MjData) -> PadFrame:
    return site_frame(data, model.site("pad_surface").id)


def free_pad(punch: str, *, condim: int, cone: str, punch_first: bool) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A pad that flies freely, its body's frame the pad frame, and a spinning punch that runs into it."""
    pad = f"""<body name="pad" pos="0.3 -0.2 0.5" euler="40 -70 25"><freejoint/>
        <geom {PAD_GEOM} mass="0.02" priority="1" condim="{condim}" friction="0.8 0.003 0.001"/>
        <site name="pad_surface"/></body>"""
    above = f"""<frame pos="0.3 -0.2 0.5" euler="40 -70 25">
        <body name="punch" pos="0.002 0.001 0.0041"><freejoint/>{punch}</body></frame>"""
    bodies = above + pad if punch_first else pad + above
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{option(cone, '0 0 0')}<worldbody>{bodies}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inward = -data.xmat[model.body("pad").id].reshape(3, 3)[:, 2]
    start = model.body("punch").dofadr[0]
    data.qvel[start : start + 3] = 0.3 * inward + (0.05, -0.02, 0.04)
    data.qvel[start + 3 : start + 6] = 3.0, -2.0, 8.0
    return model, data


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
@pytest.mark.parametrize("condim", [1, 3, 4, 6])
@pytest.mark.parametrize(
    ("punch", "punch_first", "pad_comes_second"), [(SPHERE, False, True), (BOX, False, False), (BOX, True, True)]
)
def test_wrench_is_what_changes_the_pads_momentum(punch, punch_first, pad_comes_second, condim, cone):
    model, data = free_pad(punch, condim=condim, cone=cone, punch_first=punch_first)
    pad, start = model.geom("pad").id, model.body("pad").dofadr[0]
    seen = 0
    for _ in range(12):
        mujoco.mj_step(model, data)
        wrench = contact_wrench(model, data, pad, frame_of_pad(model, data))
        # A free joint's generalised force: force in world axes, torque about the body's origin in its own axes.
        generalised = data.qfrc_constraint[start : start + 6]
        rotation = data.xmat[model.body("pad").id].reshape(3, 3)
        expected = np.concatenate([rotation.T @ generalised[:3], generalised[3:]])
        np.testing.assert_allclose(wrench, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
        if data.ncon:
            seen += 1
            assert (data.contact.geom[0, 1] == pad) == pad_comes_second
            assert wrench[2] < 0.0
    assert seen >= 3


def resting(
    gravity=(0.0, 0.0, -9.81), position=(0.0, 0.0, 0.0), quaternion=(1.0, 0.0, 0.0, 0.0), sunk=0.0
) -> mujoco.MjModel:
    """A sphere and a box on the pad, sunk in by some depth; the whole scene moved rigidly, gravity in the pad frame."""
    down = np.empty(3)
    mujoco.mju_rotVecQuat(down, np.array(gravity), np.array(quaternion))
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>{option(gravity=numbers(down))}<worldbody><frame pos="{numbers(position)}" quat="{numbers(quaternion)}">
          <geom {PAD_GEOM} priority="1" condim="4" friction="1 0.0005 0.0001"
            solref="0.003 1" solimp="0.98 0.99 0.001 0.5 2"/>
          <geom name="other_pad" type="box" size="0.0075 0.0075 0.0025" pos="0.03 0 -0.0025"/>
          <site name="pad_surface"/>
          <body name="ball" pos="0.005 0.002 {0.004 - sunk}"><freejoint/>{SPHERE}</body>
          <body name="block" pos="-0.0035 -0.001 {0.004 - sunk}"><freejoint/>{BOX}</body>
          <body name="elsewhere" pos="0.03 0 0.004"><freejoint/>{SPHERE}</body>
        </frame></worldbody></mujoco>""")


def numbers(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def settle(model: mujoco.MjModel, steps: int = 300) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, steps)
    return data


def in_pad(model: mujoco.MjModel, data: mujoco.MjData, point) -> np.ndarray:
    origin, rotation = frame_of_pad(model, data)
    return (point - origin) @ rotation


def test_at_rest_each_body_presses_with_its_weight_through_its_centre():
    gravity = (0.0, 0.0, -9.81)
    model = resting(gravity)
    data = settle(model)
    pad = model.geom("pad").id, frame_of_pad(model, data)
    bodies = wrenches_by_body(model, data, *pad)
    assert set(bodies) == {model.body("ball").id, model.body("block").id}
    for body, wrench in bodies.items():
        weight = model.body_mass[body] * np.array(gravity)
        np.testing.assert_allclose(wrench[:3], weight, rtol=1e-9, atol=1e-9 * 0.1)
        centre = in_pad(model, data, data.xipos[body])
        np.testing.assert_allclose(wrench[3:], np.cross(centre, weight), rtol=1e-9, atol=1e-9 * 4e-4)
    np.testing.assert_allclose(contact_wrench(model, data, *pad), sum(bodies.values()), rtol=1e-12)


def test_oblique_weight_shows_its_tangential_part():
    gravity = 9.81 * np.array([np.sin(0.4), 0.0, -np.cos(0.4)])
    model = resting(tuple(gravity))
    data = settle(model)
    block = wrenches_by_body(model, data, model.geom("pad").id)[model.body("block").id]
    np.testing.assert_allclose(block[:3], 0.01 * gravity, rtol=1e-6, atol=1e-8)


@given(
    st.tuples(*[st.floats(-2.0, 2.0, allow_subnormal=False)] * 3),
    st.tuples(*[st.floats(-1.0, 1.0, allow_subnormal=False)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
)
@settings(deadline=None, max_examples=15)
def test_wherever_the_scene_stands_the_wrench_is_what_moves_the_bodies(position, quaternion):
    # Not the wrench of the scene unmoved: where MuJoCo finds a contact depends by 1 % on where the scene stands.
    quaternion = np.array(quaternion) / np.linalg.norm(quaternion)
    model = resting((1.0, -2.0, -9.0), sunk=1e-4, position=position, quaternion=quaternion)
    data = settle(model, 1)
    origin, axes = frame = frame_of_pad(model, data)
    bodies = wrenches_by_body(model, data, model.geom("pad").id, frame)
    for body, wrench in bodies.items():
        start = model.body(body).dofadr[0]
        force, torque = data.qfrc_constraint[start : start + 3], data.qfrc_constraint[start + 3 : start + 6]
        moment = data.xmat[body].reshape(3, 3) @ torque + np.cross(data.xpos[body] - origin, force)
        expected = -np.concatenate([force @ axes, moment @ axes])
        np.testing.assert_allclose(wrench, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())
    total = contact_wrench(model, data, model.geom("pad").id, frame)
    np.testing.assert_allclose(total, sum(bodies.values()), rtol=1e-12, atol=1e-12 * np.abs(total).max())
    assert total[2] < 0.0


def test_forces_of_other_pads_on_the_same_body_are_not_counted():
    model = resting()
    data = settle(model)
    pad, other = (model.geom(name).id for name in ("pad", "other_pad"))
    elsewhere = model.body("elsewhere").id
    bodies = wrenches_by_body(model, data, pad)
    assert list(wrenches_by_body(model, data, other)) == [elsewhere]
    assert elsewhere not in bodies
    np.testing.assert_allclose(contact_wrench(model, data, pad), sum(bodies.values()), rtol=1e-12)


def test_wrenches_of_geoms_add_up():
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>{option()}<worldbody><geom {PAD_GEOM}/>
          <body pos="0 0 0.002"><freejoint/><geom name="left" type="sphere" size="0.002" pos="-0.004 0 0" mass="0.01"/>
          <geom name="right" type="sphere" size="0.002" pos="0.004 0 0" mass="0.01"/>
          <geom name="back" type="sphere" size="0.002" pos="0 0.004 0" mass="0.02"/></body></worldbody></mujoco>""")
    data = settle(model, 500)
    pad = model.geom("pad").id
    geoms, total = wrenches_by_geom(model, data, pad), contact_wrench(model, data, pad)
    assert list(geoms) == [model.geom(name).id for name in ("left", "right", "back")]
    assert total[2] == pytest.approx(-0.04 * 9.81, rel=1e-6)
    assert min(wrench[2] for wrench in geoms.values()) == pytest.approx(-0.02 * 9.81, rel=1e-4)  # the heavy one's half
    np.testing.assert_allclose(sum(geoms.values()), total, rtol=1e-12, atol=1e-12 * np.abs(total).max())


def test_without_contact_all_is_zero():
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><worldbody><geom {PAD_GEOM}/><body pos="0 0 1"><freejoint/>{SPHERE}</body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    for advance in (lambda: None, lambda: mujoco.mj_step(model, data)):
        advance()
        np.testing.assert_array_equal(contact_wrench(model, data, model.geom("pad").id), np.zeros(6))


def test_a_contact_that_is_only_near_carries_nothing():
    near = 0
    for margin in ("0", "0.01"):  # what margin and gap mean together differs between MuJoCo 3 and 4
        model = mujoco.MjModel.from_xml_string(f"""
            <mujoco><worldbody><geom {PAD_GEOM} margin="{margin}" gap="0.01"/>
              <body pos="0 0 0.005"><freejoint/>{SPHERE}</body></worldbody></mujoco>""")
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        if data.ncon and data.nefc == 0:
            near += 1
            np.testing.assert_array_equal(contact_wrench(model, data, model.geom("pad").id), np.zeros(6))
    assert near


def test_the_pad_frame_of_a_box_is_its_upper_face():
    model = resting(position=(0.1, 0.2, 0.3), quaternion=(0.5, 0.5, -0.5, 0.5))
    data = settle(model, 1)
    for a, b in zip(geom_frame(model, data, model.geom("pad").id), frame_of_pad(model, data), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-15)


def test_only_boxes_and_meshes_say_where_a_pad_senses():
    model = mujoco.MjModel.from_xml_string("""
        <mujoco><worldbody><geom name="dome" size="1"/>
          <body pos="0 0 1.5"><freejoint/><geom size="1" mass="1"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with pytest.raises(SceneError, match=r"'dome' is neither a box nor a mesh.*pass site_frame"):
        contact_wrench(model, data, 0)


def test_the_centre_of_a_wrench_that_is_not_known_is_not_known():
    assert np.isnan(centre_of_pressure(np.full(6, np.nan))).all()
    assert centre_of_pressure(np.zeros(6)).tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(centre_of_pressure(np.array([0.0, 0.0, -2.0, -0.002, 0.004, 0.0])), [2e-3, 1e-3, 0.0])
