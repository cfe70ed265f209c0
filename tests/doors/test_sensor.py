"""The sensor in a model: MuJoCo's wrench goes in whole, through the true geometry, wherever the pad is."""

from __future__ import annotations

import copy
import math
import pickle
import warnings
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest
import trimesh
from mujoco_versions import since
from shapely import Point, Polygon, box

from mjtactile.attach import attach_pad
from mjtactile.cli.benchmarks.extremes import left_over
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import ContactWarning, SceneError
from mjtactile.geometry.indenter import indenter_outline, punch, sphere
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad, TaxelGrid, force_vector
from mjtactile.sensor import TactileSensor
from mjtactile.sim.mjcf import press_mjcf
from mjtactile.sim.press_scene import press, press_scene
from mjtactile.sim.wrench import geom_frame

# Some bodies press beyond the range of small strains, or rock on an edge.
pytestmark = pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")
GRAM_FORCE = 9.80665e-3  # [N]
PAD_GEOM = """<geom name="pad" type="box" size="0.0075 0.0075 0.0025" pos="0 0 -0.0025" priority="1" condim="4"
    solref="0.003 1" friction="1 0.0005 0.0001"/>"""
OPTION = '<option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100" jacobian="dense"{}/>'


def felt(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Wrench on the pad about its surface's middle, summed over contact points by the book, for a pad in world axes."""
    pad = model.geom("pad").id
    origin = data.geom_xpos[pad] + [0, 0, model.geom_size[pad, 2]]
    total = np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        if pad not in contact.geom:
            continue
        local = np.zeros(6)
        mujoco.mj_contactForce(model, data, index, local)
        sign = 1.0 if contact.geom[1] == pad else -1.0
        axes = contact.frame.reshape(3, 3).T
        force, torque = sign * axes @ local[:3], sign * axes @ local[3:]
        total += np.concatenate([force, torque + np.cross(contact.pos - origin, force)])
    return total


def settled(xml: str, steps: int = 300) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, steps)
    return model, data


def scene(bodies: str, *, pad_first: bool = True, assets: str = "", gravity: str = "") -> str:
    pad = f'<body name="pad">{PAD_GEOM}</body>'
    world = pad + bodies if pad_first else bodies + pad
    return f"<mujoco>{OPTION.format(gravity)}<asset>{assets}</asset><worldbody>{world}</worldbody></mujoco>"


def block(name: str, place: str, mass: float = 0.01) -> str:
    return f"""<body name="{name}" pos="{place}"><freejoint/>
        <geom name="{name}" type="box" size="0.002 0.0015 0.002" mass="{mass}"/></body>"""


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_loads_resultant_is_mujocos_wrench(name, draft):
    """Shifted, turned and tilted presses; the moment is MuJoCo's too, not the centroid's."""
    poses = [((0.0, 0.0), 0.0, 0.0), ((1.25e-3, -0.6e-3), 25.0, 20.0), ((-2e-3, 2e-3), 200.0, 35.0)]
    for shift, turn, tilt in poses:
        model = press_scene(name, shift=shift, rotate_deg=turn)
        data = mujoco.MjData(model)
        press(model, data, force_vector(50 * GRAM_FORCE, tilt, 40.0))
        sensor = TactileSensor(model, influence=draft)
        load = sensor.load(data)
        assert load is not None
        expected = felt(model, data)
        assert left_over(load, expected[:3], expected[3:], 1e-2) <= 1e-9  # the promise
        size = float(np.linalg.norm(expected[:3]) + np.linalg.norm(expected[3:]) / 1e-2)
        np.testing.assert_allclose(sensor.wrench(data), expected, atol=1e-12 * size)


def test_footprint_is_the_outline_where_the_punch_stands(draft):
    model = press_scene("star", shift=(1.25e-3, 0.0), rotate_deg=20)
    data = mujoco.MjData(model)
    press(model, data, force_vector(20 * GRAM_FORCE))
    load = TactileSensor(model, influence=draft).load(data)
    assert load is not None
    outline = indenter_outline("star", shift=(1.25e-3, 0.0), rotate_deg=20)
    # The model's text holds nine digits; the solid is cut 50 um up.
    assert load.contact.symmetric_difference(outline).area < 1e-4 * outline.area


