"""The house itself: small rooms, a ground that holds values only, no cycle of files, and one class of a name."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "mjtactile"
GROUND = {"_installed", "_native", "_progress", "_types"}
GROUND |= {"errors", "fidelity", "pad", "pad_names", "units", "workers"}
#: Functions that a user calls with options by name, and commands, whose options typer reads off: see docs/design.md.
MANY_OPTIONS = {
    "mjtactile.attach.attach_pad",
    "mjtactile.cli.dataset.dataset",
    "mjtactile.cli.dataset.record",
    "mjtactile.cli.evaluate.evaluate",
    "mjtactile.cli.grasp.command",
    "mjtactile.cli.loop.loop",
    "mjtactile.cli.main.press",
    "mjtactile.cli.reproduce.reproduce",
    "mjtactile.cli.view.view",
    "mjtactile.contact.contact_load.contact_load",
    "mjtactile.contact.contact_load.contact_loads",
    "mjtactile.contact.wrench_basis.WrenchBasis.__init__",
    "mjtactile.envs.many.TactileVectorEnv.__init__",
    "mjtactile.envs.many.make_vec",
    "mjtactile.hands.attach_hand.attach_hand",
    "mjtactile.pad.Pad.from_mesh",
    "mjtactile.sensor.TactileSensor.__init__",
    "mjtactile.view.viewer.Viewer.__init__",
}
DOORS = {"__init__", "__main__", "attach", "sensor"}


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


FILES = {name_of(path): path for path in PACKAGE.rglob("*.py")}


def imported(path: Path) -> set[str]:
    """Our modules that a file imports anywhere in it: at its top, in functions, for type checking."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in FILES else str(node.module) for name in names}
    return found & FILES.keys() - {name_of(path)}


def test_no_file_imports_what_imports_it():
    order = TopologicalSorter({name: imported(path) for name, path in FILES.items()})
    order.prepare()  # raises a CycleError that names the files


def test_only_the_ground_and_the_front_doors_stand_at_the_top():
    assert {path.stem for path in PACKAGE.glob("*.py")} == GROUND | DOORS


def test_no_room_holds_more_than_15_files():
    rooms = {path.parent for path in FILES.values()}
    assert max(len(list(room.glob("*.py"))) for room in rooms) <= 15


def test_every_room_says_what_it_holds():
    for room in {path.parent for path in FILES.values()}:
        assert ast.get_docstring(ast.parse((room / "__init__.py").read_text())), room


def test_no_two_classes_have_one_name():
    places = defaultdict(list)
    for name, path in FILES.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(name)
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_errors_and_warnings_stand_in_one_place():
    elsewhere = [
        f"{name}.{node.name}"
        for name, path in FILES.items()
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef) and node.name.endswith(("Error", "Warning"))
        if name != "mjtactile.errors"
    ]
    assert elsewhere == []


def functions(node: ast.AST, name: str) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    """Functions in a module, those in classes and functions included, by their full names; a function in a function by
    the module's."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ClassDef):
            yield from functions(child, f"{name}.{child.name}")
        elif isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            yield f"{name}.{child.name}", child
            yield from functions(child, name)
        else:
            yield from functions(child, name)


def test_functions_take_fewer_than_seven_things():
    many = set()
    for module, path in FILES.items():
        for name, function in functions(ast.parse(path.read_text()), module):
            taken = function.args
            named = [one.arg for one in (*taken.posonlyargs, *taken.args, *taken.kwonlyargs)]
            if len([one for one in named if one not in ("self", "cls")]) + bool(taken.vararg) + bool(taken.kwarg) > 6:
                many.add(name)
    assert many == MANY_OPTIONS


def test_tests_that_the_makefile_names_are_there():
    root = PACKAGE.parent
    named = set(re.findall(r"tests/[\w/*.]+", (root / "Makefile").read_text()))
    assert len(named) > 5
    assert [one for one in sorted(named) if not list(root.glob(one))] == []
