"""Choices of a sensor beyond its pad, and geoms that are neither primitives nor meshes."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from pad_contacts import wrenches_by_body
from shapely import Polygon, box

import mjtactile
import mjtactile.sensor
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import FACING_GAP, Footprint
from mjtactile.errors import ContactError, ContactWarning, SceneError
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import force_vector
from mjtactile.plugin.attributes import Attributes
from mjtactile.plugin.engine import attribute_names
from mjtactile.sensor import TactileSensor
from mjtactile.sim.press_scene import press, press_scene
from mjtactile.sim.wrench import contact_wrench, geom_frame

OPTION = '<option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100" jacobian="dense"/>'
PAD_GEOM = """name="pad" type="box" size="0.0075 0.0075 0.0025" priority="1" condim="4" solref="0.003 1"
    friction="{} 0.0005 0.0001" mass="0.02\""""


def pressed(shape: str = "square") -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = press_scene(shape)
    data = mujoco.MjData(model)
    press(model, data, force_vector(0.5, 10.0))
    return model, data


def test_a_fidelity_reaches_the_influence_matrices_and_brings_its_law(draft, monkeypatch):
    asked = []

    def matrices(*args, **options):
        asked.append((args, options))
        return draft

    monkeypatch.setattr(mjtactile.sensor, "shared_influence", matrices)
    sensor = TactileSensor(press_scene("square"), fidelity="fast")
    assert asked == [((sensor.pad, "fast"), {})]
    assert sensor.law == draft.fidelity.law
    assert TactileSensor(press_scene("square"), influence=draft, law="elastic").law == "elastic"


def test_sensors_of_one_pad_share_its_tables():
    """Each table takes some 80 MB and a quarter of a second: a hand has two dozen pads."""
    model = press_scene("square")
    first, second = (TactileSensor(model, fidelity="fast") for _ in range(2))
    assert first.influence is second.influence
    attributes = Attributes(dict.fromkeys(attribute_names(), "") | {"fidelity": "fast"})
    assert first.influence is attributes.influence()
    assert first.influence is not TactileSensor(model, fidelity="balanced").influence


@pytest.fixture(scope="module")
def fast() -> InfluenceMatrices:
    return influence_matrices(fidelity="fast")


def shear_of(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    influence: InfluenceMatrices,
    tangential: str = "coulomb",
    **options: Any,
) -> np.ndarray:
    """Nodal forces under law elastic, by default with friction of Coulomb [N], (nodes y, nodes x, 3)."""
    load = TactileSensor(model, influence=influence, law="elastic", tangential=tangential, **options).load(data)
    assert load is not None
    return load.forces


def test_fine_contacts_stick_too(draft):
    assert draft.fidelity.cells == 400
    model, data = pressed()
    proportional, stick = (shear_of(model, data, draft, tangential) for tangential in ("proportional", "stick"))
    assert np.abs(stick - proportional).max() > 0.1 * np.abs(proportional[..., 0]).max()


def test_friction_is_the_contacts_own_unless_given(fast):
    model, data = pressed()
    data.contact.friction[:, :2] = 0.7
    own, same, less = (shear_of(model, data, fast, friction=friction) for friction in (None, 0.7, 0.2))
    np.testing.assert_array_equal(own, same)
    # Less friction lets more of it slip.
    assert np.abs(own - less).max() > 0.1 * np.abs(own[..., 0]).max()


def test_each_body_slides_with_its_own_friction(fast):
    """Two bodies far from each other that are pushed sideways."""
    bodies = "".join(
        f"""<body pos="{x} 0 0.002"><joint type="slide" axis="1 0 0" damping="5"/><joint type="slide" axis="0 0 1"/>
        <geom type="box" size=".001 .001 .002" mass=".01" priority="2" friction="{friction} .001 .001"/></body>"""
        for x, friction in ((-0.006, 0.21), (0.006, 0.9))
    )
    option = OPTION.replace("/>", ' gravity="2 0 -9.81"/>')
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco>{option}<worldbody><geom {PAD_GEOM.format(0.5)} pos="0 0 -.0025"/>{bodies}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 50)
    own, low, high = (shear_of(model, data, fast, friction=friction)[..., 0] for friction in (None, 0.21, 0.9))
    middle = own.shape[1] // 2
    left, right = (slice(None), slice(0, middle)), (slice(None), slice(middle, None))
    for half, expected, other in ((left, low, high), (right, high, low)):
        size = np.abs(expected[half]).max()
        assert np.abs(own[half] - expected[half]).max() <= 1e-2 * size
        assert np.abs(own[half] - other[half]).max() > 3e-2 * size


