"""Half-precision and one-byte storage of matrices: every row scaled to what float16 or int8 can hold.

A row's scale is a power of two, so scaling itself loses nothing: entries down to 4e-9 of the row's largest keep
eleven bits, and smaller ones an error of at most 2e-12 of it, whatever the magnitude of the matrix.
In int8 a row keeps an error of at most 1/254 of its largest entry, which suits rows whose entries matter as much as
they are large: stress at all points under one force.

numpy has no fast product in either. Matrices are widened to float32 when they are first used and kept, so
that narrow storage shrinks the file and what is mapped of it, while what has been used costs float32's memory besides.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

#: Exponent of the largest entry of a scaled row; float16 ends just below 2^16.
_TOP_EXPONENT = 15
#: Largest entry of a row scaled for int8.
_TOP_BYTE = 127


def narrow(matrix: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float16], npt.NDArray[np.float32]]:
    """A matrix (columns, rows) in half precision, and the scale of each of its rows, shape (columns, 1)."""
    largest = np.abs(matrix).max(axis=1, keepdims=True, initial=0.0)
    exponent = np.where(largest > 0, np.frexp(largest)[1] - _TOP_EXPONENT, 0)
    scaled = np.ldexp(matrix, -exponent)
    return scaled.astype(np.float16), np.ldexp(np.float32(1.0), exponent).astype(np.float32)


def narrow_to_bytes(matrix: npt.NDArray[Any]) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.float32]]:
    """A matrix (columns, rows) in one byte per entry, and the scale of each of its rows, shape (columns, 1)."""
    largest = np.abs(matrix).max(axis=1, keepdims=True, initial=0.0)
    scale = (largest / _TOP_BYTE).astype(np.float32)
    scale[scale == 0.0] = 1.0
    return np.clip(np.rint(matrix / scale), -_TOP_BYTE, _TOP_BYTE).astype(np.int8), scale


def widen(
    stored: npt.NDArray[np.float16] | npt.NDArray[np.int8], scale: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    """What `narrow` or `narrow_to_bytes` made narrow, in single precision and in memory of its own."""
    wide = stored.astype(np.float32)
    wide *= scale
    return wide