@pytest.mark.parametrize("law", ["elastic", "foundation", "uniform"])
def test_contact_is_what_pressed_when_the_load_was_made(draft, law):
    """A disc under a ball, and all of a punch, after the scene has gone on."""
    for shape in (sphere(6e-3), "star"):
        model = press_scene(shape)
        data = mujoco.MjData(model)
        press(model, data, force_vector(0.5))
        sensor = TactileSensor(model, influence=draft, law=law)
        load = sensor.load(data)
        assert load is not None
        mujoco.mj_resetData(model, data)
        assert load.contact.area == pytest.approx(load.contact_area, rel=0.05)
        if shape == "star":
            outline = indenter_outline("star")
            assert load.contact.symmetric_difference(outline).area < 1e-3 * outline.area
        else:
            assert load.contact.area < 6e-6  # that of the ball is 113 mm2
            assert load.contact.contains(Point(0, 0).buffer(0.8 * math.sqrt(load.contact_area / math.pi)))


def test_readings_are_those_of_the_door_without_mujoco(draft):
    model = press_scene("triangle", shift=(0.0, 1.25e-3))
    data = mujoco.MjData(model)
    press(model, data, force_vector(30 * GRAM_FORCE, 10.0))
    sensor = TactileSensor(model, influence=draft)
    wrench = felt(model, data)
    footprint = Footprint.from_outline(indenter_outline("triangle", shift=(0.0, 1.25e-3)), draft.surface)
    expected = draft.readings(contact_load(draft, footprint, wrench[:3], moment=wrench[3:]))
    # The solid's section against the outline: tangential creep of the press, under a micrometre.
    np.testing.assert_allclose(sensor.read(data), expected, atol=1e-3 * expected.max())
    assert sensor.read(data).shape == (4, 13, 13)


@pytest.mark.parametrize("pad_first", [True, False])
def test_pad_may_be_either_geom_of_a_contact(pad_first, draft):
    model, data = settled(scene(block("brick", "0.001 0.002 0.002"), pad_first=pad_first))
    pad = model.geom("pad").id
    assert all(contact.geom[0 if pad_first else 1] == pad for contact in data.contact)
    sensor = TactileSensor(model, influence=draft)
    load = sensor.load(data)
    assert load is not None
    force, moment = load.resultant()
    weight = 0.01 * 9.81
    # Settled, but not for ever.
    np.testing.assert_allclose(force, [0, 0, -weight], atol=1e-3 * weight)
    np.testing.assert_allclose(moment, [-0.002 * weight, 0.001 * weight, 0], atol=1e-3 * weight * 5e-3)
    np.testing.assert_allclose(load.contact.bounds, (-1e-3, 0.5e-3, 3e-3, 3.5e-3), atol=1e-5)


def test_pad_elsewhere_and_turned_reads_the_same(draft):
    text = press_mjcf(punch("star"), shift=(1e-3, 0.5e-3), rotate_deg=15)
    frame = '<worldbody><frame pos="0.3 -0.2 0.5" euler="40 -70 25">'
    moved = text.replace("<worldbody>", frame).replace("</worldbody>", "</frame></worldbody>")
    readings, wrenches = [], []
    for xml in (text, moved):
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        data.ctrl[:] = force_vector(40 * GRAM_FORCE, 15.0, 70.0)
        mujoco.mj_step(model, data, 60)
        sensor = TactileSensor(model, influence=draft)
        readings.append(sensor.read(data))
        wrenches.append(sensor.wrench(data))
    assert readings[0].max() > 0
    # Two simulations of the same press, through an iterative solver: 1e-8 of its forces.
    np.testing.assert_allclose(wrenches[1], wrenches[0], atol=1e-5 * np.abs(wrenches[0]).max())
    np.testing.assert_allclose(readings[1], readings[0], atol=1e-4 * readings[0].max())


