"""The command line: options of several commands, with their checks."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from mjtactile.fidelity import PRESETS
from mjtactile.units import MOST_NOISE

Result = TypeVar("Result")


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


def show_table(
    measure: Callable[[], Result],
    table_of: Callable[[Result], str],
    name: str,
    page: Path | None,
    *,
    as_json: bool = False,
    out: Path | None = None,
) -> Result:
    """Measure, store and print a result, and write its table on a page. Both files are checked before it is measured.

    Args:
        measure: the function that measures.
        table_of: the result as Markdown.
        name: the table's name in the page's markers.
        page: the Markdown file with the markers; None for no page.
        as_json: print JSON instead of the table.
        out: JSON file of the result; None for no file.

    Raises:
        MjTactileError: a file cannot be written, or the page lacks the markers.
    """
    from mjtactile._files import check_writable, write_atomically
    from mjtactile.cli.benchmarks.tables import table_on_page

    check_writable(out)
    write = table_on_page(page, name)
    result = measure()
    table = table_of(result)
    if out is not None:
        write_atomically(out, lambda file: file.write((json_text(result, indent=1) + "\n").encode()))
    typer.echo(json_text(result) if as_json else table)
    write(table)
    return result


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
