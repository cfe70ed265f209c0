"""The command line: options of several commands, with their checks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from mjtactile.fidelity import PRESETS


def finite(value: float | None) -> float | None:
    """Refuse "nan" and "inf", which typer's parser accepts; use it as `typer.Option(callback=finite)`."""
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number.")
    return value


def into_pad(tilt: float) -> float:
    """The same angle [deg], for `typer.Option(callback=into_pad)`: one that presses into the pad."""
    finite(tilt)
    if not abs(tilt) < 90.0:
        raise typer.BadParameter(f"{tilt:g} degrees do not press; expected more than -90 and less than 90.")
    return tilt


PageOption = Annotated[Path | None, typer.Option(help="Rewrite the table in this Markdown file.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]
FidelityOption = Annotated[
    str,
    typer.Option(help="Of the readings: fast, balanced, precise or accurate.", autocompletion=lambda: list(PRESETS)),
]
PadOption = Annotated[
    Path | None,
    typer.Option("--pad", help="TOML file of the pad: see the docs, curved pads.  [default: the paper's pad]"),
]
WorkersOption = Annotated[int, typer.Option(min=1, help="Processes, one core each; the results do not depend on it.")]
RayOption = Annotated[bool, typer.Option("--ray", help="Let Ray distribute the work; a worker lost costs only time.")]
RayAddressOption = Annotated[
    str | None,
    typer.Option(help='Of a running Ray cluster, "auto" for the one here.  [default: one on this machine]'),
]
