"""A dataset of presses as a LeRobotDataset: presses that share an outline are an episode, each press a frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mjtactile._progress import progress_bar
from mjtactile.dataset.files import Dataset, read_dataset
from mjtactile.dataset.spec import pad_from
from mjtactile.lerobot.features import Feature, tactile_columns, tactile_features, vector
from mjtactile.lerobot.writer import LeRobotWriter

#: Name of the only pad.
PAD = "pad"
#: Nominal rate [Hz]: single presses have no time, only an order.
_FPS = 1
_VECTORS = {
    "label.force": (["force_x", "force_y", "force_z"], "N"),
    "label.position": (["position_x", "position_y"], "m"),
    "label.shift": (["shift_x", "shift_y"], "m"),
    "label.rotation": (["rotation"], "rad"),
    "label.size": (["size"], "-"),
    "label.noise": (["noise"], "-"),
}


def presses_to_lerobot(presses: str | Path, folder: str | Path, *, flat: bool = False, progress: bool = True) -> int:
    """Convert a dataset of presses (`make_dataset`) to a LeRobotDataset; return the number of episodes.

    Args:
        presses: folder of the dataset of presses.
        folder: folder of the new dataset; it must not exist.
        flat: whether readings are stored as vectors; see `tactile_features`.
        progress: show a progress bar on a terminal.

    Raises:
        DatasetError: there are no presses, or the folder exists.
    """
    data = read_dataset(presses)
    # Not `spec_from`: datasets made before a specification was refused are converted all the same.
    spec = data.metadata["spec"]
    features = {name: vector(names, unit) for name, (names, unit) in _VECTORS.items()}
    features |= {"label.free": Feature(dtype="bool")}
    features |= tactile_features(PAD, pad_from(spec["pad"]), flat=flat)
    outlines = data.labels["press"] // (spec["poses"] * spec["forces"])
    episodes = [np.flatnonzero(outlines == outline) for outline in np.unique(outlines)]
    with (
        LeRobotWriter(folder, fps=_FPS, features=features, robot="mjtactile presses") as writer,
        progress_bar("writing", len(episodes), wanted=progress) as advance,
    ):
        for rows in episodes:
            columns = {
                name: np.stack([data.labels[one][rows] for one in names], axis=-1)
                for name, (names, _) in _VECTORS.items()
            }
            columns |= {"label.free": data.labels["free"][rows]}
            columns |= tactile_columns(PAD, data.readings[rows][:, None], flat=flat)
            writer.add_episode(columns, _task(data, int(rows[0])))
            advance(1)
    return len(episodes)


def _task(data: Dataset, row: int) -> str:
    shape = Path(str(data.labels["shape"][row])).stem
    return f"press the {shape} onto the pad"
