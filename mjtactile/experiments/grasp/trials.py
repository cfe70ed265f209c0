"""Hundreds of trials: from seeds, by any number of workers, resumable after interruptions.

A trial's result depends on seed, condition and number alone. Results are appended to a file, a line each, and sorted at
the end; if a process is killed, only its unfinished trials are lost.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from mjtactile._files import read_text, write_atomically
from mjtactile._installed import __version__
from mjtactile._progress import progress_bar
from mjtactile.errors import TrialsError
from mjtactile.fidelity import DEFAULT
from mjtactile.workers import Workers, distributed

Result = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class TrialSettings:
    """Settings of all trials of a run."""

    seed: int = 0  #: seed of all random numbers
    trials: int = 200  #: number of trials of each condition
    noise: float = 0.01  #: standard deviation of the readings' noise over a pad's largest reading [-]
    fidelity: str = DEFAULT  #: fidelity of the readings, a preset by name
    weights: str | None = None  #: folder of the recognisers' weights; None for those of the package


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Trials under several conditions."""

    name: str  #: such as "lift"
    conditions: tuple[str, ...]  #: names of the conditions; a trial number is the same task under all of them
    #: Function of settings, condition and number that returns plain numbers; importable by name.
    trial: Callable[[TrialSettings, str, int], Result]
    #: Function of results by condition, sorted by number, that returns what is printed.
    report: Callable[[dict[str, list[Result]]], Any]
    #: Loads recognisers from a folder of weights; it raises an error if they cannot be used.
    recognisers: Callable[[str | None], Any]
    #: Function of the same results that returns a matplotlib figure, if there is one.
    figure: Callable[[dict[str, list[Result]]], Any] | None = None


def run_trials(
    experiment: Experiment,
    settings: TrialSettings,
    *,
    workers: Workers | None = None,
    out: Path | None = None,
    progress: bool = True,
) -> dict[str, list[Result]]:
    """Run all trials whose results are not in the file `out` yet; return results by condition, in order.

    Args:
        experiment: the experiment.
        settings: settings of all trials.
        workers: where trials run; the results do not depend on it. None: this process.
        out: file of results to write, or to continue if it has the same settings.
        progress: show a progress bar on a terminal.

    Raises:
        TrialsError: `out` contains results of other trials, or is another kind of file.
        DistributeError: Ray is missing or cannot be reached, or workers are killed repeatedly during the same trial.
        OSError: `out` cannot be written.
    """
    jobs = [(condition, k) for k in range(settings.trials) for condition in experiment.conditions]
    about = {"experiment": experiment.name, "version": __version__, **asdict(settings)}
    about.pop("trials")
    about = json.loads(json.dumps(about))
    done = {} if out is None else _read(out, about)
    left = [job for job in jobs if job not in done]
    with progress_bar(experiment.name, len(jobs), wanted=progress) as advance:
        advance(len(jobs) - len(left))
        if out is not None and not out.exists():
            out.write_text(json.dumps(about) + "\n")
        tried = partial(_tried, experiment.trial, settings)
        for place, result in distributed(tried, left, workers or Workers()):
            job = left[place]
            done[job] = json.loads(json.dumps(result))
            if out is not None:
                with out.open("a") as file:
                    file.write(json.dumps({"condition": job[0], "trial": job[1], "result": result}) + "\n")
            advance(1)
    return {condition: [done[condition, k] for k in range(settings.trials)] for condition in experiment.conditions}


def _tried(trial: Callable[[TrialSettings, str, int], Result], settings: TrialSettings, job: tuple[str, int]) -> Result:
    """Run one trial in a worker."""
    return trial(settings, *job)


def _read(path: Path, about: dict[str, Any]) -> dict[tuple[str, int], Result]:
    """Results in a file by condition and number; damaged and incomplete lines are removed."""
    if not path.exists():
        return {}
    try:
        lines = read_text(path).split("\n")
        head = json.loads(lines[0])
    except (OSError, ValueError, RecursionError):
        raise TrialsError(f"{path} is not a file of trials. Choose another name.") from None
    if head != about:
        other = [key for key in about if head.get(key) != about[key]] if isinstance(head, dict) else list(about)
        raise TrialsError(f"{path} holds trials of other settings ({', '.join(other)}). Choose another name.")
    done = {line: _entry(line) for line in lines[1:-1]}
    whole = {line: entry for line, entry in done.items() if entry is not None}
    if len(whole) < len(lines) - 2 or lines[-1]:
        content = "\n".join([lines[0], *whole]) + "\n"
        write_atomically(path, lambda file: file.write(content.encode()))
    return dict(whole.values())


def _entry(line: str) -> tuple[tuple[str, int], Result] | None:
    """A trial's condition and number, and its result; None for a line that is damaged."""
    try:
        entry = json.loads(line)
        condition, number, result = entry["condition"], entry["trial"], entry["result"]
    except (ValueError, LookupError, TypeError, RecursionError):
        return None
    if not (isinstance(condition, str) and isinstance(number, int) and isinstance(result, dict)):
        return None
    return (condition, number), result
