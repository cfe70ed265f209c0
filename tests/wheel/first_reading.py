"""What works right after `pip install mjtactile`, and nothing more: run it by a Python that has just that.

It reads a pad through `import mujoco` alone, reads it again by a TactileSensor, recognises a press, and asks for what
is not installed. Readings at fidelity "fast" need no table to be built.
"""

import os
import platform
import sys
import tempfile
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

folder = tempfile.TemporaryDirectory()
os.environ["MJTACTILE_CACHE"] = str(Path(folder.name) / "cache")

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

BY_ENTRY_POINT = int(mujoco.__version__.split(".")[0]) >= 4
if not BY_ENTRY_POINT:
    import_module("mjtactile")

XML = """<mujoco>
  <extension><plugin plugin="mjtactile.pad"/></extension>
  <option integrator="implicitfast" cone="elliptic" jacobian="dense"/>
  <worldbody>
    <geom name="pad" type="box" size="0.0075 0.0075 0.0025" priority="10" condim="4" solref="0.005 1"/>
    <body pos="0 0 0.0075"><freejoint/><geom type="box" size="0.004 0.003 0.005" mass="0.05"/></body>
  </worldbody>
  <sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
    <config key="fidelity" value="fast"/>
  </plugin></sensor>
</mujoco>"""


def main() -> None:
    """Go through all of it; the first thing that is not so ends it."""
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 2000)
    mujoco.mj_forward(model, data)
    by_plugin = data.sensor("touch").data.reshape(4, 13, 13)
    assert 1e2 < by_plugin.max() < 1e5, by_plugin.max()

    import mjtactile

    check_instruction_set()
    sensor = mjtactile.TactileSensor(model, "touch")
    np.testing.assert_allclose(sensor.read(data), by_plugin, rtol=1e-6)
    weight = 0.05 * 9.81
    assert abs(sensor.wrench(data)[2] / -weight - 1) < 1e-2, sensor.wrench(data)

    scene = mjtactile.press_scene("star")
    pressed, force = mujoco.MjData(scene), mjtactile.force_vector(0.98, tilt_deg=15)
    mjtactile.press(scene, pressed, force)
    readings = mjtactile.TactileSensor(scene, fidelity="fast").read(pressed)
    felt = mjtactile.recognition.load("force")(readings).force
    assert np.linalg.norm(felt - force) < 0.1 * np.linalg.norm(force), (felt, force)
    assert mjtactile.recognition.load("shape")(readings).shape == "star"
    assert not Path(os.environ["MJTACTILE_CACHE"]).exists(), "a table was built"

    if find_spec("torch") is None:
        said = ""
        try:
            import mjtactile.torch
        except ImportError as error:
            said = str(error)
        assert 'pip install "mjtactile[torch]"' in said, said
    found = "through import mujoco alone" if BY_ENTRY_POINT else "through import mjtactile"
    print(f"MuJoCo {mujoco.__version__}: the plugin reads {found}; sensor and recognisers work")


def check_instruction_set() -> None:
    """Check that the core uses the widest kernels for this processor, which a wheel's compiler must not leave out."""
    from mjtactile._native import instruction_set

    listed = Path("/proc/cpuinfo")
    if platform.machine() == "x86_64" and listed.exists():
        flags = set(listed.read_text().split())
        best = next((name for name, flag in (("avx512", "avx512f"), ("avx2", "avx2")) if flag in flags), "plain")
        assert instruction_set() == best, (instruction_set(), best)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
