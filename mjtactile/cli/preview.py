"""`mjtactile preview`: where a pad stands on a body."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def preview(
    file: Annotated[Path, typer.Argument(help="A model with pads, in MJCF.")],
    pad: Annotated[str | None, typer.Option(help="Its sensor or geom.  [default: the first pad]")] = None,
    out: Annotated[Path, typer.Option(help="The picture to write.")] = Path("pad.png"),
) -> None:
    """Draw where a pad stands on its body and which way it faces, without simulating anything."""
    import mujoco

    from mjtactile.errors import SceneError
    from mjtactile.plugin.registration import ensure_registered
    from mjtactile.sim.preview import pad_names, preview_pad

    ensure_registered()
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except ValueError as error:
        raise SceneError(f"cannot open {file}: {error}") from error
    names = pad_names(model)
    if pad is None and not names:
        raise SceneError(f"{file} has no pad. Add one with attach_pad or as a sensor of the plugin mjtactile.pad.")
    preview_pad(model, pad or names[0], out)
    typer.echo(f"pads: {', '.join(names)}\nwrote {out}" if names else f"wrote {out}")
