"""The command line: `mjtactile grasp`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mjtactile.cli_workers import RayAddressOption, RayOption, WorkersOption

if TYPE_CHECKING:
    from mjtactile.distribute import Workers
    from mjtactile.grasp.statistics import Report
    from mjtactile.grasp.trials import Experiment

grasp_app = typer.Typer(
    help="Grasp experiments: hands that know what their pads feel, against blind ones and ones that know all.",
    no_args_is_help=True,
)

Seed = Annotated[int, typer.Option(min=0, help="Of objects, disturbances and noise.")]
Trials = Annotated[int, typer.Option(min=1, help="How many of each kind.")]
Noise = Annotated[float, typer.Option(min=0.0, help="Standard deviation over a pad's largest reading [-].")]
Fidelity = Annotated[str, typer.Option(help="Of the readings: fast, balanced, precise or accurate.")]
Weights = Annotated[Path | None, typer.Option(help="Folder of weights of one's own.  [default: shipped]")]
Out = Annotated[Path | None, typer.Option(help="Keep results in this file; call again to go on with it.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")]
Readme = Annotated[Path | None, typer.Option(help="Rewrite the table in this Markdown file.")]


@grasp_app.command()
def lift(
    seed: Seed = 0,
    trials: Trials = 200,
    workers: WorkersOption = 2,
    ray: RayOption = False,
    ray_address: RayAddressOption = None,
    noise: Noise = 0.01,
    fidelity: Fidelity = "fast",
    weights: Weights = None,
    out: Out = None,
    figure: Annotated[Path | None, typer.Option(help="Draw grips over what they had to be to this file.")] = None,
    as_json: AsJson = False,
    readme: Readme = None,
) -> None:
    """Lift objects of unknown mass and friction with the least grip that holds."""
    from mjtactile.grasp.lift import LIFT
    from mjtactile.report import check_writable

    if figure is not None:
        check_writable(figure)
    results = _run(LIFT, seed, trials, _who(workers, ray, ray_address), noise, fidelity, weights, out, as_json, readme)
    if figure is not None:
        from mjtactile.grasp.figure import lift_figure
        from mjtactile.report import write_atomically

        drawn, kind = lift_figure(results), figure.suffix.removeprefix(".").lower() or "png"
        write_atomically(figure, lambda file: drawn.savefig(file, format=kind, dpi=110))


@grasp_app.command()
def slip(
    seed: Seed = 0,
    trials: Trials = 200,
    workers: WorkersOption = 2,
    ray: RayOption = False,
    ray_address: RayAddressOption = None,
    noise: Noise = 0.01,
    fidelity: Fidelity = "fast",
    weights: Weights = None,
    out: Out = None,
    as_json: AsJson = False,
    readme: Readme = None,
) -> None:
    """Notice what slips before it has gone 2 mm, and hold it."""
    from mjtactile.grasp.slip import SLIP

    _run(SLIP, seed, trials, _who(workers, ray, ray_address), noise, fidelity, weights, out, as_json, readme)


@grasp_app.command()
def handover(
    seed: Seed = 0,
    trials: Trials = 200,
    workers: WorkersOption = 2,
    ray: RayOption = False,
    ray_address: RayAddressOption = None,
    noise: Noise = 0.01,
    fidelity: Fidelity = "fast",
    weights: Weights = None,
    out: Out = None,
    as_json: AsJson = False,
    readme: Readme = None,
) -> None:
    """Put down on contact: onto shelves of unknown height, neither dropped nor pushed."""
    from mjtactile.grasp.handover import HANDOVER

    _run(HANDOVER, seed, trials, _who(workers, ray, ray_address), noise, fidelity, weights, out, as_json, readme)


@grasp_app.command()
def sort(
    seed: Seed = 0,
    trials: Trials = 200,
    workers: WorkersOption = 2,
    ray: RayOption = False,
    ray_address: RayAddressOption = None,
    noise: Noise = 0.01,
    fidelity: Fidelity = "precise",
    out: Out = None,
    as_json: AsJson = False,
    readme: Readme = None,
) -> None:
    """Sort blocks by the shape that the fingers recognise."""
    from mjtactile.grasp.sort import SORT

    _run(SORT, seed, trials, _who(workers, ray, ray_address), noise, fidelity, None, out, as_json, readme)


def _who(workers: int, ray: bool, ray_address: str | None) -> Workers:
    from mjtactile.distribute import Workers

    return Workers(count=workers, ray=ray, ray_address=ray_address)


def _run(
    experiment: Experiment,
    seed: int,
    trials: int,
    workers: Workers,
    noise: float,
    fidelity: str,
    weights: Path | None,
    out: Path | None,
    as_json: bool,
    readme: Path | None,
) -> dict[str, list[dict[str, Any]]]:
    from mjtactile.grasp.trials import Settings, run_trials
    from mjtactile.preset import fidelity as checked

    checked(fidelity)
    settings = Settings(
        seed=seed,
        trials=trials,
        noise=noise,
        fidelity=fidelity,
        weights=None if weights is None else str(weights),
    )
    results = run_trials(experiment, settings, workers=workers, out=out)
    report: Report = experiment.report(results)
    text = report.markdown()
    typer.echo(json.dumps(_as_dict(settings, report, results), indent=2) if as_json else text)
    if readme is not None:
        from mjtactile.bench_tables import rewrite_table

        rewrite_table(
            readme, f"grasp {experiment.name}", f"Seed {seed}, readings {fidelity}, noise {noise:g}.\n\n{text}"
        )
    return results


def _as_dict(settings: Any, report: Report, results: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    return {
        "settings": asdict(settings),
        "bounds": [asdict(one) for one in report.bounds],
        "figures": report.figures,
        "trials": results,
    }
