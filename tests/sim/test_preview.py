"""A picture of where a pad stands: the pad in orange, its axes as arrows, nothing simulated."""

from __future__ import annotations

import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest

import mjtactile
from mjtactile.errors import OutputError, SceneError
from mjtactile.sim.mujoco_library import pad_sensor_names
from mjtactile.sim.render import RenderError, working_backend

TURNED = (0.5**0.5, 0.5**0.5, 0.0, 0.0)  # about x: the pad's z is the finger's -y


def finger(quat: tuple[float, ...], name: str = "ff") -> mujoco.MjSpec:
    """A pad on a finger that stands upright, on its side towards -y."""
    spec = mujoco.MjSpec.from_string("""<mujoco><worldbody><light pos="0 0 1"/><body name="finger" pos="0 0 0.1">
      <geom type="capsule" size="0.008 0.02" rgba="0.4 0.4 0.4 1"/></body></worldbody></mujoco>""")
    mjtactile.attach_pad(spec, body="finger", name=name, pos=(0, -0.0095, 0), quat=quat, fidelity="fast")
    return spec


@pytest.fixture(scope="module", autouse=True)
def _drawing():
    try:
        working_backend()
    except RenderError as error:
        pytest.skip(str(error))


def orange(picture: np.ndarray) -> int:
    red, green, blue = (picture[..., k].astype(int) for k in range(3))
    return int(((red - blue > 60) & (red - green > 15) & (green - blue > 20)).sum())


def test_the_pad_is_seen_twice_and_the_file_holds_the_same(tmp_path):
    from PIL import Image

    picture = mjtactile.preview_pad(finger(TURNED).compile(), "ff", tmp_path / "pad.png")
    near, far = picture[:, :480], picture[:, 480:]
    assert picture.shape == (480, 960, 3)
    assert orange(near) > 20 * orange(far) > 0
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "pad.png").convert("RGB")), picture)


def blue(picture: np.ndarray) -> int:
    red, green, last = (picture[..., k].astype(int) for k in range(3))
    return int(((last - red > 40) & (last - green > 20)).sum())


def test_a_pad_that_faces_into_the_finger_is_hidden_and_so_is_its_normal():
    """The camera stands where the pad looks: in front of it, or on the other side of the finger."""
    inwards = (0.5**0.5, -(0.5**0.5), 0.0, 0.0)
    seen, hidden = (mjtactile.preview_pad(finger(quat).compile(), "ff")[:, :480] for quat in (TURNED, inwards))
    assert blue(seen) > 100
    assert blue(hidden) == 0
    assert orange(hidden) < orange(seen) / 2


def test_a_geom_names_the_pad_as_well_as_its_sensor():
    model = finger(TURNED).compile()
    np.testing.assert_array_equal(mjtactile.preview_pad(model, "ff"), mjtactile.preview_pad(model, "ff_pad"))


def test_geoms_of_other_groups_are_left_out_but_never_the_pad():
    spec = finger((0.5**0.5, -(0.5**0.5), 0.0, 0.0))  # the finger hides the pad
    model = spec.compile()
    hidden, alone = (mjtactile.preview_pad(model, "ff", groups=groups)[:, :480] for groups in ((0, 1, 2), (1,)))
    assert orange(alone) > 2 * orange(hidden)


def test_nothing_is_simulated_and_a_pose_of_ones_own_is_drawn():
    spec = finger(TURNED)
    spec.body("finger").add_joint(name="turn", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.joint("turn").qpos = 0.5
    mujoco.mj_forward(model, data)
    assert mjtactile.preview_pad(model, "ff", data=data).shape == (480, 960, 3)
    assert data.time == 0.0
    assert data.joint("turn").qpos == 0.5


def test_sensors_of_other_plugins_are_no_pads():
    """MuJoCo's touch grid stands on a site, others may stand on a box as a pad does: the plugin's name decides."""
    spec = finger(TURNED)
    spec.body("finger").add_site(name="tip")
    spec.activate_plugin("mujoco.sensor.touch_grid")
    grid = spec.add_plugin(name="grid", plugin_name="mujoco.sensor.touch_grid", active=True)
    grid.config = {"size": "7 7", "fov": "45 45", "nchannel": "1", "gamma": "0"}
    on_site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": "tip"}
    sensor = spec.add_sensor(name="grid", type=mujoco.mjtSensor.mjSENS_PLUGIN, **on_site)
    sensor.plugin = grid
    sensor.plugin.name, sensor.plugin.plugin_name, sensor.plugin.active = "grid", "mujoco.sensor.touch_grid", True
    spec.add_sensor(
        name="where", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_GEOM, objname="ff_pad"
    )
    model = spec.compile()
    # As a plugin of somebody else that does stand on a box.
    model.sensor_objtype[model.sensor("grid").id] = mujoco.mjtObj.mjOBJ_GEOM
    model.sensor_objid[model.sensor("grid").id] = model.geom("ff_pad").id
    assert pad_sensor_names(model) == ["ff"]
    for name in ("grid", "where"):
        with pytest.raises(SceneError, match=f"no pad '{name}'. Available: ff"):
            mjtactile.preview_pad(model, name)


def test_wrong_names_are_refused_before_anything_is_drawn(tmp_path):
    model = finger(TURNED).compile()
    with pytest.raises(SceneError, match=r"no pad 'thumb'\. Available: ff"):
        mjtactile.preview_pad(model, "thumb")
    with pytest.raises(OutputError):
        mjtactile.preview_pad(model, "ff", tmp_path / "nowhere" / "pad.png")


@pytest.mark.parametrize("groups", [(3,), (1, 7), 1, "12", ("1",), (1.5,)])
def test_groups_that_are_not_drawn_are_refused(groups):
    with pytest.raises(SceneError, match=r"expected groups of geoms among \(0, 1, 2\)"):
        mjtactile.preview_pad(mjtactile.press_scene("star"), "pad", groups=groups)


def test_the_command_draws_the_first_pad_of_a_file(tmp_path):
    spec = finger(TURNED)
    spec.compile()
    (tmp_path / "finger.xml").write_text(spec.to_xml())
    (tmp_path / "bare.xml").write_text("<mujoco/>")

    def run(file: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "mjtactile", "preview", file]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=dict(os.environ), check=False)

    done = run("finger.xml")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "pads: ff\nwrote pad.png\n"
    assert (tmp_path / "pad.png").stat().st_size > 5000
    for file, message in (("bare.xml", "bare.xml has no pad"), ("missing.xml", "cannot open missing.xml")):
        refused = run(file)
        assert refused.returncode == 2
        assert refused.stderr.startswith("mjtactile: error: ")
        assert message in refused.stderr
