"""The compiled core and the plugin under AddressSanitizer and UndefinedBehaviorSanitizer."""

import os
import subprocess
import sys

import pytest
from sanitizers import COMPILER, ROOT, environment

#: What is run: everything the core does in Python's hands and in MuJoCo's, pickles and threads included. Bodies of
#: every kind are in the random scenes that tests/soak/test_soak.py runs with sanitizers.
TESTS = [
    *(f"tests/parity/test_{name}.py" for name in ("native", "bodies", "face_cells", "triangle_mesh", "shear")),
    *(f"tests/plugin/test_{name}.py" for name in ("plugin", "plugin_sleep")),
]
#: Memory is measured there, another process is begun without the sanitizer, or meshes are large.
LEFT_OUT = "not fine_ball and not memory and not either_order and not nodal_forces_of_any and not random_gaps"


@pytest.mark.slow
@pytest.mark.skipif(COMPILER is None or not sys.platform.startswith("linux"), reason="g++ on Linux only")
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="compiled for x86 only")
def test_nothing_is_misused():
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *TESTS, "-k", LEFT_OUT]
    run = subprocess.run(command, cwd=ROOT, env=environment(), capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
