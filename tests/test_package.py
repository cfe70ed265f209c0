"""What `import mjtactile` promises: every public name, and nothing heavy."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import mjtactile
import mjtactile.errors


@pytest.mark.parametrize("name", mjtactile.__all__)
def test_every_public_name_resolves(name):
    assert getattr(mjtactile, name) is not None
    assert name in dir(mjtactile)


def test_every_error_can_be_caught_as_one_of_ours():
    errors = {name: one for name, one in vars(mjtactile.errors).items() if name.endswith("Error")}
    assert len(errors) > 20
    assert [name for name, one in errors.items() if not issubclass(one, mjtactile.MjTactileError)] == []


@pytest.mark.parametrize(
    "name", ["dataset.read_dataset", "hands.attach_hand", "recognition.load", "transducer.calibrate", "view.Viewer"]
)
def test_what_the_pages_call_by_its_full_name_is_there_after_one_import(name):
    code = f"import mjtactile; assert callable(mjtactile.{name})"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_type_checkers_know_every_package_that_is_an_attribute():
    tree = ast.parse(Path(mjtactile.__file__).read_text())
    imported = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module == "mjtactile"]
    assert {name.name for node in imported for name in node.names} == set(mjtactile._PACKAGES)


@pytest.mark.parametrize(
    "module",
    ["plugin.engine", "plugin.model_copy", "plugin.mujoco_layout", "plugin.registration", "sim.mujoco_library"],
)
def test_modules_that_mujoco_loads_can_be_imported_before_it(module):
    # MuJoCo registers the plugin while it is imported. A module that imported MuJoCo would be needed half loaded.
    subprocess.run([sys.executable, "-c", f"import mjtactile.{module}, mujoco"], check=True)


def test_environments_are_kept_and_listed():
    make_vec = mjtactile.envs.make_vec
    assert vars(mjtactile.envs)["make_vec"] is make_vec
    assert dir(mjtactile.envs) == sorted(mjtactile.envs.__all__)


def test_unknown_names_fail_as_python_expects():
    with pytest.raises(AttributeError, match="no_such_name"):
        mjtactile.no_such_name  # noqa: B018


def test_importing_the_package_imports_nothing_heavy():
    code = "import json, sys, mjtactile; print(json.dumps(sorted(m for m in sys.modules if '.' not in m)))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"mujoco", "torch", "matplotlib", "scipy", "skfem", "trimesh", "numpy", "typer", "rich"}
    assert heavy.isdisjoint(json.loads(run.stdout))


def test_the_pad_without_mujoco_never_imports_mujoco_or_scikit_fem_from_a_warm_cache(draft):
    code = (
        "import sys, mjtactile as m\n"
        "i = m.influence_matrices(fidelity=m.Fidelity(mesh='draft'))\n"
        "f = m.Footprint.from_outline(m.indenter_outline('star'), i.surface)\n"
        "i.readings(m.contact_load(i, f, force=(0, 0, -1)))\n"
        "print([x for x in ('mujoco', 'skfem', 'torch', 'matplotlib') if x in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
