"""Choose presses with which readings are compared, and the distance from which they look like nothing taught.

python training/train_familiarity.py --data build/presses --weights build/weights/all
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from arguments import run_script
from lesson import stored_view, write_module

from mjtactile.recognition.training.familiarity import Comparison, taught_presses
from mjtactile.recognition.training.presses import see_presses


@dataclass(frozen=True, kw_only=True)
class Config(Comparison):
    """Arguments."""

    data: Path  #: folder of the dataset
    weights: Path  #: folder with the view; where the presses are written


def main(config: Config) -> None:
    """Choose and write."""
    start = time.perf_counter()
    view = stored_view(config.weights)
    presses = see_presses(config.data, view)
    taught = taught_presses(presses.readings, presses.outline, view, config)
    write_module(
        config,
        "familiarity.safetensors",
        "familiarity",
        view.layers,
        taught.arrays(),
        presses.dataset.metadata,
        time.perf_counter() - start,
    )
    print(f"familiarity: {len(taught.presses)} presses, unfamiliar from {taught.limit:.3f} standard deviations on")


if __name__ == "__main__":
    run_script(main, Config, __doc__)
