"""Which presses are stored for comparison with readings, and from what distance readings count as unfamiliar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile.errors import RecognitionError
from mjtactile.recognition.familiarity import TaughtPresses
from mjtactile.recognition.features import PrincipalComponents

#: Number of components that are compared. At 1 % of false alarms, 24 notice 98 % of pairs of bodies and all lying rods,
#: 64 notice 91 % and 92 %: later components differ more from press to press of one kind than from kind to kind.
_MOST_PARTS = 24


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """How many presses are stored, and how the limit is found."""

    presses: int = 6000  #: presses to store, 48 bytes each; fewer if there are fewer
    false_alarms: float = 0.01  #: share of presses like those of the dataset that are called unfamiliar
    noise: float = 0.06  #: largest noise, over the largest reading; its root is drawn uniformly
    quiet: float = 0.3  #: share of presses without noise
    seed: int = 7  #: of the choice and the noise


def taught_presses(
    readings: np.ndarray, outline: np.ndarray, view: PrincipalComponents, how: Comparison
) -> TaughtPresses:
    """Presses for comparison, of one half of the outlines, and the limit that the other half give.

    Args:
        readings: of presses, mirrored into the octant, (presses, layers, rows, columns) [Pa].
        outline: number of each press's outline, (presses,).
        view: the principal components.
        how: how many are stored, and how the limit is found.

    Raises:
        RecognitionError: there are too few outlines for two halves.
    """
    rng = np.random.default_rng(how.seed)
    stored, others = (np.flatnonzero(outline % 2 == rest) for rest in (0, 1))
    if not (len(stored) and len(others)):
        raise RecognitionError(
            "the dataset has one outline; expected at least two, of which one is compared with the other. Make more "
            "presses."
        )
    stored = np.sort(rng.choice(stored, min(how.presses, len(stored)), replace=False))
    parts = min(_MOST_PARTS, view.parts.shape[1])
    # Rounded to the precision in which they are stored.
    kept = view.see(readings[stored]).features[:, :parts].astype(np.float16).astype(np.float32)
    levels = np.where(rng.random(len(others)) < how.quiet, 0.0, how.noise * rng.random(len(others)) ** 2)
    clean = readings[others]
    sigma = (levels * clean.reshape(len(clean), -1).max(axis=1)).astype(np.float32)
    noisy = clean + sigma[:, None, None, None] * rng.standard_normal(clean.shape, dtype=np.float32)
    taught = TaughtPresses(kept, view.scale[:parts], np.inf, how.false_alarms)
    limit = float(np.quantile(taught.distances(view.see(noisy)), 1.0 - how.false_alarms))
    return TaughtPresses(kept, view.scale[:parts], limit, how.false_alarms)
