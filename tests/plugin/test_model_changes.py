"""Models whose numbers change while they run, as domain randomisation does, read as models made with these numbers."""

import mujoco
import numpy as np
import pytest

import mjtactile

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
