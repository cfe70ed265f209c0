"""The command line: `mjtactile loop`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mjtactile.cli.options import AsJson, FidelityOption, NoiseOption, json_text
from mjtactile.fidelity import DEFAULT
from mjtactile.units import MOST_SEED

if TYPE_CHECKING:
    from mjtactile.experiments.loop.clock import Loop, LoopSettings
    from mjtactile.experiments.loop.run import LoopResult
    from mjtactile.experiments.loop.video import LoopVideo

#: Full scale of the cells of --transducer [Pa]: under 150 gf, readings of the loop's punches are at most 33 kPa.
_FULL_SCALE = 40e3
#: With more presses, the video would not fit into memory: each press takes about 10 frames.
_MOST_PRESSES = 200


def loop(
    seed: Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Seed of punches, poses, forces and noise.")] = 0,
    presses: Annotated[int, typer.Option(min=0, max=_MOST_PRESSES, help="Number of commanded forces.")] = 4,
    sort: Annotated[bool, typer.Option(help="Sort the seven punches.")] = True,
    rate: Annotated[int, typer.Option(help="Rate of readings and recognition in simulated time [Hz].")] = 200,
    noise: NoiseOption = 0.01,
    transducer: Annotated[bool, typer.Option("--transducer", help="Read through imperfect capacitive cells.")] = False,
    fidelity: FidelityOption = DEFAULT,
    layers: Annotated[str, typer.Option(help="Sensing layers that recognisers use: all or top.")] = "all",
    weights: Annotated[
        Path | None,
        typer.Option(
            help="Folder of other weights, or one with their subfolders all and top.  [default: the package's]"
        ),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Draw forces and shapes to this file.  [default: loop.png]")
    ] = None,
    video: Annotated[
        Path | None, typer.Option(help="Write a video to this file, .gif or .webp.  [default: loop.gif]")
    ] = None,
    record: Annotated[bool, typer.Option(help="Make figure and video.")] = True,
    view: Annotated[bool, typer.Option("--view", help="Show the scene live in MuJoCo's viewer.")] = False,
    as_json: AsJson = False,
) -> None:
    """Control by touch: press with commanded forces, and sort seven unknown punches by recognised shape."""
    from mjtactile._files import check_apart, check_figure, check_writable, save_figure
    from mjtactile.experiments.loop.clock import LoopSettings, steps_between
    from mjtactile.experiments.loop.figure import loop_figure
    from mjtactile.experiments.loop.run import loop_recognisers, run_loop
    from mjtactile.fidelity import as_fidelity

    for option, path in (("--figure", figure), ("--video", video)):
        if path is not None and not record:
            raise typer.BadParameter(f"--no-record makes no figure and no video. Leave out {option} or --no-record.")
    figure, video = figure or Path("loop.png"), video or Path("loop.gif")
    as_fidelity(fidelity)
    steps_between(rate)
    loop_recognisers(layers, weights)
    settings = LoopSettings(
        seed=seed, presses=presses, sort=sort, rate=rate, noise=noise, fidelity=fidelity, layers=layers
    )
    if record:
        from mjtactile.experiments.loop.video import check_video_path

        check_apart({"--figure": figure, "--video": video})
        check_video_path(video)
        check_writable(video)
        check_figure(figure)
    with ExitStack() as open_things:
        watchers: list[Callable[[Loop], None]] = [_viewer(open_things)] if view else []
        film = _film(settings, open_things) if record else None
        if film is not None:
            watchers.append(film)
        result = run_loop(
            settings, folder=weights, transducer=_transducer(seed) if transducer else None, watch=_all_of(watchers)
        )
        if record:
            save_figure(figure, loop_figure(result), dpi=110)
        if film is not None:
            film.save(video)
    if as_json:
        typer.echo(json_text(result.judged))
        return
    _print(result)
    for path, made in ((figure, record), (video, film is not None)):
        if made:
            typer.echo(f"wrote {path}")


def _all_of(watchers: list[Callable[[Loop], None]]) -> Callable[[Loop], None]:
    def watch(loop: Loop) -> None:
        for each in watchers:
            each(loop)

    return watch


def _film(settings: LoopSettings, open_things: ExitStack) -> LoopVideo | None:
    """A video if rendering works; otherwise None, and a line on standard error says why."""
    from mjtactile.errors import RenderError
    from mjtactile.experiments.loop.scene import loop_scene
    from mjtactile.experiments.loop.video import LoopVideo

    try:
        return open_things.enter_context(LoopVideo(loop_scene(settings.seed).model))
    except RenderError as error:
        print(f"mjtactile: no video: {' '.join(str(error).split())}", file=sys.stderr)
        return None


def _viewer(open_things: ExitStack) -> Callable[[Loop], None]:
    """A function that shows the scene in a window, in real time at most; without a display there is a RenderError."""
    import time
    import warnings

    import glfw
    from mujoco import viewer as mujoco_viewer

    from mjtactile.errors import RenderError

    with warnings.catch_warnings():
        # glfw warns when it fails; the error below is clearer.
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise RenderError("--view needs a display, and there is none. Leave it out: the video shows the same.")
    shown: dict[str, Any] = {}

    def show(loop: Loop) -> None:
        if "window" not in shown:
            window = mujoco_viewer.launch_passive(loop.scene.model, loop.data)
            shown["window"], shown["start"] = open_things.enter_context(window), time.monotonic()
        if shown["window"].is_running():
            shown["window"].sync()
            time.sleep(max(0.0, shown["start"] + loop.data.time - time.monotonic()))

    return show


def _transducer(seed: int) -> Any:
    from mjtactile.transducer.array import Transducer
    from mjtactile.transducer.capacitive import CapacitiveCell
    from mjtactile.transducer.imperfections import TYPICAL

    return Transducer(CapacitiveCell.with_range(_FULL_SCALE), TYPICAL, seed=seed)


def _print(result: LoopResult) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(soft_wrap=True)
    if not console.is_terminal:
        console = Console(soft_wrap=True, width=120)
    judged = result.judged
    if judged["presses"]:
        table = Table(
            "commanded, gf", "MuJoCo's, gf", "magnitude off, gf", "direction off, deg", "reached in", box=None
        )
        for press in judged["presses"]:
            reached = "-" if press["reached_s"] is None else f"{press['reached_s'] * 1e3:.0f} ms"
            table.add_row(
                _vector(press["commanded_gf"]),
                _vector(press["true_gf"]),
                f"{press['magnitude_error_gf']:+.2f}",
                f"{press['direction_error_deg']:.2f}",
                reached,
            )
        console.print(table)
    if judged["sorted"]:
        table = Table("arm", "is", "taken for", "confidence", "looks", "position off, mm", box=None)
        for each in judged["sorted"]:
            off = "-" if each["position_error_mm"] is None else f"{each['position_error_mm']:.3f}"
            table.add_row(
                str(each["arm"]),
                each["true"],
                each["shape"] or "-",
                f"{each['confidence']:.4f}",
                str(each["looks"]),
                off,
            )
        console.print(table)
        console.print(f"{judged['sorted_right']} of {len(judged['sorted'])} in their bins", highlight=False)
    _print_rates(console, judged["rates"])


def _print_rates(console: Any, rates: dict[str, Any]) -> None:
    if not rates["ticks_felt"]:
        console.print("nothing was felt", highlight=False)
        return
    parts = [
        f"{label} {rates[name]['median']:.2f} ms (mean {rates[name]['mean']:.2f}, 99 % {rates[name]['p99']:.1f})"
        for name, label in (("read_ms", "reading"), ("force_ms", "force"), ("shape_ms", "shape"))
    ]
    console.print(
        f"MuJoCo at {rates['simulated_steps_hz']:.0f} Hz, touch at {rates['simulated_ticks_hz']:.0f} Hz of simulated "
        f"time, {rates['faster_than_real_time']:.1f} times as fast as real time",
        highlight=False,
    )
    console.print(
        f"in contact: {'; '.join(parts)}: {rates['ticks_per_second_sustained']:.0f} ticks per second sustained, "
        f"{rates['ticks_in_time']:.1%} of ticks in time",
        highlight=False,
    )


def _vector(force: list[float]) -> str:
    return "({:.1f}, {:.1f}, {:.1f})".format(*force)
