"""The command line: `mjtactile grasp`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mjtactile.cli.options import (
    AsJson,
    FidelityOption,
    NoiseOption,
    PageOption,
    RayAddressOption,
    RayOption,
    WorkersOption,
    json_text,
)
from mjtactile.fidelity import DEFAULT
from mjtactile.units import MOST_SEED

if TYPE_CHECKING:
    from mjtactile.experiments.grasp.statistics import Report
    from mjtactile.experiments.grasp.trials import Experiment, TrialSettings
    from mjtactile.workers import Workers

grasp_app = typer.Typer(
    help="Grasp experiments: hands with recognised touch, compared with hands without touch and with true forces.",
    no_args_is_help=True,
)

#: All results are in memory together.
_MOST_TRIALS = 1_000_000

Seed = Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Seed of objects, disturbances and noise.")]
Trials = Annotated[int, typer.Option(min=1, max=_MOST_TRIALS, help="Number of trials of each condition.")]
Weights = Annotated[
    Path | None,
    typer.Option(help="Folder of other weights, or one with their subfolders all and grasp.  [default: the package's]"),
]
Out = Annotated[Path | None, typer.Option(help="Store results in this file; run again to continue it.")]
Figure = Annotated[Path | None, typer.Option(help="Draw grip against least grip to this file; lift only.")]


def _add_command(experiment: str, told: str) -> None:
    """Add the command of an experiment; all of them take the same options."""

    def command(
        seed: Seed = 0,
        trials: Trials = 200,
        workers: WorkersOption = 2,
        ray: RayOption = False,
        ray_address: RayAddressOption = None,
        noise: NoiseOption = 0.01,
        fidelity: FidelityOption = DEFAULT,
        weights: Weights = None,
        out: Out = None,
        figure: Figure = None,
        as_json: AsJson = False,
        page: PageOption = None,
    ) -> None:
        from mjtactile.experiments.grasp.trials import TrialSettings
        from mjtactile.fidelity import as_fidelity
        from mjtactile.workers import Workers, check_workers

        as_fidelity(fidelity)
        own = None if weights is None else str(weights)
        settings = TrialSettings(seed=seed, trials=trials, noise=noise, fidelity=fidelity, weights=own)
        who = Workers(count=workers, ray=ray, ray_address=ray_address)
        check_workers(who)
        run = getattr(import_module(f"mjtactile.experiments.grasp.{experiment}"), experiment.upper())
        _run(run, settings, who, _Output(out=out, figure=figure, as_json=as_json, page=page))

    grasp_app.command(experiment, help=told)(command)


_add_command("lift", "Lift objects of unknown mass and friction with little more than the least grip that holds.")
_add_command("slip", "Detect slip, and stop the object before it has slid 2 mm.")
_add_command("handover", "Put objects down on shelves of unknown height, without dropping or pushing them.")
_add_command("sort", "Sort blocks by the shape that the fingers recognise.")


@dataclass(frozen=True, kw_only=True)
class _Output:
    """Files that are written, and what is printed; see the options of the commands."""

    out: Path | None
    figure: Path | None
    as_json: bool
    page: Path | None


def _run(experiment: Experiment, settings: TrialSettings, workers: Workers, output: _Output) -> None:
    from mjtactile._files import check_apart, check_figure, check_writable, save_figure
    from mjtactile.cli.benchmarks.tables import table_on_page
    from mjtactile.experiments.grasp.trials import run_trials

    table = f"grasp {experiment.name}"
    out, figure = output.out, output.figure
    if figure is not None and experiment.figure is None:
        raise typer.BadParameter(f"{table} has no figure, only lift has one. Leave out --figure.")
    check_apart({"--out": out, "--figure": figure, "--page": output.page})
    check_writable(out)
    check_figure(figure)
    write = table_on_page(output.page, table)
    experiment.recognisers(settings.weights)
    results = run_trials(experiment, settings, workers=workers, out=out)
    report: Report = experiment.report(results)
    text = report.markdown()
    typer.echo(json_text(_as_dict(settings, report, results)) if output.as_json else text)
    write(f"Seed {settings.seed}, readings {settings.fidelity}, noise {settings.noise:g}.\n\n{text}")
    if figure is not None and experiment.figure is not None:
        save_figure(figure, experiment.figure(results), dpi=110)


def _as_dict(settings: Any, report: Report, results: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    return {
        "settings": asdict(settings),
        "bounds": [asdict(one) for one in report.bounds],
        "figures": report.figures,
        "trials": results,
    }
