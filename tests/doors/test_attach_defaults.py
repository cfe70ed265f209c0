"""Pads attached to models whose defaults would spoil them."""

import mujoco
import numpy as np
import pytest

import mjtactile

#: By name: attributes of a geom class that a pad must not have.
NASTY = {
    "groups": 'contype="2" conaffinity="0"',
    "visual": 'contype="0" conaffinity="0" group="2"',
    "margin": 'margin="0.0005" gap="0.0003"',
    "mesh": 'mesh="wedge"',
    "fit": 'mesh="wedge" fitscale="3"',
    "fromto": 'type="capsule" size="0.01" fromto="0 0 0 0 0 1"',
    "size": 'type="sphere" size="0.1" pos="1 2 3" quat="0 1 0 0"',
    "euler": 'euler="0.3 0.2 0.1"',
    "axisangle": 'axisangle="1 0 0 1"',
    "xyaxes": 'xyaxes="0 1 0 -1 0 0"',
    "zaxis": 'zaxis="1 0 0"',
    "mass": 'mass="5" shellinertia="true"',
    "density": 'density="9999"',
    "contact": 'condim="1" priority="99" solmix="7" solref="0.5 3" solimp="0.1 0.2 0.3 0.4 5" friction="9 8 7"',
    "looks": 'rgba="1 0 0 0.1" material="shiny" group="4"',
    "fluid": 'fluidshape="ellipsoid" fluidcoef="1 2 3 4 5"',
    "user": 'user="1 2 3"',
}
HOST = """
<mujoco>
  <compiler angle="radian" eulerseq="zyx"/>
  <size nuser_geom="3"/>
  <default>
    {main}
    <default class="finger">{finger}</default>
  </default>
  <asset>
    <mesh name="wedge" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .3"/>
    <material name="shiny" rgba="0 1 0 1"/>
  </asset>
  <worldbody>
    <body name="finger" childclass="finger"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
  </worldbody>
</mujoco>
"""
PLACE = {"pos": (0.01, 0.02, 0.03), "quat": (0.5, 0.5, 0.5, 0.5)}


def attached(text, **options):
    spec = mujoco.MjSpec.from_string(text)
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast", **PLACE, **options)
    return spec


def fields(model):
    """Every number that the compiled model has of the pad's geom and site."""
    geom, site = model.geom("ff_pad").id, model.site("ff_surface").id
    found = {}
    for kind, one, count in (("geom", geom, model.ngeom), ("site", site, model.nsite)):
        for name in (name for name in dir(model) if name.startswith(f"{kind}_")):
            values = np.asarray(getattr(model, name))
            if values.ndim and len(values) == count and name != f"{kind}_bodyid":
                found[name] = values[one].copy()
    return found


@pytest.fixture(scope="module")
def expected():
    return fields(attached(HOST.format(main="", finger="")).compile())


@pytest.mark.parametrize("where", ["main", "finger"])
@pytest.mark.parametrize("name", NASTY)
def test_no_default_of_the_model_reaches_a_pad(expected, name, where):
    site = '<site type="box" size="1 1 1" rgba="1 0 0 1" group="1" material="shiny" euler="1 1 1"/>'
    found = fields(
        attached(HOST.format(**{"main": "", "finger": ""} | {where: f"<geom {NASTY[name]}/>{site}"})).compile()
    )
    assert found.keys() == expected.keys()
    for field, value in expected.items():
        np.testing.assert_array_equal(found[field], value, err_msg=field)
    assert found["geom_size"] == pytest.approx([0.0075, 0.0075, 0.0025])
    assert found["geom_quat"] == pytest.approx(PLACE["quat"])
    assert found["geom_pos"] == pytest.approx([0.01 - 0.0025, 0.02, 0.03])


def test_all_defaults_at_once_and_a_model_that_was_saved():
    both = HOST.format(
        main=f"<geom {NASTY['euler']} {NASTY['mesh']} {NASTY['margin']} {NASTY['contact']} {NASTY['groups']}/>",
        # Of "fluid" and "looks" MuJoCo's own writer does not say that a geom has none of it.
        finger=f"<geom {NASTY['fromto']} {NASTY['mass']} {NASTY['density']}/>",
    )
    spec = attached(both)
    model = spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    found, saved = fields(model), fields(again)
    for field in found:
        np.testing.assert_allclose(saved[field], found[field], rtol=1e-6, atol=1e-12, err_msg=field)


GROUPS = """
<mujoco>
  <default><geom {default}/></default>
  <worldbody>
    <body name="palm"><freejoint/>{palm}<body name="finger" pos=".1 0 0">{finger}</body></body>
    <body name="other" pos=".1 0 .0099"><freejoint/><geom name="other" size=".01" {other}/></body>
  </worldbody>
</mujoco>
"""
OWN = '<geom size=".001" mass=".1" {}/>'


@pytest.mark.parametrize(
    ("default", "palm", "finger", "other", "touches"),
    [
        # What the finger touches, the pad touches, and nothing else.
        ("", "", OWN.format(""), "", True),
        ("", "", OWN.format('contype="1" conaffinity="0"'), "", True),
        ("", "", OWN.format('contype="1" conaffinity="0"'), 'contype="1" conaffinity="0"', False),
        ("", "", OWN.format('contype="2" conaffinity="2"'), 'contype="2" conaffinity="2"', True),
        ("", "", OWN.format('contype="2" conaffinity="2"'), "", False),
        ("", "", OWN.format('contype="0" conaffinity="4"'), 'contype="4" conaffinity="0"', True),
        # Whatever the class for new geoms says.
        ('contype="0" conaffinity="0"', "", OWN.format('contype="1" conaffinity="1"'), 'contype="1"', True),
        # Fingertips that are only drawn: the hand decides.
        (
            "",
            OWN.format('contype="8" conaffinity="0"'),
            OWN.format('contype="0" conaffinity="0"'),
            'conaffinity="8"',
            True,
        ),
        ("", OWN.format('contype="8" conaffinity="0"'), "", "", False),
        # Nothing of the hand collides: the pad touches all that collides.
        ('contype="0" conaffinity="0"', "", OWN.format(""), 'contype="1073741824"', True),
        ('contype="0" conaffinity="0"', "", OWN.format(""), "", False),
    ],
)
def test_a_pad_touches_what_its_hand_touches(default, palm, finger, other, touches):
    text = GROUPS.format(default=default, palm=palm, finger=finger, other=other)
    spec = mujoco.MjSpec.from_string(text)
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast", output="wrench")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pair = {model.geom("ff_pad").id, model.geom("other").id}
    assert any(set(found) == pair for found in data.contact.geom) == touches


def test_a_pad_on_the_world_touches_all_that_collides():
    spec = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><geom type="plane" size="1 1 .1" pos="0 0 -1" contype="1" conaffinity="1"/>'
        '<body pos="0 0 .0099"><freejoint/><geom size=".01" contype="16" conaffinity="0"/></body></worldbody></mujoco>'
    )
    mjtactile.attach_pad(spec, body="world", name="ff", fidelity="fast", output="wrench")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 1
