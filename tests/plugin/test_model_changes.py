"""Models whose numbers change while they run, as domain randomisation does, read as models made with these numbers."""

import mujoco
import numpy as np
import pytest
from mujoco import rollout

import mjtactile
from mjtactile.errors import ContactWarning

RNG = np.random.default_rng(5)
#: Half sizes [m] of a body that stands on the pad's rim; its lower side stays where it is.
SIZES = [(0.003, width, 0.0025) for width in RNG.uniform(1e-3, 4e-3, 10)]
#: Changes of size in one simulation, enough for new geometry to take the memory of freed one many times.
CHANGES = 400


def scene(kind: str) -> str:
    return f"""<mujoco><extension><plugin plugin="mjtactile.pad"/></extension><option gravity="0 0 0"/><worldbody>
      <geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025" priority="10" solref=".005 1"/>
      <body pos=".006 0 .00247"><freejoint/><geom name="body" type="{kind}" size=".003 .0025 .0025" mass=".05"/></body>
      </worldbody><sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
        <config key="fidelity" value="fast"/></plugin></sensor></mujoco>"""


def read(model, data):
    data.qacc_warmstart[:] = 0.0
    mujoco.mj_forward(model, data)
    return data.sensor("touch").data.copy()


def resize(model, kind, size):
    radius, _, height = size
    model.geom("body").size = size if kind == "box" else (size[1], radius, 0.0)
    model.geom("body").pos = (0.0, 0.0, height - 0.0025) if kind == "box" else (0.0, 0.0, radius - 0.0025)


@pytest.mark.parametrize("kind", ["box", "cylinder"])
def test_bodies_over_the_rim_that_change_size_read_as_bodies_made_so(kind):
    fresh = []
    for size in SIZES:
        model = mujoco.MjModel.from_xml_string(scene(kind))
        resize(model, kind, size)
        fresh.append(read(model, mujoco.MjData(model)))
    assert min(one.max() for one in fresh) > 1e3
    model = mujoco.MjModel.from_xml_string(scene(kind))
    data = mujoco.MjData(model)
    for number in RNG.integers(len(SIZES), size=CHANGES):
        resize(model, kind, SIZES[number])
        np.testing.assert_array_equal(read(model, data), fresh[number])


def test_a_pad_that_changes_its_size_is_told_of_once_and_counted():
    model = mujoco.MjModel.from_xml_string(scene("box"))
    data = mujoco.MjData(model)
    read(model, data)
    assert mjtactile.plugin_health(model, data, "touch").resized == 0
    model.geom("pad").size = (0.006, 0.0075, 0.0025)
    with pytest.warns(mjtactile.ContactWarning, match="its geom has changed its size"):
        read(model, data)
    for _ in range(2):  # a second warning would be an error
        read(model, data)
    assert mjtactile.plugin_health(model, data, "touch").resized == 3
    model.geom("pad").size = (0.0075, 0.0075, 0.0025)
    read(model, data)
    assert mjtactile.plugin_health(model, data, "touch").resized == 3


def pressed_by_a_mesh(
    width: float, *, first: int = 0, fidelity: str = "fast", law: str | None = None
) -> mujoco.MjModel:
    """A bar [m] of a width lies across the pad; `first` sensors stand before the pad's."""
    spec = mujoco.MjSpec.from_string("""<mujoco><option timestep=".001" integrator="implicitfast" cone="elliptic"/>
      <worldbody><body name="finger"/></worldbody></mujoco>""")
    corners = [(x, y, z) for z in (-0.006, 0.006) for y in (-0.003, 0.003) for x in (-width / 2, width / 2)]
    spec.add_mesh(name="bar", uservert=np.ravel(corners).tolist())
    body = spec.worldbody.add_body(name="bar", pos=[0.0, 0.0, 0.006])
    body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0])
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="bar", mass=0.05)
    for number in range(2):
        if number == first:
            mjtactile.attach_pad(spec, body="finger", name="ff", fidelity=fidelity, law=law)
        spec.add_sensor(name=f"clock {number}", type=mujoco.mjtSensor.mjSENS_CLOCK)
    return spec.compile()


def alone(model: mujoco.MjModel) -> np.ndarray:
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 50)
    return data.sensordata.copy()


def rolled_out(models: list[mujoco.MjModel]) -> np.ndarray:
    """The last sensor data of each model, in simulations that share one MjData."""
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    data = mujoco.MjData(models[0])
    start = np.empty(mujoco.mj_stateSize(models[0], kind))
    mujoco.mj_getState(models[0], data, start, kind)
    return rollout.rollout(models, data, np.tile(start, (len(models), 1)), nstep=50)[1][:, -1]


def test_a_rollout_of_models_with_different_meshes_reads_each_with_its_own():
    models = [pressed_by_a_mesh(width) for width in (8e-3, 7e-3, 8e-3)]
    expected = [alone(model) for model in models]
    assert abs(expected[0] - expected[1]).max() > 0.05 * expected[0].max()
    np.testing.assert_array_equal(rolled_out(models), expected)


def test_models_that_take_the_memory_of_freed_ones_read_with_their_own_meshes():
    expected = {width: alone(pressed_by_a_mesh(width)) for width in (8e-3, 7e-3)}
    model = pressed_by_a_mesh(8e-3)
    data = mujoco.MjData(model)
    for width in (8e-3, 7e-3, 8e-3):
        other = pressed_by_a_mesh(width)
        for name in dir(model):  # as if it had been made at the address of the one before
            if isinstance(array := getattr(model, name), np.ndarray) and array.flags.writeable:
                array[...] = getattr(other, name)
        mujoco.mj_resetData(model, data)
        mujoco.mj_step(model, data, 50)
        np.testing.assert_array_equal(data.sensordata, expected[width])


@pytest.mark.skipif(not hasattr(mujoco, "mju_threadpool"), reason="this MuJoCo has no pool of threads")
def test_a_model_with_fewer_sensors_is_told_of_where_threads_press():
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="finger"/></worldbody></mujoco>')
    mjtactile.attach_pad(spec, body="finger", name="first", fidelity="fast")
    one = spec.compile()
    mjtactile.attach_pad(spec, body="finger", name="second", pos=(0.1, 0.0, 0.0), fidelity="fast")
    two = spec.compile()
    data = mujoco.MjData(two)
    mujoco.mju_threadpool(data, 2)
    with pytest.warns(ContactWarning, match="pad 'second_pad': its readings are NaN"):
        mujoco.mj_forward(one, data)
    assert np.isfinite(data.sensordata[: one.nsensordata]).all()


@pytest.mark.parametrize("other", [{"law": "uniform"}, {"fidelity": "balanced"}, {"first": 1}])
def test_a_rollout_of_models_whose_sensors_differ_is_no_number_and_says_so(other):
    models = [pressed_by_a_mesh(8e-3), pressed_by_a_mesh(8e-3, **other), pressed_by_a_mesh(8e-3)]
    with pytest.warns(ContactWarning, match="pad 'ff_pad': its readings are NaN.*an MjData of each such model"):
        found = rolled_out(models)
    np.testing.assert_array_equal(found[[0, 2]], [alone(models[0])] * 2)
    clocks = [models[1].sensor(f"clock {number}").adr[0] for number in range(2)]
    pad = np.delete(np.arange(models[1].nsensordata), clocks)
    assert np.isnan(found[1][pad]).all()
    assert found[1][clocks] == pytest.approx(0.049)  # the time when the last step began [s]
