"""The command line: `mjtactile press`, `build`, `info` and `bench`.

Every wrong input ends in one line on standard error and exit code 2.
"""

from __future__ import annotations

import io
import json
import math
import os
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from mjtactile.cli.bench import bench_app
from mjtactile.cli.dataset import dataset
from mjtactile.cli.envs import envs
from mjtactile.cli.evaluate import evaluate
from mjtactile.cli.grasp import grasp_app
from mjtactile.cli.loop import loop
from mjtactile.cli.options import AsJson, FidelityOption, finite
from mjtactile.cli.record import record
from mjtactile.cli.reproduce import reproduce
from mjtactile.cli.view import view
from mjtactile.errors import MjTactileError
from mjtactile.fidelity import DEFAULT, fidelity_text

app = typer.Typer(
    help="A sense of touch for robot hands in MuJoCo.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.add_typer(bench_app, name="bench")
app.add_typer(grasp_app, name="grasp")
app.command()(dataset)
app.command()(envs)
app.command()(evaluate)
app.command()(loop)
app.command()(record)
app.command()(reproduce)
app.command()(view)


@app.command()
def press(
    shape: Annotated[
        str, typer.Argument(help="A punch (circle, doughnut, ... see info), sphere, cylinder, box, or a mesh file.")
    ],
    force: Annotated[str, typer.Option(help="Magnitude with unit: 100gf, 0.98N.")] = "100gf",
    tilt: Annotated[float, typer.Option(callback=finite, help="Of the force, from straight into the pad [deg].")] = 0.0,
    azimuth: Annotated[float, typer.Option(callback=finite, help="Of the tilt, from +x towards +y [deg].")] = 0.0,
    shift: Annotated[str, typer.Option(help="Of the indenter, x,y [mm].")] = "0,0",
    rotate: Annotated[float, typer.Option(callback=finite, help="Of the indenter, counter-clockwise [deg].")] = 0.0,
    free: Annotated[bool, typer.Option("--free", help="Let the indenter tilt.")] = False,
    fidelity: FidelityOption = DEFAULT,
    law: Annotated[str | None, typer.Option(help="uniform, foundation or elastic.  [default: the fidelity's]")] = None,
    tangential: Annotated[str, typer.Option(help="Shear: proportional, stick or coulomb.")] = "proportional",
    friction: Annotated[float | None, typer.Option(help="Bound of the shear.  [default: none, or MuJoCo's]")] = None,
    out: Annotated[Path | None, typer.Option(help="Write arrays to this .npz file.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw readings, section and scene to this file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Press an indenter into the pad in MuJoCo and read the taxels."""
    from mjtactile._files import check_apart, check_figure, check_writable
    from mjtactile.cli.press import run_press
    from mjtactile.pad import force_vector
    from mjtactile.units import parse_force, parse_millimetres

    force_on_indenter = force_vector(parse_force(force), tilt, azimuth)
    place = parse_millimetres("shift", shift)
    check_apart({"the mesh": Path(shape), "--out": out, "--figure": figure})
    if out is not None:
        check_writable(out)
    if figure is not None:
        check_figure(figure)
    report = run_press(
        shape,
        force_on_indenter,
        fidelity=fidelity,
        law=law,
        tangential=tangential,
        friction=friction,
        shift=place,
        rotate_deg=rotate,
        tilt_free=free,
    )
    if out is not None:
        report.save(out)
    if figure is not None:
        _draw_press(report, figure)
    if as_json:
        typer.echo(json.dumps(report.as_dict(), indent=2))
    else:
        _print_press(report, out, figure)


@app.command()
def build(
    fidelity: FidelityOption = DEFAULT,
    force: Annotated[bool, typer.Option("--force", help="Build even if the cache has it.")] = False,
) -> None:
    """Build the default pad's influence matrices into the cache."""
    from time import perf_counter

    from mjtactile.influence.cache import cached_path, influence_matrices
    from mjtactile.pad import Pad

    path = cached_path(Pad(), fidelity)
    if force:
        path.unlink(missing_ok=True)
    present = path.exists()
    start = perf_counter()
    influence = influence_matrices(fidelity=fidelity)
    action = "found" if present else "built"
    typer.echo(f"{action} {influence.nbytes / 1e6:.0f} MB in {perf_counter() - start:.2f} s: {path}")


@app.command()
def info(as_json: AsJson = False) -> None:
    """Show the pad, the indenters, the meshes, the presets and what is in the cache."""
    from mjtactile._version import __version__
    from mjtactile.cli.press import OTHER_INDENTERS
    from mjtactile.fidelity import MESHES, PRESETS, Fidelity
    from mjtactile.geometry.outlines import INDENTER_NAMES
    from mjtactile.influence.cache import cache_directory, cached_path
    from mjtactile.pad import Pad

    pad = Pad()
    meshes = {name: cached_path(pad, Fidelity(mesh=name)) for name in MESHES}
    presets = {name: cached_path(pad, name) for name in PRESETS}
    facts: dict[str, Any] = {
        "version": __version__,
        "mujoco": _mujoco_version(),
        "pad": pad.summary,
        "punches": list(INDENTER_NAMES),
        "other indenters": list(OTHER_INDENTERS),
        "cache": str(cache_directory()),
        "meshes": {name: _size(path) for name, path in meshes.items()},
        "presets": {name: _size(path) for name, path in presets.items()},
    }
    if as_json:
        typer.echo(json.dumps(facts, indent=2))
        return
    for name, value in facts.items():
        if isinstance(value, list):
            value = ", ".join(value)
        elif isinstance(value, dict):
            value = ", ".join(
                f"{table} ({'not built' if size is None else f'{size / 1e6:.0f} MB'})" for table, size in value.items()
            )
        typer.echo(f"{name + ':':17}{value}")


def main() -> None:
    """Entry point: errors are one line, exit code 2; warnings are one line each."""
    warnings.showwarning = _show_warning
    if isinstance(sys.stdout, io.TextIOWrapper):  # names of files may hold what the terminal cannot show
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        app(standalone_mode=False)
        sys.stdout.flush()
    except MjTactileError as error:
        _fail(str(error))
    except KeyboardInterrupt:
        _fail("interrupted", code=130)
    except BrokenPipeError:  # whoever read the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:  # a full disk, a folder that went away
        _fail(str(error))
    except MemoryError:
        _fail("there is not enough memory for this. Ask for less: a coarser mesh, fewer presses or fewer workers.")
    except Exception as error:
        # Usage errors of the command-line parser carry their own message.
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        text = message()
        if text.startswith("Usage:"):  # a command without arguments: its whole help
            print(text, file=sys.stderr)
            sys.exit(2)
        _fail(text)


def _fail(message: str, code: int = 2) -> None:
    print(f"mjtactile: error: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(code)


def _show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    print(f"mjtactile: {category.__name__}: {' '.join(str(message).split())}", file=sys.stderr)


def _mujoco_version() -> str:
    import mujoco

    return mujoco.mj_versionString()


def _size(path: Path) -> int | None:
    return path.stat().st_size if path.exists() else None


def _draw_press(report: Any, path: Path) -> None:
    from mjtactile._files import save_figure
    from mjtactile.cli.plot import press_figure
    from mjtactile.sim.render import RenderError, render_scene
    from mjtactile.units import GRAM_FORCE

    try:
        picture = render_scene(report.model, report.data, 640, 480, camera="oblique")
    except RenderError as error:
        print(f"mjtactile: the figure goes without the scene: {error}", file=sys.stderr)
        picture = None
    shape = report.shape.replace("$", r"\$")  # which is not to be set as a formula
    title = f"{shape}, {report.force_reached / GRAM_FORCE:.4g} gf"
    drawn = press_figure(report.influence.pad, report.readings, report.outline, title=title, picture=picture)
    save_figure(path, drawn, dpi=130)


def _print_press(report: Any, out: Path | None, figure: Path | None) -> None:
    from mjtactile.units import GRAM_FORCE

    console = Console(soft_wrap=True)
    commanded = float((report.commanded**2).sum() ** 0.5)
    console.print(
        f"{report.shape}: {report.force_reached / GRAM_FORCE:.5g} gf reached of {commanded / GRAM_FORCE:.5g} gf "
        f"({report.settled.error:.1e} off) after {report.settled.time * 1e3:.0f} ms, "
        f"contact {report.contact.area * 1e6:.4g} mm2",
        highlight=False,
        markup=False,
    )
    indentation = "" if math.isnan(report.load.approach) else f"indentation {report.load.approach * 1e6:.4g} um, "
    console.print(
        f"fidelity {fidelity_text(report.influence.fidelity)}, law {report.law}: {indentation}"
        f"peak pressure {report.load.peak_pressure * 1e-3:.4g} kPa",
        highlight=False,
    )
    table = Table("depth, mm", "peak, kPa", "at x, y, mm", box=None, pad_edge=False)
    pad = report.influence.pad
    for depth, reading in zip(pad.depths, report.readings, strict=True):
        row, column = divmod(int(reading.argmax()), reading.shape[1])
        place = f"{pad.taxels.x[column] * 1e3:g}, {pad.taxels.y[row] * 1e3:g}"
        table.add_row(f"{depth * 1e3:g}", f"{reading.max() * 1e-3:.4g}", place)
    console.print(table)
    console.print(
        f"time per update ({report.readings.size} readings): {report.update_time * 1e3:.2f} ms",
        highlight=False,
    )
    for path in (out, figure):
        if path is not None:
            typer.echo(f"wrote {path}")
