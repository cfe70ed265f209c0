"""The study as a whole: done once, continued after an interruption, printed beside the paper's figures."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mjtactile.errors import MjTactileError
from mjtactile.experiments.study import plan, tables
from mjtactile.experiments.study.report import study_report
from mjtactile.experiments.study.reproduce import reproduce
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.cache import cache_directory

TINY = plan.StudySettings(
    seeds=2, fidelity="fast", magnitude_iterations=20, variant_iterations=10, shape_iterations=10, variants=False
)
PAGE = Path(__file__).resolve().parents[3] / "docs" / "study.md"


@pytest.fixture(scope="module")
def tables_elsewhere(tmp_path_factory):
    """The influence matrices of the cache, with room of its own for what the study keeps."""
    folder = tmp_path_factory.mktemp("cache")
    plan.influence_matrices(fidelity="fast", progress=False)
    for table in cache_directory().glob("influence-*.safetensors"):
        (folder / table.name).symlink_to(table)
    return folder


@pytest.fixture
def cache(tables_elsewhere, monkeypatch):
    monkeypatch.setenv("MJTACTILE_CACHE", str(tables_elsewhere))
    return tables_elsewhere


@pytest.fixture
def found(cache):
    return reproduce(TINY, workers=1, progress=False)


def test_an_interrupted_study_goes_on_where_it_stopped(cache, monkeypatch):
    settings = replace(TINY, seeds=1)
    ran, run = [], plan.Unit.run

    def runs_out(unit):
        if len(ran) == 3:
            raise KeyboardInterrupt
        ran.append(unit)
        return run(unit)

    monkeypatch.setattr(plan.Unit, "run", runs_out)
    with pytest.raises(KeyboardInterrupt):
        reproduce(settings, workers=1, progress=False)
    ran.append(None)
    reproduce(settings, workers=1, progress=False)
    finished = [unit for unit in ran if unit is not None]
    assert len(finished) == len(set(finished)) == len(list(plan.units(settings))) == 8
    reproduce(settings, workers=1, progress=False)
    assert len(ran) == 9
    reproduce(settings, workers=1, fresh=True, progress=False)
    assert len(ran) == 17


def test_results_that_were_cut_off_are_made_again(found, cache):
    victim = sorted((cache / "study").glob("*.json"))[0]
    victim.write_text(victim.read_text()[:50])
    again = reproduce(TINY, workers=1, progress=False)
    assert [u["result"] for u in again["units"]] == [u["result"] for u in found["units"]]


@pytest.mark.slow
def test_two_workers_find_what_one_finds(cache):
    settings = replace(TINY, seeds=1)
    alone = reproduce(settings, workers=1, progress=False)
    together = reproduce(settings, workers=2, fresh=True, progress=False)
    assert len(alone["units"]) == len(together["units"]) == 8
    for one, other in zip(alone["units"], together["units"], strict=True):
        assert json.dumps(one["result"]) == json.dumps(other["result"])


def test_every_unit_is_kept_under_a_name_of_its_own(cache):
    influence = plan.influence_matrices(fidelity="fast", progress=False)
    units = list(plan.units(plan.StudySettings()))
    assert len({plan.kept_path(unit, influence) for unit in units}) == len(units)
    # Each law, number of layers and variant; the maxima of one layer have one scale.
    shapes, forces = 4 * len(plan.SHAPE_VARIANTS), 4 + 4 * len(plan.FORCE_VARIANTS) - 2
    assert len(units) == shapes + forces


def test_the_report_holds_the_papers_tables_and_ours(found):
    report = study_report(found)
    for heading in ("Table 2", "Table 3", "Tables 4 and 5", "Table 6"):
        assert heading in report
    for figure in ("| 27 -> | 26.8 | 27.2 |", "| 0.53 | 0.23 |", "| 96.8 | 100 | 98.2 |", " / 0.89 |", " / 0.81 |"):
        assert figure in report, figure
    recognised = np.array(tables.force_result(found, "elastic", 4)["direction"]["recognised_deg"])[:, 3]
    assert f"{recognised.mean():.2f} ± {recognised.std():.2f}" in report
    rows = [line for line in report.splitlines() if line.startswith("| ")]
    assert sum(line.startswith("| star |") for line in rows) == 2
    assert len(found["units"][4]["result"]["outputs"]["+x"]) == len(INDENTER_NAMES)


def test_the_report_names_what_was_tried_where_it_was(found):
    assert "Likely reasons" not in study_report(found)
    units = [*found["units"]]
    for unit in found["units"]:
        if unit["study"] == "shape":
            units.append({**unit, "variant": "hidden units tanh"})
        else:
            units.append({**unit, "iterations": TINY.variant_iterations})
    report = study_report({**found, "units": units})
    assert "Likely reasons" in report
    assert "| hidden units tanh |" in report


def run_command(*arguments, cache):
    return subprocess.run(
        [sys.executable, "-m", "mjtactile", "reproduce", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "MJTACTILE_CACHE": str(cache)},
    )


@pytest.mark.slow
def test_the_command_prints_tables_and_writes_json_and_page(cache, tmp_path):
    page = tmp_path / "study.md"
    page.write_text("before\n<!-- bench study -->\nold\n<!-- end -->\nafter\n")
    done = run_command(
        "--quick",
        "--seeds",
        "1",
        "--workers",
        "1",
        "--json",
        str(tmp_path / "s.json"),
        "--page",
        str(page),
        cache=cache,
    )
    assert done.returncode == 0, done.stderr
    assert "Table 6" in done.stdout
    assert json.loads((tmp_path / "s.json").read_text())["settings"]["seeds"] == 1
    assert re.fullmatch(r"before\n<!-- bench study -->\n.*Table 2.*<!-- end -->\nafter\n", page.read_text(), re.DOTALL)


def test_the_docs_page_has_the_tables():
    (text,) = re.findall(r"<!-- bench study -->\n(.*?)<!-- end -->", PAGE.read_text(), flags=re.DOTALL)
    for heading in ("Table 2", "Table 3", "Tables 4 and 5", "Table 6", "Likely reasons"):
        assert heading in text


def test_a_worker_that_fails_says_why(cache, monkeypatch):
    def fails(unit):
        raise MjTactileError("no room")

    monkeypatch.setattr(plan.Unit, "run", fails)
    with pytest.raises(MjTactileError, match="no room"):
        reproduce(TINY, workers=1, fresh=True, progress=False)
