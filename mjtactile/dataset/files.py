"""Datasets of presses on disk: written by any number of workers, resumable after interruptions.

A dataset is a folder of Parquet files. pandas, polars, DuckDB and Arrow in any language read them without this package,
and labels can be read without the readings. Every part is a file that exists completely or not at all, so resuming
means making the missing parts. HDF5 and Zarr store arrays too, but a crash destroys an HDF5 file that is being written,
and table tools read neither. Each file's metadata contains the pad, its fingerprint and the specification as JSON under
"mjtactile", and a checksum of the whole file (seal.py). Damaged parts are detected: readers refuse them, and
`make_dataset` makes them again.
"""

from __future__ import annotations

import io
import json
import math
import shutil
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mjtactile._files import PARTIAL, check_writable, lock_file, make_folder, path_from, unusable
from mjtactile._installed import __version__, require
from mjtactile._progress import progress_bar
from mjtactile._types import Array
from mjtactile.dataset.hardware import transducer_for
from mjtactile.dataset.sampling import NOISE, OutlinePresses, outline_presses, stream
from mjtactile.dataset.seal import UNSEALED, is_sealed, is_whole, sealed
from mjtactile.dataset.shapes import shape_indenter
from mjtactile.dataset.spec import DatasetSpec
from mjtactile.errors import DamagedPartError, DatasetError, DatasetWarning, DistributeError, of_type, shortened
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad
from mjtactile.units import is_whole as is_whole_number
from mjtactile.workers import Workers, check_workers, make_files

if TYPE_CHECKING:
    import pyarrow as pa


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

    made = [press_columns(spec, outline_presses(spec, outline)) for outline in _outlines(spec, part)]
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
    influence = _influence(spec.pad, presses.preset)
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
def _influence(pad: Pad, fidelity: str) -> InfluenceMatrices:
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


#: Approximate number of presses in one file.
_PRESSES_PER_PART = 960
_FILES = "presses-*.parquet"


@dataclass(frozen=True, eq=False)
class Dataset:
    """Presses read from disk.

    Attributes:
        readings: (presses, *reading_shape) [Pa], float32.
        labels: the other columns by name, (presses,) each, SI units; see docs/datasets.md.
        metadata: pad, fingerprint and specification.
    """

    readings: np.ndarray
    labels: dict[str, np.ndarray]
    metadata: dict[str, Any]

    @property
    def forces(self) -> Array:
        """Forces on the pad in the pad frame [N], (presses, 3)."""
        return self._vectors("force_x", "force_y", "force_z")

    @property
    def positions(self) -> Array:
        """Points (x, y) where the forces' lines of action meet the surface [m], (presses, 2)."""
        return self._vectors("position_x", "position_y")

    @property
    def shifts(self) -> Array:
        """Positions (x, y) of the bodies' origins in the pad frame [m], (presses, 2)."""
        return self._vectors("shift_x", "shift_y")

    def _vectors(self, *names: str) -> Array:
        return np.stack([self.labels[name] for name in names], axis=-1)


def make_dataset(spec: DatasetSpec, folder: str | Path, *, workers: int | Workers = 1, progress: bool = True) -> int:
    """Make the missing and damaged parts of a dataset.

    Args:
        spec: specification of the dataset.
        folder: folder of the dataset, created if necessary. Existing parts of the same specification are kept.
        workers: number of processes, one core each, or a `Workers`. The files do not depend on it.
        progress: show a progress bar on a terminal.

    Returns:
        Number of presses made by this call, without those that were left out: they did not settle in MuJoCo, or their
        force does not press on a curved pad.

    Raises:
        DatasetError: `spec` is no specification or `folder` no path; the folder contains another dataset, more presses
            than specified, or another file with a part's name; a body misses the pad; another process is making the
            dataset; the disk is too small; or all presses of the dataset were left out.
        DistributeError: `workers` is neither a whole number nor a `Workers`; or workers cannot be started or reached,
            or are killed repeatedly.
        IndenterError: a mesh file cannot be read.
        OutputError: the folder cannot be made or written.

    Warns:
        DatasetWarning: a part was damaged and is made again, or presses were left out.
    """
    require("dataset")
    from mjtactile.influence.cache import influence_matrices

    chosen = _chosen(workers)
    check_workers(chosen)
    of_type(DatasetSpec, "spec", spec, DatasetError, "load_spec reads one")
    folder = path_from(folder, "folder", DatasetError)
    make_folder(folder)
    check_writable(folder / part_name(0))
    with _alone(folder):
        kept = _kept(spec, folder)
        _check_space(spec, folder, spec.presses - sum(end - first for first, end in kept))
        parts = {folder / part_name(part[0]): part for part in _parts(spec) if part not in kept}
        if not parts:
            _check_some(spec, folder)
            return 0
        for preset in spec.presets:  # built once, before all workers need them at the same time
            influence_matrices(spec.pad, preset, progress=progress)
        _check_poses(spec, parts.values())
        made = 0
        total = sum(end - first for first, end in parts.values())
        with progress_bar(f"pressing, {spec.backend}", total, wanted=progress) as advance:
            for path in make_files(partial(part_file, spec), parts, chosen):
                first, end = parts[path]
                made += _rows(path)
                advance(end - first)
        _check_some(spec, folder)
    if made < total:
        warnings.warn(
            f"{total - made} of {total} presses were left out: {_why_left_out(spec)}.", DatasetWarning, stacklevel=2
        )
    return made


