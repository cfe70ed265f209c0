"""Trials from seeds: the same whoever runs them, and continued where they were interrupted."""

import grasp_counting
import numpy as np
import pytest
from grasp_counting import COUNTING

from mjtactile.errors import TrialsError
from mjtactile.experiments.grasp.handover import HANDOVER
from mjtactile.experiments.grasp.lift import LIFT
from mjtactile.experiments.grasp.sort import SORT
from mjtactile.experiments.grasp.statistics import Bound, Report, median, share
from mjtactile.experiments.grasp.trials import TrialSettings, run_trials
from mjtactile.workers import Workers

SETTINGS = TrialSettings(seed=3, trials=5)


def test_results_do_not_depend_on_the_number_of_workers(tmp_path):
    alone = run_trials(COUNTING, SETTINGS, progress=False)
    shared = run_trials(COUNTING, SETTINGS, workers=Workers(count=2), out=tmp_path / "out", progress=False)
    assert alone == shared
    assert [len(trials) for trials in alone.values()] == [5, 5]
    assert alone["one"][2]["value"] == alone["other"][2]["value"]


def test_what_is_there_is_not_run_again(tmp_path):
    out = tmp_path / "out.jsonl"
    first = run_trials(COUNTING, SETTINGS, out=out, progress=False)
    lines = out.read_text().split("\n")
    # Interrupted in the middle of a line.
    out.write_text("\n".join(lines[:5]) + "\n" + lines[5][:20])
    grasp_counting.CALLS.clear()
    assert run_trials(COUNTING, SETTINGS, out=out, progress=False) == first
    assert len(grasp_counting.CALLS) == 10 - 4
    grasp_counting.CALLS.clear()
    more = run_trials(COUNTING, TrialSettings(seed=3, trials=6), out=out, progress=False)
    assert grasp_counting.CALLS == [("one", 5), ("other", 5)]
    assert more["one"][:5] == first["one"]


def test_a_file_of_other_trials_is_left_alone(tmp_path):
    out = tmp_path / "out.jsonl"
    run_trials(COUNTING, SETTINGS, out=out, progress=False)
    before = out.read_text()
    with pytest.raises(TrialsError, match="seed"):
        run_trials(COUNTING, TrialSettings(seed=4, trials=5), out=out, progress=False)
    assert out.read_text() == before
    (tmp_path / "notes").write_text("not trials")
    with pytest.raises(TrialsError, match="another name"):
        run_trials(COUNTING, SETTINGS, out=tmp_path / "notes", progress=False)


def test_wilsons_interval():
    # Of 95 in 100: Wilson (1927) gives 0.8883 to 0.9784.
    found = share([True] * 95 + [False] * 5)
    assert (found.value, found.low, found.high) == pytest.approx((0.95, 0.8883, 0.9784), abs=2e-4)
    assert share([True] * 200).low > 0.98
    assert np.isnan(share([]).value)


def test_a_median_lies_between_order_statistics():
    found = median([float(k) for k in range(101)])
    assert found.value == 50.0
    assert 39.0 <= found.low <= 41.0
    assert 59.0 <= found.high <= 61.0
    assert "nan" not in median([1.0, 2.0]).text()


def test_reports_of_conditions_that_gripped_nothing_have_no_numbers():
    for experiment, told in (
        (LIFT, {"success": False, "dropped": True, "crushed": False, "peak": 1.0}),
        (HANDOVER, {"success": False, "force": None, "drop": None}),
        (SORT, {"success": False, "right": False, "looks": 0}),
    ):
        text = experiment.report({condition: [told] for condition in experiment.conditions}).markdown()
        assert "nan" not in text
        assert " - |" in text
    assert median([]).text(" N") == share([]).percent == "-"


def test_a_report_says_what_was_missed():
    bound = Bound(what="lifted", bound=">= 95 %", found="90 %", met=False)
    text = Report(title="Lift.", head=("a", "b"), rows=[("1", "2")], bounds=[bound], figures={}).markdown()
    assert "| lifted | >= 95 % | 90 % | **no** |" in text
