"""The command line: `mjtactile reproduce`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from mjtactile.cli.options import PageOption, show_table


def reproduce(
    seeds: Annotated[
        int | None, typer.Option(min=1, max=1000, help="Number of initialisations of each network.  [default: 10]")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Train briefly and without variants, as a test.")] = False,
    iterations: Annotated[
        int | None, typer.Option(min=1, max=10**9, help="Most iterations of the magnitude networks.  [default: 100000]")
    ] = None,
    fidelity: Annotated[str | None, typer.Option(help="Fidelity of the readings.  [default: precise]")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one core each.")] = 2,
    fresh: Annotated[bool, typer.Option("--fresh", help="Ignore stored results of earlier runs.")] = False,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write all results to this JSON file.")] = None,
    page: PageOption = None,
) -> None:
    """Train and test the networks of Aoyagi 2008 by the paper's protocol, and compare its tables with ours."""
    from mjtactile._files import check_apart
    from mjtactile.experiments.study.plan import QUICK, StudySettings
    from mjtactile.experiments.study.report import study_report
    from mjtactile.experiments.study.reproduce import reproduce as run_study
    from mjtactile.fidelity import as_fidelity
    from mjtactile.workers import Workers

    settings = QUICK if quick else StudySettings()
    if seeds is not None:
        settings = replace(settings, seeds=seeds)
    if iterations is not None:
        settings = replace(settings, magnitude_iterations=iterations)
    if fidelity is not None:
        as_fidelity(fidelity)
        settings = replace(settings, fidelity=fidelity)
    Workers(count=workers)
    check_apart({"--json": json_file, "--page": page})
    show_table(lambda: run_study(settings, workers=workers, fresh=fresh), study_report, "study", page, out=json_file)
