"""Examples run as they are shown: their pads read what MuJoCo's contacts put on them, their pages say what they say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from client_venvs import FOLDER
from run_examples import EXAMPLES, PICTURES, ROOT, run

PARAMETERS = [
    pytest.param(name, id=name, marks=[pytest.mark.slow] if example.slow else []) for name, example in EXAMPLES.items()
]
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
#: Training, and scenes of other packages, take another way after the first rounding.
_LOOSE = {name for name, example in EXAMPLES.items() if example.slow}


def shown(name: str) -> str:
    """What the page says that the example prints."""
    page = (ROOT / "docs" / EXAMPLES[name].page).read_text()
    found = re.search(rf"<!-- bench examples/{name}\.py -->\n```text\n(.*?)\n```\n<!-- end -->", page, re.DOTALL)
    assert found, f"{EXAMPLES[name].page} has no place for what {name} prints"
    return found[1]


def words_and_numbers(text: str) -> tuple[list[str], list[str]]:
    return _NUMBER.split(text), _NUMBER.findall(text)


def agree(printed: str, expected: str) -> bool:
    """Whether two numbers differ by no more than a unit of the last digit shown. Tables made by OpenBLAS's kernels for
    Haswell, for Prescott and for this processor give readings that differ by up to 4e-6.

    Numbers with an exponent are differences that must be the same.
    """
    if "e" in printed + expected:
        return printed == expected
    digits = len(expected.partition(".")[2])
    return abs(float(printed) - float(expected)) < 1.01 * 10.0**-digits


@pytest.mark.parametrize("name", PARAMETERS)
def test_an_example_prints_what_its_page_shows_and_reads_what_mujoco_presses(name, tmp_path):
    venv = EXAMPLES[name].venv
    if venv is not None and not (FOLDER / venv / "installed").is_file():
        pytest.skip(f"the environment of {venv} is not there: make examples")
    outcome = run(name, tmp_path)
    words, numbers = words_and_numbers(outcome.printed)
    expected_words, expected_numbers = words_and_numbers(shown(name))
    assert words == expected_words
    if name not in _LOOSE:
        off = [pair for pair in zip(numbers, expected_numbers, strict=True) if not agree(*pair)]
        assert not off, "make examples"
        page = (ROOT / "docs" / EXAMPLES[name].page).read_text()
        assert not outcome.warned or "ContactWarning" in page, "the page does not say what the example warns of"
    for picture in tmp_path.glob("*.png"):
        assert (PICTURES / picture.name).is_file(), "make examples"
    if not EXAMPLES[name].pads:
        return
    assert sum(pad["force"] > 0.05 for pad in outcome.pads.values()) >= 1
    for pad in outcome.pads.values():
        # The load behind the readings, and what it says it leaves out, is MuJoCo's wrench to rounding: 1e-9 of newtons.
        assert pad["load_off"] < 1e-9
        # Readings are that load's, in the single precision of MuJoCo's plugins or better.
        assert pad["readings_off"] < 1e-6


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_page_shows_the_whole_script(name):
    page = (ROOT / "docs" / EXAMPLES[name].page).read_text()
    assert f'--8<-- "examples/{name}.py"' in page
    assert f"../examples/{name}.py)" in page  # a link, for those who read the page without the site


def test_every_script_has_a_page():
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == set(EXAMPLES)


def test_examples_are_short():
    lengths = {name: len((ROOT / "examples" / f"{name}.py").read_text().splitlines()) for name in EXAMPLES}
    assert max(lengths.values()) <= 80, lengths


def test_pictures_on_the_site_come_from_examples(tmp_path):
    drawn = set()
    for name in EXAMPLES:
        drawn |= set(re.findall(r'"(\w+\.png)"', (ROOT / "examples" / f"{name}.py").read_text()))
    assert {path.name for path in Path(PICTURES).glob("*.png")} == drawn
