"""The rooms of native/: which may include which."""

import re
from pathlib import Path

NATIVE = Path(__file__).parents[2] / "native"
#: Whoever stands further down may include what stands further up.
ROOMS = (
    "core/linalg",
    "core/geometry",
    "core/influence",
    "core/contact/cells",
    "core/contact/solvers",
    "core/contact/laws",
    "core/contact",
    "api",
    "plugin",
)
#: Concepts in a room: a header, its source, or both.
MOST_CONCEPTS = 15


def _sources() -> list[Path]:
    return sorted([*NATIVE.rglob("*.cpp"), *NATIVE.rglob("*.hpp"), *NATIVE.rglob("*.h")])


def _room(path: Path) -> str:
    return path.parent.relative_to(NATIVE).as_posix()


def _included(source: Path) -> list[Path]:
    names = re.findall(r'^#include "(.+)"$', source.read_text(), re.MULTILINE)
    found = [
        next((root / name for root in (NATIVE / "core", NATIVE) if (root / name).is_file()), None) for name in names
    ]
    assert None not in found, (source, names)
    return [path for path in found if path is not None]


def test_rooms_include_only_rooms_above_them() -> None:
    wrong = [
        (source.name, included.name)
        for source in _sources()
        for included in _included(source)
        if ROOMS.index(_room(included)) > ROOMS.index(_room(source))
    ]
    assert not wrong


def test_headers_do_not_include_each_other_in_circles() -> None:
    above = {path: _included(path) for path in _sources()}
    while above:
        free = [path for path, needs in above.items() if not any(need in above for need in needs)]
        assert free, sorted(path.name for path in above)
        for path in free:
            del above[path]


def test_no_room_is_crowded() -> None:
    concepts: dict[str, set[str]] = {}
    for path in _sources():
        concepts.setdefault(_room(path), set()).add(path.stem)
    assert set(concepts) == set(ROOMS)
    assert max(len(names) for names in concepts.values()) <= MOST_CONCEPTS
