"""The sensor plugin "mjtactile.pad" in MuJoCo: what it reads, and everywhere a model may go."""

import copy
import pickle
import resource
import subprocess
import sys
import threading
import warnings
from importlib import import_module, invalidate_caches
from importlib.abc import Loader
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np
import pytest

import mjtactile
from mjtactile._native import basis_bytes
from mjtactile.plugin.mujoco_layout import mujoco_layout
from mjtactile.sim.press_scene import press_spec
from mjtactile.sim.wrench import contact_wrench

PLUGIN = '<extension><plugin plugin="mjtactile.pad"/></extension>'
SCENE = """
<mujoco>{extension}
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10" jacobian="dense"/>
  <worldbody>{pads}{bodies}</worldbody>
  <sensor>{sensors}</sensor>
  {key}
</mujoco>
"""
KEY = '<keyframe><key name="lifted" qpos="{}"/></keyframe>'
PAD = (
    '<geom name="pad{n}" type="box" size=".0075 .0075 .0025" pos="{x} 0 -.0025" priority="1" solref=".005 1" '
    'condim="4"/>'
)
BOX = '<body name="box{n}" pos="{x} 0 .00501"><freejoint/><geom type="box" size=".004 .005 .005" mass=".05"/></body>'
SENSOR = (
    '<plugin name="touch{n}" plugin="mjtactile.pad" objtype="geom" objname="pad{n}">'
    '<config key="fidelity" value="fast"/>{config}</plugin>'
)


def scene(pads=1, config="", body=BOX):
    places = [(n, 0.03 * n) for n in range(pads)]
    return SCENE.format(
        extension=PLUGIN,
        pads="".join(PAD.format(n=n, x=x) for n, x in places),
        bodies="".join(body.format(n=n, x=x) for n, x in places),
        sensors="".join(SENSOR.format(n=n, config=config) for n, _ in places),
        key=KEY.format(" ".join(f"{x} 0 .02 1 0 0 0" for _, x in places)) if "freejoint" in body else "",
    )


def stepped(model, steps=60, seed=None):
    data = mujoco.MjData(model)
    if seed is not None:
        data.qvel[:2] = np.random.default_rng(seed).uniform(-0.05, 0.05, 2)
    mujoco.mj_step(model, data, steps)
    return data


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(scene())


@pytest.mark.parametrize("shape", mjtactile.INDENTER_NAMES)
def test_readings_are_those_of_a_tactile_sensor(shape):
    spec = press_spec(shape, shift=(1.2e-3, -0.8e-3), rotate_deg=25)
    spec.activate_plugin("mjtactile.pad")
    plugin = spec.add_plugin(name="pad_plugin", plugin_name="mjtactile.pad", active=True)
    plugin.config = {"fidelity": "balanced"}
    sensor = spec.add_sensor(
        name="touch", type=mujoco.mjtSensor.mjSENS_PLUGIN, objtype=mujoco.mjtObj.mjOBJ_GEOM, objname="pad"
    )
    sensor.plugin, sensor.plugin.active = plugin, True
    sensor.plugin.name, sensor.plugin.plugin_name = "pad_plugin", "mjtactile.pad"  # older MuJoCo needs the names
    pressed = spec.compile()
    data = mujoco.MjData(pressed)
    mjtactile.press(pressed, data, mjtactile.force_vector(0.5, 10, 40))
    mujoco.mj_forward(pressed, data)
    expected = mjtactile.TactileSensor(pressed, fidelity="balanced").read(data)
    found = data.sensordata.reshape(expected.shape)
    # A body that stands still is read from a wrench basis, in half precision.
    assert np.linalg.norm(found - expected) <= 5e-4 * np.linalg.norm(expected)


PRESS = '<joint type="slide" axis="0 0 1"/>'
CURVED = [
    '<geom type="sphere" size=".005" mass=".03"/>',
    '<geom type="capsule" size=".003 .004" quat=".7071 0 .7071 0" mass=".03"/>',
    '<geom type="cylinder" size=".004 .005" quat=".7071 .7071 0 0" mass=".03"/>',
]


