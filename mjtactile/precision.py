"""Half-precision storage of matrices: every row scaled to the middle of what float16 can hold.

A row's scale is a power of two, so scaling itself loses nothing: entries down to 4e-9 of the row's largest keep
eleven bits, and smaller ones an error of at most 2e-12 of it, whatever the magnitude of the matrix.

numpy has no fast product in half precision. Matrices are widened to float32 when they are first used and kept, so
that float16 halves the file and what is mapped of it, while what has been used costs float32's memory besides.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

#: Exponent of the largest entry of a scaled row; float16 ends just below 2^16.
_TOP_EXPONENT = 15


def narrow(matrix: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float16], npt.NDArray[np.float32]]:
    """A matrix (columns, rows) in half precision, and the scale of each of its rows, shape (columns, 1)."""
    largest = np.abs(matrix).max(axis=1, keepdims=True, initial=0.0)
    exponent = np.where(largest > 0, np.frexp(largest)[1] - _TOP_EXPONENT, 0)
    scaled = np.ldexp(matrix, -exponent)
    return scaled.astype(np.float16), np.ldexp(np.float32(1.0), exponent).astype(np.float32)


def widen(half: npt.NDArray[np.float16], scale: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """What `narrow` made narrow, in single precision and in memory of its own."""
    wide = half.astype(np.float32)
    wide *= scale
    return wide
