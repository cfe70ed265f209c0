"""The command line: `mjtactile bench mesh`, `bench plugin`, `bench trade`, `bench envs` and `bench extremes`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from mjtactile.errors import OutputError

bench_app = typer.Typer(help="Measure cost and error on this machine.", no_args_is_help=True)

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


@bench_app.command("mesh")
def bench_mesh(
    as_json: AsJson = False,
    readme: Annotated[Path | None, typer.Option(help="Rewrite the table in this Markdown file.")] = None,
) -> None:
    """Build time, size, memory, update time and error of each mesh, beside MuJoCo's <tactile>."""
    from mjtactile.bench import mesh_benchmark
    from mjtactile.bench_tables import mesh_table, rewrite_table

    result = mesh_benchmark()
    typer.echo(json.dumps(result, indent=2) if as_json else mesh_table(result))
    if readme is not None:
        rewrite_table(readme, "mesh", mesh_table(result))


@bench_app.command("plugin")
def bench_plugin(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Preset fast and few runs only.")] = False,
    readme: Annotated[Path | None, typer.Option(help="Rewrite the table in this Markdown file.")] = None,
) -> None:
    """What the MuJoCo sensor plugin adds to a step, beside MuJoCo's <tactile>, and many simulations at once."""
    from mjtactile.bench_plugin import plugin_benchmark, plugin_table
    from mjtactile.bench_tables import rewrite_table

    result = plugin_benchmark(quick=quick)
    typer.echo(json.dumps(result, indent=2) if as_json else plugin_table(result))
    if readme is not None:
        rewrite_table(readme, "plugin", plugin_table(result))


@bench_app.command("trade")
def bench_trade(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Mesh draft and three cases only.")] = False,
    measured: Annotated[Path | None, typer.Option(help="Show this earlier result (JSON), measure nothing.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the result to this JSON file.")] = None,
    readme: Annotated[Path | None, typer.Option(help="Rewrite the table in this Markdown file.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw error against time to this file.")] = None,
) -> None:
    """Error and time per update of every fidelity, which of them nothing beats, and the presets among them.

    Ten minutes on an idle machine, most of it for tables, which stay in the cache (some 3 GB).
    """
    from mjtactile.bench_tables import rewrite_table, rounded, trade_table
    from mjtactile.bench_trade import trade_benchmark
    from mjtactile.report import check_writable, write_atomically

    for path in (out, figure):
        if path is not None:
            check_writable(path)
    result = rounded(trade_benchmark(quick=quick)) if measured is None else _earlier(measured)
    if out is not None:
        write_atomically(out, lambda file: file.write((json.dumps(result, indent=1) + "\n").encode()))
    typer.echo(json.dumps(result, indent=2) if as_json else trade_table(result))
    if readme is not None:
        rewrite_table(readme, "trade", trade_table(result))
    if figure is not None:
        _draw_trade(result, figure)


@bench_app.command("envs")
def bench_envs(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="One environment and few runs only.")] = False,
    readme: Annotated[Path | None, typer.Option(help="Rewrite the table in this Markdown file.")] = None,
) -> None:
    """Steps per second of one environment and of many, with and without pads, beside a plain step of MuJoCo."""
    from mjtactile.bench_envs import envs_benchmark, envs_table
    from mjtactile.bench_tables import rewrite_table

    result = envs_benchmark(quick=quick)
    typer.echo(json.dumps(result, indent=2) if as_json else envs_table(result))
    if readme is not None:
        rewrite_table(readme, "envs", envs_table(result))


@bench_app.command("extremes")
def bench_extremes(as_json: AsJson = False) -> None:
    """What comes out, or which error, at the ends of what may be asked."""
    from mjtactile.bench_extremes import extremes_benchmark, extremes_table

    result = extremes_benchmark()
    typer.echo(json.dumps(result, indent=2) if as_json else extremes_table(result))


def _earlier(path: Path) -> dict[str, Any]:
    """A result written by `--out`."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise OutputError(f"{path} holds no result of an earlier run: {error}. Write one with --out.") from error


def _draw_trade(result: dict[str, Any], path: Path) -> None:
    from mjtactile.bench_figure import trade_figure

    trade_figure(result).savefig(path, dpi=130)
