"""Writer of the published format LeRobotDataset v3: Parquet files of frames, episodes and tasks.

    meta/info.json                                  features, rates, paths of files
    meta/stats.json                                 statistics of all frames
    meta/tasks.parquet                              descriptions of tasks by index
    meta/episodes/chunk-000/file-000.parquet        location and statistics of each episode's frames
    data/chunk-000/file-000.parquet                 frames, episode after episode

Source: https://github.com/huggingface/lerobot, version 0.4, `lerobot.datasets`. A dataset appears complete or not at
all: it is written to a temporary folder beside its own, which is renamed at the end. A lock file beside both keeps
other writers out until then.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile._files import PARTIAL, lock_file, make_folder, path_from, write_atomically
from mjtactile._installed import __version__
from mjtactile.errors import DatasetError, of_type, shortened
from mjtactile.lerobot.features import Feature
from mjtactile.lerobot.statistics import Statistics, column_statistics, joined
from mjtactile.units import finite_number, real_numbers

if TYPE_CHECKING:
    import pyarrow as pa

VERSION = "v3.0"
#: Largest number of files per folder, and size at which a new file begins [MB].
_FILES_PER_CHUNK, _FILE_SIZE = 1000, 100
_PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
#: Columns that every dataset has.
_OWN = {
    "timestamp": Feature(info={"unit": "s"}),
    "frame_index": Feature(dtype="int64"),
    "episode_index": Feature(dtype="int64"),
    "index": Feature(dtype="int64"),
    "task_index": Feature(dtype="int64"),
}
_TASK_NAME = "__index_level_0__"
#: Suffix of the file that a writer locks, after the name of its temporary folder.
_LOCK = ".lock"


class LeRobotWriter:
    """Writes episodes, as a context manager: the dataset exists after the block, and nothing is left if it fails.

    Args:
        folder: folder of the new dataset; it must not exist.
        fps: frames per second of simulated time, an integer [Hz].
        features: columns by name, besides those of every dataset.
        robot: name of the robot.

    Raises:
        DatasetError: the folder is no path or exists, or the format does not allow a name or the rate.
    """

    def __init__(
        self, folder: str | Path, *, fps: int, features: Mapping[str, Feature], robot: str | None = None
    ) -> None:
        folder = path_from(folder, "folder", DatasetError)
        if folder.exists():
            raise DatasetError(f"{folder} exists already. Name a folder that does not exist, or delete that one.")
        rate = finite_number(fps)
        if not (rate >= 1.0 and rate.is_integer()):
            raise DatasetError(
                f"fps = {shortened(fps)}; LeRobotDataset takes whole numbers of frames per second, at least 1."
            )
        if unknown := [name for name in features if name in _OWN or "/" in name]:
            raise DatasetError(
                f"a feature cannot be called {unknown[0]!r}: the name is reserved or has a slash. Choose another."
            )
        self._folder, self._partial = folder, folder.with_name(folder.name + PARTIAL)
        self._fps, self._robot = int(rate), robot
        self._features = {**features, **_OWN}
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._statistics: dict[str, Statistics] = {}
        self._frames, self._file, self._written = 0, 0, 0
        self._open: Any = None
        self._lock_file = self._partial.with_name(self._partial.name + _LOCK)
        self._entered = False

    def __enter__(self) -> LeRobotWriter:
        """Lock the dataset's name, and make the temporary folder.

        Raises:
            DatasetError: another writer is at work there, the lock file cannot be used, or the folder exists and was
                not left by a writer.
            OutputError: it cannot be made.
        """
        make_folder(self._partial.parent)
        busy = f"another writer is making the dataset {self._folder}. Close it first, or name another folder."
        self._lock = lock_file(self._lock_file, busy, DatasetError)
        try:
            self._remove_partial()
            make_folder(self._partial)
        except BaseException:
            self._release()
            raise
        self._entered = True
        return self

    def _release(self) -> None:
        """Delete the lock file, and let other writers in."""
        with suppress(OSError):
            self._lock_file.unlink()  # while it is locked: afterwards it may be another writer's
        self._lock.release()

    def _remove_partial(self) -> None:
        """Delete the partial folder that a killed process left."""
        if not os.path.lexists(self._partial):
            return
        try:
            own = self._partial.is_dir() and {entry.name for entry in self._partial.iterdir()} <= {"data", "meta"}
        except OSError:
            own = False
        if own and not self._partial.is_symlink():
            shutil.rmtree(self._partial, ignore_errors=True)
        if os.path.lexists(self._partial):
            raise DatasetError(
                f"{self._partial} exists, and is not a folder that a cut-off run left, or cannot be deleted. The "
                "dataset is written there until it is whole. Move or delete it, or name another folder."
            )

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._entered = False
        try:
            self._close_file()
            if kind is None:
                self._finish()
        finally:
            shutil.rmtree(self._partial, ignore_errors=True)
            self._release()

    def add_episode(self, columns: Mapping[str, npt.NDArray[Any]], task: str) -> None:
        """Write an episode.

        Args:
            columns: values by feature, (frames, *shape of the feature) each; (frames,) is accepted for (frames, 1).
                Values are rounded to float32, but not to integers.
            task: description of the task.

        Raises:
            DatasetError: a column is missing, unknown, of another shape, or has values that its feature's type cannot
                hold; there are no frames; or the writer is not open.
        """
        import pyarrow as pa

        if not self._entered:
            raise DatasetError(
                "the writer is not open. Add episodes in its block: with LeRobotWriter(...) as writer: ..."
            )
        checked = self._checked(columns)
        frames = len(next(iter(checked.values())))
        number = self._tasks.setdefault(task, len(self._tasks))
        whole = {**checked, **self._own_columns(frames, number)}
        arrays = {name: _array(whole[name], feature) for name, feature in self._features.items()}
        place = self._write(pa.table(arrays))
        found = {name: column_statistics(values) for name, values in whole.items()}
        self._episodes.append(
            {
                "episode_index": len(self._episodes),
                "tasks": [task],
                "length": frames,
                **place,
                "dataset_from_index": self._frames,
                "dataset_to_index": self._frames + frames,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
                **{f"stats/{name}/{kind}": one.tolist() for name, of in found.items() for kind, one in of.items()},
            }
        )
        self._frames += frames
        before = self._statistics
        self._statistics = {name: joined(before[name], one) if before else one for name, one in found.items()}

    def _checked(self, columns: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
        of_type(Mapping, "columns", columns, DatasetError, "values by feature")
        wanted = self._features.keys() - _OWN.keys()
        if wanted != columns.keys():
            raise DatasetError(
                f"an episode has columns {sorted(columns)}, but the dataset has features {sorted(wanted)}. Give one "
                "column per feature."
            )
        arrays = {name: _numbers(name, values) for name, values in columns.items()}
        frames = {len(values) for values in arrays.values()}
        if len(frames) != 1 or 0 in frames:
            raise DatasetError(
                f"an episode's columns have {sorted(frames)} frames; expected the same number in each, at least 1."
            )
        checked = {}
        for name, values in arrays.items():
            feature = self._features[name]
            shaped = values[:, None] if values.ndim == 1 and feature.shape == (1,) else values
            if shaped.shape[1:] != feature.shape:
                raise DatasetError(
                    f"column {name!r} has entries of shape {shaped.shape[1:]}; expected {feature.shape}."
                )
            checked[name] = _converted(name, shaped, feature.dtype)
        return checked

    def _own_columns(self, frames: int, task: int) -> dict[str, npt.NDArray[Any]]:
        count = np.arange(frames, dtype=np.int64)
        columns = {
            "timestamp": (count / self._fps).astype(np.float32),
            "frame_index": count,
            "episode_index": np.full(frames, len(self._episodes), dtype=np.int64),
            "index": self._frames + count,
            "task_index": np.full(frames, task, dtype=np.int64),
        }
        return {name: values[:, None] for name, values in columns.items()}

    def _write(self, table: pa.Table) -> dict[str, int]:
        """Append frames to the open file, or to a new one if that is large enough; return their location."""
        import pyarrow.parquet as pq

        if self._written + table.nbytes > _FILE_SIZE * 2**20 and self._open is not None:
            self._close_file()
            self._file, self._written = self._file + 1, 0
        chunk, file = divmod(self._file, _FILES_PER_CHUNK)
        if self._open is None:
            path = self._partial / "data" / (_PLACE.format(chunk_index=chunk, file_index=file) + ".parquet")
            path.parent.mkdir(parents=True, exist_ok=True)
            self._open = pq.ParquetWriter(path, table.schema, compression="zstd", use_dictionary=False)
        self._open.write_table(table)
        self._written += table.nbytes
        return {"data/chunk_index": chunk, "data/file_index": file}

    def _close_file(self) -> None:
        if self._open is not None:
            self._open.close()
            self._open = None

    def _finish(self) -> None:
        """Write the metadata and rename the folder.

        Raises:
            DatasetError: there are no episodes; or the folder exists by now, and the dataset got another name.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        if not self._episodes:
            raise DatasetError(f"there are no episodes to write to {self._folder}. Add some with add_episode.")
        meta = self._partial / "meta"
        episodes = meta / "episodes" / (_PLACE.format(chunk_index=0, file_index=0) + ".parquet")
        episodes.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(self._episodes), episodes, compression="zstd")
        pq.write_table(_task_table(list(self._tasks)), meta / "tasks.parquet")
        statistics = {
            name: {kind: values.tolist() for kind, values in of.items()} for name, of in self._statistics.items()
        }
        _write_json(meta / "stats.json", statistics)
        _write_json(meta / "info.json", self._info())
        try:
            self._partial.rename(self._folder)
        except OSError as error:
            if not os.path.lexists(self._folder):
                raise
            aside = self._put_aside()
            raise DatasetError(
                f"{self._folder} did not exist when the dataset was begun, but does now. The dataset is {aside} "
                "instead, with all its episodes. Rename it, or keep it there."
            ) from error

    def _put_aside(self) -> Path:
        """Give the dataset a name beside its own that does not exist."""
        number = 1
        while os.path.lexists(aside := self._folder.with_name(f"{self._folder.name}-{number}")):
            number += 1
        return self._partial.rename(aside)

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": VERSION,
            "robot_type": self._robot,
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": _FILES_PER_CHUNK,
            "data_files_size_in_mb": _FILE_SIZE,
            "video_files_size_in_mb": _FILE_SIZE,
            "fps": self._fps,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": f"data/{_PLACE}.parquet",
            "video_path": None,
            "features": {name: feature.description for name, feature in self._features.items()},
            "mjtactile": {"version": __version__},
        }


