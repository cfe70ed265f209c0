"""The command line: options of several commands, with their checks."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from mjtactile.fidelity import PRESETS
from mjtactile.units import MOST_NOISE


def finite(value: float | None) -> float | None:
    """Refuse "nan" and "inf", which typer's parser accepts; use it as `typer.Option(callback=finite)`.

    Raises:
        BadParameter: the number is not finite.
    """
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number.")
    return value


def positive(value: float | None) -> float | None:
    """Refuse zero, negative numbers, "nan" and "inf"; use it as `typer.Option(callback=positive)`.

    Raises:
        BadParameter: the number is not positive and finite.
    """
    finite(value)
    if value is not None and value <= 0.0:
        raise typer.BadParameter(f"{value:g} is not a positive number.")
    return value


def into_pad(tilt: float) -> float:
    """Refuse a tilt [deg] with which a force does not press; use it as `typer.Option(callback=into_pad)`.

    Raises:
        BadParameter: the angle is not between -90 and 90 degrees.
    """
    finite(tilt)
    if not abs(tilt) < 90.0:
        raise typer.BadParameter(f"{tilt:g} degrees do not press; expected more than -90 and less than 90.")
    return tilt


def json_text(value: Any, *, indent: int = 2) -> str:
    """Results as JSON, in which numbers that are not finite are null."""
    return json.dumps(_with_nulls(value), indent=indent, allow_nan=False)


def _with_nulls(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _with_nulls(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_with_nulls(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


PageOption = Annotated[Path | None, typer.Option(help="Write the table into this Markdown file, between its markers.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]
FidelityOption = Annotated[
    str,
    typer.Option(
        help="Fidelity of the readings: fast, balanced, precise or accurate.", autocompletion=lambda: list(PRESETS)
    ),
]
NoiseOption = Annotated[
    float,
    typer.Option(
        min=0.0, max=MOST_NOISE, callback=finite, help="Standard deviation of noise over a pad's largest reading [-]."
    ),
]
PadOption = Annotated[
    Path | None, typer.Option("--pad", help="TOML file of the pad; see docs/curved.md.  [default: the paper's pad]")
]
WorkersOption = Annotated[int, typer.Option(min=1, help="Processes, one core each; the results do not depend on it.")]
RayOption = Annotated[bool, typer.Option("--ray", help="Distribute the work with Ray; a lost worker costs only time.")]
RayAddressOption = Annotated[
    str | None,
    typer.Option(help='Address of a running Ray cluster; "auto" finds one on this machine.  [default: start one]'),
]
