"""Progress bars on a terminal, and nothing elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(
    description: str, total: float, *, wanted: bool = True, counted: bool = True
) -> Iterator[Callable[[float], None]]:
    """A bar on standard error; yields what advances it by a number of steps.

    Args:
        description: what is being done.
        total: steps in all.
        counted: show how many steps are done; else the share in percent, for steps that are nothing to count.
        wanted: whether to show one; on anything but a terminal there is none.
    """
    if not (wanted and sys.stderr.isatty()):
        yield lambda steps: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    done = MofNCompleteColumn() if counted else TaskProgressColumn()
    columns = (TextColumn("{task.description}"), BarColumn(), done, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps: bar.advance(task, steps)