def _chosen(workers: object) -> Workers:
    """Where parts are made: at workers, or in a whole number of processes from 1 on."""
    if isinstance(workers, Workers):
        return workers
    if not is_whole_number(workers):
        raise DistributeError(
            f"workers = {shortened(workers)}; expected a whole number of processes, or a Workers, for example "
            "Workers(ray=True)."
        )
    return Workers(count=int(workers))


def _rows(path: Path) -> int:
    """Number of presses in a part."""
    require("dataset")
    import pyarrow.parquet as pq

    with path.open("rb") as file:  # Arrow cannot open names that are not UTF-8
        return pq.ParquetFile(file).metadata.num_rows


def _check_some(spec: DatasetSpec, folder: Path) -> None:
    """Refuse a complete dataset without any press."""
    if not any(_rows(folder / part_name(first)) for first, _ in _parts(spec)):
        raise DatasetError(
            f"all {spec.presses} presses were left out: {_why_left_out(spec)}. The dataset in {folder} is empty. "
            "Delete it, and give other forces, tilts or shifts."
        )


def _why_left_out(spec: DatasetSpec) -> str:
    if spec.backend == "mujoco":
        return "bodies did not settle, because they slide, tip or rock"
    return "forces did not press along -z, because they are tilted on a slope of the pad"


def read_dataset(folder: str | Path, *, labels_only: bool = False, most: int | None = None) -> Dataset:
    """Read a dataset and verify all checksums.

    Args:
        folder: folder of the dataset, as in `make_dataset`.
        labels_only: do not read the readings; they are an empty array in the result.
        most: stop after the part in which this number of presses is reached; by default read all.

    Raises:
        DatasetError: `folder` is no path, there is no dataset, its files belong to different datasets, a file is
            damaged, or presses are missing.
    """
    require("dataset")
    import pyarrow as pa

    folder = path_from(folder, "folder", DatasetError)
    remedy = f"Make what is missing: mjtactile dataset --spec FILE.toml --out {folder}"
    paths = sorted(folder.glob(_FILES))
    if not paths:
        raise DatasetError(
            f"there is no dataset in {folder}. Make one: mjtactile dataset --spec FILE.toml --out {folder}"
        )
    tables, metadata, following, asked = [], {}, 0, 0
    for path in paths:
        try:
            part = read_part(path)
        except DamagedPartError as error:
            raise DamagedPartError(f"{error} {remedy}") from error
        if metadata and part.metadata["spec_fingerprint"] != metadata["spec_fingerprint"]:
            raise DatasetError(f"{path} belongs to another dataset than {paths[0].name}. Keep one dataset per folder.")
        first, end = part.presses
        if first != following:
            raise DatasetError(f"presses {following} to {first} are missing in {folder}. {remedy}")
        metadata, following, asked = part.metadata, end, max(asked, part.asked)
        tables.append(part.table(readings=not labels_only))
        if most is not None and sum(len(one) for one in tables) >= most:
            break
    else:
        if following < asked:
            raise DatasetError(f"presses {following} to {asked} are missing in {folder}. {remedy}")
    whole = pa.concat_tables(tables)
    labels = {name: whole[name].to_numpy() for name in whole.column_names if name != "readings"}
    if labels_only:
        return Dataset(np.zeros(0, dtype=np.float32), labels, metadata)
    flat = whole["readings"].combine_chunks().flatten().to_numpy()
    return Dataset(flat.reshape(-1, *metadata["reading_shape"]), labels, metadata)


