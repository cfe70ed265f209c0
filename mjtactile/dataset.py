"""Datasets of presses on disk: made by any number of workers, continued where they were interrupted.

A dataset is a folder of Parquet files: columns by name that pandas, polars, DuckDB or Arrow in any language read
without this package, labels readable without the readings, compressed, and every part a file that is there whole or
not at all, so that going on after an interruption is making the parts that are missing. HDF5 and Zarr hold arrays as
well, but one HDF5 file is lost to a crash while it is written, and neither is read by table tools. Each file's
metadata holds the pad, its fingerprint and the specification, as JSON under "mjtactile".
"""

from __future__ import annotations

import io
import json
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mjtactile.dataset_spec import DatasetError, DatasetSpec
from mjtactile.distribute import Workers, make_files
from mjtactile.influence import InfluenceMatrices
from mjtactile.pad import Array, Pad
from mjtactile.press_sampling import NOISE, OutlinePresses, outline_presses, stream
from mjtactile.progress import progress_bar

if TYPE_CHECKING:
    import pyarrow as pa

FORMAT = 1
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
    tasks = {path: _PartOf(spec, part) for path, part in parts.items()}
    chosen = Workers(count=max(workers, 1)) if isinstance(workers, int) else workers
    with progress_bar(f"pressing, {spec.backend}", total, wanted=progress) as advance:
        for path in make_files(_part_file, tasks, chosen):
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


def press_columns(spec: DatasetSpec, presses: OutlinePresses) -> dict[str, np.ndarray]:
    """Labels and readings of the presses of one outline, as columns; presses that did not settle are left out."""
    influence = _influence(spec.pad, presses.preset)
    if spec.backend == "mujoco":
        from mjtactile.press_mujoco import mujoco_readings as readings_of
    else:
        from mjtactile.press_physics import physics_readings as readings_of
    readings, forces, points = readings_of(influence, presses)
    count = len(readings)
    index = presses.first + np.arange(count)
    noise = np.zeros(count)
    for k in range(count):
        readings[k], noise[k] = _as_reported(spec, readings[k], stream(spec.seed, NOISE, int(index[k])))
    shifts = np.repeat([pose.shift for pose in presses.poses], spec.forces, axis=0)
    columns = {
        "press": index,
        "shape": np.full(count, presses.shape),
        "size": np.full(count, presses.size),
        "rotation": np.repeat([pose.rotation for pose in presses.poses], spec.forces),
        "shift_x": shifts[:, 0],
        "shift_y": shifts[:, 1],
        "force_x": forces[:, 0],
        "force_y": forces[:, 1],
        "force_z": forces[:, 2],
        "position_x": points[:, 0],
        "position_y": points[:, 1],
        "free": np.full(count, presses.free),
        "preset": np.full(count, presses.preset),
        "law": np.full(count, presses.law),
        "tangential": np.full(count, presses.tangential),
        "noise": noise,
        "transducer": np.full(count, (spec.transducer or {}).get("name", "none")),
        "readings": readings.reshape(count, -1).astype(np.float32),
    }
    settled = np.isfinite(columns["readings"]).all(axis=1)
    return {name: column[settled] for name, column in columns.items()}


def _as_reported(spec: DatasetSpec, readings: Array, rng: np.random.Generator) -> tuple[Array, float]:
    """Readings [Pa] as the transducer reports them, with noise, and its relative standard deviation."""
    if spec.transducer is not None:
        from mjtactile.press_transducer import reported

        readings = reported(spec.transducer, readings, rng)
    noise = float(rng.uniform(*spec.noise))
    if noise > 0.0:
        readings = readings + noise * np.nanmax(readings) * rng.standard_normal(readings.shape)
    return readings, noise


@lru_cache(maxsize=4)
def _influence(pad: Pad, preset: str) -> InfluenceMatrices:
    from mjtactile.cache import influence_matrices

    return influence_matrices(pad, preset=preset, progress=False)


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


@dataclass(frozen=True)
class _PartOf:
    """What a worker is asked for."""

    spec: DatasetSpec
    part: tuple[int, int]  #: first press and end


def _part_file(task: _PartOf) -> bytes:
    """The file of one part."""
    import pyarrow.parquet as pq

    spec, (first, end) = task.spec, task.part
    outlines = range(first // spec.presses_per_outline, math.ceil(end / spec.presses_per_outline))
    made = [press_columns(spec, outline_presses(spec, outline)) for outline in outlines]
    columns = {name: np.concatenate([columns[name] for columns in made]) for name in made[0]}
    wanted = columns["press"] < end
    table = _table(spec, task.part, {name: column[wanted] for name, column in columns.items()})
    file = io.BytesIO()
    pq.write_table(table, file, compression="zstd")
    return file.getvalue()


def _table(spec: DatasetSpec, part: tuple[int, int], columns: dict[str, np.ndarray]) -> pa.Table:
    import pyarrow as pa

    from mjtactile import __version__

    readings = columns["readings"]
    lists = pa.FixedSizeListArray.from_arrays(pa.array(readings.ravel()), readings.shape[1])
    arrays = {name: pa.array(column) for name, column in columns.items() if name != "readings"}
    metadata = {
        "format": FORMAT,
        "version": __version__,
        "part": part,
        "pad": spec.pad.description,
        "pad_fingerprint": spec.pad.fingerprint,
        "reading_shape": spec.pad.reading_shape,
        "spec": spec.description,
        "spec_fingerprint": spec.fingerprint,
    }
    table = pa.table({**arrays, "readings": lists})
    return table.replace_schema_metadata({"mjtactile": json.dumps(metadata)})


def _metadata_of(path: Path, schema: pa.Schema) -> dict[str, Any]:
    try:
        return json.loads((schema.metadata or {})[b"mjtactile"])
    except (KeyError, ValueError):
        raise DatasetError(f"{path} is not a part of a dataset of presses. Move it elsewhere.") from None