def test_several_bodies_add(draft):
    places = {"left": "-0.004 0 0.002", "right": "0.004 0.001 0.002"}
    both = settled(scene("".join(block(n, p) for n, p in places.items())))
    sensor = TactileSensor(both[0], influence=draft)
    load = sensor.load(both[1])
    assert load is not None
    alone = []
    for name, place in places.items():
        model, data = settled(scene(block(name, place)))
        one = TactileSensor(model, influence=draft).load(data)
        assert one is not None
        alone.append(one)
    expected = alone[0].forces + alone[1].forces
    # Two simulations.
    np.testing.assert_allclose(load.forces, expected, atol=1e-4 * np.abs(expected).max())
    assert load.contact.area == pytest.approx(2 * 4e-3 * 3e-3, rel=1e-3)
    np.testing.assert_allclose(np.concatenate(load.resultant()), felt(*both), atol=1e-9)


def test_a_body_of_several_geoms_has_one_footprint(draft):
    """Two legs of one body share a wrench as one rigid face would."""
    legs = """<body name="table" pos="0 0 0.002"><freejoint/>
        <geom type="box" size="0.001 0.001 0.002" pos="-0.004 0 0" mass="0.01"/>
        <geom type="box" size="0.001 0.001 0.002" pos="0.004 0 0" mass="0.03"/></body>"""
    model, data = settled(scene(legs))
    load = TactileSensor(model, influence=draft).load(data)
    assert load is not None
    assert load.contact.area == pytest.approx(2 * 4e-6, rel=1e-3)
    np.testing.assert_allclose(np.concatenate(load.resultant()), felt(model, data), atol=1e-9)


def test_without_contact_nothing_is_read(draft):
    model = press_scene("square")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    sensor = TactileSensor(model, influence=draft)
    readings = sensor.read(data)
    assert readings.shape == (4, 13, 13)
    assert not readings.any()
    assert sensor.load(data) is None
    assert not sensor.wrench(data).any()
    assert not sensor.carried(data).any()
    assert sensor.health().readings == 0


def test_readings_follow_the_body_and_stay_where_it_stands(draft):
    model = press_scene("star")
    data = mujoco.MjData(model)
    press(model, data, force_vector(20 * GRAM_FORCE))
    sensor = TactileSensor(model, influence=draft)
    first = sensor.read(data)
    np.testing.assert_array_equal(sensor.read(data), first)
    data.qpos[0] += 1e-3
    mujoco.mj_forward(model, data)
    moved = sensor.read(data)
    assert np.abs(moved - first).max() > 0.01 * first.max()
    # Far less than taxels tell apart.
    data.qpos[0] += 1e-11
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(sensor.read(data), moved, atol=1e-4 * moved.max())


