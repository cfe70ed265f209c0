"""Offsets computed from MuJoCo's description of itself are those its headers give a compiler."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import mujoco
import pytest

from mjtactile._native import library
from mjtactile.plugin.mujoco_layout import _FIELDS, mujoco_layout

COMPILER = shutil.which("g++") or shutil.which("clang++")
#: Members of mjpPlugin in the order of `Plugin` in native/plugin/mujoco_view.hpp.
PLUGIN_MEMBERS = (
    "name", "nattribute", "attributes", "capabilityflags", "needstage", "nstate", "nsensordata", "init", "destroy",
    "copy", "reset", "compute", "advance", "visualize", "actuator_act_dot", "sdf_distance", "sdf_gradient",
    "sdf_staticdistance", "sdf_attribute", "sdf_aabb",
)  # fmt: skip


def compiled(tmp_path, expressions):
    """Values of C expressions under the headers of the MuJoCo in use."""
    lines = "".join(f'std::printf("%zu\\n", static_cast<std::size_t>({one}));' for one in expressions)
    source = tmp_path / "offsets.cpp"
    source.write_text(f"#include <cstddef>\n#include <cstdio>\n#include <mujoco/mujoco.h>\nint main() {{ {lines} }}\n")
    include = Path(mujoco.__file__).parent / "include"
    program = tmp_path / "offsets"
    subprocess.run([str(COMPILER), "-w", f"-I{include}", str(source), "-o", str(program)], check=True)
    run = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    return [int(line) for line in run.stdout.split()]


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
def test_offsets_are_the_compilers(tmp_path):
    layout = mujoco_layout()
    expressions, expected = [], []
    for structure, names in _FIELDS:
        expressions.append(f"sizeof({structure})")
        expected.append(layout.sizes[structure])
        for name in filter(None, names):
            expressions.append(f"offsetof({structure}, {name})")
            expected.append(layout.offsets[structure][name])
    assert compiled(tmp_path, expressions) == expected


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
def test_the_plugins_own_structure_is_as_it_was(tmp_path):
    found = compiled(tmp_path, ["sizeof(mjpPlugin)", *(f"offsetof(mjpPlugin, {name})" for name in PLUGIN_MEMBERS)])
    assert found == [152, 0, 8, 16, 24, 28, *range(32, 152, 8)]


def test_the_core_refuses_a_layout_of_another_size():
    assert library().mjt_plugin_register(None, ctypes.c_size_t(3), None, ctypes.c_size_t(1), None) == -1
