"""The command line: `mjtactile grasp`."""

from __future__ import annotations

from dataclasses import asdict
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
    show_table,
)
from mjtactile.fidelity import DEFAULT
from mjtactile.units import MOST_SEED

if TYPE_CHECKING:
    from mjtactile.experiments.grasp.trials import Experiment

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
        from mjtactile._files import check_apart, check_figure, check_writable, save_figure
        from mjtactile.experiments.grasp.trials import TrialSettings, run_trials
        from mjtactile.fidelity import as_fidelity
        from mjtactile.workers import Workers, check_workers

        as_fidelity(fidelity)
        own = None if weights is None else str(weights)
        settings = TrialSettings(seed=seed, trials=trials, noise=noise, fidelity=fidelity, weights=own)
        who = Workers(count=workers, ray=ray, ray_address=ray_address)
        check_workers(who)
        run: Experiment = getattr(import_module(f"mjtactile.experiments.grasp.{experiment}"), experiment.upper())
        if figure is not None and run.figure is None:
            raise typer.BadParameter(f"grasp {experiment} has no figure, only lift has one. Leave out --figure.")
        check_apart({"--out": out, "--figure": figure, "--page": page})
        check_writable(out)
        check_figure(figure)

        def results() -> dict[str, Any]:
            run.recognisers(own)
            found = run_trials(run, settings, workers=who, out=out)
            report = run.report(found)
            bounds = [asdict(one) for one in report.bounds]
            return {"settings": asdict(settings), "bounds": bounds, "figures": report.figures, "trials": found}

        def table(result: dict[str, Any]) -> str:
            about = f"Seed {seed}, readings {fidelity}, noise {noise:g}."
            return f"{about}\n\n{run.report(result['trials']).markdown()}"

        made = show_table(results, table, f"grasp {experiment}", page, as_json=as_json)
        if figure is not None and run.figure is not None:
            save_figure(figure, run.figure(made["trials"]), dpi=110)

    grasp_app.command(experiment, help=told)(command)


_add_command("lift", "Lift objects of unknown mass and friction with little more than the least grip that holds.")
_add_command("slip", "Detect slip, and stop the object before it has slid 2 mm.")
_add_command("handover", "Put objects down on shelves of unknown height, without dropping or pushing them.")
_add_command("sort", "Sort blocks by the shape that the fingers recognise.")
