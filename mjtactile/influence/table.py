"""Influence matrices on disk: one safetensors file, written atomically, with checksums, read by mapping.

safetensors is a documented, safe, language-neutral container (a JSON header, then raw arrays), so other programs can
read these files. Beside the metadata the header keeps a checksum of every array and one of itself. A process compares
them when it first opens a file; arrays are memory-mapped, so that processes share what they read.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._files import METADATA, check_arrays, check_header, has_no_checksums, replacing, with_checksums
from mjtactile._types import Tables
from mjtactile.errors import CorruptInfluenceError, StaleInfluenceError
from mjtactile.fem.stiffness import Parity

#: Raised whenever the meaning of a stored array changes; older files are then rebuilt.
FORMAT_VERSION = 3
#: Raised whenever the numbers of curved pads' tables change; flat pads' stay valid.
SWEPT_VERSION = 1


_DTYPES = {
    "F64": np.float64,
    "F32": np.float32,
    "F16": np.float16,
    "I64": np.int64,
    "I32": np.int32,
    "I8": np.int8,
}
_HEADER_LENGTH_BYTES = 8
#: Files found whole in this process, by device, inode, size, and times of the last changes.
_whole: set[tuple[int, ...]] = set()
#: A file that changed less than this ago is compared again next time: file systems count time in steps [s].
_SETTLED = 2.0


def table_name(kind: str, parity: Parity, sensing_layer: int | None = None) -> str:
    """Name of one stored matrix: kind, symmetry class and, for stresses, the sensing layer."""
    signs = "".join("+" if sign > 0 else "-" if sign < 0 else "0" for sign in (parity.x, parity.y))
    return f"{kind} {signs}" if sensing_layer is None else f"{kind} {signs} {sensing_layer}"


def write_tables(path: Path, tables: Tables, metadata: dict[str, Any]) -> None:
    """Write arrays, JSON metadata and checksums of both to a file that appears complete or not at all.

    Raises:
        OSError: when the folder cannot be written or the disk is full; nothing is left behind.
    """
    from safetensors.numpy import save_file

    tables = {name: np.ascontiguousarray(table) for name, table in tables.items()}
    about = with_checksums(tables, json.dumps(metadata))
    path.parent.mkdir(parents=True, exist_ok=True)
    # The cache removes what builders left that were killed, and knows by the name whose it was.
    with replacing(path, prefix=f".{path.stem}-") as file:
        try:
            save_file(tables, file.name, metadata=about)
        except OSError:
            raise
        except Exception as error:  # safetensors wraps a full disk in an error class of its own
            raise OSError(f"cannot write {path}: {error}") from error


def read_tables(path: Path) -> tuple[Tables, dict[str, Any]]:
    """Map the arrays of a file, read-only, and parse its metadata.

    All bytes are compared with the file's checksums when this process first opens it, and again when it was changed.

    Raises:
        FileNotFoundError: when there is no such file.
        CorruptInfluenceError: when the file is truncated, damaged or not one of ours.
        StaleInfluenceError: when the file is from before there were checksums.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist. Build the table: mjtactile build")
    try:
        with safe_open(path, framework="np"):
            pass  # checks that the header's arrays fill the file, each as large as its shape
        with path.open("rb") as file:
            state = os.fstat(file.fileno())
            content = np.memmap(file, dtype=np.uint8, mode="r")
        tables, about = _read_header(content)
        if not has_no_checksums(about):
            check_header(tables, about)
            _check_once(tables, about, state)
            return tables, json.loads(about[METADATA])
    except (SafetensorError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise CorruptInfluenceError(
            f"{path} is not a whole influence table ({type(error).__name__}: {error}). Bring back a copy of it, or "
            "delete it and rebuild: mjtactile build"
        ) from error
    raise StaleInfluenceError(f"{path} is of an earlier version, which kept no checksums. Rebuild it: mjtactile build")


def read_metadata(path: Path) -> dict[str, Any]:
    """The metadata of a file; its arrays are neither read nor compared with their checksums.

    Raises:
        CorruptInfluenceError: when the file is truncated, damaged or not one of ours.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="np") as file:
            return json.loads(file.metadata()[METADATA])
    except (SafetensorError, KeyError, TypeError, ValueError) as error:
        raise CorruptInfluenceError(f"{path} is not a whole influence table ({error}).") from error


def _read_header(content: npt.NDArray[np.uint8]) -> tuple[Tables, dict[str, str]]:
    """Arrays over a mapped file, and the header's metadata."""
    start = _HEADER_LENGTH_BYTES + int.from_bytes(content[:_HEADER_LENGTH_BYTES].tobytes(), "little")
    header = json.loads(content[_HEADER_LENGTH_BYTES:start].tobytes())
    about = header.pop("__metadata__", {})
    tables: Tables = {}
    for name, entry in header.items():
        first, last = (start + offset for offset in entry["data_offsets"])
        # Plain arrays over the mapped file: slicing a memmap costs more than many a product with the slice.
        tables[name] = np.asarray(content[first:last].view(_DTYPES[entry["dtype"]]).reshape(entry["shape"]))
    return tables, about


def _check_once(tables: Tables, about: dict[str, str], state: os.stat_result) -> None:
    """Refuse, by ValueError, arrays that do not match their checksums; once per process and state of the file."""
    known = (state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns)
    if known in _whole:
        return
    check_arrays(tables, about)
    if time.time() - max(state.st_mtime, state.st_ctime) > _SETTLED:
        _whole.add(known)
