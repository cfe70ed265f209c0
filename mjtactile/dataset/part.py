"""One part of a dataset: a Parquet file of presses with their labels and readings, made, written and read whole.

Each file's metadata contains the pad, its fingerprint and the specification as JSON under "mjtactile", and a checksum
of the whole file (seal.py).
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
from mjtactile._installed import __version__, require
from mjtactile._types import Array
from mjtactile.dataset.hardware import transducer_for
from mjtactile.dataset.sampling import NOISE, OutlinePresses, outline_presses, stream
from mjtactile.dataset.seal import UNSEALED, is_sealed, is_whole, sealed
from mjtactile.dataset.spec import DatasetSpec
from mjtactile.errors import DamagedPartError, DatasetError
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad

if TYPE_CHECKING:
    import pyarrow as pa


#: Pattern of the file names of parts.
PART_FILES = "presses-*.parquet"
#: Version of the files' format.
FORMAT = 2
#: Columns that contain names.
_NAMES = ("shape", "preset", "law", "tangential", "transducer")
#: Columns that are the same for all presses of an outline, named as in `OutlinePresses`.
_OF_OUTLINE = ("shape", "size", "free", "preset", "law", "tangential")
#: Key of the metadata in a file's schema.
_METADATA = b"mjtactile"


def part_file(spec: DatasetSpec, part: tuple[int, int]) -> bytes:
    """Make one part of a dataset, presses from the first index to before the second; return its Parquet file."""
    require("dataset")
    import pyarrow.parquet as pq

    made = [press_columns(spec, outline_presses(spec, outline)) for outline in outlines_of(spec, part)]
    columns = {name: np.concatenate([columns[name] for columns in made]) for name in made[0]}
    wanted = columns["press"] < part[1]
    table = _table(spec, part, {name: column[wanted] for name, column in columns.items()})
    file = io.BytesIO()
    # No two readings are alike, so a dictionary of them would be larger than the readings themselves. Page checksums
    # are for readers that do not know this package.
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


def outlines_of(spec: DatasetSpec, part: tuple[int, int]) -> range:
    """Indices of the outlines of a part's presses."""
    first, end = part
    return range(first // spec.presses_per_outline, math.ceil(end / spec.presses_per_outline))


@dataclass(frozen=True, eq=False)
class Part:
    """A part that was read and verified."""

    path: Path  #: path of the file
    metadata: dict[str, Any]  #: pad, specification and range of presses
    content: bytes  #: bytes of the file

    @property
    def presses(self) -> tuple[int, int]:
        """Index of the first press, and one past the last."""
        first, end = self.metadata["part"]
        return first, end

    @property
    def asked(self) -> int:
        """Number of presses of the whole dataset when the part was made."""
        return self.metadata["spec"]["presses"]

    def table(self, *, readings: bool) -> pa.Table:
        """The columns, with or without the readings."""
        require("dataset")
        import pyarrow as pa
        import pyarrow.parquet as pq

        names = [name for name in part_schema(self.metadata["reading_shape"]).names if readings or name != "readings"]
        return pq.read_table(pa.BufferReader(self.content), columns=names).replace_schema_metadata(None)


def part_name(first: int) -> str:
    """File name of a part, given the index of its first press."""
    return f"presses-{first:09d}.parquet"


def first_press(path: Path) -> int:
    """Index of a part's first press, from the part's file name; -1 if that is no name of a part."""
    digits = path.stem.removeprefix("presses-")
    return int(digits) if digits.isdecimal() and path.name == part_name(int(digits)) else -1


def count_presses(path: Path) -> int:
    """Number of presses in a part, from its file's metadata alone."""
    require("dataset")
    import pyarrow.parquet as pq

    with path.open("rb") as file:  # Arrow cannot open names that are not UTF-8
        return pq.ParquetFile(file).metadata.num_rows


def read_part(path: Path) -> Part:
    """Read a part and verify its checksum.

    Raises:
        DamagedPartError: it is damaged, or has the name of another part.
        DatasetError: it is another kind of file.
    """
    require("dataset")
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
        raise DatasetError(
            f"{path} is of another version of mjtactile. Read it with that one, or make the dataset again."
        )
    if not schema.equals(part_schema(metadata["reading_shape"])):
        raise DamagedPartError(f"{path} has other columns than a part of a dataset of presses.")
    part = Part(path, metadata, content)
    if path.name != part_name(part.presses[0]):
        raise DamagedPartError(f"{path} holds presses {part.presses[0]} to {part.presses[1]}: it was renamed.")
    return part


def part_schema(reading_shape: Sequence[int]) -> pa.Schema:
    """Columns of a part, in order."""
    require("dataset")
    import pyarrow as pa

    text, number, flag = pa.string(), pa.float64(), pa.bool_()
    columns = {"press": pa.int64(), "shape": text}
    columns |= dict.fromkeys(("size", "rotation", "shift_x", "shift_y"), number)
    columns |= dict.fromkeys(("force_x", "force_y", "force_z", "position_x", "position_y"), number)
    columns |= {"free": flag, "preset": text, "law": text, "tangential": text, "noise": number, "transducer": text}
    return pa.schema({**columns, "readings": pa.list_(pa.float32(), math.prod(reading_shape))})


def _is_foreign(content: bytes) -> bool:
    """Whether a file is a valid Parquet file without this package's metadata."""
    require("dataset")
    import pyarrow as pa
    import pyarrow.parquet as pq

    if is_sealed(content):
        return False
    try:
        return _METADATA not in (pq.read_schema(pa.BufferReader(content)).metadata or {})
    except (pa.ArrowException, OSError, ValueError):
        return False


def press_columns(spec: DatasetSpec, presses: OutlinePresses) -> dict[str, np.ndarray]:
    """Labels and readings of an outline's presses that settled, as columns by name, (presses, ...)."""
    influence = influence_of(spec.pad, presses.preset)
    if spec.backend == "mujoco":
        from mjtactile.dataset.by_scene import mujoco_readings as readings_of
    else:
        from mjtactile.dataset.by_law import physics_readings as readings_of
    readings, forces, points = readings_of(influence, presses)
    count = len(readings)
    settled = np.isfinite(readings.reshape(count, -1)).all(axis=1)
    index = presses.first + np.arange(count)
    noise = np.zeros(count)
    for k in np.flatnonzero(settled):
        readings[k], noise[k] = _as_reported(spec, readings[k], stream(spec.seed, NOISE, int(index[k])))
    shifts = np.repeat([pose.shift for pose in presses.poses], spec.forces, axis=0)
    columns = {
        "press": index,
        **{name: np.full(count, getattr(presses, name)) for name in _OF_OUTLINE},
        "rotation": np.repeat([pose.rotation for pose in presses.poses], spec.forces),
        **{f"shift_{axis}": values for axis, values in zip("xy", shifts.T, strict=True)},
        **{f"force_{axis}": values for axis, values in zip("xyz", forces.T, strict=True)},
        **{f"position_{axis}": values for axis, values in zip("xy", points.T, strict=True)},
        "noise": noise,
        "transducer": np.full(count, (spec.transducer or {}).get("name", "none")),
        "readings": readings.reshape(count, -1).astype(np.float32),
    }
    return {name: column[settled] for name, column in columns.items()}


def _as_reported(spec: DatasetSpec, readings: Array, rng: np.random.Generator) -> tuple[Array, float]:
    """Readings [Pa] with transducer and noise, and the noise's standard deviation over the largest reading [-]."""
    if spec.transducer is not None:
        readings = transducer_for(spec.transducer, readings.shape, seed=int(rng.integers(2**31)))(readings)
    noise = float(rng.uniform(*spec.noise))
    if noise > 0.0:
        readings = readings + noise * readings.max() * rng.standard_normal(readings.shape)
    return readings, noise


@lru_cache(maxsize=4)
def influence_of(pad: Pad, fidelity: str) -> InfluenceMatrices:
    """Influence matrices of a pad; those of the last few fidelities stay in memory."""
    from mjtactile.influence.cache import influence_matrices

    return influence_matrices(pad, fidelity, progress=False)


def _table(spec: DatasetSpec, part: tuple[int, int], columns: dict[str, np.ndarray]) -> pa.Table:
    require("dataset")
    import pyarrow as pa

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
