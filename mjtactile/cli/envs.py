"""The command line: `mjtactile envs`."""

from __future__ import annotations

import typer

from mjtactile.cli.options import PageOption
from mjtactile.errors import MjTactileError


def envs(page: PageOption = None) -> None:
    """What goes into and comes out of each gymnasium environment, with units."""
    from mjtactile.cli.benchmarks.tables import table_on_page

    write = table_on_page(page, "environments")
    try:
        from mjtactile.cli.envs_tables import environment_tables
    except ImportError as error:
        raise MjTactileError(f"environments need gymnasium: pip install 'mjtactile[envs]' ({error}).") from error
    text = environment_tables()
    typer.echo(text)
    write(text)
