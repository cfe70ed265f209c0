"""Bodies without a joint between them press as the rigid body that they are, and what is far away changes nothing."""

import mujoco
import numpy as np
import pytest
from bodies_of_model import compare

import mjtactile  # noqa: F401  (registers the plugin)

SCENE = """<mujoco><extension><plugin plugin="mjtactile.pad"/></extension>
  <option integrator="implicitfast" cone="elliptic" jacobian="dense" gravity="0 0 0"/>
  <asset><mesh name="far" vertex="-.9 -.9 -.2 .9 -.9 -.2 0 .9 -.2 0 0 -.1"/></asset>
  <worldbody>{world}
    <body name="finger"><joint type="slide" axis="0 0 1"/>
      <geom name="pad" type="box" size=".0075 .0075 .0025" priority="10" condim="4" solref=".005 1"/></body>
  </worldbody>
  <sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
    <config key="fidelity" value="fast"/><config key="output" value="von_mises carried"/></plugin></sensor></mujoco>"""
WHOLE = '<geom type="box" size=".004 .003 .005"/>'
HALVES = [f'<geom type="box" size=".002 .003 .005" pos="{x} 0 0"/>' for x in (-0.002, 0.002)]
#: Two halves of a box, in bodies that are welded to one another.
LINKS = {
    "child": "{0}<body>{1}</body>",
    "siblings": "<body>{1}</body><body>{0}</body>",
    "turned": '{0}<body pos="0 .1 0" euler="90 0 0"><body pos="0 0 .1" euler="-90 0 0">'
    '<body pos=".1 0 0" euler="0 0 90"><body pos="0 .1 0" euler="0 0 -90">{1}</body></body></body></body>',
}
MOTIONS = {"static": "", "mocap": 'mocap="true"'}


def pressed(held: str, how: str = "", beside: str = "") -> np.ndarray:
    """Readings [Pa] of a pad that is pushed with half a newton against a body of the world."""
    body = f'<body {how} pos=".001 -.002 .00749" euler="0 0 20">{held}</body>'
    model = mujoco.MjModel.from_xml_string(SCENE.format(world=body + beside))
    data = mujoco.MjData(model)
    data.xfrc_applied[model.body("finger").id, 2] = 0.5
    mujoco.mj_step(model, data, 300)
    assert data.sensordata[-4] == pytest.approx(-0.5, rel=1e-3)
    return data.sensordata[:-6].copy()


@pytest.mark.parametrize("how", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize("links", LINKS.values(), ids=LINKS)
def test_welded_links_press_as_one_body(links, how):
    """Read as two bodies, each with the force of its own contacts, they are 10 % off. What is left is the corners of
    the joined outline, which are rounded to a micrometre."""
    expected = pressed(WHOLE, how)
    np.testing.assert_allclose(pressed(links.format(*HALVES), how), expected, atol=1e-3 * expected.max())


FAR = {
    "floor": '<geom type="plane" size="1 1 .1" pos="0 0 -.1"/>',
    "floor that leans": '<geom type="plane" size="1 1 .1" pos="0 0 -.1" euler="2 3 0"/>',
    "table": '<geom type="box" size="1 1 .1" pos="0 0 -.2"/>',
    "mesh": '<geom type="mesh" mesh="far"/>',
    "wall": '<geom type="box" size=".01 1 1" pos=".03 0 0"/>',
    "post": '<geom type="cylinder" size=".003 .1" pos=".013 0 0"/>',
    "ball": '<geom type="sphere" size=".01" pos="0 -.03 0"/>',
    "bar": '<geom type="capsule" size=".005 .1" pos="0 0 -.03" euler="0 90 0"/>',
    "egg": '<geom type="ellipsoid" size=".1 .005 .02" pos="0 .02 0"/>',
}


@pytest.mark.parametrize("far", FAR.values(), ids=FAR)
def test_what_the_pad_cannot_reach_leaves_a_flat_face_flat(far):
    """Every geom of the world belongs to one body, so a floor belongs to the body that presses."""
    box = '<geom type="box" size=".004 .003 .005" pos=".001 -.002 .00749" euler="0 0 20"/>'
    np.testing.assert_array_equal(pressed("", beside=box + far), pressed("", beside=box))


NEAR = {
    "a post beside the face": '<geom type="cylinder" size=".001 .004" pos="-.006 .005 .00649"/>',
    "a ball beside the face": '<geom type="sphere" size=".002" pos="-.005 .005 .00449"/>',
}


@pytest.mark.parametrize("near", NEAR.values(), ids=NEAR)
def test_what_the_pad_reaches_presses_too(near):
    box = '<geom type="box" size=".003 .003 .005" pos=".003 -.002 .00749"/>'
    assert np.abs(pressed("", beside=box + near) - pressed("", beside=box)).max() > 100.0


@pytest.mark.parametrize("links", LINKS.values(), ids=LINKS)
def test_welded_links_are_read_as_by_the_dense_contact(links):
    """A ball and a rod, which the pad meets at two places of one rigid body."""
    parts = (
        '<geom type="sphere" size=".003" pos="-.004 0 -.002"/>',
        '<geom type="capsule" size=".003 .002" pos=".002 0 -.002" euler="90 0 0"/>',
    )
    body = f'<body pos=".001 -.001 .00748" euler="0 0 20">{links.format(*parts)}</body>'
    model = mujoco.MjModel.from_xml_string(SCENE.format(world=body))
    data = mujoco.MjData(model)
    data.xfrc_applied[model.body("finger").id, 2] = 0.5
    mujoco.mj_step(model, data, 300)
    assert data.ncon >= 2
    assert compare(model, data, cells=1000).error <= 0.15


def test_mocap_bodies_press_where_they_are_and_not_with_the_world():
    """A ball of the world and one of a mocap body: MuJoCo before version 4 counts both as welded to the world."""
    ball = '<geom type="sphere" size=".003" pos="{} 0 .00549"/>'
    readings = []
    for there, moved in ((0.004, 0.0), (0.5, -0.496)):
        world = ball.format(-0.004) + f'<body mocap="true">{ball.format(there)}</body>'
        model = mujoco.MjModel.from_xml_string(SCENE.format(world=world))
        data = mujoco.MjData(model)
        data.mocap_pos[0, 0] = moved
        data.xfrc_applied[model.body("finger").id, 2] = 0.5
        mujoco.mj_step(model, data, 300)
        assert data.ncon == 2
        readings.append(data.sensordata[:-6].copy())
    assert readings[0].max() > 1e3
    np.testing.assert_allclose(*readings, atol=1e-6 * readings[0].max())
