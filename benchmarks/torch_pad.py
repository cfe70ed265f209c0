"""What a PadModel costs, folded and as one whole matrix per layer: memory, time per load; a table for docs/torch.md."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from mjtactile import Footprint, contact_load, indenter_outline, influence_matrices
from mjtactile.cli.benchmarks.timing import median_time
from mjtactile.fidelity import PRESETS
from mjtactile.torch import PadModel

LOADS, REPEATS = 256, 3
START, END = "<!-- bench torch -->\n", "<!-- end -->"
COLUMNS = ("preset", "MB", "MB whole", "NumPy and core", "forward", "and backward", "forward, whole", "and backward")


def nbytes(tensors: list[Tensor]) -> int:
    return sum(one.numel() * one.element_size() for one in tensors)


def row(preset: str) -> list[str]:
    influence = influence_matrices(fidelity=preset)
    model = PadModel(influence)
    footprint = Footprint.from_outline(indenter_outline("star", rotate_deg=20), influence.surface)
    load = contact_load(influence, footprint, force=(0.1, 0.0, -0.5))
    forces = model.nodal_forces([load]).repeat(LOADS, 1, 1, 1)
    points = [part.stop - part.start for part in influence.sample_slices]
    whole = [torch.rand(int(np.prod(model.force_shape)), 5 * count) for count in points]
    averages = [model.get_buffer(f"average_{k}") for k in range(len(points))]

    def unfolded(forces: Tensor) -> Tensor:
        norms = [(forces.flatten(1) @ one).unflatten(1, (-1, 5)).norm(dim=-1) for one in whole]
        return torch.stack([norm @ average.T for norm, average in zip(norms, averages, strict=True)], dim=1)

    def with_gradient(model: Callable[[Tensor], Tensor]) -> None:
        given = forces.clone().requires_grad_()
        model(given).sum().backward()

    works: list[tuple[int, Callable[[], object]]] = [
        (1, lambda: influence.readings(load)),
        (LOADS, torch.no_grad()(lambda: model(forces))),
        (LOADS, lambda: with_gradient(model)),
        (LOADS, torch.no_grad()(lambda: unfolded(forces))),
        (LOADS, lambda: with_gradient(unfolded)),
    ]
    times = [median_time(work, REPEATS) / count for count, work in works]
    sizes = [nbytes(list(model.buffers())), nbytes(whole + averages)]
    return [preset, *(f"{size / 1e6:.0f}" for size in sizes), *(f"{time * 1e3:.2g} ms" for time in times)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--doc", type=Path, help="page whose table to replace")
    page = parser.parse_args().doc
    torch.set_num_threads(1)
    rows = [list(COLUMNS), ["---"] * len(COLUMNS), *(row(preset) for preset in PRESETS)]
    table = "".join(f"| {' | '.join(cells)} |\n" for cells in rows)
    print(table)
    if page is not None:
        before, rest = page.read_text().split(START)
        page.write_text(before + START + table + END + rest.split(END, 1)[1])


if __name__ == "__main__":
    main()
