"""Datasets of presses on disk: written by any number of workers, resumable after interruptions.

A dataset is a folder of Parquet files. pandas, polars, DuckDB and Arrow in any language read them without this package,
and labels can be read without the readings. Every part is a file that exists completely or not at all, so resuming
means making the missing parts. HDF5 and Zarr store arrays too, but a crash destroys an HDF5 file that is being written,
and table tools read neither. Damaged parts are detected: readers refuse them, and `make_dataset` makes them again.
"""

from __future__ import annotations

import math
import shutil
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile._files import PARTIAL, check_writable, lock_file, make_folder, path_from
from mjtactile._installed import require
from mjtactile._progress import progress_bar
from mjtactile._types import Array
from mjtactile.dataset.part import (
    PART_FILES,
    Part,
    count_presses,
    first_press,
    influence_of,
    outlines_of,
    part_file,
    part_name,
    read_part,
)
from mjtactile.dataset.sampling import outline_presses
from mjtactile.dataset.shapes import shape_indenter
from mjtactile.dataset.spec import DatasetSpec
from mjtactile.errors import DamagedPartError, DatasetError, DatasetWarning, of_type
from mjtactile.workers import Workers, check_workers, make_files

#: Approximate number of presses in one file.
_PRESSES_PER_PART = 960


@dataclass(frozen=True, eq=False)
class Dataset:
    """Presses read from disk.

    Attributes:
        readings: (presses, *reading_shape) [Pa], float32.
        labels: the other columns by name, (presses,) each, SI units; see docs/datasets.md.
        metadata: pad, fingerprint and specification.
    """

    readings: np.ndarray
    labels: dict[str, np.ndarray]
    metadata: dict[str, Any]

    @property
    def forces(self) -> Array:
        """Forces on the pad in the pad frame [N], (presses, 3)."""
        return self._vectors("force_x", "force_y", "force_z")

    @property
    def positions(self) -> Array:
        """Points (x, y) where the forces' lines of action meet the surface [m], (presses, 2)."""
        return self._vectors("position_x", "position_y")

    @property
    def shifts(self) -> Array:
        """Positions (x, y) of the bodies' origins in the pad frame [m], (presses, 2)."""
        return self._vectors("shift_x", "shift_y")

    def _vectors(self, *names: str) -> Array:
        return np.stack([self.labels[name] for name in names], axis=-1)


def make_dataset(spec: DatasetSpec, folder: str | Path, *, workers: int | Workers = 1, progress: bool = True) -> int:
    """Make the missing and damaged parts of a dataset.

    Args:
        spec: specification of the dataset.
        folder: folder of the dataset, created if necessary. Existing parts of the same specification are kept.
        workers: number of processes, one core each, or a `Workers`. The files do not depend on it.
        progress: show a progress bar on a terminal.

    Returns:
        Number of presses made by this call, without those that were left out: they did not settle in MuJoCo, or their
        force does not press on a curved pad.

    Raises:
        DatasetError: `spec` is no specification or `folder` no path; the folder contains another dataset, more presses
            than specified, or another file with a part's name; a body misses the pad; another process is making the
            dataset; the disk is too small; or all presses of the dataset were left out.
        DistributeError: `workers` is neither a whole number nor a `Workers`; or workers cannot be started or reached,
            or are killed repeatedly.
        IndenterError: a mesh file cannot be read.
        OutputError: the folder cannot be made or written.

    Warns:
        DatasetWarning: a part was damaged and is made again, or presses were left out.
    """
    require("dataset")
    from mjtactile.influence.cache import influence_matrices

    chosen = workers if isinstance(workers, Workers) else Workers(count=workers)
    check_workers(chosen)
    of_type(DatasetSpec, "spec", spec, DatasetError, "load_spec reads one")
    folder = path_from(folder, "folder", DatasetError)
    make_folder(folder)
    check_writable(folder / part_name(0))
    with _alone(folder):
        kept = _kept(spec, folder)
        _check_space(spec, folder, spec.presses - sum(end - first for first, end in kept))
        parts = {folder / part_name(part[0]): part for part in _parts(spec) if part not in kept}
        if not parts:
            _check_some(spec, folder)
            return 0
        for preset in spec.presets:  # built once, before all workers need them at the same time
            influence_matrices(spec.pad, preset, progress=progress)
        _check_poses(spec, parts.values())
        made = 0
        total = sum(end - first for first, end in parts.values())
        with progress_bar(f"pressing, {spec.backend}", total, wanted=progress) as advance:
            for path in make_files(partial(part_file, spec), parts, chosen):
                first, end = parts[path]
                made += count_presses(path)
                advance(end - first)
        _check_some(spec, folder)
    if made < total:
        warnings.warn(
            f"{total - made} of {total} presses were left out: {_why_left_out(spec)}.", DatasetWarning, stacklevel=2
        )
    return made


