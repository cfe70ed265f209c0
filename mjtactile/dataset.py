"""Datasets of presses on disk: made by any number of workers, continued where they were interrupted.

A dataset is a folder of Parquet files: columns by name that pandas, polars, DuckDB or Arrow in any language read
without this package, labels readable without the readings, compressed, and every part a file that is there whole or
not at all, so that going on after an interruption is making the parts that are missing. HDF5 and Zarr hold arrays as
well, but one HDF5 file is lost to a crash while it is written, and neither is read by table tools. Each file's
metadata holds the pad, its fingerprint and the specification, as JSON under "mjtactile".
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mjtactile.dataset_parts import PartOf, part_file
from mjtactile.dataset_spec import DatasetError, DatasetSpec
from mjtactile.distribute import Workers, make_files
from mjtactile.pad import Array
from mjtactile.progress import progress_bar

if TYPE_CHECKING:
    import pyarrow as pa

#: About as many presses go into one file.
_PRESSES_PER_PART = 960


@dataclass(frozen=True, eq=False)
class Dataset:
    """Presses read back.

    Attributes:
        readings: (presses, layers, rows, columns) [Pa], float32.
        labels: the other columns by name, (presses,) each, SI units; see docs/datasets.md.
        metadata: pad, fingerprint and specification.
    """

    readings: np.ndarray
    labels: dict[str, np.ndarray]
    metadata: dict[str, Any]

    @property
    def pad_fingerprint(self) -> str:
        """Of the pad that was pressed."""
        return self.metadata["pad_fingerprint"]

    @property
    def forces(self) -> Array:
        """On the pad, pad frame, (presses, 3) [N]."""
        return self._vectors("force_x", "force_y", "force_z")

    @property
    def positions(self) -> Array:
        """Where the forces pass through the surface, (presses, 2) [m]."""
        return self._vectors("position_x", "position_y")

    @property
    def shifts(self) -> Array:
        """Where the bodies' origins are, (presses, 2) [m]."""
        return self._vectors("shift_x", "shift_y")

    def _vectors(self, *names: str) -> Array:
        return np.stack([self.labels[name] for name in names], axis=-1)


def make_dataset(spec: DatasetSpec, folder: Path, *, workers: int | Workers = 1, progress: bool = True) -> int:
    """Make the parts of a dataset that are not there yet.

    Args:
        spec: what to make.
        folder: where to; made if needed. Parts of the same specification are kept.
        workers: processes, one core each, or where to find others (distribute.py). The files do not depend on them.
        progress: show a progress bar on a terminal.

    Returns:
        How many presses were made now.

    Raises:
        DatasetError: the folder holds another dataset.
        DistributeError: there are no workers, or they die again and again.
        OSError: the folder cannot be written.
    """
    from mjtactile.cache import influence_matrices

    folder.mkdir(parents=True, exist_ok=True)
    parts = {_path(folder, part): part for part in _parts(spec) if not _is_there(spec, folder, part)}
    if not parts:
        return 0
    for preset in spec.presets:  # built once, before workers ask for them together
        influence_matrices(spec.pad, preset=preset, progress=progress)
    made = 0
    total = sum(end - first for first, end in parts.values())
    tasks = {path: PartOf(spec, part) for path, part in parts.items()}
    chosen = Workers(count=max(workers, 1)) if isinstance(workers, int) else workers
    with progress_bar(f"pressing, {spec.backend}", total, wanted=progress) as advance:
        for path in make_files(part_file, tasks, chosen):
            first, end = parts[path]
            count = end - first
            made += count
            advance(count)
    return made


def read_dataset(folder: Path, *, labels_only: bool = False, most: int | None = None) -> Dataset:
    """Read a dataset.

    Args:
        folder: as given to `make_dataset`.
        labels_only: leave the readings out, as an empty array.
        most: read no more parts once there are this many presses; by default all.

    Raises:
        DatasetError: there is none, or files that are not of one dataset.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    paths = sorted(folder.glob("presses-*.parquet"))
    if not paths:
        raise DatasetError(
            f"there is no dataset in {folder}. Make one: mjtactile dataset --spec FILE.toml --out {folder}"
        )
    tables, metadata = [], {}
    for path in paths:
        names = [name for name in pq.read_schema(path).names if not (labels_only and name == "readings")]
        table = pq.read_table(path, columns=names)
        own = _metadata_of(path, table.schema)
        if metadata and own["spec_fingerprint"] != metadata["spec_fingerprint"]:
            raise DatasetError(f"{path} belongs to another dataset than {paths[0].name}. Keep one dataset per folder.")
        metadata = own
        tables.append(table)
        if most is not None and sum(len(one) for one in tables) >= most:
            break
    whole = pa.concat_tables([table.replace_schema_metadata(None) for table in tables])
    labels = {name: whole[name].to_numpy() for name in whole.column_names if name != "readings"}
    if labels_only:
        return Dataset(np.zeros(0, dtype=np.float32), labels, metadata)
    flat = whole["readings"].combine_chunks().flatten().to_numpy()
    return Dataset(flat.reshape(-1, *metadata["reading_shape"]), labels, metadata)


def _parts(spec: DatasetSpec) -> list[tuple[int, int]]:
    """First press and end of every part; parts hold whole outlines, the last one as much as is asked for."""
    per_part = math.ceil(_PRESSES_PER_PART / spec.presses_per_outline) * spec.presses_per_outline
    return [(first, min(first + per_part, spec.presses)) for first in range(0, spec.presses, per_part)]


def _path(folder: Path, part: tuple[int, int]) -> Path:
    return folder / f"presses-{part[0]:09d}.parquet"


def _is_there(spec: DatasetSpec, folder: Path, part: tuple[int, int]) -> bool:
    import pyarrow.parquet as pq

    path = _path(folder, part)
    if not path.is_file():
        return False
    metadata = _metadata_of(path, pq.read_schema(path))
    if metadata["spec_fingerprint"] != spec.fingerprint:
        raise DatasetError(
            f"{folder} holds a dataset of another specification or seed. Choose another folder, or delete that one."
        )
    return metadata["part"] == list(part)


def _metadata_of(path: Path, schema: pa.Schema) -> dict[str, Any]:
    try:
        return json.loads((schema.metadata or {})[b"mjtactile"])
    except (KeyError, ValueError):
        raise DatasetError(f"{path} is not a part of a dataset of presses. Move it elsewhere.") from None
