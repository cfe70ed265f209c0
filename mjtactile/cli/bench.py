"""The command line: `mjtactile bench` with `mesh`, `plugin`, `trade`, `envs`, `extremes` and `today`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from mjtactile.cli.options import AsJson, PageOption
from mjtactile.errors import OutputError

bench_app = typer.Typer(help="Measure cost and error on this machine.", no_args_is_help=True)

Out = Annotated[Path | None, typer.Option(help="Write the result to this JSON file.")]


@bench_app.command("mesh")
def bench_mesh(as_json: AsJson = False, page: PageOption = None) -> None:
    """Build time, size, memory, update time and error of each mesh, beside MuJoCo's `<tactile>`."""
    from mjtactile.cli.benchmarks.mesh import mesh_benchmark
    from mjtactile.cli.benchmarks.tables import mesh_table, table_on_page

    write = table_on_page(page, "mesh")
    result = mesh_benchmark()
    typer.echo(json.dumps(result, indent=2) if as_json else mesh_table(result))
    write(mesh_table(result))


@bench_app.command("plugin")
def bench_plugin(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Preset fast and few runs only.")] = False,
    out: Out = None,
    page: PageOption = None,
) -> None:
    """What the MuJoCo sensor plugin adds to a step, beside MuJoCo's `<tactile>`, and many simulations at once."""
    from mjtactile._files import check_apart, check_writable
    from mjtactile.cli.benchmarks.plugin import plugin_benchmark, plugin_table
    from mjtactile.cli.benchmarks.tables import rounded, table_on_page

    check_apart({"--out": out, "--page": page})
    if out is not None:
        check_writable(out)
    write = table_on_page(page, "plugin")
    result = rounded(plugin_benchmark(quick=quick))
    if out is not None:
        _store(result, out)
    typer.echo(json.dumps(result, indent=2) if as_json else plugin_table(result))
    write(plugin_table(result))


@bench_app.command("trade")
def bench_trade(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Mesh draft and three cases only.")] = False,
    measured: Annotated[Path | None, typer.Option(help="Show this earlier result (JSON), measure nothing.")] = None,
    out: Out = None,
    page: PageOption = None,
    figure: Annotated[Path | None, typer.Option(help="Draw error against time to this file.")] = None,
) -> None:
    """Error and time per update of every fidelity, which of them nothing beats, and the presets among them.

    Ten minutes on an idle machine, most of it for tables, which stay in the cache (some 3 GB).
    """
    from mjtactile._files import check_apart, check_figure, check_writable
    from mjtactile.cli.benchmarks.tables import rounded, table_on_page, trade_table
    from mjtactile.cli.benchmarks.trade import trade_benchmark

    check_apart({"--measured": measured, "--out": out, "--figure": figure, "--page": page})
    if out is not None:
        check_writable(out)
    if figure is not None:
        check_figure(figure)
    write = table_on_page(page, "trade")
    result = rounded(trade_benchmark(quick=quick)) if measured is None else _earlier(measured)
    table = trade_table(result)
    if out is not None:
        _store(result, out)
    typer.echo(json.dumps(result, indent=2) if as_json else table)
    write(table)
    if figure is not None:
        _draw_trade(result, figure)


@bench_app.command("envs")
def bench_envs(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="One environment and few runs only.")] = False,
    page: PageOption = None,
) -> None:
    """Steps per second of one environment and of many, with and without pads, beside a plain step of MuJoCo."""
    from mjtactile.cli.benchmarks.envs import envs_benchmark, envs_table
    from mjtactile.cli.benchmarks.tables import table_on_page

    write = table_on_page(page, "envs")
    result = envs_benchmark(quick=quick)
    typer.echo(json.dumps(result, indent=2) if as_json else envs_table(result))
    write(envs_table(result))


@bench_app.command("extremes")
def bench_extremes(as_json: AsJson = False) -> None:
    """What comes out, or which error, at the ends of what may be asked."""
    from mjtactile.cli.benchmarks.extremes import extremes_benchmark, extremes_table

    result = extremes_benchmark()
    typer.echo(json.dumps(result, indent=2) if as_json else extremes_table(result))


@bench_app.command("today")
def bench_today(page: PageOption = None) -> None:
    """What people use today, beside mjtactile: from the stored runs of `trade` and `plugin`, measures nothing."""
    from mjtactile.cli.benchmarks.tables import stored_runs, table_on_page, today_table

    write = table_on_page(page, "today")
    table = today_table(**stored_runs())
    typer.echo(table)
    write(table)


def _store(result: dict[str, Any], path: Path) -> None:
    from mjtactile._files import write_atomically

    write_atomically(path, lambda file: file.write((json.dumps(result, indent=1) + "\n").encode()))


def _earlier(path: Path) -> dict[str, Any]:
    """A result written by `--out`."""
    from mjtactile._files import read_text
    from mjtactile.cli.benchmarks.tables import trade_table

    try:
        result = json.loads(read_text(path))
        trade_table(result)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise OutputError(
            f"{path} holds no result of an earlier run: {error or type(error).__name__}. Write one with --out."
        ) from error
    return result


def _draw_trade(result: dict[str, Any], path: Path) -> None:
    from mjtactile._files import save_figure
    from mjtactile.cli.benchmarks.figure import trade_figure

    save_figure(path, trade_figure(result), dpi=130)
