"""The command line: `mjtactile view`, `preview`, `hands` and `envs`, which show models, pads and catalogues."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import mujoco
import typer

from mjtactile.cli.options import PageOption, finite, show_table


def view(
    model: Annotated[Path | None, typer.Argument(help="MJCF file of a model with pads.")] = None,
    scene: Annotated[str | None, typer.Option(help="Demonstration to show in place of a model: grasp.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="First port to try; 0 for any free port.")] = 8080,
    anyone: Annotated[
        bool, typer.Option("--anyone", help="Let other machines open the page and control the simulation.")
    ] = False,
    rate: Annotated[float, typer.Option(min=1.0, max=120.0, help="Updates of the page per second.")] = 30.0,
    seconds: Annotated[
        float | None, typer.Option(callback=finite, help="End after this simulated time [s].  [default: never]")
    ] = None,
    record: Annotated[Path | None, typer.Option(help="Record from the beginning to this .npz file.")] = None,
    replay: Annotated[Path | None, typer.Option(help="Replay this recording of the model first.")] = None,
) -> None:
    """Show a model and its pads live in a browser."""
    from mjtactile._files import check_npz
    from mjtactile.view.clock import Clock
    from mjtactile.view.demonstrations import demonstration
    from mjtactile.view.recording import Recording
    from mjtactile.view.viewer import Viewer

    if (model is None) == (scene is None):
        raise typer.BadParameter("expected either the file of a model or --scene, such as --scene grasp.")
    if seconds is not None and seconds <= 0.0:
        raise typer.BadParameter(f"--seconds {seconds:g}; expected a positive number of seconds.")
    check_npz(record)
    shown = None if replay is None else Recording.load(replay)
    demo, compiled = (None, _compiled(model)) if model is not None else demonstration(str(scene))
    data, clock = mujoco.MjData(compiled), Clock()
    with Viewer(compiled, data, host=host, port=port, anyone=anyone, rate=rate) as viewer:
        typer.echo(f"open {viewer.url} in a browser; Ctrl+C ends")
        if record is not None:
            viewer.record()
        if shown is not None:
            viewer.replay(shown)
        try:
            while seconds is None or data.time < seconds:
                if demo is not None:
                    demo.control(compiled, data)
                mujoco.mj_step(compiled, data)
                viewer.sync()
                clock.wait(float(data.time), viewer.controls.speed)
        except KeyboardInterrupt:
            typer.echo("ended")
        if record is not None:
            made = viewer.stop_recording()
            made.save(record)
            full = f", the first {made.duration:.1f} s: no more frames are kept" if made.full else ""
            typer.echo(f"wrote {record}{full}")


def preview(
    file: Annotated[Path, typer.Argument(help="MJCF file of a model with pads.")],
    pad: Annotated[str | None, typer.Option(help="Name of the pad's sensor or geom.  [default: the first pad]")] = None,
    out: Annotated[Path, typer.Option(help="Picture to write.")] = Path("pad.png"),
) -> None:
    """Draw position and orientation of a pad on its body, without a simulation."""
    from mjtactile.errors import SceneError
    from mjtactile.sim.mujoco_library import pad_sensor_names
    from mjtactile.sim.preview import preview_pad

    model = _compiled(file)
    names = pad_sensor_names(model)
    if pad is None and not names:
        raise SceneError(f"{file} has no pad. Add one with attach_pad or as a sensor of the plugin mjtactile.pad.")
    preview_pad(model, pad or names[0], out)
    typer.echo(f"pads: {', '.join(names)}\nwrote {out}" if names else f"wrote {out}")


def _compiled(path: Path) -> mujoco.MjModel:
    """The compiled model of a file."""
    from mjtactile.errors import SceneError
    from mjtactile.plugin.registration import ensure_registered

    ensure_registered()
    if not path.is_file():
        found = "it is not a file" if path.exists() else "there is no such file"
        raise SceneError(f"cannot open {path}: {found}. Give the path of a model with pads in MJCF, such as hand.xml.")
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise SceneError(
            f"cannot open {path}: {str(error).strip()}. Expected a model in MJCF, such as hand.xml."
        ) from error


def hands(page: PageOption = None) -> None:
    """List the hands that mjtactile.hands.attach_hand knows, and their pads."""
    from mjtactile.cli.hands_tables import hands_tables

    show_table(hands_tables, str, "hands", page)


def envs(page: PageOption = None) -> None:
    """Print actions and observations of each gymnasium environment, with units."""
    from mjtactile.cli.envs_tables import environment_tables

    show_table(environment_tables, str, "environments", page)
