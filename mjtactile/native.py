"""The compiled core: the same arithmetic as the readable NumPy code, several times faster.

What is here answers as the NumPy functions do that call it; those take over where the core is switched off, or where
it hands a contact back that needs slower, surer ways. Switch it off with MJTACTILE_NATIVE=0, or with `without_native`.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
import weakref
from collections.abc import Iterator
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile.errors import NativeError
from mjtactile.pad import Array

if TYPE_CHECKING:
    from mjtactile.compliance import SurfaceCompliance
    from mjtactile.influence import InfluenceMatrices

#: Version of the functions in native/core/api.h that this module calls.
API_VERSION = 5
#: Components of a force or a traction.
COMPONENTS = 3
#: Forces within two to this power, up or down, of 1 N are read as they are.
_COMMON_POWERS = 20
_NAME = {"darwin": "libmjtactile.dylib", "win32": "mjtactile.dll"}.get(sys.platform, "libmjtactile.so")

_enabled = os.environ.get("MJTACTILE_NATIVE", "1") != "0"


def enabled() -> bool:
    """Whether the compiled core is in use."""
    return _enabled


@contextlib.contextmanager
def without_native() -> Iterator[None]:
    """Use the NumPy reference within this block, in all threads."""
    global _enabled
    before, _enabled = _enabled, False
    try:
        yield
    finally:
        _enabled = before


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
        "compiles it. Only what needs no MuJoCo does without it, several times slower, where MJTACTILE_NATIVE=0 is set."
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
    for name in ("mjt_pad_new", "mjt_body_new", "mjt_reader_new"):
        getattr(loaded, name).restype = ctypes.c_void_p
    loaded.mjt_pad_bytes.restype = ctypes.c_size_t
    loaded.mjt_basis_bytes.restype = ctypes.c_size_t
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


def rigid_contact(
    compliance: Array, modes: Array, heights: Array | None, resultants: Array, start: npt.NDArray[np.bool_] | None
) -> tuple[npt.NDArray[np.bool_], Array, Array, Array] | None:
    """Cells pressed and the maps of a RigidContact; None where exchanging cells finds no contact."""
    cells, motions = modes.shape
    compliance, modes, resultants = contiguous(compliance), contiguous(modes), contiguous(resultants)
    heights = None if heights is None else contiguous(heights)
    start = None if start is None else np.ascontiguousarray(start)
    pressed = np.empty(cells, dtype=bool)
    forces, motion, separation = (np.empty((count, motions + 1)) for count in (cells, motions, cells))
    found = library().mjt_rigid_contact(
        ctypes.c_size_t(cells),
        ctypes.c_size_t(motions),
        *(pointer(one) for one in (compliance, modes, heights, resultants, start, pressed, forces, motion, separation)),
    )
    return (pressed, forces, motion, separation) if found else None


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

    def normal_compliance(self, centroids: Array, areas: Array, inverse_distance: Array, scale: float) -> Array:
        """Normal compliance between cells [m/N]; `inverse_distance`: of their shape, `scale` times as large here."""
        centroids, areas, inverse_distance = contiguous(centroids), contiguous(areas), contiguous(inverse_distance)
        compliance = np.empty((len(areas), len(areas)))
        library().mjt_normal_compliance(
            self.handle,
            ctypes.c_size_t(len(areas)),
            pointer(centroids),
            pointer(areas),
            pointer(inverse_distance),
            ctypes.c_double(scale),
            pointer(compliance),
        )
        return compliance


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
            from mjtactile.native_tables import make_pad

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