def _numbers(name: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
    """The values of a column as an array of numbers with at least one axis, checked."""
    array = real_numbers(values)
    if array is None or array.ndim == 0:
        raise DatasetError(
            f"column {name!r} is {shortened(values)}; expected an array of numbers with one entry per frame."
        )
    return array


def _converted(name: str, values: npt.NDArray[Any], dtype: str) -> npt.NDArray[Any]:
    """A column's values in its feature's type, checked; floating-point numbers are rounded, but integers are exact."""
    with np.errstate(invalid="ignore", over="ignore"):
        converted = values.astype(dtype)
    if converted.dtype == values.dtype:
        return converted
    if dtype == "float32":
        held = np.isfinite(converted) | ~np.isfinite(values)
    elif dtype == "bool":
        held = (values == 0) | (values == 1)
    elif values.dtype.kind == "f":  # the limits of int64 as exact floating-point numbers
        held = (values >= -(2.0**63)) & (values < 2.0**63) & (np.floor(values) == values)
    else:
        held = values <= np.iinfo(dtype).max
    if not np.all(held):
        raise DatasetError(
            f"column {name!r} has a value of {values[~held].flat[0]}, which its feature's type {dtype} cannot hold. "
            "Give other values, or make it a feature of another type."
        )
    return converted


def _array(values: npt.NDArray[Any], feature: Feature) -> pa.Array:
    """A column in the format's types: numbers, lists of fixed length for vectors, nested lists for arrays."""
    import pyarrow as pa

    array = pa.array(np.ascontiguousarray(values).reshape(-1))
    if feature.shape == (1,):
        return array
    if len(feature.shape) == 1:
        return pa.FixedSizeListArray.from_arrays(array, feature.shape[0])
    for length in reversed(feature.shape):
        ends = pa.array(np.arange(0, len(array) + 1, length, dtype=np.int32))
        array = pa.ListArray.from_arrays(ends, array)
    return array


def _task_table(tasks: list[str]) -> pa.Table:
    """Indices of tasks, as a pandas table whose index is their descriptions."""
    import pyarrow as pa

    def column(name: str | None, field: str, kind: tuple[str, str]) -> dict[str, Any]:
        return {"name": name, "field_name": field, "pandas_type": kind[0], "numpy_type": kind[1], "metadata": None}

    said = {
        "index_columns": [_TASK_NAME],
        "column_indexes": [],
        "columns": [
            column("task_index", "task_index", ("int64", "int64")),
            column(None, _TASK_NAME, ("unicode", "object")),
        ],
        "pandas_version": "2.0.0",
    }
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), _TASK_NAME: pa.array(tasks, pa.string())})
    return table.replace_schema_metadata({b"pandas": json.dumps(said).encode()})


def _write_json(path: Path, value: Any) -> None:
    write_atomically(path, lambda file: file.write(json.dumps(value, indent=1).encode()))
