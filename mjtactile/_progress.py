"""Progress on standard error: a bar on a terminal; elsewhere lines of text if asked for, otherwise nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

#: Time between lines of progress where there is no terminal [s].
_BETWEEN_LINES = 10.0
#: Share of the work after which the time left is estimated: the first steps of a build take longer than most others.
_ESTIMATED_FROM = 0.1


def say(text: str) -> None:
    """Write a line to standard error, unless there is none, as in programs with windows, or nobody reads it."""
    if sys.stderr is not None:
        with suppress(OSError, ValueError):  # a broken pipe, a file that was closed
            print(f"mjtactile: {text}", file=sys.stderr)
            with suppress(AttributeError):  # an object that can only be written to
                sys.stderr.flush()


def _is_terminal() -> bool:
    """Whether standard error is a terminal; programs put objects in its place that can only be written to."""
    try:
        return sys.stderr.isatty()
    except (AttributeError, ValueError):
        return False


@contextmanager
def progress_bar(
    description: str, total: float, *, wanted: bool = True, counted: bool = True, lines: bool = False
) -> Iterator[Callable[[float], None]]:
    """A progress bar on standard error; yields a function that advances it by a number of steps.

    Args:
        description: text beside the bar.
        total: number of steps.
        wanted: whether to show anything.
        counted: show the number of completed steps; False shows only the percentage, for steps of different lengths,
            and the time left only once a tenth is done.
        lines: whether to write a line every ten seconds where standard error is not a terminal.
    """
    if not (wanted and _is_terminal()):
        yield _by_lines(total) if wanted and lines else lambda steps: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        Task,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class LaterTimeRemaining(TimeRemainingColumn):
        def render(self, task: Task) -> Text:
            return super().render(task) if task.completed >= _ESTIMATED_FROM * total else Text("")

    done = (MofNCompleteColumn(), TimeRemainingColumn()) if counted else (TaskProgressColumn(), LaterTimeRemaining())
    columns = (TextColumn("{task.description}"), BarColumn(), *done)
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps: bar.advance(task, steps)


def _by_lines(total: float) -> Callable[[float], None]:
    """A function that writes the percentage done now and then, and the time left once a tenth is done."""
    began = said = time.monotonic()
    done = 0.0

    def advance(steps: float) -> None:
        nonlocal said, done
        done += steps
        now = time.monotonic()
        if now - said >= _BETWEEN_LINES and done < total:
            said = now
            share = done / total
            left = f", about {(now - began) * (1.0 / share - 1.0):.0f} s left" if share >= _ESTIMATED_FROM else ""
            say(f"{share:.0%} done{left}")

    return advance
