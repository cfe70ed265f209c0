"""What a pad's readings came to: counts of a simulation, and the switch of the warnings."""

import _thread
import threading
import warnings
from collections import Counter
from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from shapely.geometry import box

import mjtactile
from mjtactile.errors import ContactWarning, SceneError, contacts_are_quiet, quiet_contacts
from mjtactile.plugin import health

SCENE = """<mujoco><option timestep="0.001"/><worldbody><body name="finger"/>
  <body name="anvil" pos="0 0 0.0049"><freejoint/><geom type="box" size="0.004 0.003 0.005" mass="{mass}"/></body>
</worldbody><sensor><clock name="clock"/></sensor></mujoco>"""


def pressed(mass: float, steps: int = 20, *, name: str = "ff") -> tuple[mujoco.MjModel, mujoco.MjData]:
    spec = mujoco.MjSpec.from_string(SCENE.format(mass=mass))
    mjtactile.attach_pad(spec, body="finger", name=name, fidelity="fast")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, steps)
    return model, data


def in_a_thread(work: Callable[[], object]) -> None:
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()


def test_health_counts_readings_with_contact_of_one_simulation():
    model, data = pressed(0.02)
    found = mjtactile.plugin_health(model, data, "ff")
    assert found.readings == 20
    assert (found.beyond_range, found.not_carried, found.approximated, found.refused) == (0, 0, 0, 0)
    assert found.slowest > 0.0
    assert mjtactile.plugin_health(model, mujoco.MjData(model), "ff").readings == 0


PUSHED = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody><body name="finger"/>
  <body name="anvil" pos="0 0 0.0001" gravcomp="1"><joint name="slide" type="slide" axis="1 0.2 0"/>
  <joint name="press" type="slide" axis="0 0 1" damping="1"/>{geom}</body></worldbody>
