"""Proportions and medians with confidence intervals, and tables of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjtactile.experiments.markdown import markdown_table

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % confidence interval."""

    value: float  #: the estimate
    low: float  #: lower end of the interval
    high: float  #: upper end of the interval

    def text(self, unit: str = "", *, scale: float = 1.0, digits: int = 1) -> str:
        """Text such as "97.5 % (94.3 to 98.9)"; without the interval if there are too few samples, "-" without any.

        The numbers are multiplied by `scale` and have so many decimals; `unit` follows the value.
        """
        if np.isnan(self.value):
            return "-"
        if not np.isfinite((self.low, self.high)).all():
            return f"{scale * self.value:.{digits}f}{unit}"
        value, low, high = (f"{scale * one:.{digits}f}" for one in (self.value, self.low, self.high))
        return f"{value}{unit} ({low} to {high})"

    @property
    def percent(self) -> str:
        """Text of a proportion in per cent."""
        return self.text(" %", scale=100.0)


def share(marks: Sequence[bool]) -> Estimate:
    """Proportion of true marks, with Wilson's interval; NaN if there are no marks."""
    from scipy.stats import binomtest

    if not len(marks):
        return Estimate(float("nan"), 0.0, 1.0)
    result = binomtest(int(np.sum(marks)), len(marks))
    interval = result.proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(float(np.mean(marks)), float(interval.low), float(interval.high))


def median(values: Sequence[float]) -> Estimate:
    """Median, with an interval between two order statistics, which assumes no distribution.

    The interval is NaN if there are too few values; all is NaN if there are none.
    """
    from scipy.stats import quantile_test

    if not len(values):
        return Estimate(*[float("nan")] * 3)
    interval = quantile_test(np.asarray(values), p=0.5).confidence_interval(CONFIDENCE)
    return Estimate(float(np.median(values)), float(interval.low), float(interval.high))


@dataclass(frozen=True, kw_only=True)
class Bound:
    """A bound, and the value that was measured."""

    what: str  #: name of the quantity
    bound: str  #: the bound as text
    found: str  #: the measured value as text
    met: bool  #: whether the value is within the bound


@dataclass(frozen=True, kw_only=True)
class Report:
    """The report that an experiment prints."""

    title: str  #: one sentence above the table
    head: tuple[str, ...]  #: titles of the table's columns
    rows: list[tuple[str, ...]]  #: cells of the table's rows
    bounds: list[Bound]  #: bounds that were to be reached
    figures: dict[str, Any]  #: plain numbers by name

    def markdown(self) -> str:
        """Title, table and bounds as Markdown."""
        met = {True: "yes", False: "**no**"}
        bounds = [(one.what, one.bound, one.found, met[one.met]) for one in self.bounds]
        parts = [self.title, markdown_table(self.head, self.rows)]
        parts += [markdown_table(("bound", "", "reached", "met"), bounds)] if bounds else []
        return "\n\n".join(parts)
