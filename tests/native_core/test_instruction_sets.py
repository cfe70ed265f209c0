"""The core runs on any x86-64 processor: wide instructions stand where only the chosen kernels reach them."""

import os
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import pytest
from sanitizers import COMPILER, INCLUDES, NATIVE, WIDE

from mjtactile import _native as native
from mjtactile.errors import NativeError

CPUINFO = Path("/proc/cpuinfo")


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


@pytest.mark.skipif(COMPILER is None or not sys.platform.startswith("linux"), reason="g++ on Linux only")
@pytest.mark.skipif(os.uname().machine != "x86_64", reason="compiled for x86 only")
def test_the_processor_is_asked_and_not_the_run_time_library_of_the_compiler(tmp_path):
    # Zig's library, with which wheels are linked, says of every instruction set that the processor does not have it.
    built = tmp_path / "kernels.o"
    source = NATIVE / "core" / "linalg" / "kernels.cpp"
    flags = ["-std=c++17", "-O3", "-fPIC", "-DMJTACTILE_X86", *INCLUDES]
    subprocess.run([str(COMPILER), *flags, "-c", str(source), "-o", str(built)], check=True)
    listed = subprocess.run(["nm", "--undefined-only", built], capture_output=True, text=True, check=True).stdout
    assert "kKernels" in listed
    assert "__cpu" not in listed


@pytest.mark.skipif(not CPUINFO.exists() or os.uname().machine != "x86_64", reason="asks Linux on x86")
def test_the_sets_that_can_be_used_are_those_of_the_processor():
    flags = set(CPUINFO.read_text().split())
    before = native.instruction_set()
    assert before == next((name for name in ("avx512", "avx2") if needed(name) <= flags), "plain")
    for name in WIDE:
        with nullcontext() if needed(name) <= flags else pytest.raises(NativeError, match="for this processor"):
            native.use_instruction_set(name)
    native.use_instruction_set(before)


def needed(name: str) -> set[str]:
    """Flags of the processor, in Linux' words, that kernels are compiled for."""
    return {flag.removeprefix("-m") for flag in WIDE[name]}


def test_flags_are_those_of_the_build():
    build = (NATIVE / "CMakeLists.txt").read_text()
    for name, flags in WIDE.items():
        assert f'kernels_{name}.cpp PROPERTIES COMPILE_OPTIONS "{";".join(flags)}")' in build
