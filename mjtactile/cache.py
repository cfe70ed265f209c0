"""Influence matrices built once per pad and mesh, and kept in a per-user cache."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from mjtactile.errors import CorruptInfluenceError, InfluenceWarning, StaleInfluenceError
from mjtactile.influence import (
    InfluenceMatrices,
    influence_fingerprint,
    load_influence,
    sampling_tables,
)
from mjtactile.mesh import MeshDensity, mesh_density
from mjtactile.pad import Pad
from mjtactile.table import Tables

#: Environment variable that moves the cache.
CACHE_VARIABLE = "MJTACTILE_CACHE"


def cache_directory() -> Path:
    """Folder of the cached tables: $MJTACTILE_CACHE, or the user's cache folder."""
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen:
        return Path(chosen).expanduser()
    from platformdirs import user_cache_path

    return user_cache_path("mjtactile")


def cached_path(pad: Pad, mesh: str | MeshDensity = "default") -> Path:
    """Where the influence matrices of a pad on a mesh are kept."""
    return cache_directory() / f"influence-{influence_fingerprint(pad, mesh_density(mesh))[:20]}.safetensors"


def influence_matrices(
    pad: Pad | None = None, mesh: str | MeshDensity = "default", *, progress: bool = True, cache: bool = True
) -> InfluenceMatrices:
    """Influence matrices of a pad: from the cache, or built and kept there.

    Several processes may ask at once: one builds, the others wait for it and map its file. A damaged file is rebuilt;
    a cache that cannot be written costs a warning and the next build, nothing else.

    Args:
        pad: by default the paper's, `Pad()`.
        mesh: "draft", "default" or "fine", or a MeshDensity.
        progress: show a progress bar on a terminal while building.
        cache: False neither reads nor writes the cache.

    Raises:
        MeshError: when the mesh does not exist or cannot be solved.

    Warns:
        MeshWarning: when the pad is too wide or thin for the mesh's full resolution.
        InfluenceWarning: when the cache had to be repaired or could not be written.
    """
    pad, density = Pad() if pad is None else pad, mesh_density(mesh)
    if not cache:
        return build_influence(pad, density, progress=progress)
    path = cached_path(pad, density)
    found = _load_if_whole(path, pad, density)
    if found is not None:
        return found
    with _locked(path) as error:
        # Another process may have built it while this one waited.
        found = None if error is not None else _load_if_whole(path, pad, density)
        if found is not None:
            return found
        built = build_influence(pad, density, progress=progress)
        try:
            if error is not None:
                raise error
            built.save(path)
        except OSError as failure:
            _warn_not_kept(path, failure)
            return built
    return load_influence(path, pad, density)


def build_influence(pad: Pad, density: MeshDensity, *, progress: bool = True) -> InfluenceMatrices:
    """Build influence matrices without looking at the cache; see `influence_matrices`."""
    # scikit-fem is only needed here: a cached table starts without importing it.
    from mjtactile.build import build_steps, build_tables
    from mjtactile.sampling import layer_sampling

    tables: Tables = {}
    for k in range(len(pad.depths)):
        tables |= sampling_tables(layer_sampling(pad, k, density.points_at(k)), k)
    with _progress_bar(progress, f"building influence matrices, {pad.summary}", build_steps(pad, density)) as step:
        for class_tables in build_tables(pad, density, on_step=step):
            tables |= class_tables
    return InfluenceMatrices(pad, density, tables)


def _load_if_whole(path: Path, pad: Pad, density: MeshDensity) -> InfluenceMatrices | None:
    try:
        return load_influence(path, pad, density)
    except FileNotFoundError:
        return None
    except (CorruptInfluenceError, StaleInfluenceError, OSError) as error:
        warnings.warn(f"the cached table cannot be used and is built anew: {error}", InfluenceWarning, stacklevel=3)
        return None


@contextmanager
def _locked(path: Path) -> Iterator[OSError | None]:
    """Make the table's folder and hold its lock; yields the error instead where that cannot be done."""
    from filelock import FileLock

    lock = FileLock(path.with_suffix(".lock"))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except (OSError, NotImplementedError) as error:
        yield error if isinstance(error, OSError) else OSError(str(error))
        return
    try:
        yield None
    finally:
        lock.release()


def _warn_not_kept(path: Path, error: OSError) -> None:
    warnings.warn(
        f"the influence matrices could not be kept in {path.parent} ({error}); they will be built again next time. "
        f"Free space there, or point {CACHE_VARIABLE} at a folder that can be written.",
        InfluenceWarning,
        stacklevel=3,
    )


@contextmanager
def _progress_bar(wanted: bool, description: str, total: int) -> Iterator[Callable[[], None]]:
    if not (wanted and sys.stderr.isatty()):
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda: bar.advance(task)
