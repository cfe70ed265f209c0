"""The benchmark of the meshes, on the coarsest one."""

from pathlib import Path

import pytest

from mjtactile.cli.benchmarks import mesh
from mjtactile.cli.benchmarks.tables import mesh_table

DESIGN = """
reference = "draft"
meshes = ["draft"]
[[case]]
name = "circle, centred"
shape = "circle"
force = 10.0
"""


def test_a_mesh_is_built_loaded_and_applied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    design = tmp_path / "mesh.toml"
    design.write_text(DESIGN)
    monkeypatch.setattr(mesh, "asset_path", lambda _: design)
    monkeypatch.setattr(mesh, "mujoco_tactile_time", lambda: 2e-5)
    monkeypatch.setattr(mesh, "_REPEATS", 1)
    result = mesh.mesh_benchmark()
    draft = result["meshes"]["draft"]
    assert draft["errors"] == {"circle, centred": 0.0}
    assert min(value for name, value in draft.items() if name != "errors") > 0.0
    assert "| draft |" in mesh_table(result)
