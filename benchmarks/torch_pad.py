"""What a PadModel costs, folded and as one whole matrix per layer: memory and time per load; tables for docs/torch.md.

python benchmarks/torch_pad.py --doc docs/torch.md
python benchmarks/torch_pad.py --device cuda --doc docs/torch.md
"""

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

REPEATS = 3
#: Loads at once, by type of device.
LOADS = {"cpu": 256, "cuda": 4096}
END = "<!-- end -->"
COLUMNS = ("forward", "and backward", "forward, whole", "and backward")


def nbytes(tensors: list[Tensor]) -> int:
    return sum(one.numel() * one.element_size() for one in tensors)


def finished(device: torch.device, work: Callable[[], object]) -> Callable[[], None]:
    """The work, with the wait until the device has done it."""

    def wait() -> None:
        work()
        if device.type == "cuda":
            torch.cuda.synchronize(device)

    return wait


def row(preset: str, device: torch.device) -> list[str]:
    influence = influence_matrices(fidelity=preset)
    model = PadModel(influence, device=device)
    footprint = Footprint.from_outline(indenter_outline("star", rotate_deg=20), influence.surface)
    load = contact_load(influence, footprint, force=(0.1, 0.0, -0.5))
    count = LOADS[device.type]
    forces = model.nodal_forces([load]).repeat(count, 1, 1, 1)
    points = [part.stop - part.start for part in influence.sample_slices]
    whole = [torch.rand(int(np.prod(model.force_shape)), 5 * number, device=device) for number in points]
    averages = [model.get_buffer(f"average_{k}") for k in range(len(points))]

    def unfolded(forces: Tensor) -> Tensor:
        norms = [(forces.flatten(1) @ one).unflatten(1, (-1, 5)).norm(dim=-1) for one in whole]
        return torch.stack([norm @ average.T for norm, average in zip(norms, averages, strict=True)], dim=1)

    def with_gradient(model: Callable[[Tensor], Tensor]) -> None:
        given = forces.clone().requires_grad_()
        model(given).sum().backward()

    works: list[Callable[[], object]] = [
        torch.no_grad()(lambda: model(forces)),
        lambda: with_gradient(model),
        torch.no_grad()(lambda: unfolded(forces)),
        lambda: with_gradient(unfolded),
    ]
    seconds = [median_time(finished(device, work), REPEATS) / count for work in works]
    if device.type == "cuda":
        return [preset, *(f"{one * 1e6:.2g} µs" for one in seconds)]
    times = [f"{one * 1e3:.2g} ms" for one in (median_time(lambda: influence.readings(load), REPEATS), *seconds)]
    sizes = [f"{nbytes(one) / 1e6:.0f}" for one in (list(model.buffers()), whole + averages)]
    return [preset, *sizes, *times]


def table(device: torch.device) -> str:
    columns = ["preset", *([] if device.type == "cuda" else ["MB", "MB whole", "NumPy and core"]), *COLUMNS]
    rows = [columns, ["---"] * len(columns), *(row(preset, device) for preset in PRESETS)]
    lines = "".join(f"| {' | '.join(cells)} |\n" for cells in rows)
    return f"{torch.cuda.get_device_name(device)}:\n\n{lines}" if device.type == "cuda" else lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", type=torch.device, default=torch.device("cpu"), help="cpu (one core) or cuda")
    parser.add_argument("--doc", type=Path, help="page whose table to replace")
    options = parser.parse_args()
    torch.set_num_threads(1)
    text = table(options.device)
    print(text)
    if options.doc is not None:
        start = f"<!-- bench torch {options.device.type} -->\n"
        before, rest = options.doc.read_text().split(start)
        options.doc.write_text(before + start + text + END + rest.split(END, 1)[1])


if __name__ == "__main__":
    main()
