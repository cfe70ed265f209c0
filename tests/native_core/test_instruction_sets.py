"""The core runs on any x86-64 processor: wide instructions stand where only the chosen kernels reach them."""

import os
import subprocess
import sys

import pytest
from sanitizers import COMPILER, INCLUDES, NATIVE, WIDE


@pytest.mark.skipif(COMPILER is None or not sys.platform.startswith("linux"), reason="g++ on Linux only")
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="compiled for x86 only")
@pytest.mark.parametrize("name", WIDE)
def test_wide_kernels_are_reached_by_one_constant_only(name, tmp_path):
    # A function that others can call, or that the linker may take in place of one compiled without these instructions,
    # ends the process on a processor that lacks them.
    built = tmp_path / "kernels.o"
    source = NATIVE / "core" / "linalg" / f"kernels_{name}.cpp"
    flags = ["-std=c++17", "-O3", "-fPIC", "-DMJTACTILE_X86", *INCLUDES, *WIDE[name]]
    subprocess.run([str(COMPILER), *flags, "-c", str(source), "-o", str(built)], check=True)
    listed = subprocess.run(["nm", "-C", "--defined-only", "--extern-only", built], capture_output=True, text=True)
    symbols = [line.split(maxsplit=2)[1:] for line in listed.stdout.splitlines()]
    assert [symbol for _, symbol in symbols] == [f"mjtactile::{name}::kKernels"]
    assert symbols[0][0] in "DR", "a constant in memory, computed by nothing"


def test_flags_are_those_of_the_build():
    build = (NATIVE / "CMakeLists.txt").read_text()
    for name, flags in WIDE.items():
        assert f'kernels_{name}.cpp PROPERTIES COMPILE_OPTIONS "{";".join(flags)}")' in build