def _outlines(spec: DatasetSpec, part: tuple[int, int]) -> range:
    """Indices of the outlines of a part's presses."""
    first, end = part
    return range(first // spec.presses_per_outline, math.ceil(end / spec.presses_per_outline))


def _parts(spec: DatasetSpec) -> Iterator[tuple[int, int]]:
    """First press and end of every part; all parts but the last contain whole outlines."""
    per_part = math.ceil(_PRESSES_PER_PART / spec.presses_per_outline) * spec.presses_per_outline
    return ((first, min(first + per_part, spec.presses)) for first in range(0, spec.presses, per_part))


def _check_poses(spec: DatasetSpec, parts: Iterable[tuple[int, int]]) -> None:
    """Refuse presses that would miss the pad, before any is made; the message names the press and the entry.

    With backend "physics", bodies that miss a curved pad are refused with the specification.
    """
    from mjtactile.dataset.by_law import always_on_pad, check_on_pad, pose_footprint

    certain = all(always_on_pad(contact, spec.pad) for contact in spec.contacts)
    if certain or (spec.backend == "physics" and not spec.pad.surface.is_flat):
        return
    for outline in sorted({outline for part in parts for outline in _outlines(spec, part)}):
        presses = outline_presses(spec, outline)
        if spec.backend == "mujoco":
            from mjtactile.dataset.by_scene import pose_scene

            touch = partial(pose_scene, shape_indenter(presses.shape, presses.size), spec.pad, presses)
        else:
            touch = partial(pose_footprint, _influence(spec.pad, presses.preset), presses)
        check_on_pad(spec.pad, presses, touch)


def _kept(spec: DatasetSpec, folder: Path) -> set[tuple[int, int]]:
    """First press and end of the valid parts in a folder; damaged parts are renamed.

    Raises:
        DatasetError: the folder contains another dataset, more presses than specified, or another file with a part's
            name.
    """
    kept, damaged, most = set(), [], 0
    own = spec.fingerprint
    for path in sorted(folder.glob(_FILES)):
        try:
            part = read_part(path)
        except DamagedPartError as error:
            damaged.append((path, error))
            continue
        if part.metadata["spec_fingerprint"] != own:
            raise DatasetError(
                f"{folder} holds a dataset of {_difference(spec, part)}. Choose another folder, or delete that one."
            )
        kept.add(part.presses)
        most = max(most, part.asked, part.presses[1])
    for path, _ in damaged:
        most = max(most, _least_asked(path))
    if spec.presses < most:
        raise DatasetError(
            f"{folder} holds a dataset of {most} presses, but {spec.presses} were asked for. Presses are never "
            f"deleted: ask for at least {most}, or choose another folder."
        )
    for path, error in damaged:
        aside = _put_aside(path)
        warnings.warn(
            f"{error} Its presses are made again; what was there is now {aside}.", DatasetWarning, stacklevel=3
        )
    return kept


def _difference(spec: DatasetSpec, part: Part) -> str:
    """In what a dataset differs, as words for an error message."""
    if {**part.metadata["spec"], "presses": spec.presses} == spec.description:
        return "the same specification, but with other mesh files: they have changed"
    return "another specification or seed"


def _least_asked(path: Path) -> int:
    """Least number of presses of the dataset that a damaged part belonged to, from its name."""
    digits = path.stem.removeprefix("presses-")
    return int(digits) + 1 if digits.isdecimal() and len(digits) == len(part_name(0)) - len("presses-.parquet") else 0


def _put_aside(path: Path) -> Path:
    """Rename a damaged part, not delete it.

    Readers of Parquet folders ignore hidden files, or take those that end in ".parquet"; some take names with "_".
    """
    number = 0
    while (aside := path.with_name(f".damaged-{number}-{path.stem}")).exists():
        number += 1
    return path.rename(aside)


def _check_space(spec: DatasetSpec, folder: Path, presses: int) -> None:
    """Refuse datasets larger than the free disk space; compression of noisy readings is neglected."""
    needed, free = presses * math.prod(spec.pad.reading_shape) * 4, shutil.disk_usage(folder).free
    if needed > free:
        raise DatasetError(
            f"{presses} presses take up to {needed / 1e9:.3g} GB, but {folder} has {free / 1e9:.3g} GB left. Ask for "
            "fewer presses, free some space, or choose another folder."
        )


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Lock the folder against other processes that make datasets, and remove partial files of killed processes."""
    busy = f"another process is making the dataset in {folder}. Wait for it, or choose another folder."
    lock = lock_file(folder / ".lock", busy, DatasetError)
    try:
        if lock.is_locked:
            for left in folder.glob(f".*{PARTIAL}"):
                left.unlink(missing_ok=True)
        yield
    finally:
        lock.release()
