"""Models that are still there when Python ends, in cycles that only its last garbage collection takes apart."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import mujoco
import mjtactile

spec = mujoco.MjSpec.from_string(
    '<mujoco><worldbody><body name="finger"><geom size="0.01" mass="1"/></body></worldbody></mujoco>'
)
mjtactile.attach_pad(spec, body="finger", name="pad", fidelity="fast")
names = {"model": spec.compile()}
names["data"] = mujoco.MjData(names["model"])
exec("def function(): pass", names)  # which holds its namespace, which holds it
print("whole")
"""


def test_python_ends_in_peace():
    run = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout, run.stderr) == (0, "whole\n", "")
