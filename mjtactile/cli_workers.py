"""The command line: options that say who does the work, the same for every command that distributes it."""

from __future__ import annotations

from typing import Annotated

import typer

WorkersOption = Annotated[int, typer.Option(min=1, help="Processes, one core each; the results do not depend on it.")]
RayOption = Annotated[bool, typer.Option("--ray", help="Let Ray distribute the work; a worker lost costs only time.")]
RayAddressOption = Annotated[
    str | None,
    typer.Option(help='Of a running Ray cluster, "auto" for the one here.  [default: one on this machine]'),
]
