"""The README is short; its code, and that of pages that took over some of it, runs as printed."""

import re
from pathlib import Path

import mujoco
import pytest

import mjtactile
from mjtactile.dataset import ContactSpec, DatasetSpec, make_dataset

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


@pytest.mark.parametrize("name", ["recognition.md", "transducers.md"])
def test_python_on_a_page_runs_from_top_to_bottom(name, default_influence):
    names = {}
    for block in blocks(ROOT / "docs" / name, "python"):
        exec(compile(block, name, "exec"), names)
    # What the last block made of a press: an answer, or readings as an array reports them.
    if name == "recognition.md":
        assert names["found"].shape == "star"
    else:
        assert names["corrected"].shape == (4, 13, 13)
        assert names["corrected"].max() > 1e3


def test_the_servo_on_the_page_reaches_the_force_it_says(default_influence):
    names = {}
    exec(compile(blocks(ROOT / "docs" / "loop.md", "python")[-1], "loop.md", "exec"), names)
    force, commanded = names["sensor"].wrench(names["data"])[:3], names["commanded"]
    # The page says within 2 %.
    assert abs(force - commanded).max() < 0.02 * abs(commanded).max()


def test_the_recorder_on_the_page_writes_an_episode(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(blocks(ROOT / "docs" / "lerobot.md", "python")[-1], "lerobot.md", "exec"), {})
    assert (tmp_path / "mine" / "meta" / "info.json").is_file()


def test_the_environment_on_the_page_feels_what_it_rewards():
    names = {}
    exec(compile(blocks(ROOT / "docs" / "environments.md", "python")[-1], "environments.md", "exec"), names)
    envs, np = names["envs"], names["np"]
    steps = [envs.step(np.full((64, 1), 0.5, dtype=np.float32)) for _ in range(30)]
    seen, rewards, *_ = steps[-1]
    pressing = -seen["tactile"][:, 0, 2]
    # The observed force has noise of 1 %, and the reward is by the true one.
    assert np.abs(np.abs(pressing - 0.2) + rewards).max() < 0.05 * 0.5
    assert 0.1 < pressing.min() < 0.2 < pressing.max() < 0.55


def test_the_page_of_datasets_reads_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pressed = ContactSpec(shapes=("circle",), force=(0.5, 0.6))
    made = make_dataset(DatasetSpec(presses=2, contacts=(pressed,), presets=("fast",)), "build/presses")
    names = {}
    exec(compile(blocks(ROOT / "docs" / "datasets.md", "python")[-1], "datasets.md", "exec"), names)
    assert names["readings"].shape == (made, 4, 13, 13)
    assert names["forces"].shape == (made, 3)
    assert list(names["shapes"]) == ["circle"] * made


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
