"""The compiled core, which solves contacts and computes readings: find it, load it, pass arrays to it."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import NativeError

#: Version of the functions in native/api/api.h that this module calls.
API_VERSION = 19
#: Functions that return a handle, and functions that return a count.
_MADE = tuple(
    f"mjt_{name}"
    for name in (
        *("pad_new", "outer_quadric", "outer_patch", "body_new", "reader_new", "press_new"),
        *("face_cells", "placed_cells", "footprint_flat", "footprint_heights"),
    )
)
_COUNTS = ("mjt_basis_bytes", "mjt_press_parts", "mjt_press_edges", "mjt_reader_rim")
_NAME = {"darwin": "libmjtactile.dylib", "win32": "mjtactile.dll"}.get(sys.platform, "libmjtactile.so")


def library_path() -> Path:
    """Path of the compiled core: MJTACTILE_LIBRARY if set, else the library installed with the package.

    Raises:
        NativeError: there is no such file.
    """
    named = os.environ.get("MJTACTILE_LIBRARY")
    candidates = [Path(named)] if named else [Path(__file__).parent / _NAME]
    if not named:
        with contextlib.suppress(metadata.PackageNotFoundError):
            files = metadata.files("mjtactile") or []
            candidates += [Path(str(file.locate())) for file in files if file.name == _NAME]
    for candidate in candidates:
        if candidate.is_file():
            return candidate.resolve()
    looked = ", ".join(str(candidate) for candidate in candidates)
    raise NativeError(
        f"the compiled core was not found (looked for {looked}). Install mjtactile with `pip install .`, which "
        "compiles it."
    )


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The compiled core, loaded at the first call.

    Raises:
        NativeError: the library is missing or damaged, is of another kind of machine, or has another version than
            `API_VERSION`.
    """
    path = library_path()
    try:
        loaded = ctypes.CDLL(str(path))
        found = int(loaded.mjt_version())
    except (OSError, AttributeError) as error:
        raise NativeError(
            f"the compiled core cannot be loaded: {error}. It is damaged or was compiled for another kind of machine. "
            "Install mjtactile again: pip install --force-reinstall --no-deps mjtactile"
        ) from error
    if found != API_VERSION:
        raise NativeError(
            f"the compiled core {path} has version {found}, but this mjtactile needs {API_VERSION}. Install mjtactile "
            "again with `pip install .`, so that both come from one source."
        )
    loaded.mjt_kernels.restype = ctypes.c_char_p
    for name in _MADE:
        getattr(loaded, name).restype = ctypes.c_void_p
    for name in _COUNTS:
        getattr(loaded, name).restype = ctypes.c_size_t
    return loaded


def instruction_set() -> str:
    """Instruction set of the kernels in use: "avx512", "avx2" or "plain"."""
    return str(library().mjt_kernels().decode())


def use_instruction_set(name: str) -> None:
    """Use the kernels of an instruction set, "avx512", "avx2" or "plain", in all threads.

    Raises:
        NativeError: this processor does not support it.
    """
    if not library().mjt_use_kernels(name.encode()):
        raise NativeError(f"no kernels {name!r} for this processor. Known: avx512, avx2, plain.")


def basis_bytes() -> int:
    """Memory that cached wrench bases take in this process [bytes]; at most 256 MiB."""
    return int(library().mjt_basis_bytes())


def contiguous(array: npt.ArrayLike) -> Array:
    """The array as the core expects it: double precision, C-contiguous; copied only if necessary."""
    return np.ascontiguousarray(array, dtype=np.float64)


def pointer(array: npt.NDArray[Any] | None) -> ctypes.c_void_p:
    """Address of an array's data, null for None; the caller must keep the array alive."""
    if array is None:
        return ctypes.c_void_p(None)
    if array.size and array.flags.carray:  # contiguous and writeable: several times as fast as `array.ctypes`
        return ctypes.c_void_p(ctypes.addressof(ctypes.c_char.from_buffer(array.data)))
    return ctypes.c_void_p(array.ctypes.data)


def sized(array: Array) -> tuple[ctypes.c_size_t, ctypes.c_void_p]:
    """Length and address of an array, as two arguments of a C function."""
    return ctypes.c_size_t(len(array)), pointer(array)
