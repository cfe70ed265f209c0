"""Influence matrices on disk: one safetensors file, written atomically, checked by fingerprint, read by mapping.

safetensors is a documented, safe, language-neutral container (a JSON header, then raw arrays), so other programs can
read these files. Arrays are memory-mapped: opening a table of hundreds of megabytes takes milliseconds, and only the
columns that are used are read.
"""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile.errors import CorruptInfluenceError
from mjtactile.fem import Parity

#: Raised whenever the meaning of a stored array changes; older files are then rebuilt.
FORMAT_VERSION = 2

Tables = dict[str, npt.NDArray[Any]]
"""Arrays by name, see `table_name`, `build.build_tables` and `matrix.stored_matrix`."""

_DTYPES = {
    "F64": np.float64,
    "F32": np.float32,
    "F16": np.float16,
    "I64": np.int64,
    "I32": np.int32,
    "I8": np.int8,
}
_HEADER_LENGTH_BYTES = 8


def table_name(kind: str, parity: Parity, sensing_layer: int | None = None) -> str:
    """Name of one stored matrix: kind, symmetry class and, for stresses, the sensing layer."""
    signs = "".join("+" if sign > 0 else "-" for sign in (parity.x, parity.y))
    return f"{kind} {signs}" if sensing_layer is None else f"{kind} {signs} {sensing_layer}"


def write_tables(path: Path, tables: Tables, metadata: dict[str, Any]) -> None:
    """Write arrays and JSON metadata to a file that appears complete or not at all.

    Raises:
        OSError: when the folder cannot be written or the disk is full; nothing is left behind.
    """
    from safetensors.numpy import save_file

    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=".partial")
    os.close(handle)
    partial = Path(name)
    try:
        try:
            save_file(tables, partial, metadata={"mjtactile": json.dumps(metadata)})
        except OSError:
            raise
        except Exception as error:  # safetensors wraps a full disk in an error class of its own
            raise OSError(f"cannot write {path}: {error}") from error
        with partial.open("rb+") as file:
            os.fsync(file.fileno())
        partial.chmod(0o644)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read_tables(path: Path) -> tuple[Tables, dict[str, Any]]:
    """Map the arrays of a file, read-only, and parse its metadata.

    Raises:
        FileNotFoundError: when there is no such file.
        CorruptInfluenceError: when the file is truncated, damaged or not one of ours.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist. Build the table: mjtactile build")
    try:
        with safe_open(path, framework="np") as file:  # checks the header against the file's length
            metadata = json.loads((file.metadata() or {})["mjtactile"])
        return _map_arrays(path), metadata
    except (SafetensorError, KeyError, ValueError, UnicodeDecodeError) as error:
        raise CorruptInfluenceError(
            f"{path} is not a whole influence table ({type(error).__name__}: {error}). Delete it and rebuild: "
            "mjtactile build"
        ) from error


def _map_arrays(path: Path) -> Tables:
    content = np.memmap(path, dtype=np.uint8, mode="r")
    start = _HEADER_LENGTH_BYTES + int.from_bytes(content[:_HEADER_LENGTH_BYTES].tobytes(), "little")
    header = json.loads(content[_HEADER_LENGTH_BYTES:start].tobytes())
    header.pop("__metadata__", None)
    tables: Tables = {}
    for name, entry in header.items():
        first, last = (start + offset for offset in entry["data_offsets"])
        # Plain arrays over the mapped file: slicing a memmap costs more than many a product with the slice.
        tables[name] = np.asarray(content[first:last].view(_DTYPES[entry["dtype"]]).reshape(entry["shape"]))
    return tables
