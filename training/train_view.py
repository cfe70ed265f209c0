"""Find the principal parts of a pad's readings: what every recogniser looks at.

python training/train_view.py --data build/presses --weights build/weights/all
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from arguments import run_script
from lesson import write_module

from mjtactile.recognition.training.presses import fit_view


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments."""

    data: Path  #: folder of the dataset
    weights: Path  #: folder to write to
    layers: tuple[int, ...] | None = None  #: sensing layers to look at, 0 on top; by default all
    parts: int | None = None  #: principal parts; by default 256, or five sevenths of the taxels if they are fewer


def main(config: Config) -> None:
    """Fit and write."""
    start = time.perf_counter()
    view, dataset = fit_view(config.data, config.layers, config.parts)
    arrays = {"parts": view.parts, "mean": view.mean, "scale": view.scale}
    seconds = time.perf_counter() - start
    write_module(config, "view.safetensors", "view", view.layers, arrays, dataset, seconds)
    print(f"view of layers {view.layers}: {view.parts.shape[1]} parts, {seconds:.0f} s")


if __name__ == "__main__":
    run_script(main, Config, __doc__)
