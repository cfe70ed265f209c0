"""The command line: `mjtactile bench` with `mesh`, `plugin`, `trade`, `small-contacts`, `envs`, `extremes`, `today`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from mjtactile.cli.options import AsJson, PageOption, show_table
from mjtactile.errors import OutputError

bench_app = typer.Typer(help="Measure time, size and error on this machine.", no_args_is_help=True)

Out = Annotated[Path | None, typer.Option(help="Write the result to this JSON file.")]


@bench_app.command("mesh")
def bench_mesh(as_json: AsJson = False, page: PageOption = None) -> None:
    """Measure build time, size, memory, update time and error of each mesh, compared with MuJoCo's `<tactile>`."""
    from mjtactile.cli.benchmarks.mesh import mesh_benchmark
    from mjtactile.cli.benchmarks.tables import mesh_table

    show_table(mesh_benchmark, mesh_table, "mesh", page, as_json=as_json)


@bench_app.command("plugin")
def bench_plugin(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Measure preset fast alone, in few runs.")] = False,
    out: Out = None,
    page: PageOption = None,
) -> None:
    """Measure the time that the sensor plugin adds to a MuJoCo step, compared with MuJoCo's `<tactile>`."""
    from mjtactile._files import check_apart
    from mjtactile.cli.benchmarks.plugin import plugin_benchmark, plugin_table
    from mjtactile.cli.benchmarks.tables import rounded

    check_apart({"--out": out, "--page": page})
    show_table(lambda: rounded(plugin_benchmark(quick=quick)), plugin_table, "plugin", page, as_json=as_json, out=out)


@bench_app.command("trade")
def bench_trade(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Measure mesh draft alone, in three cases.")] = False,
    measured: Annotated[Path | None, typer.Option(help="Show this stored result (JSON); measure nothing.")] = None,
    out: Out = None,
    page: PageOption = None,
    figure: Annotated[Path | None, typer.Option(help="Draw error against time to this file.")] = None,
) -> None:
    """Measure error and time per update of every fidelity, and show the presets and the Pareto front.

    This takes ten minutes on an idle machine, mostly for building tables, which stay in the cache (about 3 GB).
    """
    from mjtactile._files import check_apart, check_figure, save_figure
    from mjtactile.cli.benchmarks.figure import trade_figure
    from mjtactile.cli.benchmarks.tables import rounded, trade_table
    from mjtactile.cli.benchmarks.trade import trade_benchmark

    check_apart({"--measured": measured, "--out": out, "--figure": figure, "--page": page})
    check_figure(figure)

    def measure() -> dict[str, Any]:
        return rounded(trade_benchmark(quick=quick)) if measured is None else _earlier(measured)

    result = show_table(measure, trade_table, "trade", page, as_json=as_json, out=out)
    if figure is not None:
        save_figure(figure, trade_figure(result), dpi=130)


@bench_app.command("small-contacts")
def bench_small_contacts(as_json: AsJson = False, page: PageOption = None) -> None:
    """Measure the error of every preset under contacts that are not much larger than an element of its mesh."""
    from mjtactile.cli.benchmarks.small_contacts import small_contacts_benchmark, small_contacts_table

    show_table(small_contacts_benchmark, small_contacts_table, "small-contacts", page, as_json=as_json)


@bench_app.command("envs")
def bench_envs(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Measure one environment alone, in few runs.")] = False,
    page: PageOption = None,
) -> None:
    """Measure steps per second of one environment and of many, with and without pads, compared with MuJoCo alone."""
    from mjtactile.cli.benchmarks.envs import envs_benchmark, envs_table

    show_table(lambda: envs_benchmark(quick=quick), envs_table, "envs", page, as_json=as_json)


@bench_app.command("extremes")
def bench_extremes(as_json: AsJson = False) -> None:
    """Measure the error at the limits of pads, loads and inputs, or show the error message there."""
    from mjtactile.cli.benchmarks.extremes import extremes_benchmark, extremes_table

    show_table(extremes_benchmark, extremes_table, "extremes", None, as_json=as_json)


@bench_app.command("today")
def bench_today(page: PageOption = None) -> None:
    """Compare mjtactile with other sensors, from the stored results of `trade` and `plugin`; measure nothing."""
    from mjtactile.cli.benchmarks.tables import stored_runs, today_table

    show_table(stored_runs, lambda runs: today_table(**runs), "today", page)


def _earlier(path: Path) -> dict[str, Any]:
    """A result written by `--out`."""
    from mjtactile._files import read_text
    from mjtactile.cli.benchmarks.tables import trade_table

    try:
        result = json.loads(read_text(path))
        trade_table(result)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise OutputError(
            f"{path} holds no result of `bench trade`: {error or type(error).__name__}. Write one with --out."
        ) from error
    return result
