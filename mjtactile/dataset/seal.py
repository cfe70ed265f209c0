"""A checksum of a Parquet file, stored inside the file.

The checksum is an entry of 64 digits in the file's key-value metadata, which other readers ignore. The digits are zeros
while the file is written. Then they are replaced by the SHA-256 of the file with those zeros. So each file can be
verified by itself, and any change of its columns, schema or checksum is detected.
"""

from __future__ import annotations

import hashlib
import re

_KEY = b"mjtactile.sha256"
_ZEROS = b"0" * 64
#: Metadata of a file before it is sealed.
UNSEALED = {_KEY: _ZEROS}
#: Key and value in Parquet's footer, with the value's field and length between them (Thrift's compact protocol).
_SEAL = re.compile(_KEY + rb"\x18\x40([0-9a-f]{64})")


def sealed(content: bytes) -> bytes:
    """Replace the zeros of `UNSEALED` in a Parquet file by its checksum.

    Raises:
        ValueError: the file does not have `UNSEALED` among its metadata, or has it more than once.
    """
    places = list(_SEAL.finditer(content))
    if len(places) != 1 or places[0][1] != _ZEROS:
        raise ValueError("the file has no place for one checksum: was it written with UNSEALED among its metadata?")
    return _with_digits(content, places[0], _checksum(content, places[0]))


def is_sealed(content: bytes) -> bool:
    """Whether a file has a checksum, correct or not."""
    return _KEY in content


def is_whole(content: bytes) -> bool:
    """Whether a file has a correct checksum."""
    found = _SEAL.search(content)
    return found is not None and found[1] == _checksum(content, found)


def _checksum(content: bytes, place: re.Match[bytes]) -> bytes:
    return hashlib.sha256(_with_digits(content, place, _ZEROS)).hexdigest().encode()


def _with_digits(content: bytes, place: re.Match[bytes], digits: bytes) -> bytes:
    return content[: place.start(1)] + digits + content[place.end(1) :]