def test_pad_and_body_that_turn_together_read_the_same(draft):
    option = OPTION.format(' gravity="0 0 0"').replace("/>", '><flag filterparent="disable"/></option>')
    xml = f"""<mujoco>{option}<worldbody><body name="hand"><joint name="turn" axis="0 1 0"/>
        <body name="pad">{PAD_GEOM}</body>
        <body name="brick" pos="0.001 0 0.00199"><joint type="slide" axis="0 0 1"/>
        <geom type="box" size="0.002 0.0015 0.002" mass="0.01"/></body></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml.replace('name="pad" type', 'name="pad" mass="0.1" type'))
    data = mujoco.MjData(model)
    sensor = TactileSensor(model, influence=draft)
    readings = []
    for angle in (0.0, 0.5, 1.5):
        data.qpos[0] = angle
        mujoco.mj_forward(model, data)
        readings.append(sensor.read(data))
    assert readings[0].max() > 0.0
    for turned in readings[1:]:
        np.testing.assert_allclose(turned, readings[0], atol=1e-4 * readings[0].max())


@since("3.8", "meshes touch in one point")
def test_notch_of_a_mesh_stays_open_although_mujoco_collides_its_hull(draft):
    u_shape = Polygon([(-4, -4), (4, -4), (4, 4), (2, 4), (2, -2), (-2, -2), (-2, 4), (-4, 4)])
    solid = trimesh.creation.extrude_polygon(u_shape, 4.0).apply_scale(1e-3)
    vertices, faces = (" ".join(map(str, a.ravel())) for a in (solid.vertices, solid.faces))
    assets = f'<mesh name="u" vertex="{vertices}" face="{faces}" inertia="exact"/>'
    body = '<body name="u" pos="0 0 0"><freejoint/><geom type="mesh" mesh="u" mass="0.01"/></body>'
    model, data = settled(scene(body, assets=assets))
    load = TactileSensor(model, influence=draft).load(data)
    assert load is not None
    centre = u_shape.centroid
    # MuJoCo moves meshes to their centre of mass; the body came to rest a few micrometres from where it started.
    expected = box(-4, -4, 4, 4).difference(box(-2, -2, 2, 5))
    assert load.contact.area * 1e6 == pytest.approx(expected.area, rel=2e-3)
    assert load.contact.area < 0.9 * load.contact.convex_hull.area
    assert load.contact.centroid.y * 1e3 == pytest.approx(centre.y, abs=0.02)


@pytest.mark.parametrize("depth", [0.001, 0.0002])
def test_contact_on_the_pads_side_is_in_the_wrench_and_not_in_the_readings(depth, draft):
    """Gravity pulls a block sideways against the pad's flank, its top below the sensing surface."""
    body = f"""<body name="wall" pos="0.0095 0 {-0.001 - depth}"><joint type="slide" axis="1 0 0"/>
        <geom type="box" size="0.002 0.001 0.001" mass="0.01"/></body>"""
    model, data = settled(scene(body, gravity=' gravity="-9.81 0 0"'))
    assert data.ncon > 0
    sensor = TactileSensor(model, influence=draft)
    readings = sensor.read(data)  # warns of nothing: warnings are errors here
    assert not readings.any()
    assert not sensor.carried(data).any()
    np.testing.assert_allclose(sensor.wrench(data)[:3], [-0.01 * 9.81, 0.0, 0.0], atol=1e-3)
    load = sensor.load(data)
    assert load is not None
    assert not load.forces.any()
    np.testing.assert_allclose(load.residual_force, sensor.wrench(data)[:3], rtol=1e-12)


