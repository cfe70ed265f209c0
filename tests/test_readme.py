"""The README is short; its code, and that of pages that took over some of it, runs as printed."""

import re
from pathlib import Path

import mujoco
import pytest

import mjtactile

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
PAGES = [README, ROOT / "docs" / "benchmarks.md", ROOT / "docs" / "contact.md"]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(), flags=re.DOTALL)


@pytest.mark.parametrize(("page", "block"), [(page.name, block) for page in PAGES for block in blocks(page, "python")])
def test_python_on_the_page_runs(page, block, default_influence, capsys):
    names = {}
    exec(compile(block, page, "exec"), names)
    assert names["readings"].shape == (4, 13, 13)
    assert names["readings"].max() > 1e3


def test_xml_in_the_readme_is_a_model_whose_pad_reads():
    (xml,) = blocks(README, "xml")
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    assert mjtactile.TactileSensor(model, "ff").read(data).max() > 1e3


def test_the_press_takes_15_lines():
    assert len(blocks(README, "python")[0].strip().splitlines()) <= 15


def test_the_readme_is_short():
    assert len(README.read_text().splitlines()) <= 150
