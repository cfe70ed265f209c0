"""The command line: `mjtactile envs`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def envs(
    readme: Annotated[Path | None, typer.Option(help="Rewrite the tables in this Markdown file.")] = None,
) -> None:
    """What goes into and comes out of each gymnasium environment, with units."""
    from mjtactile.cli.benchmarks.tables import check_page, rewrite_table

    if readme is not None:
        check_page(readme, "environments")
    from mjtactile.cli.envs_tables import environment_tables

    text = environment_tables()
    typer.echo(text)
    if readme is not None:
        rewrite_table(readme, "environments", text)