def test_steady_reading_warns_of_nothing(draft):
    model = press_scene("doughnut")
    data = mujoco.MjData(model)
    press(model, data, force_vector(20 * GRAM_FORCE, 10.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        TactileSensor(model, influence=draft).read(data)


def test_missing_geom_lists_those_there_are(draft):
    model = press_scene("square")
    with pytest.raises(SceneError, match=r"'skin' does not exist in the model. Available: \[.*'pad'.*Pass geom="):
        TactileSensor(model, geom="skin", influence=draft)


def test_geom_of_another_size_is_refused_naming_both(draft):
    model = press_scene("square", pad=Pad(size=(16e-3, 15e-3)))
    with pytest.raises(SceneError, match=r"16 x 15 x 5 mm, but the pad measures 15 x 15 x 5 mm.*half"):
        TactileSensor(model, influence=draft)


def test_geom_that_is_no_box_is_refused(draft):
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom name="pad" type="sphere" size="0.01"/></worldbody></mujoco>'
    )
    with pytest.raises(SceneError, match="not a box"):
        TactileSensor(model, influence=draft)


BOX = '<body name="{}" pos="0 0 0.004"><freejoint/><geom type="box" size="0.004 0.004 0.004" mass="0.05"/></body>'
METHODS = ("read", "load", "carried", "wrench")


@pytest.mark.parametrize("method", METHODS)
def test_data_of_another_model_are_refused(method, draft):
    model, _ = settled(scene(BOX.format("one")), 1)
    _, of_another = settled(scene(BOX.format("one") + BOX.format("two").replace("0 0 0.004", "1 0 0")), 1)
    sensor = TactileSensor(model, influence=draft)
    for data, says in ((of_another, "belongs to another model"), (None, "type NoneType"), (model, "type MjModel")):
        with pytest.raises(SceneError, match=f"{says}; expected the mujoco.MjData of the model"):
            getattr(sensor, method)(data)


def test_data_of_a_varied_model_are_read(draft):
    """Domain randomisation: the same tree, another mass."""
    model, data = settled(scene(BOX.format("one")))
    varied, of_varied = settled(scene(BOX.format("one").replace("0.05", "0.1")))
    sensor = TactileSensor(model, influence=draft)
    # The tolerance is what is left of settling.
    assert sensor.wrench(of_varied)[2] == pytest.approx(2 * sensor.wrench(data)[2], rel=1e-3)
    assert varied.signature == model.signature


def test_readings_are_solved_where_the_model_disables_its_sensors():
    spec = mujoco.MjSpec.from_string(
        """<mujoco><worldbody><body name="finger"/><body pos="0.001 0 0.005"><freejoint/>
        <geom type="box" size="0.004 0.003 0.005" mass="0.05"/></body></worldbody></mujoco>"""
    )
    attach_pad(spec, body="finger", name="ff", fidelity="fast")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 300)
    written = TactileSensor(model, "ff").read(data)
    without = mujoco.MjData(model)
    without.qpos[:], without.qvel[:], without.qacc_warmstart[:] = data.qpos, data.qvel, data.qacc_warmstart
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_SENSOR
    mujoco.mj_forward(model, without)
    assert not without.sensordata.any()
    solved = TactileSensor(model, "ff").read(without)
    assert solved.max() > 1e3
    np.testing.assert_allclose(solved, written, rtol=0.0, atol=1e-3 * written.max())


def test_a_sensor_of_the_plugin_is_not_read_where_its_numbers_are_not():
    """Two models of one tree, whose sensors put out other things."""
    text = """<mujoco><extension><plugin plugin="mjtactile.pad"/></extension><worldbody>
      <geom name="pad" type="box" size="0.0075 0.0075 0.0025"/></worldbody>
      <sensor><plugin name="ff" plugin="mjtactile.pad" objtype="geom" objname="pad">
      <config key="fidelity" value="fast"/><config key="output" value="{}"/></plugin></sensor></mujoco>"""
    model, of_another = settled(text.format("von_mises"), 1)[0], settled(text.format("wrench von_mises"), 1)[1]
    with pytest.raises(SceneError, match="belongs to another model"):
        TactileSensor(model, "ff").read(of_another)


@pytest.mark.parametrize("model", ["hand.xml", None, mujoco.MjSpec()], ids=["name", "nothing", "spec"])
def test_what_is_no_model_is_refused_with_what_makes_one(model):
    with pytest.raises(SceneError, match=r"expected a mujoco.MjModel: MjSpec.compile\(\)"):
        TactileSensor(model)


@pytest.mark.parametrize("gap", [-1e-3, math.nan, math.inf, "1e-3", True])
def test_a_facing_gap_is_a_length(gap, draft):
    with pytest.raises(SceneError, match=r"facing_gap = .*; expected a length in metres"):
        TactileSensor(settled(scene(BOX.format("one")), 1)[0], influence=draft, facing_gap=gap)


def test_matrices_of_another_pad_are_refused_naming_both(draft):
    other = Pad(taxels=TaxelGrid(rows=3, columns=3))
    with pytest.raises(SceneError, match=r"13 x 13 taxels.*3 x 3 taxels.*influence_matrices\(pad\)"):
        TactileSensor(press_scene("square"), other, influence=draft)


def test_pad_is_the_matrices_own_by_default(draft):
    assert TactileSensor(press_scene("square"), influence=draft).pad is draft.pad


