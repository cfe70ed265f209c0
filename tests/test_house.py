"""The house itself: small rooms, a ground that holds values only, and no cycle of files, however they import."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "mjtactile"
GROUND = {"_files", "_installed", "_native", "_progress", "_types"}
GROUND |= {"errors", "fidelity", "pad", "pad_names", "units", "workers"}
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
