"""Synchronises simulated time with real time."""

from __future__ import annotations

import time

#: A simulation that is further behind real time than this does not catch up [s].
_MOST_BEHIND = 0.1


class Clock:
    """Waits until real time has reached simulated time."""

    def __init__(self) -> None:
        self._due: float | None = None
        self._simulated = 0.0

    def wait(self, simulated: float, speed: float) -> None:
        """Sleep until real time has reached the simulated time [s], of which `speed` passes per real time [-]."""
        now = time.perf_counter()
        if self._due is None or simulated < self._simulated:
            self._due = now
        else:
            self._due += (simulated - self._simulated) / speed
        self._simulated = simulated
        if self._due < now - _MOST_BEHIND:
            self._due = now
        elif self._due > now:
            time.sleep(self._due - now)