@pytest.mark.parametrize("option", ["law", "tangential", "tilt"])
def test_choices_that_do_not_exist_are_refused(option, draft):
    choice: dict[str, Any] = {option: "loose"}
    with pytest.raises(ContactError, match=rf"{option} 'loose' does not exist.*Available: \w+, "):
        TactileSensor(press_scene("square"), influence=draft, **choice)


def test_options_that_do_not_go_together_are_refused(draft):
    with pytest.raises(ContactError, match="needs law='elastic'"):
        TactileSensor(press_scene("square"), influence=draft, law="uniform", tangential="stick")


def test_a_force_that_is_not_finite_warns_and_reads_as_no_number(draft):
    model, data = pressed()
    sensor = TactileSensor(model, influence=draft)
    data.efc_force[:] = np.nan
    with pytest.warns(ContactWarning, match="pad 'pad', body 'square': nothing is read from it"):
        assert np.isnan(sensor.read(data)).all()
    assert sensor.health().refused == 1


def pad_on_terrain() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A pad face down on a height field with one plateau in the middle of its underside's track."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>{OPTION}
        <asset><hfield name="h" nrow="41" ncol="41" size=".02 .02 .002 .002"/></asset>
        <worldbody><geom type="hfield" hfield="h"/>
        <body pos="0.001 0 0.00449" euler="180 0 30"><joint type="slide" axis="0 0 1"/>
        <geom {PAD_GEOM.format(1)}/></body></worldbody></mujoco>""")
    x, y = np.meshgrid(np.linspace(-0.02, 0.02, 41), np.linspace(-0.02, 0.02, 41))
    model.hfield_data[:] = ((np.abs(x) < 3.1e-3) & (np.abs(y) < 2.1e-3)).astype(float).ravel()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    return model, data


def test_a_height_field_presses_on_a_pad_that_lies_on_it(draft):
    model, data = pad_on_terrain()
    sensor = TactileSensor(model, influence=draft, law="uniform")
    load = sensor.load(data)
    assert load is not None
    assert sensor.read(data).max() > 0.0
    # A plateau of 6 x 4 mm whose flanks fall by 2 mm over the next 1 mm: 50 um down it is 0.025 mm wider all round. The
    # load is off its middle, so that a part of it does not bear.
    frame = geom_frame(model, data, sensor.geom)
    corners = np.array([[-3.025, -2.025], [3.025, -2.025], [3.025, 2.025], [-3.025, 2.025]]) * 1e-3
    seen = (np.column_stack([corners, np.full(4, 2e-3)]) - frame.position) @ frame.rotation
    assert load.contact.within(Polygon(seen[:, :2]).buffer(5e-5))
    assert load.contact.area > 0.6 * Polygon(seen[:, :2]).area
    np.testing.assert_allclose(sensor.wrench(data)[2], -0.02 * 9.81, rtol=0.02)


TORUS = """<mujoco><option timestep="0.001"/><extension><plugin plugin="mujoco.sdf.torus"><instance name="t">
    <config key="radius1" value="0.004"/><config key="radius2" value="0.002"/></instance></plugin></extension>
    <asset><mesh name="t"><plugin instance="t"/></mesh></asset>
    <worldbody><geom name="pad" type="box" size="0.0075 0.0075 0.0025" pos="0 0 -0.0025" priority="1" solref=".003 1"/>
    <body pos="0 0 0.00199"><freejoint/><geom type="sdf" mesh="t" mass="0.01"><plugin instance="t"/></geom></body>
    </worldbody></mujoco>"""


def torus_on_pad() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(TORUS)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 200)
    return model, data


def test_a_signed_distance_function_presses_with_a_ring(draft):
    model, data = torus_on_pad()
    sensor = TactileSensor(model, influence=draft, law="uniform")
    load = sensor.load(data)
    assert load is not None
    np.testing.assert_allclose(load.resultant()[0], contact_wrench(model, data, 0)[:3], atol=1e-9)
    # A ring of 4 mm radius, where its tube of 2 mm is 50 um above its bottom; sunk in a little, and a mesh.
    width = 2 * np.sqrt(2 * 2e-3 * 5e-5)
    assert load.contact.area == pytest.approx(2 * np.pi * 4e-3 * width, rel=0.1)


def two_boxes(gap: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Two free boxes that stand beside each other on a pad."""
    bodies = "".join(
        f"""<body pos="{side * (0.001 + gap / 2)} 0 0.002"><freejoint/>
        <geom type="box" size=".001 .002 .002" mass=".02" contype="{kind}" conaffinity="{kind}"/></body>"""
        for side, kind in ((-1, 1), (1, 2))
    )
    pad = f'<geom {PAD_GEOM.format(1)} contype="3" conaffinity="3" pos="0 0 -.0025"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{OPTION}<worldbody>{pad}{bodies}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 60)
    return model, data


