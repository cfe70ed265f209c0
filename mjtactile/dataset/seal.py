"""A checksum inside a Parquet file, of all the other bytes of it.

It is an entry of the file's own key-value metadata, which other readers pass over: 64 digits that are zeros while the
file is written and become the SHA-256 of the file with those zeros. So every file stands for itself, whatever it is
copied with, and not a bit of it can change unnoticed: neither in the columns, nor in the schema, nor in the checksum.
"""

from __future__ import annotations

import hashlib
import re

_KEY = b"mjtactile.sha256"
_ZEROS = b"0" * 64
#: What a file's metadata hold before it is sealed.
UNSEALED = {_KEY: _ZEROS}
#: Key and value as Parquet's footer has them, with the value's field and length between (Thrift's compact protocol).
_SEAL = re.compile(_KEY + rb"\x18\x40([0-9a-f]{64})")


def sealed(content: bytes) -> bytes:
    """A Parquet file with `UNSEALED` among its metadata, with its checksum."""
    places = list(_SEAL.finditer(content))
    if len(places) != 1 or places[0][1] != _ZEROS:
        raise ValueError("the file has no place for one checksum: was it written with UNSEALED among its metadata?")
    return _with_digits(content, places[0], _checksum(content, places[0]))


def is_sealed(content: bytes) -> bool:
    """Whether a file has a checksum, right or wrong."""
    return _KEY in content


def is_whole(content: bytes) -> bool:
    """Whether a file has a checksum, and every byte is as it was when it got it."""
    found = _SEAL.search(content)
    return found is not None and found[1] == _checksum(content, found)


def _checksum(content: bytes, place: re.Match[bytes]) -> bytes:
    return hashlib.sha256(_with_digits(content, place, _ZEROS)).hexdigest().encode()


def _with_digits(content: bytes, place: re.Match[bytes], digits: bytes) -> bytes:
    return content[: place.start(1)] + digits + content[place.end(1) :]
