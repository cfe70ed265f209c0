"""Statistics of columns, with which policies normalise their inputs: of one episode, and of several together."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

#: Statistics of a column by name: "min", "max", "mean", "std", "count" and the keys of `QUANTILES`.
Statistics = dict[str, npt.NDArray[Any]]

QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


def column_statistics(values: npt.NDArray[Any]) -> Statistics:
    """Statistics of every component of values (frames, *shape) over the frames of an episode.

    Minimum, maximum, mean, standard deviation and quantiles, (*shape) each, and the number of frames, (1,).
    """
    numbers = values.astype(np.float64)
    found = {
        "min": numbers.min(axis=0),
        "max": numbers.max(axis=0),
        "mean": numbers.mean(axis=0),
        "std": numbers.std(axis=0),
        "count": np.array([len(numbers)]),
    }
    return found | dict(zip(QUANTILES, np.quantile(numbers, list(QUANTILES.values()), axis=0), strict=True))


def joined(first: Statistics, second: Statistics) -> Statistics:
    """Joint statistics of two sets of frames.

    Quantiles are averaged with the numbers of frames as weights, as in LeRobot itself.
    """
    n, m = float(first["count"][0]), float(second["count"][0])
    share = m / (n + m)
    mean = first["mean"] + share * (second["mean"] - first["mean"])
    spread = (1 - share) * (first["std"] ** 2 + (first["mean"] - mean) ** 2)
    spread = spread + share * (second["std"] ** 2 + (second["mean"] - mean) ** 2)
    found = {
        "min": np.minimum(first["min"], second["min"]),
        "max": np.maximum(first["max"], second["max"]),
        "mean": mean,
        "std": np.sqrt(spread),
        "count": first["count"] + second["count"],
    }
    return found | {name: first[name] + share * (second[name] - first[name]) for name in QUANTILES}