def test_pressing_harder_scales_readings(draft):
    peaks = []
    for grams in (20, 40):
        model = press_scene("circle")
        data = mujoco.MjData(model)
        press(model, data, force_vector(grams * GRAM_FORCE))
        peaks.append(TactileSensor(model, influence=draft).read(data).max())
    # MuJoCo reaches the force within 0.01 %.
    assert math.isclose(peaks[1], 2 * peaks[0], rel_tol=1e-3)


def test_shown_geoms_that_are_not_over_the_pad_leave_the_pressing_to_those_that_touch(draft):
    tool = """<body name="tool" pos="0 0 0.002"><joint type="slide" axis="0 0 1"/>
        <geom type="box" size="{}" mass="0.01"/>{}</body>"""
    size = "0.002 0.003 0.002"
    decoration = '<geom type="sphere" size="0.001" pos="0.03 0 0" contype="0" conaffinity="0" mass="0"/>'
    readings = []
    for extra in ("", decoration):
        model, data = settled(scene(tool.format(size, extra), gravity=' gravity="0 0 -9.81"'))
        readings.append(TactileSensor(model, influence=draft).read(data))
    assert readings[0].max() > 0
    np.testing.assert_allclose(readings[1], readings[0], rtol=1e-9)


@since("3.8", "its own error, treeFirst, with a flex and no joints")
def test_a_flex_presses_where_it_touches(draft):
    cloth = """<flexcomp name="f" type="grid" count="4 4 2" spacing=".002 .002 .002" pos="{} 0 .0015" radius=".0005"
        dim="3" mass=".01"><edge equality="true"/><contact selfcollide="none"/></flexcomp>"""
    centres = []
    for x in (-2e-3, 2e-3):
        model, data = settled(scene(cloth.format(x), gravity=' gravity="0 0 -9.81"'), steps=60)
        assert data.ncon > 0
        sensor = TactileSensor(model, influence=draft)
        readings = sensor.read(data)
        assert readings.max() > 0.0
        np.testing.assert_allclose(sensor.carried(data), sensor.wrench(data), atol=1e-6)
        load = sensor.load(data)
        assert load is not None
        assert 0.0 < load.contact.area <= load.contact_area * (1 + 1e-6)  # squares may overlap
        centres.append(float(readings[0].sum(axis=0) @ np.linspace(-6, 6, 13) / readings[0].sum()))
    assert centres[0] < -1.0 < 1.0 < centres[1]


