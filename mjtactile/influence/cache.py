"""Influence matrices, built once per pad and fidelity and stored in a cache of the user."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mjtactile._files import is_there
from mjtactile._progress import progress_bar, say
from mjtactile._types import Tables
from mjtactile.errors import CorruptInfluenceError, InfluenceError, InfluenceWarning, StaleInfluenceError
from mjtactile.fem.mesh import warn_if_coarser
from mjtactile.fidelity import DEFAULT, Fidelity, as_fidelity, fidelity_summary
from mjtactile.influence.matrices import InfluenceMatrices, read_influence
from mjtactile.influence.provenance import check_provenance, influence_fingerprint
from mjtactile.influence.storage import ClassStorage, in_storage, narrowing_steps, plain_fidelity, reduced_and_narrowed
from mjtactile.influence.table import read_metadata
from mjtactile.pad import Pad, require_pad

if TYPE_CHECKING:
    from filelock import BaseFileLock

#: Environment variable with the path of the cache.
CACHE_VARIABLE = "MJTACTILE_CACHE"
#: Folder of tables in the package: the default pad's at fidelity "fast", so that a first reading needs no build.
SHIPPED = Path(__file__).resolve().parent / "tables"
#: Time that reducing matrices takes, over that of solving for them: a third on the default pad, more or less elsewhere.
_REDUCTION_SHARE = 1 / 3
#: Size of a table that is told before it is built [bytes]; the paper's pad has a compliance of 104 MB at most.
_LARGE = 2e8
#: What happens instead if a table cannot be used, as words for the warning.
_BUILT, _READ_INSTEAD = "is built anew", "that of the package is read instead"
#: Waiting for another process that builds: time before the first message, and between messages [s].
_SILENT_WAIT, _WAIT_BETWEEN_LINES = 2.0, 60.0


def cache_directory() -> Path:
    """Folder of the cached tables: $MJTACTILE_CACHE, or the user's cache folder.

    Raises:
        InfluenceError: that folder lies in a home folder, and the system does not know of one.
    """
    from platformdirs import user_cache_path

    chosen = os.environ.get(CACHE_VARIABLE)
    try:
        # Some versions of platformdirs leave the "~" of an unknown home folder in the path.
        return (Path(chosen) if chosen else user_cache_path("mjtactile")).expanduser()
    except RuntimeError as error:
        raise InfluenceError(
            f"the folder of the tables is {chosen or 'in the home folder of this user'}, and the system knows no such "
            f"home folder (the variable HOME is not set, or there is no such user). Name a folder that can be written "
            f"in the variable {CACHE_VARIABLE}, as in {CACHE_VARIABLE}=/tmp/mjtactile."
        ) from error


def cached_path(pad: Pad, fidelity: str | Fidelity) -> Path:
    """Path in the cache for the influence matrices of a pad, whether or not they exist; see `influence_matrices`."""
    fingerprint = influence_fingerprint(pad, as_fidelity(fidelity))
    return cache_directory() / f"influence-{fingerprint[:20]}.safetensors"


def stored_path(pad: Pad, fidelity: str | Fidelity) -> Path | None:
    """Path of a pad's influence matrices in the cache or in the package; None if they were not built yet."""
    kept = cached_path(pad, fidelity)
    return next((path for path in (kept, SHIPPED / kept.name) if is_there(path)), None)


