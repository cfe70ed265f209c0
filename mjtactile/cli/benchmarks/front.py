"""The Pareto front of measured fidelities: those that no other beats in both time and error."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np


def update_time(row: dict[str, Any]) -> float:
    """Mean over the cases of the time from a body in a new place to readings [s]."""
    return float(np.mean(list(row["moved_s"].values())))


def error(row: dict[str, Any]) -> float:
    """Median over the cases of the error against the reference [-]."""
    return float(np.median(list(row["errors"].values())))


def front(rows: Iterable[dict[str, Any]], slack: float = 0.0) -> list[dict[str, Any]]:
    """The rows that no other row beats in both time and error, fastest first.

    Args:
        rows: results of `measure.measure`.
        slack: a row counts as beaten only if another is better by this fraction in both [-].
    """
    rows = sorted(rows, key=update_time)
    return [row for row in rows if not any(_beats(other, row, slack) for other in rows if other is not row)]


def _beats(other: dict[str, Any], row: dict[str, Any], slack: float) -> bool:
    faster, better = (measure(other) <= (1.0 - slack) * measure(row) for measure in (update_time, error))
    same = update_time(other) == update_time(row) and error(other) == error(row)
    return faster and better and not same