<actuator><motor joint="press"/><velocity joint="slide" kv="200"/></actuator></mujoco>"""
#: Contacts of which few cells are alike: slivers of them at an edge, or many at a round rim.
ROUGH = {
    "box on an edge": '<geom type="box" size="0.004 0.004 0.0025" pos="0 0 0.00264" euler="0 2 0" mass="0.015"/>',
    "box on a corner": '<geom type="box" size="0.004 0.003 0.0025" pos="0 0 0.0028" euler="3 2 20" mass="0.015"/>',
    "ball": '<geom type="sphere" size="0.005" pos="0 0 0.005" mass="0.015"/>',
    "cylinder on its rim": '<geom type="cylinder" size="0.004 0.003" pos="0 0 0.0032" euler="4 0 0" mass="0.015"/>',
}


@pytest.mark.parametrize("fidelity", ["fast", "balanced"])
@pytest.mark.parametrize("name", ROUGH)
def test_shear_that_sticks_is_found_on_every_cell(name, fidelity):
    spec = mujoco.MjSpec.from_string(PUSHED.format(geom=ROUGH[name]))
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity=fidelity, tangential="stick")
    model = spec.compile()
    data = mujoco.MjData(model)
    for way in (1, -1, 1, -1):
        data.ctrl[:] = -1.0, way * 0.01
        mujoco.mj_step(model, data, 100)
    found = mjtactile.plugin_health(model, data, "ff")
    assert found.readings >= 350
    assert (found.approximated, found.refused) == (0, 0)


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("enabled", [True, False])
def test_contacts_beyond_small_strains_are_counted_and_warned_of_once_if_wanted(enabled, again):
    """`again` is another simulation with equal names."""
    mjtactile.set_warnings(enabled)
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            model, data = pressed(100.0, name="warned")
    finally:
        mjtactile.set_warnings(True)
    assert mjtactile.plugin_health(model, data, "warned").beyond_range > 1
    strains = [one for one in told if issubclass(one.category, ContactWarning) and "'anvil'" in str(one.message)]
    assert len([one for one in strains if "no longer small" in str(one.message)]) == int(enabled)
    assert {one.filename for one in strains} <= {__file__}


@pytest.mark.parametrize("shown", ["default", "always"])
def test_equal_warnings_of_further_simulations_are_issued_where_the_filters_are_others(shown):
    """An environment that makes a simulation for each episode warns once in a run, and each test hears of it."""
    for _ in range(2):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter(shown)
            for _ in range(3):
                pressed(100.0, name="repeated")
        assert len([one for one in told if "no longer small" in str(one.message)]) == 1


def test_while_contacts_are_to_be_quiet_nothing_is_told_or_counted():
    counted = sum(health._warned.values())
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        filters = warnings.filters
        with quiet_contacts():
            assert warnings.filters is filters  # all threads have the same ones
            model, data = pressed(100.0, name="silent")
            influence = mjtactile.influence_matrices(fidelity="fast")
            face = mjtactile.Footprint.from_outline(box(-1e-3, -1e-3, 1e-3, 1e-3), influence.surface)
            mjtactile.contact_load(influence, face, (0, 0, -100))
            sensor = mjtactile.TactileSensor(model, geom="silent_pad", fidelity="fast")
            sensor.read(data)
        in_a_thread(lambda: mujoco.mj_step(model, data, 3))
        mujoco.mj_step(model, data)
    assert not told
    assert sum(health._warned.values()) == counted
    with pytest.warns(ContactWarning, match="silent_pad"):
        mjtactile.TactileSensor(model, geom="silent_pad", fidelity="fast").read(data)


def test_threads_that_are_not_pythons_are_quiet_with_whoever_started_them():
    """As those of mujoco.batch, on which a batch's data are made; other threads of Python are not."""
    seen: list[bool] = []
    with quiet_contacts(), quiet_contacts():
        in_a_thread(lambda: seen.append(contacts_are_quiet()))
        assert seen == [False]
        done = threading.Event()
        _thread.start_new_thread(lambda: (seen.append(contacts_are_quiet()), done.set()), ())
        assert done.wait(10.0)
        assert seen == [False, True]
    assert not contacts_are_quiet()