def influence_matrices(
    pad: Pad | None = None, fidelity: str | Fidelity = DEFAULT, *, progress: bool = True, cache: bool = True
) -> InfluenceMatrices:
    """Influence matrices of a pad: read from the cache or the package if they exist, otherwise built and cached.

    Several processes may call this at once: one builds, the others wait and map its file; after two seconds they say so
    on standard error. A damaged file is rebuilt, and partial files of killed processes are removed. If the cache cannot
    be written, a warning is issued and the next process builds again. Reduced tables are derived from the whole table
    of the same mesh if it is cached.

    Args:
        pad: by default the paper's, `Pad()`.
        fidelity: "fast", "balanced", "precise" or "accurate", or a Fidelity with its own mesh, storage and contact law.
        progress: report progress of a build on standard error: as a bar on a terminal, as lines elsewhere.
        cache: False neither reads nor writes the cache.

    Raises:
        InfluenceError: the cache's folder lies in a home folder, and the system does not know of one.
        MeshError: the mesh does not exist, cannot be solved, or needs more memory than the machine has.
        PadError: `pad` is no pad.
        PresetError: there is no such fidelity.

    Warns:
        MeshWarning: the pad is too wide or thin for the mesh's full resolution.
        InfluenceWarning: the cache had to be repaired or could not be written.
    """
    pad, chosen = Pad() if pad is None else require_pad(pad), as_fidelity(fidelity)
    warn_if_coarser(pad, chosen.density)
    if not cache:
        return build_influence(pad, chosen, progress=progress)
    path = cached_path(pad, chosen)
    shipped = SHIPPED / path.name
    found = _load_if_whole(path, pad, chosen, _READ_INSTEAD if is_there(shipped) else _BUILT)
    found = found or _load_if_whole(shipped, pad, chosen)
    if found is not None:
        return found
    with _locked(path) as error:
        if error is None:
            _remove_leftovers(path.parent, path)
        # Another process may have built it while this one waited.
        found = None if error is not None else _load_if_whole(path, pad, chosen)
        if found is not None:
            return found
        if progress:
            size = _compliance_bytes(pad, chosen)
            large = f" They take at least {size / 1e6:.0f} MB, and minutes to build." if size > _LARGE else ""
            say(
                f"building influence matrices at fidelity {fidelity_summary(chosen)} for a {pad.summary}. This is done "
                f"once; they are kept in {path.parent}.{large}"
            )
        built = _derived_from_cache(pad, chosen, progress=progress) or build_influence(pad, chosen, progress=progress)
        try:
            if error is not None:
                raise error
            built.save(path)
        except OSError as failure:
            _warn_not_kept(path, failure)
            return built
    return read_influence(path, pad, chosen)


def _compliance_bytes(pad: Pad, fidelity: Fidelity) -> int:
    """Size of the surface compliance in a table [bytes], which is most of it on wide sheets."""
    return 8 * sum(len(free) ** 2 for free in InfluenceMatrices(pad, fidelity, {}).free)


@dataclass(frozen=True)
class CachedTable:
    """A table in the cache."""

    path: Path  #: of the file
    size: int  #: of the file [bytes]
    contents: str  #: pad and fidelity as text, or the reason why the file cannot be used
    usable: bool  #: whether this version of the package can read it


def cached_tables() -> list[CachedTable]:
    """Tables in the cache, the largest first; their arrays are not read.

    Raises:
        OSError: the cache is no folder, or cannot be read.
    """
    try:
        paths = [path for path in cache_directory().iterdir() if path.match("influence-*.safetensors")]
    except FileNotFoundError:
        return []
    tables = []
    for path in paths:
        try:
            size = path.lstat().st_size
        except FileNotFoundError:
            continue  # another process has removed it
        if path.is_dir():
            continue
        usable = False
        try:
            pad, fidelity = check_provenance(path, read_metadata(path), None, None)
            contents, usable = f"{pad.summary}, {fidelity_summary(fidelity)}", True
        except StaleInfluenceError:
            contents = "of another version of mjtactile"
        except (CorruptInfluenceError, OSError) as error:
            contents = f"damaged: {error}"
        tables.append(CachedTable(path, size, contents, usable))
    return sorted(tables, key=lambda table: (-table.size, table.path))


def clear_cache(*, unusable_only: bool = False) -> list[CachedTable]:
    """Remove tables, or only unusable ones, from the cache, and return them; those that are open can still be used.

    Tables that are being built stay.

    Raises:
        OSError: a table cannot be removed.
    """
    from filelock import FileLock, Timeout

    removed = []
    for table in cached_tables():
        if unusable_only and table.usable:
            continue
        try:
            with FileLock(table.path.with_suffix(".lock"), timeout=0):
                table.path.unlink(missing_ok=True)
        except Timeout:
            continue
        except OSError as error:
            raise OSError(f"{table.path} cannot be removed: {error}") from error
        removed.append(table)
    return removed


