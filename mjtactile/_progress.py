"""Progress: a bar on a terminal; elsewhere lines for work that nobody expects, and else nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: How often a line says how far work has come, where there is no terminal [s].
_BETWEEN_LINES = 10.0


def say(text: str) -> None:
    """Put a line on standard error."""
    print(f"mjtactile: {text}", file=sys.stderr, flush=True)


@contextmanager
def progress_bar(
    description: str, total: float, *, wanted: bool = True, counted: bool = True, lines: bool = False
) -> Iterator[Callable[[float], None]]:
    """A bar on standard error; yields what advances it by a number of steps.

    Args:
        description: what is being done.
        total: steps in all.
        counted: show how many steps are done; else the share in percent, for steps that are nothing to count.
        wanted: whether to show anything.
        lines: whether standard error gets a line every ten seconds where it is no terminal.
    """
    if not (wanted and sys.stderr.isatty()):
        yield _by_lines(total) if wanted and lines else lambda steps: None
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


def _by_lines(total: float) -> Callable[[float], None]:
    """What says, now and then, how much is done and how long the rest will take."""
    began = said = time.monotonic()
    done = 0.0

    def advance(steps: float) -> None:
        nonlocal said, done
        done += steps
        now = time.monotonic()
        if now - said >= _BETWEEN_LINES and done < total:
            said = now
            say(f"{done / total:.0%} done, about {(now - began) * (total / done - 1.0):.0f} s left")

    return advance