@pytest.mark.parametrize("geom", CURVED)
def test_curved_bodies_are_read_too(geom):
    body = f'<body name="box{{n}}" pos="{{x}} 0 .00501">{geom}{PRESS}</body>'
    # Older MuJoCo needs the flag to see that a cylinder lies on more than one point.
    text = scene(body=body).replace("<worldbody>", '<option><flag multiccd="enable"/></option><worldbody>')
    round_model = mujoco.MjModel.from_xml_string(text)
    data = stepped(round_model, 40)
    mujoco.mj_forward(round_model, data)
    expected = mjtactile.TactileSensor(round_model, geom="pad0", fidelity="fast").read(data)
    assert expected.max() > 0.0
    found = data.sensordata.reshape(expected.shape)
    assert np.linalg.norm(found - expected) <= 0.01 * np.linalg.norm(expected)


LARGE = '<body name="box{{n}}" pos="{} 0 .00501"><freejoint/><geom type="box" size=".02 .018 .005" mass=".05"/></body>'


@pytest.mark.parametrize("shift", [0.0, 0.003, 0.018])
def test_faces_over_the_sheets_edge(shift):
    large = mujoco.MjModel.from_xml_string(scene(body=LARGE.format(shift).replace("<freejoint/>", PRESS)))
    data = mujoco.MjData(large)
    mujoco.mj_step(large, data, 40)
    data.plugin_state[:] = 0.0
    mujoco.mj_forward(large, data)
    expected = mjtactile.TactileSensor(large, geom="pad0", fidelity="fast").read(data)
    assert expected.max() > 0.0
    # Here the part over the sheet has its first corner where the reference has it, so that the cells are the same.
    assert np.abs(data.sensordata.reshape(expected.shape) - expected).max() <= 1e-5 * expected.max()


def test_all_outputs_of_one_sensor():
    config = '<config key="output" value="wrench stress von_mises"/>'
    whole = mujoco.MjModel.from_xml_string(scene(config=config))
    data = stepped(whole)
    mujoco.mj_forward(whole, data)
    wrench, stress, readings = np.split(data.sensordata, [6, 6 + 6 * 676])
    assert wrench == pytest.approx(contact_wrench(whole, data, whole.geom("pad0").id), rel=1e-12, abs=1e-15)
    influence = mjtactile.influence_matrices(fidelity="fast")
    load = mjtactile.TactileSensor(whole, geom="pad0", influence=influence).load(data)
    assert load is not None
    expected = influence.stress(load).ravel()
    assert np.linalg.norm(stress - expected) <= 0.03 * np.linalg.norm(expected)
    assert readings.max() > 0.0


@pytest.mark.parametrize(("more", "presses"), [("", False), (" von_mises", True)])
def test_where_only_wrenches_are_wanted_nothing_is_pressed(more, presses):
    config = f'<config key="output" value="wrench{more}"/>'
    model = mujoco.MjModel.from_xml_string(scene(config=config))
    data = stepped(model)
    mujoco.mj_forward(model, data)
    assert data.sensordata[:6] == pytest.approx(contact_wrench(model, data, model.geom("pad0").id), rel=1e-12)
    assert data.sensordata[2] < 0.0
    # The state's first number tells poses that were pressed apart.
    assert (data.plugin_state[0] != 0.0) == presses


def test_without_contact_all_is_zero(model):
    data = mujoco.MjData(model)
    data.qpos[2] = 0.03
    mujoco.mj_forward(model, data)
    assert not data.sensordata.any()


def test_a_basis_reads_what_a_solution_reads(model):
    data = stepped(model, 300)
    assert data.plugin_state[1] == 8.0
    steady = data.sensordata.copy()
    data.plugin_state[:] = 0.0
    mujoco.mj_forward(model, data)
    assert np.abs(data.sensordata - steady).max() <= 1e-3 * steady.max()


def test_finite_differences_at_rest_follow_the_body_if_no_basis_is_used(model):
    """As docs/plugin.md says. One-sided and centred differences agree, but for the curvature over a step."""

    def by_position(centred, steady):
        data = stepped(model, 300)
        if not steady:
            data.plugin_state[:] = 0.0
        readings = np.zeros((model.nsensordata, 2 * model.nv))
        mujoco.mjd_transitionFD(model, data, 1e-6, centred, None, None, readings, None)
        return readings[:, :2]

    centred = by_position(1, steady=False)
    assert np.abs(by_position(0, steady=False) - centred).max() <= 0.01 * np.abs(centred).max()
    assert np.abs(by_position(0, steady=True) - centred).max() > 0.1 * np.abs(centred).max()


def test_too_large_a_pressure_warns_once():
    heavy = mujoco.MjModel.from_xml_string(scene().replace('mass=".05"', 'mass="20"'))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        data = stepped(heavy, 20)
    texts = [str(one.message) for one in caught if issubclass(one.category, mjtactile.ContactWarning)]
    assert sum("pad 'pad0', body 'box0': strains are no longer small" in text for text in texts) == 1
    assert len(set(texts)) == len(texts)
    assert data.sensordata.max() > 0.0


