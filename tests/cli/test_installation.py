"""`mjtactile doctor`, `cache`, the help and shell completion, as a user meets them."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mjtactile.envs
import mjtactile.recognition  # noqa: F401
from mjtactile._installed import DOCUMENTATION
from mjtactile.errors import MjTactileError
from mjtactile.influence.cache import SHIPPED

DOCS = Path(__file__).parents[2] / "docs"


def run(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "mjtactile", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "TERM": "dumb", **{name: str(value) for name, value in environment.items()}},
    )


@pytest.fixture
def cache(tmp_path) -> Path:
    """Two tables: one whole, one cut short."""
    (shipped,) = SHIPPED.glob("*.safetensors")
    shutil.copy(shipped, tmp_path)
    (tmp_path / "influence-cut.safetensors").write_bytes(shipped.read_bytes()[:1000])
    return tmp_path


def test_the_doctor_finds_nothing_wrong_here(tmp_path):
    done = run("doctor", MJTACTILE_CACHE=tmp_path / "cache")
    assert done.returncode == 0, done.stdout
    assert "WRONG" not in done.stdout
    for text in ("MuJoCo", "instruction set", "plugin: registers", f"{tmp_path / 'cache'}, 0 tables", "extras"):
        assert text in done.stdout


def test_the_doctor_says_how_to_mend_a_cache_that_cannot_be_written(tmp_path):
    (tmp_path / "file").touch()
    done = run("doctor", "--json", MJTACTILE_CACHE=tmp_path / "file" / "cache")
    assert done.returncode == 1
    (found,) = [finding for finding in json.loads(done.stdout) if finding["cure"]]
    assert found["about"] == "cache"
    assert "MJTACTILE_CACHE" in found["cure"]


def test_the_doctor_says_how_to_mend_a_cache_in_an_unknown_home():
    done = run("doctor", "--json", MJTACTILE_CACHE="~no-such-user/cache")
    wrong = {finding["about"]: finding["cure"] for finding in json.loads(done.stdout) if finding["cure"]}
    assert set(wrong) == {"plugin", "tables", "cache"}
    assert all("MJTACTILE_CACHE" in cure for cure in wrong.values())
    assert done.stderr == ""


def test_the_doctor_says_how_to_mend_a_missing_core(tmp_path):
    done = run("doctor", MJTACTILE_LIBRARY=tmp_path / "nowhere.so", MJTACTILE_CACHE=tmp_path)
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    wrong = next(k for k, line in enumerate(lines) if line.startswith("WRONG  compiled core"))
    assert "pip install" in lines[wrong + 1]
    assert any(line.startswith("WRONG  plugin") for line in lines)


def test_a_damaged_core_stops_no_command_without_need_of_it_and_the_doctor_names_it(tmp_path):
    (tmp_path / "damaged.so").write_text("no library")
    broken = {"MJTACTILE_LIBRARY": tmp_path / "damaged.so", "MJTACTILE_CACHE": tmp_path}
    assert run("cache", "list", **broken).returncode == 0
    done = run("doctor", "--json", **broken)
    wrong = {finding["about"]: finding["cure"] for finding in json.loads(done.stdout) if finding["cure"]}
    assert set(wrong) == {"compiled core", "plugin"}
    assert all("damaged.so" in cure and "pip install" in cure for cure in wrong.values())


def test_the_cache_is_listed_with_what_each_table_is_of(cache):
    tables = json.loads(run("cache", "list", "--json", MJTACTILE_CACHE=cache).stdout)
    assert [table["usable"] for table in tables] == [True, False]
    assert tables[0]["contents"].endswith("13 x 13 taxels at 4 depths, fast")
    assert tables[0]["size"] == sum(1 for _ in Path(tables[0]["path"]).read_bytes())
    assert f"2 tables in {cache}" in run("cache", "list", MJTACTILE_CACHE=cache).stdout


def test_the_cache_is_cleared_of_what_is_of_no_use_or_of_all(cache):
    assert "removed 1 tables" in run("cache", "clear", "--unusable", MJTACTILE_CACHE=cache).stdout
    assert not (cache / "influence-cut.safetensors").exists()
    (cache / "influence-of-mine.txt").touch()
    assert "nothing is removed yet: 1 tables" in run("cache", "clear", MJTACTILE_CACHE=cache).stdout
    assert len(list(cache.glob("*.safetensors"))) == 1
    assert "removed 1 tables, 4.5 MB" in run("cache", "clear", "--yes", MJTACTILE_CACHE=cache).stdout
    assert not list(cache.glob("*.safetensors"))
    assert (cache / "influence-of-mine.txt").exists()


def test_a_link_to_nowhere_in_the_cache_is_a_damaged_table_and_a_folder_none(cache):
    (cache / "influence-link.safetensors").symlink_to(cache / "nowhere")
    (cache / "influence-folder.safetensors").mkdir()
    tables = json.loads(run("cache", "list", "--json", MJTACTILE_CACHE=cache).stdout)
    assert [table["usable"] for table in tables] == [True, False, False]
    assert "2 of them" in run("doctor", MJTACTILE_CACHE=cache).stdout
    assert "removed 2 tables" in run("cache", "clear", "--unusable", MJTACTILE_CACHE=cache).stdout
    assert not (cache / "influence-link.safetensors").is_symlink()


def test_a_cache_that_is_no_folder_is_an_error_in_one_line(tmp_path):
    (tmp_path / "file").touch()
    for command in ("list", "clear"):
        done = run("cache", command, MJTACTILE_CACHE=tmp_path / "file")
        assert done.returncode == 2
        assert f"Not a directory: '{tmp_path / 'file'}'" in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_help_groups_the_commands_and_gives_examples():
    text = run("--help", COLUMNS=100).stdout
    places = [text.index(part) for part in ("Touch", "press ", "Experiments", "bench ", "This installation", "doctor ")]
    assert places == sorted(places)
    assert "mjtactile press star --force 100gf --tilt 15" in text


@pytest.mark.parametrize(
    ("words", "known"), [("mjtactile doc", "doctor"), ("mjtactile press star --fidelity ", "fast")]
)
def test_the_shell_completes_commands_and_values(words, known):
    code = "import sys; sys.argv = ['mjtactile']; from mjtactile.cli.main import main; main()"
    asked = {"_MJTACTILE_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split(" ")) - 1)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **asked})
    assert known in done.stdout.split()


def test_pages_that_errors_name_are_there():
    kinds, pages = [MjTactileError], set()
    while kinds:
        kind = kinds.pop()
        pages |= {kind.page} - {None}
        kinds += kind.__subclasses__()
    assert "recognition.md" in pages
    assert all((DOCS / str(page)).is_file() for page in pages)


def test_an_error_names_its_page():
    assert run("press", "star", "--law", "none").stderr.strip().endswith(f"More: {DOCUMENTATION}contact.html")
