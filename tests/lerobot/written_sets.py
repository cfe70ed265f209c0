"""Reading what was written back: with pyarrow, and with LeRobot's own package where its venv is."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
#: Made by `make build/lerobot/installed`: LeRobot's package pins versions that clash with ours.
PYTHON = ROOT / "build" / "lerobot" / "bin" / "python"

needs_lerobot = pytest.mark.skipif(
    not PYTHON.exists(), reason="LeRobot's package is not there: make build/lerobot/installed"
)


def info(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "meta" / "info.json").read_text())


def read(folder: Path) -> dict[str, np.ndarray]:
    """All frames by column, in order, as arrays of the features' shapes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.concat_tables([pq.read_table(path) for path in sorted((folder / "data").glob("*/*.parquet"))])
    shapes = {name: feature["shape"] for name, feature in info(folder)["features"].items()}
    columns = {}
    for name in table.column_names:
        column = table[name].combine_chunks()
        while not (pa.types.is_primitive(column.type) or pa.types.is_boolean(column.type)):
            column = column.flatten()
        shape = [] if shapes[name] == [1] else shapes[name]
        columns[name] = column.to_numpy(zero_copy_only=False).reshape(len(table), *shape)
    return columns


def read_with_lerobot(folder: Path, out: Path) -> dict[str, np.ndarray]:
    """The same, read by LeRobotDataset, with what it says of the dataset."""
    script = Path(__file__).with_name("read_dataset.py")
    done = subprocess.run([PYTHON, script, folder, out], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with np.load(out) as file:
        return dict(file)