@since("3.8", "its own error, treeFirst, with a flex and no joints")
@pytest.mark.parametrize(("count", "spacing"), [(11, 0.0012), (6, 0.0024), (14, 0.001)])
def test_a_cloth_presses_with_what_mujoco_says_of_each_contact(draft, count, spacing):
    """A cloth is not rigid: the readings are the sum of those of its contacts, each on a square of its own."""
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option integrator="implicitfast" cone="elliptic" timestep=".001"/>
        <worldbody><body name="finger"/><body name="b" pos="0 0 .004"><flexcomp name="c" type="grid"
        count="{count} {count} 1" spacing="{spacing} {spacing} .003" dim="2" radius=".0005" mass=".02">
        <contact selfcollide="none"/><edge equality="true"/></flexcomp></body></worldbody></mujoco>""")
    attach_pad(spec, body="finger", name="pad", fidelity="fast")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 60)
    frame, force = geom_frame(model, data, model.geom("pad_pad").id), np.zeros(6)
    nodal = SurfaceLoad.none(draft.surface).forces
    for number in range(data.ncon):
        contact = data.contact[number]
        mujoco.mj_contactForce(model, data, number, force)
        x, y, _ = frame.rotation.T @ (contact.pos - frame.position)
        pressing = force[:3] @ contact.frame.reshape(3, 3) @ frame.rotation
        pressing *= -np.sign(pressing[2])
        square = box(x - 1e-4, y - 1e-4, x + 1e-4, y + 1e-4)
        traction = np.divide(pressing, 4e-8)
        load = SurfaceLoad.from_tractions(draft, square, lambda points, _, t=traction: np.tile(t, (len(points), 1)))
        nodal = nodal + load.forces
    readings = TactileSensor(model, influence=draft, geom="pad_pad").read(data)
    wanted = draft.readings(SurfaceLoad(nodal, draft.surface, Polygon()))
    assert np.linalg.norm(readings - wanted) < 0.01 * np.linalg.norm(wanted)


@since("3.8", "its own error, treeFirst, with a flex and no joints")
@pytest.mark.parametrize(("mass", "large"), [(0.005, False), (1.0, True)])
def test_strains_below_a_flex_are_judged_over_more_than_its_contact_points(draft, mass, large):
    """The vertices in the middle of a disc lie so close together that its points cover next to nothing."""
    disc = f"""<flexcomp name="f" type="disc" dim="2" count="7 7 1" spacing=".002 .002 .002" pos="0 0 .0005"
        radius=".0005" mass="{mass}"><edge equality="true" damping=".001"/><contact selfcollide="none"/></flexcomp>"""
    model, data = settled(scene(disc, gravity=' gravity="0 0 -9.81"'), steps=60)
    sensor = TactileSensor(model, influence=draft)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", ContactWarning)
        sensor.read(data)
    assert any("strains are no longer small" in str(one.message) for one in told) == large
    assert sensor.wrench(data)[2] < -2.0 * mass
    assert sensor.health().beyond_range == large


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda both: pickle.loads(pickle.dumps(both))])
def test_copies_of_a_sensor_read_alike(copied, draft):
    """As planners copy what they simulate, and as processes are handed it."""
    ball = '<body pos="0 0 .0039"><freejoint/><geom type="sphere" size=".004" mass=".05"/></body>'
    model, data = settled(scene(ball), 40)
    sensor = TactileSensor(model, influence=draft, geom="pad")
    expected = sensor.read(data)
    again, there = copied((sensor, data))
    np.testing.assert_array_equal(again.read(there), expected)
    assert expected.max() > 0.0
    assert again.health().readings == 1


@pytest.mark.parametrize("saved", ["sensor", "data", "both", "neither"])
def test_signatures_that_pickles_lose_refuse_nothing_and_sizes_still_do(saved, draft):
    """MuJoCo stores no signature of the kinematic tree in pickles."""
    ball = '<body pos="0 0 .0039"><freejoint/><geom type="sphere" size=".004" mass=".05"/></body>'
    model, data = settled(scene(ball), 40)
    _, of_another = settled(scene(ball + ball.replace("0 0 ", "1 0 ")), 40)
    sensor = TactileSensor(model, influence=draft, geom="pad")
    expected = sensor.read(data)
    if saved in ("sensor", "both"):
        sensor = pickle.loads(pickle.dumps(sensor))
    if saved in ("data", "both"):
        data, of_another = pickle.loads(pickle.dumps((data, of_another)))
    np.testing.assert_array_equal(sensor.read(data), expected)
    with pytest.raises(SceneError, match="belongs to another model"):
        sensor.read(of_another)


def test_threads_share_a_sensor(draft):
    """Each reads states of its own; the core solves without Python's lock."""
    ball = '<body pos="0 0 .0039"><freejoint/><geom type="sphere" size=".004" mass=".05"/></body>'
    model, _ = settled(scene(ball), 1)
    sensor = TactileSensor(model, influence=draft, geom="pad")
    states = [mujoco.MjData(model) for _ in range(4)]
    for number, data in enumerate(states):
        mujoco.mj_step(model, data, 40 + 5 * number)
    expected = [sensor.read(data) for data in states]
    with ThreadPoolExecutor(len(states)) as executor:
        found = executor.map(lambda data: [sensor.read(data) for _ in range(200)], states)
    for wanted, readings in zip(expected, found, strict=True):
        assert all(np.array_equal(wanted, one) for one in readings)
