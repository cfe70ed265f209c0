"""The compiled core and the plugin under AddressSanitizer and UndefinedBehaviorSanitizer."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMPILER = shutil.which("g++")
FLAGS = ["-std=c++17", "-O1", "-g", "-fPIC", "-shared", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
#: What is run: everything the core does in Python's hands and in MuJoCo's, pickles and threads included.
TESTS = [
    *(f"tests/parity/test_{name}.py" for name in ("native", "faces", "curved")),
    *(f"tests/mujoco/test_{name}.py" for name in ("plugin", "plugin_bodies")),
]
#: Memory is measured there, and another process is begun without the sanitizer.
LEFT_OUT = "not memory and not orders and not nodal_forces_of_any and not random_gaps"


def library(folder):
    """The core compiled with sanitizers, without CMake: plain kernels and those of AVX2."""
    native = ROOT / "native"
    includes = [f"-I{native / 'core'}", f"-I{native / 'plugin'}"]
    wide = {"avx2": ["-mavx2", "-mfma", "-mf16c"], "avx512": ["-mavx512f", "-mavx2", "-mfma", "-mf16c"]}
    objects, running = [], []
    for source in sorted([*native.glob("core/*.cpp"), *native.glob("plugin/*.cpp")]):
        target = folder / f"{source.stem}.o"
        flags = [f for f in FLAGS if f != "-shared"] + wide.get(source.stem.removeprefix("kernels_"), [])
        command = [str(COMPILER), *flags, "-DMJTACTILE_X86", *includes, "-c", str(source), "-o", str(target)]
        running.append(subprocess.Popen(command))
        objects.append(str(target))
        if len(running) >= 2:
            assert running.pop(0).wait() == 0
    assert all(process.wait() == 0 for process in running)
    built = folder / "libmjtactile.so"
    subprocess.run([str(COMPILER), *FLAGS, *objects, "-o", str(built)], check=True)
    return built


@pytest.mark.slow
@pytest.mark.skipif(COMPILER is None or not sys.platform.startswith("linux"), reason="g++ on Linux only")
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="compiled for x86 only")
def test_nothing_is_misused(tmp_path):
    runtime = [
        subprocess.run([str(COMPILER), f"-print-file-name={name}"], capture_output=True, text=True, check=True).stdout
        for name in ("libasan.so", "libubsan.so", "libstdc++.so")
    ]
    environment = os.environ | {
        "MJTACTILE_LIBRARY": str(library(tmp_path)),
        "LD_PRELOAD": " ".join(path.strip() for path in runtime),
        "ASAN_OPTIONS": "detect_leaks=0",  # Python's own
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *TESTS, "-k", LEFT_OUT]
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