def test_a_simulation_that_ends_in_a_thread_is_told_of():
    """The main thread waits meanwhile, and delivers warnings later."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        in_a_thread(lambda: pressed(100.0, name="ended"))
    assert [one for one in told if "ended" in str(one.message) and "no longer small" in str(one.message)]


def test_a_reading_in_a_thread_leaves_notes_of_other_simulations_to_the_main_thread(capfd):
    good, good_data = pressed(0.02)
    bad, bad_data = pressed(96.0, steps=0, name="other")
    sensor = mjtactile.TactileSensor(good, geom="ff_pad", fidelity="fast")
    read = []

    def work() -> None:
        mujoco.mj_step(bad, bad_data, 20)
        read.append(sensor.read(good_data).max())

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        in_a_thread(work)
    assert read[0] > 0.0
    assert "ContactWarning: pad 'other_pad'" in capfd.readouterr().err


def test_a_reading_that_is_asked_for_raises_its_warning_if_warnings_are_errors():
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        model, data = pressed(100.0)
        mjtactile.TactileSensor(model, geom="ff_pad", fidelity="fast").read(data)
        warnings.simplefilter("error")
        for _ in range(2):
            with pytest.raises(ContactWarning, match="no longer small"):
                mjtactile.TactileSensor(model, geom="ff_pad", fidelity="fast").read(data)


@pytest.mark.parametrize("output", ["von_mises", "wrench"])
def test_a_pad_that_faces_the_wrong_way_is_told(output):
    spec = mujoco.MjSpec.from_string(SCENE.format(mass=0.05))
    mjtactile.attach_pad(
        spec, body="finger", name="ff", fidelity="fast", output=output, pos=(0, 0, -0.005), quat=(0, 1, 0, 0)
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    with pytest.warns(ContactWarning, match="body 'anvil': it presses on the pad's back.*[+]z side"):
        mujoco.mj_step(model, data, 20)
    assert mjtactile.plugin_health(model, data, "ff").behind >= 20
    if output == "von_mises":
        assert not data.sensor("ff").data.any()


def test_warnings_as_errors_leave_nothing_to_be_told_of_the_next_model(capfd):
    """Two bodies press too hard, so there are two notes; the first is an error, and the second is told with it."""
    second = '<body name="second" pos="0 0.0055 0.0049"><freejoint/><geom type="box" size=".002 .002 .005" mass="99"/>'
    spec = mujoco.MjSpec.from_string(SCENE.format(mass=98).replace("</worldbody>", f"{second}</body></worldbody>"))
    mjtactile.attach_pad(spec, body="finger", name="earlier", fidelity="fast")
    model = spec.compile()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, mujoco.MjData(model), 20)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        pressed(97.0)
    assert not [one for one in told if "earlier" in str(one.message)]
    printed = capfd.readouterr().err
    assert all(f"ContactWarning: pad 'earlier_pad', body '{name}'" in printed for name in ("anvil", "second"))


def test_shear_counts_towards_the_range_of_small_strains():
    """A flat plate lies on the pad, and gravity leans so that friction carries two thirds of the weight."""
    spec = mujoco.MjSpec.from_string(SCENE.format(mass=1).replace("0.0049", "0.0009").replace("0.005", "0.001"))
    spec.option.gravity = (4, 0, -6)
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast", output="range carried")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 40)
    load, force = data.sensor("ff").data[0], data.sensor("ff").data[1:4]
    assert force[0] == pytest.approx(4.0, rel=0.02)
    assert force[2] == pytest.approx(-6.0, rel=0.02)
    area, limit = 0.008 * 0.006, 0.1 * 3e6
    expected = np.sqrt(force[2] ** 2 + 3 * force[0] ** 2) / area / limit
    assert load == pytest.approx(expected, rel=0.03)


@pytest.mark.filterwarnings("ignore::mjtactile.errors.ContactWarning")
def test_taxels_saturate_where_bodies_press_on_one_place():
    """Three anvils stand in each other, and each presses with as much as the pad bears."""
    anvil = '<body pos="0 0 0.0049"><freejoint/><geom type="box" size=".004 .003 .005" mass="99" contype="2"/></body>'
    scene = (
        SCENE.format(mass=98)
        .replace("</worldbody>", f"{anvil}{anvil}</worldbody>")
        .replace("mass", 'conaffinity="0" mass')
    )
    spec = mujoco.MjSpec.from_string(scene)
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast")
    spec.geom("ff_pad").conaffinity = 3
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 20)
    assert len(set(data.contact.geom1)) == 1
    assert len(set(data.contact.geom2)) == 3
    readings = data.sensor("ff").data
    assert readings.max() == 1.2 * 3e6
    assert mjtactile.plugin_health(model, data, "ff").beyond_range > 0


@pytest.mark.parametrize("name", ["clock", "absent"])
def test_other_sensors_have_no_health(name):
    model, data = pressed(0.02, steps=1)
    with pytest.raises(SceneError, match=r"Available: \['ff'\]"):
        mjtactile.plugin_health(model, data, name)


def test_simulations_of_other_models_have_no_health():
    model, _ = pressed(0.02, steps=1)
    other = mujoco.MjModel.from_xml_string("<mujoco/>")
    with pytest.raises(SceneError, match="made from this model"):
        mjtactile.plugin_health(model, mujoco.MjData(other), "ff")


def test_a_warning_that_came_up_once_more_came_up_one_more_time(monkeypatch, capfd):
    for again, said in ((1, "1 more time in"), (2, "2 more times in")):
        monkeypatch.setattr(health, "_warned", Counter({"a warning": 1 + again}))
        health._tell_counts()
        assert said in capfd.readouterr().err
