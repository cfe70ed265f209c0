"""Read a LeRobotDataset with LeRobot's own package, and write all of it to an .npz file; run in a venv that has it.

    python read_dataset.py DATASET OUT.npz

PyPI's torchvision is compiled for PyTorch with CUDA, and its operators do not load beside a PyTorch without it. LeRobot
uses none of them to read arrays: the one that torchvision describes when it is imported is declared here, empty.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np
import torch

warnings.simplefilter("ignore")
_OPERATORS = torch.library.Library("torchvision", "FRAGMENT")
if not hasattr(torch.ops.torchvision, "nms"):
    _OPERATORS.define("nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")

from lerobot.datasets.lerobot_dataset import LeRobotDataset  # noqa: E402  # pyright: ignore[reportMissingImports]


def main(folder: str, out: str) -> None:
    """Read, and write."""
    data = LeRobotDataset("local/dataset", root=folder)
    frames = [data[number] for number in range(len(data))]
    columns = {name: np.stack([np.asarray(frame[name]) for frame in frames]) for name in frames[0] if name != "task"}
    tasks = np.array([frame["task"] for frame in frames])
    facts = {"fps": data.fps, "episodes": data.num_episodes, "frames": data.num_frames}
    ends = np.array([[episode["dataset_from_index"], episode["dataset_to_index"]] for episode in data.meta.episodes])
    means = {f"mean/{name}": of["mean"] for name, of in data.meta.stats.items()}
    units = {f"unit/{name}": np.array(of.get("info", {}).get("unit", "")) for name, of in data.features.items()}
    found: dict[str, Any] = {**columns, "task": tasks, "ends": ends, **facts, **means, **units}
    np.savez(out, **found)


if __name__ == "__main__":
    main(*sys.argv[1:])
