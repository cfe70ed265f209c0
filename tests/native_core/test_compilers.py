"""The core compiles without warnings by compilers that its build does not use."""

import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import pytest
from sanitizers import INCLUDES, NATIVE, WIDE

CLANG = shutil.which("clang++")


@pytest.mark.slow
@pytest.mark.skipif(CLANG is None, reason="clang++ is not installed")
def test_clang_warns_of_nothing():
    warnings = re.search(
        r"target_compile_options\(mjtactile PRIVATE (-Wall.*)\)", (NATIVE / "CMakeLists.txt").read_text()
    )
    assert warnings is not None
    common = ["-std=c++17", "-fsyntax-only", "-Werror", *warnings[1].split(), *INCLUDES]

    def compiled(source):
        wide = WIDE.get(source.stem.removeprefix("kernels_"), [])
        if wide and os.uname().machine != "x86_64":
            return ""
        command = [str(CLANG), *common, *(["-DMJTACTILE_X86", *wide] if wide else []), str(source)]
        return subprocess.run(command, capture_output=True, text=True, check=False).stderr

    with ThreadPoolExecutor(2) as threads:
        said = "".join(threads.map(compiled, sorted(NATIVE.rglob("*.cpp"))))
    assert not said, said[-3000:]
