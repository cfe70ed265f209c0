"""Pads and bodies that sleep, between which MuJoCo has no contacts."""

import timeit
from functools import partial

import mujoco
import numpy as np
import pytest

import mjtactile

pytestmark = [
    pytest.mark.skipif(not hasattr(mujoco.MjData, "body_awake"), reason="this MuJoCo lets no body sleep"),
    pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning"),
]
PAD = '<geom name="pad" type="box" size=".0075 .0075 .0025" {}/>'
#: Bodies of which one carries the pad and one moves: which of them sleeps, and where they touch.
SCENES = {
    "a body on a pad": PAD.format('pos="0 0 -.0025"')
    + '<body pos="0 0 .005"><freejoint/><geom type="box" size=".004 .004 .005" mass=".1"/></body>',
    "a body on a pad's side": PAD.format('euler="0 90 0"')
    + '<body pos="0 0 .0125"><freejoint/><geom type="box" size=".002 .002 .005" mass=".1"/></body>',
    "a pad on a peg": '<geom type="box" size=".004 .004 .005" pos="0 0 -.005"/><body pos="0 0 .0025"><freejoint/>'
    + PAD.format('euler="180 0 0" mass=".1"')
    + "</body>",
}


def asleep(scene: str, output: str) -> tuple[mujoco.MjModel, mujoco.MjData, np.ndarray]:
    """A scene in which everything has just fallen asleep, and what the sensor read before."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep=".002" cone="elliptic"><flag sleep="enable"/></option>
      <extension><plugin plugin="mjtactile.pad"/></extension>
      <worldbody>{SCENES[scene]}</worldbody>
      <sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
        <config key="fidelity" value="fast"/><config key="output" value="{output}"/></plugin></sensor></mujoco>""")
    data = mujoco.MjData(model)
    for _ in range(3000):
        awake = data.sensor("touch").data.copy()
        mujoco.mj_step(model, data)
        if data.ntree_awake == 0:
            return model, data, awake
    raise AssertionError("nothing fell asleep")


@pytest.mark.parametrize("output", ["wrench", "wrench von_mises"])
@pytest.mark.parametrize("scene", SCENES)
def test_what_sleeps_is_read_as_before(scene, output):
    model, data, awake = asleep(scene, output)
    assert np.linalg.norm(awake[:3]) == pytest.approx(0.981, rel=1e-2)
    if "von_mises" in output and "side" not in scene:
        assert awake[6:].max() > 1e3
    mujoco.mj_step(model, data, 100)
    assert data.ntree_awake == 0
    # The body still settled a little in its last step.
    found = data.sensor("touch").data
    np.testing.assert_allclose(found[:6], awake[:6], atol=1e-2 * 0.981)
    np.testing.assert_allclose(found[6:], awake[6:], atol=1e-2 * awake.max())


def test_a_sensor_without_stress_forgets_contacts_on_reset():
    model, data, _ = asleep("a body on a pad", "wrench")
    mujoco.mj_step(model, data)
    assert data.plugin_state.any()
    data.plugin_state[:] = 0.0
    mujoco.mj_step(model, data)
    np.testing.assert_array_equal(data.sensor("touch").data, np.zeros(6))


def test_a_body_put_elsewhere_while_sensors_were_off_is_not_felt():
    model, data, awake = asleep("a body on a pad", "wrench von_mises")
    assert awake[6:].max() > 1e3
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    data.qpos[:3] = 0.3, 0.0, 0.05
    model.opt.gravity[:] = 0.0
    mujoco.mj_step(model, data, 2000)
    assert data.ntree_awake == 0
    model.opt.disableflags = 0
    mujoco.mj_step(model, data, 2)
    np.testing.assert_array_equal(data.sensor("touch").data, 0.0)


def test_what_sleeps_is_felt_again_once_sensors_are_back_on():
    model, data, awake = asleep("a body on a pad", "wrench von_mises")
    for flags in (int(mujoco.mjtDisableBit.mjDSBL_SENSOR), 0):
        model.opt.disableflags = flags
        mujoco.mj_step(model, data, 50)
    np.testing.assert_allclose(data.sensor("touch").data, awake, atol=1e-2 * awake.max())


def test_a_tactile_sensor_feels_no_body_that_sleeps_elsewhere():
    model, _, _ = asleep("a body on a pad", "wrench")
    there, elsewhere = mujoco.MjData(model), mujoco.MjData(model)
    sensor = mjtactile.TactileSensor(model, geom="pad", fidelity="fast")
    mujoco.mj_step(model, there, 12)
    assert sensor.read(there).max() > 1e3
    elsewhere.qpos[:3] = 0.3, 0.0, 0.05
    model.opt.gravity[:] = 0.0
    mujoco.mj_step(model, elsewhere, 2000)
    assert elsewhere.ntree_awake == 0
    assert sensor.read(elsewhere).max() == 0.0
    assert sensor.load(elsewhere) is None


def test_steps_do_not_become_slower_while_a_body_sleeps():
    """Against another that has just fallen asleep, in turn and by least times: what else runs only adds."""
    for_long, just_now = (asleep("a body on a pad", "wrench von_mises")[:2] for _ in range(2))
    mujoco.mj_step(*for_long, 10_000)
    took = {"for long": [], "just now": []}
    for _ in range(50):
        for name, simulation in zip(took, (for_long, just_now), strict=True):
            took[name].append(timeit.timeit(partial(mujoco.mj_step, *simulation, 50), number=1))
    assert min(took["for long"]) < 1.5 * min(took["just now"])
