"""The command line: `mjtactile envs`."""

from __future__ import annotations

import typer

from mjtactile.cli.options import PageOption


def envs(page: PageOption = None) -> None:
    """Print actions and observations of each gymnasium environment, with units."""
    from mjtactile.cli.benchmarks.tables import table_on_page

    write = table_on_page(page, "environments")
    from mjtactile.cli.envs_tables import environment_tables

    text = environment_tables()
    typer.echo(text)
    write(text)
