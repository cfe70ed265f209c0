"""Extras: what is not installed says the line that installs it, and everything else works without."""

import ast
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import mjtactile
from mjtactile._installed import EXTRAS, Extra, require
from mjtactile.errors import MissingExtraError, MjTactileError

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "mjtactile"
DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
OWNER = {module: name for name, extra in EXTRAS.items() for module in extra.modules}
#: Those that bring no package of their own.
GATHERING = {"all", "dev", "lerobot"}
#: What only those who work on mjtactile install.
OF_DEVELOPERS = {"docs"}
#: A process in which extras are not installed, as far as Python's imports can tell.
BLOCKED = f"""import sys
from importlib.machinery import PathFinder
find = PathFinder.find_spec
PathFinder.find_spec = lambda name, *args: None if name in {sorted(OWNER)} else find(name, *args)
"""


def without_extras(code: str, cache: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", f"{BLOCKED}\n{code}"],
        capture_output=True,
        text=True,
        env={**os.environ, "MJTACTILE_CACHE": str(cache)},
    )


def command(*arguments: str) -> str:
    return f"sys.argv = ['mjtactile', *{arguments!r}]\nfrom mjtactile.cli.main import main\nmain()"


def test_the_extras_are_those_of_pyproject():
    assert DECLARED.keys() - GATHERING - OF_DEVELOPERS == EXTRAS.keys()


def test_all_gathers_every_extra():
    (line,) = DECLARED["all"]
    assert set(line.removeprefix("mjtactile[").removesuffix("]").split(",")) == EXTRAS.keys()


@pytest.mark.parametrize("name", EXTRAS)
def test_what_is_missing_says_the_line_that_installs_it(name, monkeypatch):
    require(name)
    module = EXTRAS[name].modules[0]
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError, match=rf'{module}.* pip install "mjtactile\[{name}\]"') as caught:
        require(name)
    assert isinstance(caught.value, MjTactileError | ImportError)


def imports_of_extras(tree: ast.Module) -> list[tuple[str, int, list[ast.AST]]]:
    """Extra, line and enclosing nodes of every import of its packages at run time."""
    found = []

    def walk(node: ast.AST, around: list[ast.AST]) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            return
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            names = [str(node.module)] if isinstance(node, ast.ImportFrom) else []
        owners = {OWNER[name.split(".")[0]] for name in names if name.split(".")[0] in OWNER}
        found.extend((owner, node.lineno, around) for owner in owners)  # type: ignore[attr-defined]
        for child in ast.iter_child_nodes(node):
            walk(child, [*around, node])

    walk(tree, [])
    return found


def requires(nodes: list[ast.AST], extra: str) -> bool:
    calls = [call for node in nodes for call in ast.walk(node) if isinstance(call, ast.Call)]
    return any(ast.unparse(call) == f"require('{extra}')" for call in calls)


def test_no_package_of_an_extra_is_imported_without_asking_for_it():
    unasked, seen = [], 0
    for path in PACKAGE.rglob("*.py"):
        rooms = [room / "__init__.py" for room in path.parents if PACKAGE in (room, *room.parents)]
        of_rooms: list[ast.AST] = [ast.parse(room.read_text()) for room in rooms]
        for extra, line, around in imports_of_extras(ast.parse(path.read_text())):
            seen += 1
            functions = [node for node in around if isinstance(node, ast.FunctionDef)]
            if not (requires(list(functions), extra) or requires(of_rooms, extra)):
                unasked.append(f"{path.relative_to(ROOT)}:{line} imports what only [{extra}] brings")
    assert not unasked
    assert seen > 20


def test_sensor_plugin_and_recognisers_need_no_extra(tmp_path):
    script = ROOT / "tests" / "wheel" / "first_reading.py"
    done = without_extras(f"import runpy; runpy.run_path({str(script)!r}, run_name='__main__')", tmp_path / "cache")
    assert done.returncode == 0, done.stderr
    assert "sensor and recognisers work" in done.stdout


def test_the_command_line_presses_without_extras_and_without_a_build(tmp_path):
    done = without_extras(command("press", "circle", "--fidelity", "fast"), tmp_path / "cache")
    assert done.returncode == 0, done.stderr
    assert "gf reached" in done.stdout
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (("press", "circle", "--fidelity", "fast", "--figure", "p.png"), "figures"),
        (("dataset", "--spec", str(ROOT / "training" / "presses.toml"), "--out", "TMP"), "dataset"),
        (("reproduce", "--quick"), "torch"),
        (("envs",), "envs"),
        (("evaluate", "--presses", "20"), "dataset"),
        (("loop",), "figures"),
        (("grasp", "lift", "--trials", "1", "--ray"), "ray"),
    ],
)
def test_a_command_that_needs_an_extra_says_so_in_one_line(arguments, extra, tmp_path):
    done = without_extras(command(*(str(tmp_path / "out") if a == "TMP" else a for a in arguments)), tmp_path)
    assert done.returncode == 2, done.stdout
    assert done.stderr.startswith("mjtactile: error: ")
    assert len(done.stderr.splitlines()) == 1
    assert f'pip install "mjtactile[{extra}]"' in done.stderr


def test_a_package_of_ours_that_needs_an_extra_says_so(tmp_path):
    done = without_extras("import mjtactile.torch", tmp_path)
    assert 'pip install "mjtactile[torch]"' in done.stderr.splitlines()[-1]
    assert mjtactile.__version__


def test_a_folder_of_a_package_s_name_is_not_the_package(tmp_path, monkeypatch):
    """Ray leaves a folder /tmp/ray behind, which Python imports where /tmp is on its path."""
    (tmp_path / "no_package_of_this_name").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    assert Extra(("no_package_of_this_name",), "nothing").missing == ["no_package_of_this_name"]
    assert Extra(("pytest",), "tests").missing == []