def test_what_rests_reads_as_in_a_simulation_that_has_read_nothing_before():
    """Under changes of the force from none over a rounding error to a few per cent, and between other contacts."""
    config = '<config key="output" value="von_mises carried range"/>'
    model = mujoco.MjModel.from_xml_string(scene(config=config))
    data, state = mujoco.MjData(model), mujoco.mjtState.mjSTATE_INTEGRATION
    kept, unlike = np.empty(mujoco.mj_stateSize(model, state)), 0
    mujoco.mj_step(model, data, 300)
    for step in range(60):
        change = (0.0, 1e-13, 0.0, 1e-3, 0.0, 0.03)[step % 6]
        data.xfrc_applied[1, :3] = change * np.array([0.3, 0.1, -1.0]) * model.body_mass[1] * 9.81
        if 20 <= step < 24:  # something else in between: a corner, and nothing
            data.xfrc_applied[1, 3 if step < 22 else 2] = 2e-3 if step < 22 else 1.0
        mujoco.mj_getState(model, data, kept, state)
        before = data.sensordata.copy()
        mujoco.mj_step(model, data)
        fresh = mujoco.MjData(model)
        mujoco.mj_setState(model, fresh, kept, state)
        mujoco.mj_step(model, fresh)
        assert fresh.sensordata.tobytes() == data.sensordata.tobytes(), step
        unlike += before.tobytes() != data.sensordata.tobytes()
    assert unlike > 10


def test_forward_twice_gives_the_same_bits(model):
    data = stepped(model, 300)
    mujoco.mj_forward(model, data)
    first = data.sensordata.copy()
    mujoco.mj_forward(model, data)
    assert (data.sensordata == first).all()


WRONG = {
    '<config key="pad" value="none"/>': ("default", "register_pad"),
    '<config key="fidelity" value="quick"/>': ("fast, balanced, precise, accurate",),
    '<config key="output" value="force"/>': ("von_mises, stress, wrench",),
    '<config key="output" value="wrench, range"/>': ("separated by spaces",),
    '<config key="law" value="hertz"/>': ("uniform, foundation, elastic",),
    '<config key="tangential" value="slip"/>': ("proportional, stick, coulomb",),
    '<config key="tilt" value="loose"/>': ("free, fixed",),
    '<config key="friction" value="much"/>': ("number",),
    '<config key="friction" value="-1"/>': ("not negative",),
    '<config key="visual" value="yes"/>': ("on, off",),
}


@pytest.mark.parametrize("config", WRONG)
def test_wrong_attributes_say_the_right_ones(config):
    text = scene(config=config)
    if "fidelity" in config:
        text = text.replace('<config key="fidelity" value="fast"/>', "")
    with pytest.raises(ValueError, match=r"mjtactile|friction") as caught:
        mujoco.MjModel.from_xml_string(text)
    assert all(part in str(caught.value) for part in WRONG[config])


def test_a_geom_that_is_no_pad_is_refused():
    size = 'type="box" size=".0075 .0075 .0025"'
    with pytest.raises(ValueError, match="14 x 15 x 5 mm, but the pad measures 15 x 15 x 5 mm"):
        mujoco.MjModel.from_xml_string(scene().replace(size, 'type="box" size=".007 .0075 .0025"'))
    with pytest.raises(ValueError, match="is not a box"):
        mujoco.MjModel.from_xml_string(scene().replace(size, 'type="sphere" size=".01"'))


@pytest.mark.skipif(not hasattr(mujoco.MjModel, "sensor_history"), reason="this MuJoCo keeps no earlier readings")
def test_a_history_that_mujoco_has_no_room_for_is_refused():
    spec = mujoco.MjSpec.from_string(scene())
    spec.sensors[0].nsample = 1
    spec.sensors[0].interval = (0.02, 0.0)
    with pytest.raises(ValueError, match="asks for a history"):
        spec.compile()


def test_pads_of_one_model_do_not_mix():
    two = mujoco.MjModel.from_xml_string(scene(pads=2))
    data = mujoco.MjData(two)
    data.qpos[9] = 0.03  # the second box is lifted
    mujoco.mj_step(two, data, 20)
    assert data.sensor("touch0").data.any()
    assert not data.sensor("touch1").data.any()


