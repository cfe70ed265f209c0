"""What long work says where there is no terminal: how much is done and how long the rest takes, or nothing."""

from __future__ import annotations

import io

import pytest

from mjtactile import _progress


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(_progress.time, "monotonic", lambda: now[0])
    return now


def test_lines_come_every_ten_seconds_with_the_time_that_is_left(clock, capsys):
    with _progress.progress_bar("work", 10, lines=True) as advance:
        for clock[0] in (4.0, 8.0, 12.0, 16.0, 24.0, 28.0, 32.0, 36.0, 40.0, 44.0):
            advance(1)
    # After 3 of 10 steps in 12 s, 7 steps take 28 s; after 5 in 24 s, 24 s; the last step has nothing left to wait for.
    assert capsys.readouterr().err.splitlines() == [
        "mjtactile: 30% done, about 28 s left",
        "mjtactile: 50% done, about 24 s left",
        "mjtactile: 80% done, about 9 s left",
    ]


def test_the_time_that_is_left_is_said_once_a_tenth_is_done(clock, capsys):
    """First steps of a build may take hundreds of times as long as the others."""
    with _progress.progress_bar("work", 1000, lines=True) as advance:
        for clock[0], steps in ((30.0, 1), (41.0, 98), (52.0, 1)):
            advance(steps)
    assert capsys.readouterr().err.splitlines() == [
        "mjtactile: 0% done",
        "mjtactile: 10% done",  # 99 of 1000, rounded
        "mjtactile: 10% done, about 468 s left",
    ]


@pytest.mark.parametrize(("done", "shown"), [(9, False), (10, True)])
def test_a_bar_of_uneven_steps_shows_the_time_that_is_left_once_a_tenth_is_done(done, shown, monkeypatch):
    screen = io.StringIO()
    monkeypatch.setattr(screen, "isatty", lambda: True)
    monkeypatch.setattr(_progress.sys, "stderr", screen)
    with _progress.progress_bar("work", 100, counted=False) as advance:
        advance(done)
    assert f"{done}%" in screen.getvalue()
    # The time left is not known yet, as all steps came at once; without a column for it there are no colons.
    assert ("-:--:--" in screen.getvalue().split(f"{done}%")[-1]) == shown


@pytest.mark.parametrize("asked", [{}, {"lines": True, "wanted": False}])
def test_work_that_is_expected_or_unwatched_says_nothing(asked, clock, capsys):
    with _progress.progress_bar("work", 2, **asked) as advance:
        clock[0] = 60.0
        advance(1)
    assert capsys.readouterr().err == ""


class Written:
    """What some programs put in the place of standard error: it can be written to, and no more."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> None:
        self.text += text

    def flush(self) -> None:
        """Nothing is kept back."""


class Broken(Written):
    def write(self, text: str) -> None:
        raise BrokenPipeError(32, "Broken pipe")


class OnlyWritten:
    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> None:
        self.text += text


def closed() -> io.StringIO:
    file = io.StringIO()
    file.close()
    return file


@pytest.mark.parametrize(
    "stream",
    [None, Written(), OnlyWritten(), Broken(), closed()],
    ids=["none", "written", "only written", "broken", "closed"],
)
def test_work_is_done_whatever_stands_for_standard_error(stream, clock, monkeypatch, capsys):
    monkeypatch.setattr(_progress.sys, "stderr", stream)
    _progress.say("a line")
    with _progress.progress_bar("work", 2, lines=True) as advance:
        clock[0] = 60.0
        advance(1)
    assert capsys.readouterr().out == ""  # where print() writes if it is given None
    if type(stream) in (Written, OnlyWritten):
        assert stream.text.splitlines() == ["mjtactile: a line", "mjtactile: 50% done, about 60 s left"]
