"""The compiled core, which presses bodies and reads pads: loaded, and called."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
import weakref
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mjtactile.errors import NativeError
from mjtactile.pad import Array

if TYPE_CHECKING:
    from mjtactile.contact.compliance import SurfaceCompliance
    from mjtactile.influence.matrices import InfluenceMatrices

#: Version of the functions in native/core/api.h that this module calls.
API_VERSION = 6
#: Forces within two to this power, up or down, of 1 N are read as they are.
_COMMON_POWERS = 20
#: Functions that give back a handle, and those that give back a number of something.
_MADE = tuple(
    f"mjt_{name}"
    for name in ("pad_new", "body_new", "reader_new", "face_cells", "footprint_flat", "footprint_heights", "press_new")
)
_COUNTS = ("mjt_pad_bytes", "mjt_basis_bytes", "mjt_press_parts", "mjt_press_edges")
_NAME = {"darwin": "libmjtactile.dylib", "win32": "mjtactile.dll"}.get(sys.platform, "libmjtactile.so")


def library_path() -> Path:
    """Where the compiled core lies: MJTACTILE_LIBRARY, or what was installed with the package.

    Raises:
        NativeError: when there is none.
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
    """The compiled core, loaded once.

    Raises:
        NativeError: when there is none, or one of another version.
    """
    path = library_path()
    loaded = ctypes.CDLL(str(path))
    found = int(loaded.mjt_version())
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
        NativeError: when this processor does not have it.
    """
    if not library().mjt_use_kernels(name.encode()):
        raise NativeError(f"no kernels {name!r} for this processor. Known: avx512, avx2, plain.")


def basis_bytes() -> int:
    """Memory that wrench bases take in this process [bytes]; bounded by 256 MiB for each precision."""
    return int(library().mjt_basis_bytes())


def traction_forces(x: Array, y: Array, edges: Array, tractions: Array) -> Array:
    """See SurfaceGrid.traction_forces; `x` and `y` are the grid's vertices, tractions (edges, 3)."""
    forces = np.empty((2 * len(y) - 1, 2 * len(x) - 1, 3))
    edges, tractions = contiguous(edges), contiguous(tractions)
    x, y = contiguous(x), contiguous(y)
    library().mjt_traction_forces(
        *_sized(x), *_sized(y), ctypes.c_size_t(len(edges)), pointer(edges), pointer(tractions), pointer(forces)
    )
    return forces


class HalfSpace(NamedTuple):
    """Integrals over pairs of cells (cells, cells) [m^3], r and (x, y) from a point of the second to one of the first.

    Attributes:
        inverse_distance: of 1/r.
        xx: of y^2/r^3.
        xy: of -x y/r^3.
        yy: of x^2/r^3.
        along: of x/r^2.
        across: of y/r^2.
    """

    inverse_distance: Array
    xx: Array
    xy: Array
    yy: Array
    along: Array
    across: Array


def half_space(edges: Array, sides: npt.NDArray[np.integer[Any]], cells: int) -> HalfSpace:
    """Integrals of a half space's response over pairs of cells.

    Args:
        edges: between cells, each once, (edges, 2 ends, 2) [m].
        sides: cells to the left and right of each, (edges, 2); -1 for none.
        cells: their number.
    """
    edges, sides = contiguous(edges), np.ascontiguousarray(sides, dtype=np.int32)
    integrals = np.empty((len(HalfSpace._fields), cells, cells))
    library().mjt_half_space(
        ctypes.c_size_t(cells), ctypes.c_size_t(len(edges)), pointer(edges), pointer(sides), pointer(integrals)
    )
    return HalfSpace(*integrals)


class NativePad:
    """One pad's tables as the core holds them; make it with `native_pad`.

    Attributes:
        handle: what the core's functions take.
    """

    def __init__(self, handle: int, taxels: tuple[int, ...]) -> None:
        self.handle = ctypes.c_void_p(handle)
        self._taxels = taxels
        self._has_foundation = self._has_tangential = False
        self._finalizer = weakref.finalize(self, library().mjt_pad_free, self.handle)

    @property
    def nbytes(self) -> int:
        """Memory the stress matrices take [bytes]."""
        return int(library().mjt_pad_bytes(self.handle))

    def readings(self, forces: Array) -> Array:
        """Readings (layers, rows, columns) [Pa] of nodal forces (nodes y, nodes x, 3) [N]."""
        readings = np.empty(self._taxels)
        # Single precision squares stresses: forces far from 1 N are brought there, by a power of two, which is exact.
        power = int(np.frexp(np.abs(forces).max(initial=0.0))[1])
        power = power if abs(power) > _COMMON_POWERS else 0
        forces = contiguous(np.ldexp(forces, -power) if power else forces)
        library().mjt_readings(self.handle, pointer(forces), pointer(readings))
        return np.ldexp(readings, power) if power else readings

    def set_foundation(self, areas: Array, stiffnesses: Array) -> None:
        """Springs of law "foundation", see `foundation_springs`; what is set stays, other threads may be reading it."""
        if self._has_foundation:
            return
        self._has_foundation = True
        areas, stiffnesses = contiguous(areas), contiguous(stiffnesses)
        library().mjt_pad_set_foundation(self.handle, ctypes.c_size_t(len(areas)), pointer(areas), pointer(stiffnesses))

    def set_tangential(self, compliance: SurfaceCompliance) -> None:
        """What shear needs that does not spread in proportion to the pressure; what is set stays, see above."""
        with _making:
            if self._has_tangential:
                return
            self._has_tangential = True
            remainder = contiguous(compliance.remainder)
            library().mjt_pad_set_tangential(self.handle, ctypes.c_double(compliance.poisson), pointer(remainder))


_pads: weakref.WeakKeyDictionary[InfluenceMatrices, dict[bool, NativePad]] = weakref.WeakKeyDictionary()
_making = threading.Lock()


def native_pad(influence: InfluenceMatrices, *, stress: bool = False) -> NativePad:
    """The core's copy of influence matrices, made when it is first asked for and shared by all that use them.

    Args:
        influence: of the pad.
        stress: whether whole stress tensors are wanted, which take a fifth more memory.
    """
    with _making:
        made = _pads.setdefault(influence, {})
        if stress not in made:
            from mjtactile.contact.core_pad import make_pad

            made[stress] = make_pad(influence, stress=stress)
        return made[stress]


def contiguous(array: npt.ArrayLike) -> Array:
    """As the core takes it: double precision, in order."""
    return np.ascontiguousarray(array, dtype=np.float64)


def pointer(array: npt.NDArray[Any] | None) -> ctypes.c_void_p:
    """Where an array lies; it must stay alive."""
    return ctypes.c_void_p(None if array is None else array.ctypes.data)


def _sized(array: Array) -> tuple[ctypes.c_size_t, ctypes.c_void_p]:
    return ctypes.c_size_t(len(array)), pointer(array)