# Numbers so small that they are 0 in single precision are no error, whatever NumPy has been told to make of them.
@np.errstate(under="ignore")
def build_influence(pad: Pad, fidelity: str | Fidelity, *, progress: bool = True) -> InfluenceMatrices:
    """Build influence matrices without reading or writing the cache; arguments as in `influence_matrices`.

    Raises:
        MeshError: the mesh does not exist, cannot be solved, or needs more memory than the machine has.
        PresetError: there is no such fidelity.
    """
    # Imported here because a cached table does not need scikit-fem.
    from mjtactile.fem.taxel_quadrature import layer_sampling, sampling_tables
    from mjtactile.influence.build import build_steps, build_tables

    chosen = as_fidelity(fidelity)
    density, sampling = chosen.density, {}
    steps = build_steps(pad, density)
    to_narrow = narrowing_steps(pad, plain_fidelity(chosen), chosen)
    total = steps * (1.0 + _REDUCTION_SHARE) if to_narrow else steps
    with progress_bar("influence matrices", total, wanted=progress, counted=False, lines=True) as advance:
        for k in range(pad.sensing_layers):
            sampling |= sampling_tables(layer_sampling(pad, k, density.points_at(k)), k)
        storage = ClassStorage(pad, chosen, sampling)
        tables: Tables = dict(storage.sampling)
        for class_tables in build_tables(
            pad,
            density,
            dtype=storage.fidelity.widest_precision,
            on_step=lambda: advance(1),
            rows=storage.averaged,
            columns=storage.columns,
        ):
            tables |= class_tables
        whole = InfluenceMatrices(pad, storage.fidelity, tables)
        return reduced_and_narrowed(whole, chosen, lambda: advance((total - steps) / to_narrow))


@np.errstate(under="ignore")  # as in build_influence
def _derived_from_cache(pad: Pad, chosen: Fidelity, *, progress: bool) -> InfluenceMatrices | None:
    """Influence matrices derived from the whole ones (`plain_fidelity`), if the cache has those; otherwise None."""
    plain = plain_fidelity(chosen)
    path = cached_path(pad, plain)
    if path == cached_path(pad, chosen):
        return None
    found = _load_if_whole(path, pad, plain)
    if found is None:
        return None
    steps = narrowing_steps(pad, found.fidelity, chosen)
    with progress_bar("influence matrices", steps, wanted=progress, counted=False, lines=True) as advance:
        return in_storage(found, chosen, lambda: advance(1))


def _load_if_whole(path: Path, pad: Pad, chosen: Fidelity, instead: str = _BUILT) -> InfluenceMatrices | None:
    try:
        return read_influence(path, pad, chosen)
    except FileNotFoundError:
        return None
    except (CorruptInfluenceError, StaleInfluenceError, OSError) as error:
        warnings.warn(f"the cached table cannot be used and {instead}: {error}", InfluenceWarning, stacklevel=3)
        return None


@contextmanager
def _locked(path: Path) -> Iterator[OSError | None]:
    """Create the table's folder and hold the table's lock; yields the error if that fails, otherwise None."""
    from filelock import FileLock

    lock = FileLock(path.with_suffix(".lock"))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _acquire(lock)
    except (OSError, NotImplementedError) as error:
        yield error if isinstance(error, OSError) else OSError(str(error))
        return
    try:
        yield None
    finally:
        lock.release()


def _acquire(lock: BaseFileLock) -> None:
    """Acquire the lock; report on standard error if that takes long."""
    from filelock import Timeout

    patience = _SILENT_WAIT
    while True:
        try:
            lock.acquire(timeout=patience)
            return
        except Timeout:
            say(
                f"waiting for another process that builds the same influence matrices and holds {lock.lock_file}. If "
                f"it was stopped or hangs, let it go on or end it (`fuser {lock.lock_file}` finds it), or point "
                f"{CACHE_VARIABLE} at another folder."
            )
            patience = _WAIT_BETWEEN_LINES


def _remove_leftovers(folder: Path, own: Path) -> None:
    """Remove partial files of killed processes from the cache's folder; this process holds the lock of the table `own`.

    A process that writes a table holds its lock, so a partial file whose lock is free is abandoned.
    """
    from filelock import FileLock, Timeout

    for partial in folder.glob(".influence-*.partial"):
        table = folder / partial.name[1:].rpartition("-")[0]
        try:
            with nullcontext() if table.name == own.stem else FileLock(f"{table}.lock", timeout=0):
                partial.unlink(missing_ok=True)
        except (Timeout, OSError, NotImplementedError):
            continue  # it is being written, or cannot be removed: it does no harm


def _warn_not_kept(path: Path, error: OSError) -> None:
    warnings.warn(
        f"the influence matrices could not be kept in {path.parent} ({error}); they will be built again next time. "
        f"Free space there, or point {CACHE_VARIABLE} at a folder that can be written.",
        InfluenceWarning,
        stacklevel=3,
    )
