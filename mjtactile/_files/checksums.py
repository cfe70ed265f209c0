"""Checksums of the arrays in a safetensors file, and of its header: kept in the header's metadata, and compared."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Tables

#: Entries of a safetensors header's metadata: the writer's text, the arrays' checksums, and the header's checksum.
METADATA, CHECKSUMS, HEADER = "mjtactile", "checksums", "header"
#: Bytes per word of a checksum.
_WORD = 8
#: Words per row of a checksum: 4 kB, the block size in which disks and memory are usually damaged.
_ROW = 512
#: Rows summed at a time: few enough to stay in the processor's cache for the second sum.
_ROWS = 128
_DIGEST_BYTES = 8


def checksum(array: npt.NDArray[Any]) -> str:
    """Checksum of any array's bytes in C order, 16 hexadecimal digits; dtype and shape do not enter."""
    content = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    whole = len(content) // (_WORD * _ROW)
    rows = content[: whole * _WORD * _ROW].view(np.uint64).reshape(whole, _ROW)
    digest = hashlib.blake2b(len(content).to_bytes(_WORD, "little"), digest_size=_DIGEST_BYTES)
    columns = np.zeros(_ROW, np.uint64)
    for first in range(0, whole, _ROWS):
        block = rows[first : first + _ROWS]
        digest.update(block.sum(axis=1).tobytes())
        columns += block.sum(axis=0)
    digest.update(columns.tobytes())
    digest.update(content[whole * _WORD * _ROW :].tobytes())
    return digest.hexdigest()


def with_checksums(arrays: Tables, said: str) -> dict[str, str]:
    """Metadata of a safetensors header: the text `said` about arrays as entry `METADATA`, and their checksums."""
    about = {METADATA: said, CHECKSUMS: json.dumps({name: checksum(array) for name, array in arrays.items()})}
    return about | {HEADER: _header_checksum(arrays, about)}


def check_header(arrays: Tables, about: dict[str, str]) -> None:
    """Refuse a header whose array names, types, shapes or metadata are not what was written.

    Raises:
        ValueError: the header does not match its checksum; the message says in which way.
    """
    if set(about) != {METADATA, CHECKSUMS, HEADER}:
        raise ValueError(f"the header's metadata has entries {', '.join(sorted(about)) or 'none'}")
    if about[HEADER] != _header_checksum(arrays, about):
        raise ValueError("the header does not match its checksum")


def check_arrays(arrays: Tables, about: dict[str, str]) -> None:
    """Refuse arrays that do not match their checksums; `check_header` checks the header first.

    Raises:
        ValueError: some arrays do not match; the message names them.
    """
    expected = json.loads(about[CHECKSUMS])
    wrong = [name for name, array in arrays.items() if checksum(array) != expected[name]]
    if wrong:
        raise ValueError(f"{', '.join(map(repr, wrong))} does not match its checksum")


def _header_checksum(arrays: Tables, about: dict[str, str]) -> str:
    """Checksum of everything in a header except the arrays' offsets: swapped arrays fail their own checksums."""
    entries = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    said = json.dumps([entries, about[METADATA], about[CHECKSUMS]], sort_keys=True)
    return hashlib.blake2b(said.encode(), digest_size=_DIGEST_BYTES).hexdigest()
