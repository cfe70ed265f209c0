"""One part of a dataset of presses: made, put into the bytes of a Parquet file, and read back from it.

Every file carries a checksum of all its bytes (dataset_seal.py), and its metadata say which presses it holds: damage of
any kind is noticed before anything of the file is used.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mjtactile._files import unusable
from mjtactile.dataset.sampling import NOISE, OutlinePresses, outline_presses, stream
from mjtactile.dataset.seal import UNSEALED, is_sealed, is_whole, sealed
from mjtactile.dataset.spec import DatasetError, DatasetSpec
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Array, Pad

if TYPE_CHECKING:
    import pyarrow as pa

#: Of the files' metadata.
FORMAT = 2
#: Columns of names.
_NAMES = ("shape", "preset", "law", "tangential", "transducer")
#: Key of the metadata in a file's schema.
_METADATA = b"mjtactile"


class DamagedPartError(DatasetError):
    """A part that is not as it was written; it can be made again."""


@dataclass(frozen=True)
class PartOf:
    """What a worker is asked for."""

    spec: DatasetSpec
    part: tuple[int, int]  #: first press and end


def part_file(task: PartOf) -> bytes:
    """The file of one part."""
    import pyarrow.parquet as pq

    spec, (first, end) = task.spec, task.part
    outlines = range(first // spec.presses_per_outline, math.ceil(end / spec.presses_per_outline))
    made = [press_columns(spec, outline_presses(spec, outline)) for outline in outlines]
    columns = {name: np.concatenate([columns[name] for columns in made]) for name in made[0]}
    wanted = columns["press"] < end
    table = _table(spec, task.part, {name: column[wanted] for name, column in columns.items()})
    file = io.BytesIO()
    # No two readings are alike: a dictionary of them is larger than they are. Page checksums are for readers that know
    # nothing of this package.
    writer = pq.ParquetWriter(
        file,
        table.schema,
        compression="zstd",
        use_dictionary=list(_NAMES),  # type: ignore[arg-type]
        write_page_checksum=True,
    )
    with writer:
        writer.write_table(table)
        writer.add_key_value_metadata(UNSEALED)
    return sealed(file.getvalue())


@dataclass(frozen=True, eq=False)
class Part:
    """A part that was read back and is as it was written.

    Attributes:
        path: of the file.
        metadata: pad, specification and place of the part.
        content: the file.
    """

    path: Path
    metadata: dict[str, Any]
    content: bytes

    @property
    def presses(self) -> tuple[int, int]:
        """First press and end."""
        first, end = self.metadata["part"]
        return first, end

    @property
    def asked(self) -> int:
        """How many presses were asked for when the part was made, in the whole dataset."""
        return self.metadata["spec"]["presses"]

    def table(self, *, readings: bool) -> pa.Table:
        """The columns, with the readings or without them."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        names = [name for name in part_schema(self.metadata["reading_shape"]).names if readings or name != "readings"]
        return pq.read_table(pa.BufferReader(self.content), columns=names).replace_schema_metadata(None)


def part_name(first: int) -> str:
    """What the file of a part is called, by its first press."""
    return f"presses-{first:09d}.parquet"


def read_part(path: Path) -> Part:
    """Read a part and make sure that it is as it was written.

    Raises:
        DamagedPartError: it is damaged, or lies under another part's name.
        DatasetError: it is something else.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    found = unusable(path)
    if found is not None:
        raise DatasetError(f"{path} is {found}, not a part of a dataset of presses. Move it elsewhere.")
    content = path.read_bytes()
    if not is_whole(content):
        if _is_foreign(content):
            raise DatasetError(f"{path} is not a part of a dataset of presses. Move it elsewhere.")
        raise DamagedPartError(f"{path} is damaged: its bytes are not those that were written.")
    schema = pq.read_schema(pa.BufferReader(content))
    metadata = json.loads((schema.metadata or {}).get(_METADATA, b"{}"))
    if metadata.get("format") != FORMAT:
        raise DatasetError(f"{path} is of another version of mjtactile. Read it with that, or make the dataset again.")
    if not schema.equals(part_schema(metadata["reading_shape"])):
        raise DamagedPartError(f"{path} has other columns than a part of a dataset of presses.")
    part = Part(path, metadata, content)
    if path.name != part_name(part.presses[0]):
        raise DamagedPartError(f"{path} holds presses {part.presses[0]} to {part.presses[1]}: it was renamed.")
    return part


def part_schema(reading_shape: Sequence[int]) -> pa.Schema:
    """Columns of a part, in order."""
    import pyarrow as pa

    text, number, flag = pa.string(), pa.float64(), pa.bool_()
    columns = {"press": pa.int64(), "shape": text}
    columns |= dict.fromkeys(("size", "rotation", "shift_x", "shift_y"), number)
    columns |= dict.fromkeys(("force_x", "force_y", "force_z", "position_x", "position_y"), number)
    columns |= {"free": flag, "preset": text, "law": text, "tangential": text, "noise": number, "transducer": text}
    return pa.schema({**columns, "readings": pa.list_(pa.float32(), math.prod(reading_shape))})


def _is_foreign(content: bytes) -> bool:
    """Whether it is a sound Parquet file of somebody else."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if is_sealed(content):
        return False
    try:
        return _METADATA not in (pq.read_schema(pa.BufferReader(content)).metadata or {})
    except (pa.ArrowException, OSError, ValueError):
        return False


def press_columns(spec: DatasetSpec, presses: OutlinePresses) -> dict[str, np.ndarray]:
    """Labels and readings of the presses of one outline, as columns; presses that did not settle are left out."""
    influence = _influence(spec.pad, presses.preset)
    if spec.backend == "mujoco":
        from mjtactile.dataset.by_scene import mujoco_readings as readings_of
    else:
        from mjtactile.dataset.by_law import physics_readings as readings_of
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
        from mjtactile.dataset.hardware import reported

        readings = reported(spec.transducer, readings, rng)
    noise = float(rng.uniform(*spec.noise))
    if noise > 0.0:
        readings = readings + noise * np.nanmax(readings) * rng.standard_normal(readings.shape)
    return readings, noise


@lru_cache(maxsize=4)
def _influence(pad: Pad, preset: str) -> InfluenceMatrices:
    from mjtactile.influence.cache import influence_matrices

    return influence_matrices(pad, preset=preset, progress=False)


def _table(spec: DatasetSpec, part: tuple[int, int], columns: dict[str, np.ndarray]) -> pa.Table:
    import pyarrow as pa

    from mjtactile import __version__

    readings = columns["readings"]
    lists = pa.FixedSizeListArray.from_arrays(pa.array(readings.ravel()), readings.shape[1])
    arrays = {name: pa.array(column) for name, column in columns.items() if name != "readings"}
    schema = part_schema(spec.pad.reading_shape)
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
    return pa.table({**arrays, "readings": lists}, schema=schema.with_metadata({_METADATA: json.dumps(metadata)}))
