"""The core compiled with AddressSanitizer and UndefinedBehaviorSanitizer, and how processes are run with it.

python tests/native_core/sanitizers.py <command> ...
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from filelock import FileLock

ROOT = Path(__file__).resolve().parents[2]
#: One build for all who ask: compiling takes a minute.
FOLDER = ROOT / "build" / "sanitizers"
COMPILER = shutil.which("g++")
NATIVE = ROOT / "native"
INCLUDES = [f"-I{NATIVE / 'core'}", f"-I{NATIVE}"]
#: What files named kernels_<instruction set>.cpp are compiled with, as in native/CMakeLists.txt.
WIDE = {"avx2": ["-mavx2", "-mfma", "-mf16c"], "avx512": ["-mavx512f", "-mavx2", "-mfma", "-mf16c"]}
#: Without what AddressSanitizer stops at as well, null and beyond an object: it takes a fifth of the time to compile.
CHECKS = ["-fsanitize=address,undefined", "-fno-sanitize=null,object-size", "-fno-sanitize-recover=all"]
FLAGS = ["-std=c++17", "-O1", "-g1", "-fPIC", "-shared", *CHECKS]


def library() -> Path:
    """The core compiled with sanitizers, without CMake: plain kernels and AVX2. Kept while no source changes."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with FileLock(FOLDER / "lock"):  # tests that run side by side compile it once
        built = FOLDER / "libmjtactile.so"
        sources = [path for path in NATIVE.rglob("*") if path.is_file()]
        if not built.is_file() or built.stat().st_mtime <= max(path.stat().st_mtime for path in sources):
            _compile(built)
        return built


def _compile(built: Path) -> None:
    objects, running = [], []
    for source in sorted(NATIVE.rglob("*.cpp")):
        target = FOLDER / f"{source.stem}.o"
        flags = [f for f in FLAGS if f != "-shared"] + WIDE.get(source.stem.removeprefix("kernels_"), [])
        command = [str(COMPILER), *flags, "-DMJTACTILE_X86", *INCLUDES, "-c", str(source), "-o", str(target)]
        running.append(subprocess.Popen(command))
        objects.append(str(target))
        if len(running) >= 2:
            assert running.pop(0).wait() == 0
    assert all(process.wait() == 0 for process in running)
    subprocess.run([str(COMPILER), *FLAGS, *objects, "-o", str(built)], check=True)


def environment() -> dict[str, str]:
    """Variables of a process that uses such a core, which is compiled first."""
    runtime = [
        subprocess.run([str(COMPILER), f"-print-file-name={name}"], capture_output=True, text=True, check=True).stdout
        for name in ("libasan.so", "libubsan.so", "libstdc++.so")
    ]
    return os.environ | {
        "MJTACTILE_LIBRARY": str(library()),
        "LD_PRELOAD": " ".join(path.strip() for path in runtime),
        "ASAN_OPTIONS": "detect_leaks=0",  # Python's own
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }


if __name__ == "__main__":
    sys.exit(subprocess.run(sys.argv[1:], env=environment(), check=False).returncode)