def test_bodies_near_each_other_feel_each_other(draft):
    """Each body deforms the surface under the other: together they read otherwise than one by one."""
    model, data = two_boxes(gap=2e-4)
    sensor = TactileSensor(model, influence=draft, law="elastic")
    load = sensor.load(data)
    assert load is not None
    np.testing.assert_allclose(load.resultant()[0], sensor.wrench(data)[:3], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(load.resultant()[1], sensor.wrench(data)[3:], rtol=1e-6, atol=1e-9)
    together = sensor.read(data)
    np.testing.assert_allclose(draft.readings(load), together, rtol=1e-6)
    alone = []
    for body, wrench in wrenches_by_body(model, data, model.geom("pad").id).items():
        side = -1 if body == 1 else 1
        outline = box(side * 1.1e-3 - 1e-3, -2e-3, side * 1.1e-3 + 1e-3, 2e-3)
        footprint = Footprint.from_outline(outline, draft.surface)
        alone.append(contact_load(draft, footprint, wrench[:3], moment=wrench[3:], law="elastic"))
    apart = draft.readings(alone[0] + alone[1])
    assert 5e-3 < np.linalg.norm(together - apart) / np.linalg.norm(apart) < 0.1


def test_a_sensor_of_the_plugin_takes_no_second_choice():
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="finger"/></worldbody></mujoco>')
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast")
    model = spec.compile()
    with pytest.raises(SceneError, match=r"'ff' is a sensor of the plugin, which has its own law, geom\. Leave"):
        TactileSensor(model, "ff", law="uniform", geom="nope")
    own: dict[str, Any] = {
        "fidelity": "balanced",
        "tangential": "proportional",
        "geom": "pad",
        "facing_gap": FACING_GAP,
    }
    for option, value in own.items():  # the defaults, where the sensor's own may be others
        with pytest.raises(SceneError, match=rf"'ff' is a sensor of the plugin, which has its own {option}\. Leave"):
            TactileSensor(model, "ff", **{option: value})
    with pytest.raises(SceneError, match=r"geom 'pad' does not exist.*or the name of a sensor of the plugin: \['ff'\]"):
        TactileSensor(model)


def test_a_geom_is_named_once():
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="finger"/></worldbody></mujoco>')
    for name in "ab":
        mjtactile.attach_pad(spec, body="finger", name=name, output=None)
    model = spec.compile()
    with pytest.raises(SceneError, match=r"pad = 'b_pad' .* but geom = 'a_pad' names one too\. Give one of them"):
        TactileSensor(model, "b_pad", geom="a_pad", fidelity="fast")
    assert TactileSensor(model, "b_pad", fidelity="fast").geom == model.geom("b_pad").id
