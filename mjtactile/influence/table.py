"""Influence matrices on disk: one safetensors file, written atomically, with checksums, read by mapping.

safetensors is a documented, safe, language-neutral container (a JSON header, then raw arrays), so other programs can
read these files. The header contains metadata, a checksum of every array and one of itself. A process verifies them
when it first opens a file. Arrays are memory-mapped, so that processes share memory.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from mjtactile._files import make_folder, write_atomically
from mjtactile._files.checksums import METADATA, check_arrays, check_header, with_checksums
from mjtactile._types import Tables
from mjtactile.errors import CorruptInfluenceError
from mjtactile.fem.symmetry import Parity

#: Incremented whenever the meaning of a stored array changes; older files are then rebuilt.
FORMAT_VERSION = 3
#: Incremented whenever the numbers in curved pads' tables change; tables of flat pads stay valid.
SWEPT_VERSION = 2

_DTYPES = {
    "F64": np.float64,
    "F32": np.float32,
    "F16": np.float16,
    "I64": np.int64,
    "I32": np.int32,
    "I8": np.int8,
}
_HEADER_LENGTH_BYTES = 8
#: Files that this process verified, by device, inode, size, and times of the last changes.
_whole: set[tuple[int, ...]] = set()
#: A file changed less than this ago is verified again, because time stamps of file systems are coarse [s].
_SETTLED = 2.0
#: Characters of a table's name in that of its partial file: names in the cache are shorter, and longer ones leave room
#: for the rest of the partial file's name.
_NAMED = 50


def table_name(kind: str, parity: Parity, sensing_layer: int | None = None) -> str:
    """Name of one stored matrix: kind, symmetry class and, for stresses, the sensing layer."""
    signs = "".join("+" if sign > 0 else "-" if sign < 0 else "0" for sign in (parity.x, parity.y))
    return f"{kind} {signs}" if sensing_layer is None else f"{kind} {signs} {sensing_layer}"


def write_tables(path: Path, tables: Tables, metadata: dict[str, Any]) -> None:
    """Write arrays, JSON metadata and checksums of both to a file that appears complete or not at all.

    The folder is made if necessary. Links are followed.

    Raises:
        OutputError: the folder cannot be written, the disk is full, or the path is write-protected, no regular file or
            no valid file name; no partial file remains.
    """
    from safetensors.numpy import save_file

    tables = {name: np.ascontiguousarray(table) for name, table in tables.items()}
    about = with_checksums(tables, json.dumps(metadata))
    make_folder(path.parent)

    def write(file: IO[bytes]) -> None:
        try:
            save_file(tables, file.name, metadata=about)
        except OSError:
            raise
        except Exception as error:  # safetensors wraps a full disk in an error class of its own
            raise OSError(str(error)) from error

    # The prefix names the table, so that the cache can remove the partial files of processes that were killed.
    write_atomically(path, write, prefix=f".{path.stem[:_NAMED]}-")


def read_tables(path: Path) -> tuple[Tables, dict[str, Any]]:
    """Memory-map the arrays of a file, read-only, and parse its metadata.

    All checksums are verified when this process first opens the file, and again after it was changed.

    Raises:
        FileNotFoundError: there is no such file.
        CorruptInfluenceError: the file is truncated, damaged or not an influence table.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise FileNotFoundError(
            f"{path} does not exist. InfluenceMatrices.save writes such a file; influence_matrices(pad) and mjtactile "
            "build make tables in the cache, which need no path."
        )
    try:
        with safe_open(path, framework="np"):
            pass  # opening checks that the header's arrays fill the file and have the sizes of their shapes
        with path.open("rb") as file:
            state = os.fstat(file.fileno())
            content = np.memmap(file, dtype=np.uint8, mode="r")
        tables, about = _read_header(content)
        check_header(tables, about)
        _check_once(tables, about, state)
        return tables, json.loads(about[METADATA])
    except (SafetensorError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise CorruptInfluenceError(
            f"{path} is not a whole influence table ({type(error).__name__}: {error}). Restore it from a copy, or "
            "delete it and rebuild: mjtactile build"
        ) from error


def read_metadata(path: Path) -> dict[str, Any]:
    """The metadata of a file, without reading or verifying its arrays.

    Raises:
        CorruptInfluenceError: the file is truncated, damaged or not an influence table.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="np") as file:
            return json.loads(file.metadata()[METADATA])
    except (SafetensorError, KeyError, TypeError, ValueError) as error:
        raise CorruptInfluenceError(
            f"{path} is not a whole influence table ({error}). Delete it: mjtactile cache clear --unusable"
        ) from error


def _read_header(content: npt.NDArray[np.uint8]) -> tuple[Tables, dict[str, str]]:
    """Arrays over a mapped file, and the header's metadata."""
    start = _HEADER_LENGTH_BYTES + int.from_bytes(content[:_HEADER_LENGTH_BYTES].tobytes(), "little")
    header = json.loads(content[_HEADER_LENGTH_BYTES:start].tobytes())
    about = header.pop("__metadata__", {})
    tables: Tables = {}
    for name, entry in header.items():
        first, last = (start + offset for offset in entry["data_offsets"])
        # Plain arrays over the mapped file, because slicing a np.memmap is slow.
        tables[name] = np.asarray(content[first:last].view(_DTYPES[entry["dtype"]]).reshape(entry["shape"]))
    return tables, about


def _check_once(tables: Tables, about: dict[str, str], state: os.stat_result) -> None:
    """Verify checksums once per process and state of the file; raises ValueError if an array does not match."""
    known = (state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns)
    if known in _whole:
        return
    check_arrays(tables, about)
    if time.time() - max(state.st_mtime, state.st_ctime) > _SETTLED:
        _whole.add(known)
