"""The command line: `mjtactile`, its groups of commands, and `press`.

Every wrong input ends in one line on standard error and exit code 2.
"""

from __future__ import annotations

import io
import math
import os
import sys
import warnings
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from mjtactile._installed import __version__, page_address
from mjtactile.cli.bench import bench_app
from mjtactile.cli.dataset import dataset, record
from mjtactile.cli.evaluate import evaluate
from mjtactile.cli.grasp import grasp_app
from mjtactile.cli.installation import build, cache_app, doctor, info
from mjtactile.cli.loop import loop
from mjtactile.cli.options import AsJson, FidelityOption, PadOption, finite, into_pad, json_text, positive
from mjtactile.cli.reproduce import reproduce
from mjtactile.cli.view import envs, hands, preview, view
from mjtactile.errors import MjTactileError
from mjtactile.fidelity import DEFAULT, fidelity_text

_EXAMPLES = """
Examples:

    mjtactile press star --force 100gf --tilt 15   # press a punch into the pad
    mjtactile press tool.stl --scale 1e-3 --json   # press a mesh of your own, drawn in millimetres
    mjtactile press sphere --pad dome.toml --figure dome.png   # use a pad of your own
    mjtactile doctor                               # check the installation
    mjtactile COMMAND --help                       # show a command's options
"""
_MEASURE, _INSTALLATION = "Experiments and measurements", "This installation"