def _check_some(spec: DatasetSpec, folder: Path) -> None:
    """Refuse a complete dataset without any press."""
    if not any(count_presses(folder / part_name(first)) for first, _ in _parts(spec)):
        raise DatasetError(
            f"all {spec.presses} presses were left out: {_why_left_out(spec)}. The dataset in {folder} is empty. "
            "Delete it, and give other forces, tilts or shifts."
        )


def _why_left_out(spec: DatasetSpec) -> str:
    if spec.backend == "mujoco":
        return "bodies did not settle, because they slide, tip or rock"
    return "forces did not press along -z, because they are tilted on a slope of the pad"


def read_dataset(folder: str | Path, *, labels_only: bool = False, most: int | None = None) -> Dataset:
    """Read a dataset and verify all checksums.

    Args:
        folder: folder of the dataset, as in `make_dataset`.
        labels_only: do not read the readings; they are an empty array in the result.
        most: stop after the part in which this number of presses is reached; by default read all.

    Raises:
        DatasetError: `folder` is no path, there is no dataset, its files belong to different datasets, a file is
            damaged, or presses are missing.
    """
    require("dataset")
    import pyarrow as pa

    folder = path_from(folder, "folder", DatasetError)
    remedy = f"Make what is missing: mjtactile dataset --spec FILE.toml --out {folder}"
    paths = sorted(folder.glob(PART_FILES))
    if not paths:
        raise DatasetError(
            f"there is no dataset in {folder}. Make one: mjtactile dataset --spec FILE.toml --out {folder}"
        )
    tables, metadata, following, asked = [], {}, 0, 0
    for path in paths:
        try:
            part = read_part(path)
        except DamagedPartError as error:
            raise DamagedPartError(f"{error} {remedy}") from error
        if metadata and part.metadata["spec_fingerprint"] != metadata["spec_fingerprint"]:
            raise DatasetError(f"{path} belongs to another dataset than {paths[0].name}. Keep one dataset per folder.")
        first, end = part.presses
        if first != following:
            raise DatasetError(f"presses {following} to {first} are missing in {folder}. {remedy}")
        metadata, following, asked = part.metadata, end, max(asked, part.asked)
        tables.append(part.table(readings=not labels_only))
        if most is not None and sum(len(one) for one in tables) >= most:
            break
    else:
        if following < asked:
            raise DatasetError(f"presses {following} to {asked} are missing in {folder}. {remedy}")
    whole = pa.concat_tables(tables)
    labels = {name: whole[name].to_numpy() for name in whole.column_names if name != "readings"}
    if labels_only:
        return Dataset(np.zeros(0, dtype=np.float32), labels, metadata)
    flat = whole["readings"].combine_chunks().flatten().to_numpy()
    return Dataset(flat.reshape(-1, *metadata["reading_shape"]), labels, metadata)


def _parts(spec: DatasetSpec) -> Iterator[tuple[int, int]]:
    """First press and end of every part; all parts but the last contain whole outlines."""
    per_part = math.ceil(_PRESSES_PER_PART / spec.presses_per_outline) * spec.presses_per_outline
    return ((first, min(first + per_part, spec.presses)) for first in range(0, spec.presses, per_part))


