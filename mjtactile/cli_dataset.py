"""The command line: `mjtactile dataset`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mjtactile.cli_workers import RayAddressOption, RayOption, WorkersOption


def dataset(
    spec: Annotated[Path, typer.Option(help="TOML file that says what to press; see docs/datasets.md.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to.  [default: the file's name without .toml]")
    ] = None,
    presses: Annotated[int | None, typer.Option(min=1, help="How many, in place of the file's number.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="In place of the file's.")] = None,
    workers: WorkersOption = 2,
    ray: RayOption = False,
    ray_address: RayAddressOption = None,
) -> None:
    """Make a dataset of presses; call again to go on where it was interrupted."""
    from dataclasses import replace
    from time import perf_counter

    from mjtactile.dataset import make_dataset
    from mjtactile.dataset_spec import load_spec
    from mjtactile.distribute import Workers

    who = Workers(count=workers, ray=ray, ray_address=ray_address)
    wanted = load_spec(spec)
    if presses is not None:
        wanted = replace(wanted, presses=presses)
    if seed is not None:
        wanted = replace(wanted, seed=seed)
    folder = spec.with_suffix("") if out is None else out
    start = perf_counter()
    made = make_dataset(wanted, folder, workers=who)
    typer.echo(f"made {made} of {wanted.presses} presses in {perf_counter() - start:.1f} s: {folder}")