app = typer.Typer(
    help="A sense of touch for robot hands in MuJoCo.",
    epilog=_EXAMPLES,
    no_args_is_help=True,
    rich_markup_mode="markdown",  # brackets, around units, stay what they are
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mjtactile {__version__}")
        raise typer.Exit


@app.callback()
def before_any_command(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before a command."""


@app.command(rich_help_panel="Touch")
def press(
    shape: Annotated[
        str, typer.Argument(help="A punch (circle, doughnut, ... see info), sphere, cylinder, box, or a mesh file.")
    ],
    force: Annotated[
        str, typer.Option(help="Magnitude with unit: 100gf, 0.98N; at most 2.5 N along each axis of the pad.")
    ] = "100gf",
    tilt: Annotated[
        float, typer.Option(callback=into_pad, help="Angle of the force to the pad's inward normal [deg].")
    ] = 0.0,
    azimuth: Annotated[
        float, typer.Option(callback=finite, help="Direction of the tilt, from +x towards +y [deg].")
    ] = 0.0,
    shift: Annotated[str, typer.Option(help="Position x,y of the indenter [mm].")] = "0,0",
    rotate: Annotated[
        float, typer.Option(callback=finite, help="Rotation of the indenter, counter-clockwise [deg].")
    ] = 0.0,
    scale: Annotated[
        float | None,
        typer.Option(
            callback=positive, help="Metres per unit of a mesh file: 1e-3 for one drawn in millimetres.  [default: 1]"
        ),
    ] = None,
    free: Annotated[bool, typer.Option("--free", help="Let the indenter tilt.")] = False,
    fidelity: FidelityOption = DEFAULT,
    law: Annotated[
        str | None, typer.Option(help="Contact law: uniform, foundation or elastic.  [default: the fidelity's]")
    ] = None,
    tangential: Annotated[str, typer.Option(help="Shear: proportional, stick or coulomb.")] = "proportional",
    friction: Annotated[
        float | None, typer.Option(help="Coefficient that bounds the shear [-].  [default: none; coulomb: MuJoCo's]")
    ] = None,
    pad: PadOption = None,
    recognise: Annotated[
        bool, typer.Option("--recognise", help="Find force and shape from the readings alone, by the trained networks.")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Write readings and wrench to this .npz file.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw readings, section and scene to this file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Press an indenter into a pad in MuJoCo and read the taxels."""
    from mjtactile._files import check_apart, check_figure, check_npz
    from mjtactile.cli.press import PressProblem, run_press
    from mjtactile.pad import Pad, force_vector
    from mjtactile.pad_names import pad_from_file
    from mjtactile.units import parse_force, parse_millimetres

    force_on_indenter = force_vector(parse_force(force), tilt, azimuth)
    place = parse_millimetres("shift", shift)
    check_apart({"the mesh": Path(shape), "--pad": pad, "--out": out, "--figure": figure})
    check_npz(out)
    check_figure(figure)
    report = run_press(
        PressProblem(
            shape=shape,
            force=force_on_indenter,
            pad=Pad() if pad is None else pad_from_file(pad),
            fidelity=fidelity,
            law=law,
            tangential=tangential,
            friction=friction,
            shift=place,
            rotate_deg=rotate,
            scale=scale,
            tilt_free=free,
            recognise=recognise,
        )
    )
    if out is not None:
        report.save(out)
    if as_json:
        typer.echo(json_text(report.as_dict()))
    else:
        _print_press(report)
    sys.stdout.flush()
    if figure is not None:
        _draw_press(report, figure)  # takes a second or two, so the numbers are printed first
    for path in (out, figure):
        if path is not None and not as_json:
            typer.echo(f"wrote {path}")


for _command_of_touch in (loop, view, dataset, record, envs, preview, hands):
    app.command(rich_help_panel="Touch")(_command_of_touch)
app.add_typer(grasp_app, name="grasp", rich_help_panel=_MEASURE)
app.command(rich_help_panel=_MEASURE)(evaluate)
app.command(rich_help_panel=_MEASURE)(reproduce)
app.add_typer(bench_app, name="bench", rich_help_panel=_MEASURE)
app.command(rich_help_panel=_INSTALLATION)(doctor)
app.command(rich_help_panel=_INSTALLATION)(info)
app.command(rich_help_panel=_INSTALLATION)(build)
app.add_typer(cache_app, name="cache", rich_help_panel=_INSTALLATION)


def main() -> None:
    """Entry point: errors are one line, exit code 2; warnings are one line each."""
    warnings.showwarning = partial(_show_warning, set())
    if isinstance(sys.stdout, io.TextIOWrapper):  # file names may contain characters that the terminal cannot show
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        code = _command()(prog_name="mjtactile", standalone_mode=False)
        sys.stdout.flush()
        if code:  # the command has reported a problem itself
            sys.exit(code)
    except MjTactileError as error:
        _fail(f"{_sentence(str(error))} More: {page_address(error.page)}" if error.page else str(error))
    except KeyboardInterrupt:
        _fail("interrupted", code=130)
    except BrokenPipeError:  # the reader of the output, such as `head`, has ended
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
        if not text:  # a group without a command: its help has been shown
            sys.exit(2)
        context = getattr(error, "ctx", None)
        _fail(f"{_sentence(text)} See `{context.command_path} --help`." if context is not None else text)


@lru_cache(maxsize=1)
def _command() -> Callable[..., Any]:
    """All commands with their options. Cached, because typer takes longer to collect them than to refuse an option."""
    return typer.main.get_command(app)


def _sentence(text: str) -> str:
    """The text with a full stop if it has no end mark, so that another sentence can follow."""
    return text if text.endswith((".", "?", "!")) else f"{text}."


def _fail(message: str, code: int = 2) -> None:
    print(f"mjtactile: error: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(code)


def _show_warning(shown: set[str], message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Print a warning once, because several places may issue the same one."""
    line = f"{category.__name__}: {' '.join(str(message).split())}"
    if line not in shown:
        shown.add(line)
        print(f"mjtactile: {line}", file=sys.stderr)


def _draw_press(report: Any, path: Path) -> None:
    from mjtactile._files import save_figure
    from mjtactile.cli.plot import press_figure
    from mjtactile.sim.render import RenderError, render_scene
    from mjtactile.units import GRAM_FORCE

    try:
        picture = render_scene(report.model, report.data, 640, 480, camera="oblique")
    except RenderError as error:
        print(f"mjtactile: the figure is drawn without the scene: {error}", file=sys.stderr)
        picture = None
    shape = report.shape.replace("$", r"\$")  # a bare dollar sign would begin a formula
    title = f"{shape}, {report.force_reached / GRAM_FORCE:.4g} gf"
    drawn = press_figure(report.influence.pad, report.readings, report.contact, title=title, picture=picture)
    save_figure(path, drawn, dpi=130)


def _recognised_line(recognised: Any) -> str:
    from mjtactile.units import GRAM_FORCE

    x, y, z = recognised.force.tolist()
    tilt, shape = math.degrees(math.atan2(math.hypot(x, y), -z)), recognised.shape
    line = f"recognised: {math.hypot(x, y, z) / GRAM_FORCE:.4g} gf, tilted by {tilt:.3g} deg; "
    if shape is None:
        return line + "a face that covers the pad"
    size = "" if math.isnan(shape.size) else f" of size {shape.size:.3g}"
    rotation = "" if math.isnan(shape.rotation) else f", rotated by {math.degrees(shape.rotation):.3g} deg"
    doubt = "" if recognised.familiar else "; these readings look like nothing that was taught, so do not rely on it"
    x, y = shape.position * 1e3
    return f"{line}{shape.shape}{size} at {x:.3g}, {y:.3g} mm{rotation}{doubt}"


def _print_press(report: Any) -> None:
    from mjtactile.units import GRAM_FORCE

    console = Console(soft_wrap=True)
    commanded = float((report.commanded**2).sum() ** 0.5)
    console.print(
        f"{report.shape}: {report.force_reached / GRAM_FORCE:.5g} gf reached of {commanded / GRAM_FORCE:.5g} gf "
        f"({report.settled.error * 100:.2g} % off) after {report.settled.time * 1e3:.0f} ms, "
        f"contact {report.load.contact_area * 1e6:.4g} mm2",
        highlight=False,
        markup=False,
    )
    deep = report.load.indentation
    indentation = "" if math.isnan(deep) else f"indentation {deep * 1e6:.4g} um, "
    console.print(
        f"fidelity {fidelity_text(report.influence.fidelity)}, law {report.law}: {indentation}"
        f"peak pressure {report.load.peak_pressure * 1e-3:.4g} kPa",
        highlight=False,
    )
    table = Table("depth, mm", "peak, kPa", "at x, y, mm", box=None, pad_edge=False)
    for peak in report.peaks:
        x, y = peak.place
        table.add_row(peak.layer.removesuffix(" mm"), f"{peak.reading * 1e-3:.4g}", f"{x * 1e3:.4g}, {y * 1e3:.4g}")
    console.print(table)
    if report.recognised is not None:
        console.print(_recognised_line(report.recognised), highlight=False, markup=False)
    console.print(
        f"time per update ({report.readings.size} readings): {report.update_time * 1e3:.2f} ms", highlight=False
    )