def _check_poses(spec: DatasetSpec, parts: Iterable[tuple[int, int]]) -> None:
    """Refuse presses that would miss the pad, before any is made; the message names the press and the entry.

    With backend "physics", bodies that miss a curved pad are refused with the specification.
    """
    from mjtactile.dataset.by_law import always_on_pad, check_on_pad, pose_footprint

    certain = all(always_on_pad(contact, spec.pad) for contact in spec.contacts)
    if certain or (spec.backend == "physics" and not spec.pad.surface.is_flat):
        return
    for outline in sorted({outline for part in parts for outline in outlines_of(spec, part)}):
        presses = outline_presses(spec, outline)
        if spec.backend == "mujoco":
            from mjtactile.dataset.by_scene import pose_scene

            touch = partial(pose_scene, shape_indenter(presses.shape, presses.size), spec.pad, presses)
        else:
            touch = partial(pose_footprint, influence_of(spec.pad, presses.preset), presses)
        check_on_pad(spec.pad, presses, touch)


def _kept(spec: DatasetSpec, folder: Path) -> set[tuple[int, int]]:
    """First press and end of the valid parts in a folder; damaged parts are renamed.

    Raises:
        DatasetError: the folder contains another dataset, more presses than specified, or another file with a part's
            name.
    """
    kept, damaged, most = set(), [], 0
    own = spec.fingerprint
    for path in sorted(folder.glob(PART_FILES)):
        try:
            part = read_part(path)
        except DamagedPartError as error:
            damaged.append((path, error))
            continue
        if part.metadata["spec_fingerprint"] != own:
            raise DatasetError(
                f"{folder} holds a dataset of {_difference(spec, part)}. Choose another folder, or delete that one."
            )
        kept.add(part.presses)
        most = max(most, part.asked, part.presses[1])
    for path, _ in damaged:
        most = max(most, first_press(path) + 1)
    if spec.presses < most:
        raise DatasetError(
            f"{folder} holds a dataset of {most} presses, but {spec.presses} were asked for. Presses are never "
            f"deleted: ask for at least {most}, or choose another folder."
        )
    for path, error in damaged:
        aside = _put_aside(path)
        warnings.warn(
            f"{error} Its presses are made again; what was there is now {aside}.", DatasetWarning, stacklevel=3
        )
    return kept


def _difference(spec: DatasetSpec, part: Part) -> str:
    """In what a dataset differs, as words for an error message."""
    if {**part.metadata["spec"], "presses": spec.presses} == spec.description:
        return "the same specification, but with other mesh files: they have changed"
    return "another specification or seed"


def _put_aside(path: Path) -> Path:
    """Rename a damaged part, not delete it.

    Readers of Parquet folders ignore hidden files, or take those that end in ".parquet"; some take names with "_".
    """
    number = 0
    while (aside := path.with_name(f".damaged-{number}-{path.stem}")).exists():
        number += 1
    return path.rename(aside)


def _check_space(spec: DatasetSpec, folder: Path, presses: int) -> None:
    """Refuse datasets larger than the free disk space; compression of noisy readings is neglected."""
    needed, free = presses * math.prod(spec.pad.reading_shape) * 4, shutil.disk_usage(folder).free
    if needed > free:
        raise DatasetError(
            f"{presses} presses take up to {needed / 1e9:.3g} GB, but {folder} has {free / 1e9:.3g} GB left. Ask for "
            "fewer presses, free some space, or choose another folder."
        )


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Lock the folder against other processes that make datasets, and remove partial files of killed processes."""
    busy = f"another process is making the dataset in {folder}. Wait for it, or choose another folder."
    lock = lock_file(folder / ".lock", busy, DatasetError)
    try:
        if lock.is_locked:
            for left in folder.glob(f".*{PARTIAL}"):
                left.unlink(missing_ok=True)
        yield
    finally:
        lock.release()