def test_several_models_and_simulations_share_one_table(model):
    other = mujoco.MjModel.from_xml_string(scene())
    first, second = stepped(model), stepped(other)
    assert (first.sensordata == second.sensordata).all()


def test_keyframes_and_resets(model):
    data = stepped(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert not data.sensordata.any()
    assert not data.plugin_state.any()
    mujoco.mj_resetData(model, data)
    mujoco.mj_step(model, data, 60)
    assert (data.sensordata == stepped(model).sensordata).all()


def test_copies_go_on_alike(model, tmp_path):
    data = stepped(model)
    copies = [copy.copy(data), copy.deepcopy(data), pickle.loads(pickle.dumps(data))]
    if hasattr(mujoco, "mj_copyData"):  # not in older bindings
        copies.append(mujoco.MjData(model))
        mujoco.mj_copyData(copies[-1], model, data)
    mujoco.mj_step(model, data, 30)
    for one in copies:
        mujoco.mj_step(model, one, 30)
        assert (one.sensordata == data.sensordata).all()


def test_saved_and_read_again(model, tmp_path):
    expected = stepped(model).sensordata
    spec = mujoco.MjSpec.from_string(scene())
    spec.compile()
    mujoco.mj_saveModel(model, str(tmp_path / "scene.mjb"))
    again = [
        mujoco.MjModel.from_xml_string(spec.to_xml()),
        getattr(mujoco.MjModel, "from_binary_path")(str(tmp_path / "scene.mjb")),  # noqa: B009 (no stub)
        pickle.loads(pickle.dumps(model)),
        copy.deepcopy(model),
    ]
    assert all((stepped(one).sensordata == expected).all() for one in again)


def test_threads_read_the_same_bits(model):
    expected = [stepped(model, 200, seed).sensordata for seed in range(4)]
    found = [None] * 4

    def run(seed):
        found[seed] = stepped(model, 200, seed).sensordata

    threads = [threading.Thread(target=run, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((one == other).all() for one, other in zip(found, expected, strict=True))


BALL = '<body name="box{n}" pos="{x} 0 .00501"><freejoint/><geom type="sphere" size=".005" mass=".05"/></body>'
needs_pool = pytest.mark.skipif(not hasattr(mujoco, "mju_threadpool"), reason="this MuJoCo has no pool of threads")


def rolling(model, workers):
    """A simulation with a pool of threads, in which each of the model's balls rolls on its pad in its own way."""
    data = mujoco.MjData(model)
    mujoco.mju_threadpool(data, workers)
    data.qvel[:] = np.random.default_rng(2).uniform(-0.05, 0.05, model.nv)
    return data


@needs_pool
@pytest.mark.parametrize("workers", [1, 2])
def test_a_pool_of_threads_reads_the_same_bits(workers):
    model = mujoco.MjModel.from_xml_string(scene(pads=4, body=BALL))
    alone, together = mujoco.MjData(model), rolling(model, workers)
    alone.qvel[:] = together.qvel
    read = 0
    for step in range(300):
        if step == 150:  # the pool is given another size, and taken away
            mujoco.mju_threadpool(together, 3 - workers)
        if step == 250:
            mujoco.mju_threadpool(together, 0)
        for data in (alone, together):
            mujoco.mj_step(model, data)
        assert (together.sensordata == alone.sensordata).all()
        read += together.sensordata.any()
    assert read > 100


def worker_seconds(model):
    """Processor time of a pool's one thread over 300 steps [s]."""
    threads = Path("/proc/self/task")
    before = set(threads.iterdir())
    data = rolling(model, 1)
    (worker,) = set(threads.iterdir()) - before
    for _ in range(300):
        mujoco.mj_step(model, data)
    return 1e-9 * float((worker / "schedstat").read_text().split()[0])


@needs_pool
@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="needs Linux's times of threads")
def test_a_pool_of_threads_presses_pads():
    """The most of some tries: on a busy machine its threads take turns."""
    model, ratios = mujoco.MjModel.from_xml_string(scene(pads=4, body=BALL)), []
    for _ in range(4):
        model.opt.disableflags = 0
        with_pads = worker_seconds(model)
        model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_SENSOR
        ratios.append(with_pads / worker_seconds(model))
    assert max(ratios) > 6  # 20; without tasks of pads it would be 2


def initial_states(model, count):
    data = mujoco.MjData(model)
    spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
    states = np.empty((count, mujoco.mj_stateSize(model, spec)))
    for seed in range(count):
        mujoco.mj_resetData(model, data)
        data.qvel[:2] = np.random.default_rng(seed).uniform(-0.05, 0.05, 2)
        mujoco.mj_getState(model, data, states[seed], spec)
    return states


def test_rollouts_read_what_a_loop_reads(model):
    states = initial_states(model, 6)
    _, found = mujoco.rollout.rollout(model, [mujoco.MjData(model) for _ in range(2)], states, nstep=80)
    expected = [stepped(model, 80, seed).sensordata for seed in range(6)]
    assert (np.asarray(found)[:, -1] == np.array(expected)).all()


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("persistent", [False, True])
def test_batches_read_what_a_loop_reads(model, threads, persistent):
    module = find_spec("mujoco.batch")
    if module is None or module.origin is None or Path(module.origin).parent != Path(mujoco.__file__).parent:
        pytest.skip("this MuJoCo has no batches")
    batch = import_module("mujoco.batch").Batch(model, nsim=6, nthread=threads, persistent=persistent)
    for seed in range(6):
        batch.qvel[seed, :2] = np.random.default_rng(seed).uniform(-0.05, 0.05, 2)
    readings = batch.bind("sensordata")
    for _ in range(80):
        batch.step()
    expected = [stepped(model, 80, seed).sensordata for seed in range(6)]
    assert (readings == np.array(expected)).all()


def test_a_heat_map_is_drawn_when_asked_for():
    for visual, tiles in (("on", 169), ("off", 0)):
        shown = mujoco.MjModel.from_xml_string(scene(config=f'<config key="visual" value="{visual}"/>'))
        data = stepped(shown)
        drawn = mujoco.MjvScene(shown, maxgeom=1000)
        plain = mujoco.MjModel.from_xml_string(scene().replace(PLUGIN, "").split("<sensor>")[0] + "</mujoco>")
        bare = mujoco.MjvScene(plain, maxgeom=1000)
        options, camera = mujoco.MjvOption(), mujoco.MjvCamera()
        for one, at, to in ((shown, data, drawn), (plain, stepped(plain), bare)):
            mujoco.mjv_updateScene(one, at, options, None, camera, mujoco.mjtCatBit.mjCAT_ALL, to)
        assert drawn.ngeom - bare.ngeom == tiles


def test_tiles_of_a_heat_map_stand_for_no_object_in_segmentations():
    """Whatever an earlier scene has left in the places where they are written."""
    shown = mujoco.MjModel.from_xml_string(scene(config='<config key="visual" value="on"/>'))
    data, scenery = stepped(shown), mujoco.MjvScene(shown, maxgeom=1000)
    for one in scenery.geoms:
        one.segid = one.objid = one.objtype = one.category = one.transparent = 2
    mujoco.mjv_updateScene(
        shown, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, scenery
    )
    tiles = [one for one in scenery.geoms[: scenery.ngeom] if one.rgba[3] == np.float32(0.75)]
    assert len(tiles) == 169
    decor, unknown = int(mujoco.mjtCatBit.mjCAT_DECOR), int(mujoco.mjtObj.mjOBJ_UNKNOWN)
    assert {(one.segid, one.objid, one.objtype, one.category, one.transparent) for one in tiles} == {
        (-1, -1, unknown, decor, 0)
    }


@pytest.mark.parametrize("output", ["von_mises", "wrench stress von_mises", "wrench"])
def test_a_copy_shows_the_readings_of_its_original(output):
    """Viewers draw a copy of mjData in which no sensor computes anything."""
    config = f'<config key="visual" value="on"/><config key="output" value="{output}"/>'
    shown = mujoco.MjModel.from_xml_string(scene(config=config))
    data, scenery = stepped(shown), mujoco.MjvScene(shown, maxgeom=1000)

    def drawn(state):
        options, camera = mujoco.MjvOption(), mujoco.MjvCamera()
        mujoco.mjv_updateScene(shown, state, options, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scenery)
        return [(one.pos.tolist(), one.rgba.tolist()) for one in scenery.geoms[: scenery.ngeom]]

    original = drawn(data)
    assert len(original) > 169
    assert drawn(copy.copy(data)) == original
    again = mujoco.MjData(shown)
    assert len(drawn(again)) == len(original) - 169
    if hasattr(mujoco, "mj_copyData"):
        mujoco.mj_copyData(again, shown, data)
        assert drawn(again) == original


def test_steps_without_sensors_leave_the_plugins_state_alone(model):
    data = stepped(model)
    kept = data.plugin_state.copy()
    assert kept.any()
    for start in (kept, np.zeros_like(kept)):
        data.plugin_state[:] = start
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        mujoco.mj_step(model, data, 5)
        model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        np.testing.assert_array_equal(data.plugin_state, start)


def test_no_output_is_a_number_once_the_simulation_has_diverged():
    config = '<config key="output" value="von_mises wrench carried range"/>'
    flags = '<option><flag autoreset="disable"/></option><worldbody>'
    diverges = mujoco.MjModel.from_xml_string(scene(config=config).replace("<worldbody>", flags))
    data = stepped(diverges)
    data.qvel[0] = np.nan
    with pytest.warns(mjtactile.ContactWarning):
        mujoco.mj_forward(diverges, data)
    assert np.isnan(data.sensordata).all()


def test_absurd_forces_saturate_readings(model):
    read = []
    for force in (1e10, 1e30):
        data = stepped(model)
        data.xfrc_applied[model.body("box0").id, 2] = -force
        with pytest.warns(mjtactile.ContactWarning):
            mujoco.mj_forward(model, data)
        read.append(data.sensordata.copy())
    assert read[0].max() > 1e6
    np.testing.assert_allclose(read[1], read[0], rtol=0.1)


@pytest.mark.parametrize(
    "order",
    [
        "import mjtactile, mujoco",
        "import mujoco, mjtactile",
        "import mjtactile, importlib.util; importlib.util.find_spec('mujoco'); import mujoco",
        "from mjtactile.plugin.registration import ensure_registered; ensure_registered(); import mujoco",
    ],
)
def test_registration_in_either_order_of_imports(order):
    code = f"{order}; mujoco.MjModel.from_xml_string({scene()!r}); print('compiled')"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout.strip() == "compiled"


def test_a_package_whose_existence_is_asked_first_is_still_waited_for(monkeypatch, tmp_path):
    from mjtactile.plugin.import_hook import after_import

    (tmp_path / "waited_for.py").write_text("import broken_first\n")
    monkeypatch.syspath_prepend(tmp_path)
    called, before = [], list(sys.meta_path)
    after_import("waited_for", lambda: called.append(sys.modules["waited_for"]))
    try:
        assert find_spec("waited_for") is not None
        with pytest.raises(ModuleNotFoundError, match="broken_first"):
            import_module("waited_for")
        (tmp_path / "broken_first.py").touch()
        invalidate_caches()
        assert find_spec("waited_for") is not None
        assert not called
        assert [import_module("waited_for")] == called
        assert sys.meta_path == before
    finally:
        sys.meta_path[:] = before
        sys.modules.pop("waited_for", None)


def test_a_loader_of_several_modules_is_wrapped_once_and_acts_for_one(monkeypatch):
    from mjtactile.plugin.import_hook import after_import

    class Finder(Loader):
        def find_spec(self, fullname, path=None, target=None):
            return ModuleSpec(fullname, self) if fullname in ("shared_a", "shared_b") else None

        def exec_module(self, module):
            vars(module)["executed"] = vars(module).get("executed", 0) + 1

    finder, called = Finder(), []
    monkeypatch.setattr(sys, "meta_path", [finder, *sys.meta_path])
    after_import("shared_a", lambda: called.append(1))
    try:
        find_spec("shared_a")
        wrapped = finder.exec_module
        find_spec("shared_a")
        assert finder.exec_module is wrapped
        assert import_module("shared_b").executed == 1
        assert not called
        assert import_module("shared_a").executed == 1
        assert called == [1]
    finally:
        for name in ("shared_a", "shared_b"):
            sys.modules.pop(name, None)


def test_a_mujoco_that_describes_itself_wrongly_is_refused(monkeypatch):
    from mujoco.introspect import structs

    model_fields = list(structs.STRUCTS["mjModel"].fields)
    shorter = copy.copy(structs.STRUCTS["mjModel"])
    object.__setattr__(shorter, "fields", tuple(model_fields[1:]))
    monkeypatch.setitem(structs.STRUCTS, "mjModel", shorter)
    with pytest.raises(mjtactile.NativeError, match=r"tested with MuJoCo 3\.3\.7 to 4\.0"):
        mujoco_layout()


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is looked up in /proc")
def test_many_steps_take_no_more_memory(model):
    def memory():
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    data = stepped(model, 20_000)
    before, bases = memory(), basis_bytes()
    mujoco.mj_step(model, data, 20_000)
    assert memory() - before <= 2e6
    assert basis_bytes() - bases <= 2e6
