"""Hands of robosuite, in the environment that has it and its MuJoCo."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from client_venvs import FOLDER, install

from mjtactile.hands import hand

SCRIPT = Path(__file__).with_name("grippers_of_robosuite.py")


@pytest.mark.slow
def test_pads_stand_on_robosuites_hands_as_the_tables_say_and_feel_a_ball():
    if not (FOLDER / "robosuite" / "installed").is_file():
        pytest.skip("the environment of robosuite is not there: make examples")
    python = install("robosuite", FOLDER)
    environment = {name: value for name, value in os.environ.items() if name != "MJTACTILE_LIBRARY"}
    environment["PYTHONPATH"] = str(SCRIPT.parents[1])
    done = subprocess.run([str(python), str(SCRIPT)], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout.splitlines()[-1])
    assert set(answers) == {"panda", "robotiq_85", "inspire"}
    for name, answer in answers.items():
        proud = hand(name).proud
        assert set(answer["over_mm"]) == set(proud)
        for shape, (low, high) in answer["over_mm"].items():
            assert low >= 1e3 * proud[shape][0] - 2e-3
            assert high <= 1e3 * proud[shape][1] + 2e-3
        # Facets turn what presses on a curved pad by a degree or two.
        assert answer["carried"] == pytest.approx(0.5, rel=1e-2)
