"""The README's Python runs as printed, and its press has the length it promises."""

import re
from pathlib import Path

import pytest

README = Path(__file__).resolve().parent.parent / "README.md"
BLOCKS = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS)
def test_python_in_the_readme_runs(block, default_influence, capsys):
    names = {}
    exec(compile(block, str(README), "exec"), names)
    assert names["readings"].shape == (4, 13, 13)
    assert names["readings"].max() > 1e3


def test_the_press_takes_15_lines():
    assert len(BLOCKS[0].strip().splitlines()) <= 15


def test_generated_tables_are_there():
    (table,) = re.findall(r"<!-- bench mesh -->\n(.*?)<!-- end -->", README.read_text(), flags=re.DOTALL)
    for name in ("draft", "default", "fine", "<tactile>"):
        assert name in table
