"""Pads attached to models of other people."""

import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjtactile
from mjtactile.sim.wrench import contact_wrench

HAND = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <default><geom priority="3" solref="0.02 1" friction="0.3"/></default>
  <worldbody>
    <body name="finger" pos="0 0 0.02" euler="180 0 0">
      <joint name="press" type="slide" axis="0 0 1" range="-0.05 0.05"/>
      <geom type="capsule" size=".006 .01" pos="0 0 -.02"/>
    </body>
    <body name="block"><geom type="box" size=".004 .003 .005" pos="0 0 -.005" priority="0"/></body>
  </worldbody>
  <actuator><motor joint="press"/></actuator>
</mujoco>
"""


def hand(**options):
    spec = mujoco.MjSpec.from_string(HAND)
    geom = mjtactile.attach_pad(spec, body="finger", name="ff", **{"fidelity": "fast", **options})
    return spec, geom


def pressed(model):
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.5
    mujoco.mj_step(model, data, 500)
    mujoco.mj_forward(model, data)
    return data


def test_what_is_added():
    spec, geom = hand(pos=(0, 0, 1e-3), quat=(2, 0, 0, 0))
    assert geom.name == "ff_pad"
    model = spec.compile()
    assert model.geom("ff_pad").size == pytest.approx([0.0075, 0.0075, 0.0025])
    assert model.geom("ff_pad").pos == pytest.approx([0, 0, 1e-3 - 2.5e-3])
    assert model.site("ff_surface").pos == pytest.approx([0, 0, 1e-3])
    assert model.sensor("ff").dim == 676


def test_a_pad_without_a_sensor_is_read_when_asked():
    with_sensor, without = hand()[0].compile(), hand(output=None)[0].compile()
    assert (without.nsensor, without.nplugin) == (0, 0)
    data = pressed(without)
    asked = mjtactile.TactileSensor(without, geom="ff_pad", fidelity="fast").read(data)
    same = mujoco.MjData(with_sensor)
    same.qpos[:], same.qvel[:], same.ctrl[:] = data.qpos, data.qvel, data.ctrl
    same.qacc_warmstart[:] = data.qacc_warmstart
    mujoco.mj_forward(with_sensor, same)
    expected = mjtactile.TactileSensor(with_sensor, geom="ff_pad", fidelity="fast").read(same)
    assert asked.max() > 1e3
    assert asked == pytest.approx(expected, rel=1e-6, abs=1e-3)
    with pytest.raises(mjtactile.SceneError, match="adds no sensor"):
        hand(output=None, visual=True)


def test_sensor_by_name_and_by_geom_read_alike():
    model = hand()[0].compile()
    data = pressed(model)
    by_name = mjtactile.TactileSensor(model, "ff")
    by_geom = mjtactile.TactileSensor(model, "ff_pad", fidelity="fast")
    found, expected = by_name.read(data), by_geom.read(data)
    assert (found.ravel() == data.sensor("ff").data).all()
    assert np.linalg.norm(found - expected) <= 0.02 * np.linalg.norm(expected)
    assert by_name.wrench(data)[2] == pytest.approx(-(0.5 + model.body("finger").mass * 9.81), rel=1e-3)
    assert by_name.influence.fidelity == mjtactile.PRESETS["fast"]


def test_the_pad_decides_the_contact():
    model = hand()[0].compile()
    data = pressed(model)
    assert (data.contact.solref[:, 0] == 0.005).all()
    assert contact_wrench(model, data, model.geom("ff_pad").id)[2] < 0.0


THIN = mjtactile.Pad(
    size=(12e-3, 1e-2),
    layers=(
        mjtactile.Layer(thickness=1e-3, young=1e6 / 3, poisson=0.45),
        mjtactile.Layer(thickness=2e-3, young=2e6, poisson=0.3),
    ),
    taxels=mjtactile.TaxelGrid(rows=3, columns=4, pitch=(2e-3, 2.5e-3)),
    depths=(1e-3,),
)
OPEN = """
import sys, mujoco, mjtactile
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
data.ctrl[0] = 0.5
mujoco.mj_step(model, data, 500)
mujoco.mj_forward(model, data)
sys.stdout.buffer.write(data.sensor("ff").data.tobytes())
"""


def test_a_pad_of_ones_own():
    model = hand(pad=THIN, output="von_mises wrench")[0].compile()
    assert model.geom("ff_pad").size[2] == pytest.approx(1.5e-3)
    assert model.sensor("ff").dim == 12 + 6
    data = pressed(model)
    assert mjtactile.TactileSensor(model, "ff").read(data).shape == (1, 3, 4)


@pytest.mark.parametrize("registered", [False, True])
def test_a_model_with_a_pad_of_ones_own_is_opened_by_a_process_that_does_not_know_it(tmp_path, registered):
    if registered:
        mjtactile.register_pad("thin", THIN)
    spec, _ = hand(pad="thin" if registered else THIN)
    expected = pressed(spec.compile()).sensor("ff").data
    (tmp_path / "hand.xml").write_text(spec.to_xml())
    run = subprocess.run([sys.executable, "-c", OPEN, tmp_path / "hand.xml"], capture_output=True, check=True)
    found = np.frombuffer(run.stdout)
    assert found.shape == (12,)
    assert found.max() > 0.0
    assert found == pytest.approx(expected, rel=1e-3)  # XML has six digits


def test_a_file_of_saved_matrices_stays_a_file(tmp_path):
    path = str(tmp_path / "pad.safetensors")
    mjtactile.influence_matrices(fidelity="fast").save(path)
    for fidelity in ("fast", None):
        spec, _ = hand(pad=path, fidelity=fidelity)
        assert f'<config key="pad" value="{path}"/>' in (spec.compile(), spec.to_xml())[1]
    spec, _ = hand(pad=path, fidelity="balanced")
    with pytest.raises(ValueError, match=r"at fidelity fast.*at fidelity balanced"):
        spec.compile()


@pytest.mark.parametrize("pad", [None, THIN, "file"])
def test_without_a_fidelity_it_is_balanced_or_that_of_a_file(pad, tmp_path):
    if pad == "file":
        pad = tmp_path / "pad.safetensors"
        mjtactile.influence_matrices(fidelity="fast").save(pad)
    spec, _ = hand(pad=pad, fidelity=None)
    assert spec.plugins[0].config.get("fidelity") == (None if isinstance(pad, Path) else "balanced")
    with pytest.raises(mjtactile.SceneError, match="law 'soft' does not exist"):
        hand(pad=pad, fidelity=None, law="soft")


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (mjtactile.pad_text(THIN).replace('"depths"', '"depth"'), 'lacks "depths"'),
        (mjtactile.pad_text(THIN)[:-1], "not JSON"),
        (mjtactile.pad_text(THIN).replace("[0.001]", "[0.005]"), "0.005 m lies outside the sheet"),
    ],
)
def test_a_damaged_pad_in_a_model_says_what_is_wrong(value, says):
    spec, _ = hand(pad=THIN)
    spec.compile()
    quoted = spec.to_xml().replace(*(text.replace('"', "&quot;") for text in (mjtactile.pad_text(THIN), value)))
    with pytest.raises(ValueError, match=f'attribute "pad".*{says}'):
        mujoco.MjModel.from_xml_string(quoted)


def test_attached_pads_go_along_when_specs_are_attached():
    parent = mujoco.MjSpec.from_string('<mujoco><option timestep="0.001" integrator="implicitfast"/></mujoco>')
    for prefix in ("left_", "right_"):
        child, _ = hand()
        parent.worldbody.add_frame(pos=[0.1 if prefix == "left_" else -0.1, 0, 0]).attach_body(
            child.body("finger"), prefix, ""
        )
    model = parent.compile()
    assert [model.sensor(name).dim[0] for name in ("left_ff", "right_ff")] == [676, 676]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"body": "thumb"}, "finger"),
        ({"fidelity": "quick"}, "fast, balanced, precise, accurate"),
        ({"output": "force"}, "von_mises, stress, wrench"),
        ({"pad": "none"}, "default"),
        ({"pos": (0, 0)}, "three lengths"),
        ({"contact": "hard"}, "stiff, soft"),
        ({"contact": np.array(["stiff", "soft"])}, "contact is of type ndarray.*'stiff' or 'soft'"),
        ({"output": np.array(["wrench", "range"])}, "von_mises, stress, wrench"),
        ({"law": np.array(["elastic", "uniform"])}, "uniform, foundation, elastic"),
        ({"body": None}, "None does not exist"),
        ({"name": ""}, "not empty"),
        ({"name": 3}, "not empty"),
        ({"name": "a\0b"}, "without the null character"),
        ({"pos": ("0", "0", "0")}, "three lengths"),
        ({"quat": np.array([1.0, 0.0, 0.0, 1j])}, "quaternion"),
        ({"pos": "0 0 0"}, "three lengths"),
        ({"pos": (0, 0, np.nan)}, "three lengths"),
        ({"pos": (0, 0, np.inf)}, "three lengths"),
        ({"quat": (np.inf, 0, 0, 0)}, "quaternion"),
        ({"quat": (0, 0, 0, 0)}, "quaternion"),
        ({"pad": 3}, "type int; expected a mjtactile.Pad"),
        ({"pad": {"size": (1, 1)}}, "type dict; expected a mjtactile.Pad"),
        ({"output": "wrench wrench"}, "'wrench' .* twice"),
        ({"law": "hertz"}, "uniform, foundation, elastic"),
        ({"friction": -1.0}, "not negative"),
        ({"friction": np.nan}, "not negative"),
        ({"friction": "0.5"}, "not negative"),
        ({"tangential": "glue"}, "proportional, stick, coulomb"),
        ({"tangential": "stick", "law": "foundation"}, "needs law='elastic'"),
        ({"tangential": "coulomb", "friction": -0.1}, "not negative"),
        ({"tilt": "loose"}, "free, fixed"),
    ],
)
def test_wrong_arguments_say_the_right_ones(options, says):
    spec = mujoco.MjSpec.from_string(HAND)
    with pytest.raises(mjtactile.SceneError, match=says):
        mjtactile.attach_pad(spec, **{"body": "finger", "name": "ff", **options})


@pytest.mark.parametrize("size", [5e-324, 1e-200, 0.3, 1e200, 1.7e308])
def test_an_orientation_of_any_size_is_one(size):
    model = hand(quat=(size, 0.0, -size, 0.0))[0].compile()
    half = np.sqrt(0.5)
    assert model.site("ff_surface").quat == pytest.approx([half, 0.0, -half, 0.0], abs=1e-15)  # rounding


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        (HAND, r"type str; expected a mujoco.MjSpec. Make one with mujoco\.MjSpec\.from_file"),
        (None, "type NoneType; expected a mujoco.MjSpec"),
        (
            mujoco.MjModel.from_xml_string(HAND),
            "MjSpec. A compiled model takes no more geoms: attach the pad to its MjSpec",
        ),
    ],
    ids=["text", "nothing", "compiled"],
)
def test_what_is_no_specification_is_refused_with_what_makes_one(spec, says):
    with pytest.raises(mjtactile.SceneError, match=says):
        mjtactile.attach_pad(spec, body="finger", name="ff")
    with pytest.raises(mjtactile.SceneError, match=says):
        mjtactile.hands.attach_hand(spec, "shadow")


DOME = mjtactile.Pad(surface=mjtactile.SphereCap(20e-3))


@pytest.mark.parametrize(
    ("take", "pad"),
    [
        (lambda spec: spec.worldbody.add_site(name="ff_surface"), None),
        (lambda spec: spec.worldbody.add_geom(name="ff_pad", size=[1e-3, 0, 0]), None),
        (lambda spec: spec.add_mesh(name="ff_pad", uservert=[0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]), DOME),
        (lambda spec: spec.add_sensor(name="ff", type=mujoco.mjtSensor.mjSENS_CLOCK), None),
    ],
    ids=["site", "geom", "mesh", "sensor"],
)
def test_a_taken_name_leaves_the_specification_as_it_was(take, pad):
    spec = mujoco.MjSpec.from_string(HAND)
    take(spec)
    before = len(spec.geoms), len(spec.sites), len(spec.sensors), len(spec.meshes)
    with pytest.raises(mjtactile.SceneError, match=r"already\. Give the pad another name than 'ff'"):
        mjtactile.attach_pad(spec, body="finger", name="ff", pad=pad)
    assert (len(spec.geoms), len(spec.sites), len(spec.sensors), len(spec.meshes)) == before


def test_a_pads_file_may_be_a_path(tmp_path):
    (tmp_path / "pad.toml").write_text("sampling_radius = 0.6e-3\n")
    spec, _ = hand(pad=tmp_path / "pad.toml")
    assert mjtactile.TactileSensor(spec.compile(), "ff").pad == mjtactile.Pad(sampling_radius=0.6e-3)


def test_names_of_pads_stay_what_they_are():
    mjtactile.register_pad("mine", mjtactile.Pad())
    with pytest.raises(mjtactile.SceneError, match="another one"):
        mjtactile.register_pad("mine", mjtactile.Pad(size=(0.02, 0.02)))


@pytest.mark.parametrize(
    "door",
    [
        lambda none: mjtactile.register_pad("none", none),
        mjtactile.pad_text,
        mjtactile.influence_matrices,
        lambda none: mjtactile.TactileSensor(mujoco.MjModel.from_xml_string("<mujoco/>"), none),
    ],
)
def test_what_is_no_pad_is_refused_in_one_line(door):
    with pytest.raises(mjtactile.PadError, match=r"pad is of type int; expected a mjtactile\.Pad"):
        door(3)
