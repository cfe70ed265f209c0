"""Pages for people: every link leads somewhere, and every generated table has its place."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from mjtactile import INDENTER_NAMES, recognition
from mjtactile.cli.press import OTHER_INDENTERS
from mjtactile.dataset.shapes import SHAPE_NAMES

ROOT = Path(__file__).resolve().parent.parent
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
#: Markers of tables by the command that writes them, where it is not called `mjtactile bench NAME`.
MARKERS = {"mjtactile envs": "environments", "mjtactile hands": "hands"}


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def prose(page: Path) -> str:
    """The page without its code, where brackets mean something else."""
    return re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(), flags=re.DOTALL)


def anchors(page: Path) -> set[str]:
    """What headings are called in links: lower case, hyphens for spaces, punctuation left out."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_to_what_is_there(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if link.startswith(("http://", "https://")):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{link} leads nowhere"
        assert not anchor or anchor in anchors(target), f"{link}: no such heading"


def commands_that_write_tables() -> list[tuple[str, str]]:
    """Commands of `make tables`, each with the page that it writes."""
    recipe = re.search(r"^tables:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    assert recipe is not None
    found = []
    for line in recipe[1].splitlines():
        words = shlex.split(line.strip().replace("$(BIN)/", ""))
        assert words.count("--page") == 1, f"{line.strip()} names no page"
        first = next(k for k, word in enumerate(words) if word.startswith("--"))
        found.append((" ".join(words[:first]), words[words.index("--page") + 1]))
    return found


@pytest.mark.parametrize(("command", "page"), commands_that_write_tables())
def test_a_table_has_its_markers_where_its_command_writes(command, page):
    marker = MARKERS.get(command, command.removeprefix("mjtactile bench "))
    found = re.findall(
        rf"^<!-- bench {marker} -->\n.+?\n<!-- end -->$", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE
    )
    assert len(found) == 1, f"{page} has no table '{marker}'"


def test_make_tables_writes_every_table_of_the_benchmarks():
    written = {
        (MARKERS.get(name, name.removeprefix("mjtactile bench ")), page) for name, page in commands_that_write_tables()
    }
    for page in ("README.md", "docs/benchmarks.md", "docs/environments.md", "docs/hands.md"):
        markers = re.findall(r"^<!-- bench (.+) -->$", (ROOT / page).read_text(), flags=re.MULTILINE)
        assert markers
        assert {(marker, page) for marker in markers} <= written


def rows_of(marker: str) -> list[list[str]]:
    """Cells of a table in docs/benchmarks.md, without its head."""
    page = (ROOT / "docs" / "benchmarks.md").read_text()
    found = re.search(rf"<!-- bench {marker} -->\n(.*?)\n<!-- end -->", page, re.DOTALL)
    assert found is not None
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in found[1].splitlines()[2:]]


def test_what_the_benchmarks_say_of_presets_is_what_their_tables_show():
    text = " ".join((ROOT / "docs" / "benchmarks.md").read_text().split())
    said = re.search(r"off by (\d+) % in the median and by (\d+) % at worst", text)
    assert said is not None
    fast = next(row for row in rows_of("small-contacts") if row[0] == "fast")
    medians, worst = zip(*(re.findall(r"[\d.]+", cell) for cell in fast[1:]), strict=True)
    assert [int(value) for value in said.groups()] == [round(max(map(float, each))) for each in (medians, worst)]

    bodies = [row for row in rows_of("plugin") if re.match(r"(moving|unchanged) .*, balanced$", row[0])]
    long = [row for row in bodies if re.search("torus|height field", row[0])]
    assert len(bodies) > 10
    for rows, words in ((bodies, "adds ([\\d.]+) to ([\\d.]+) ms to a step"), (long, "take ([\\d.]+) to ([\\d.]+) ms")):
        said = re.search(words, text)
        assert said is not None
        least, most = (1e3 * float(value) for value in said.groups())
        added = [float(row[1].removesuffix(" us")) for row in rows if rows is long or row not in long]
        # Said to one digit.
        assert min(added) == pytest.approx(least, rel=0.5)
        assert 0.8 * most < max(added) <= most


def test_the_glossary_says_which_names_of_shapes_each_door_takes():
    page = (ROOT / "docs" / "glossary.md").read_text()
    table = page.split("## Names of shapes")[1].strip().splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table if line.startswith("| `")]

    def taken(column: int) -> list[str]:
        return [name for row in rows if row[column].startswith("name") for name in re.findall(r"`(\w+)`", row[0])]

    assert taken(1) == list(INDENTER_NAMES)
    assert sorted(taken(2)) == sorted((*INDENTER_NAMES, *OTHER_INDENTERS))
    assert sorted(taken(3)) == sorted(SHAPE_NAMES)
    known = [name.removeprefix("shape ") for name in recognition.modules() if name.startswith("shape ")]
    assert sorted(taken(4)) == sorted(known)
