"""One part of a dataset of presses: made, and put into the bytes of a Parquet file."""

from __future__ import annotations

import io
import json
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from mjtactile.dataset_spec import DatasetSpec
from mjtactile.influence import InfluenceMatrices
from mjtactile.pad import Array, Pad
from mjtactile.press_sampling import NOISE, OutlinePresses, outline_presses, stream

if TYPE_CHECKING:
    import pyarrow as pa

#: Of the files' metadata.
FORMAT = 1


@dataclass(frozen=True)
class PartOf:
    """What a worker is asked for."""

    spec: DatasetSpec
    part: tuple[int, int]  #: first press and end


def part_file(task: PartOf) -> bytes:
    """The file of one part."""
    import pyarrow.parquet as pq

    spec, (first, end) = task.spec, task.part
    outlines = range(first // spec.presses_per_outline, math.ceil(end / spec.presses_per_outline))
    made = [press_columns(spec, outline_presses(spec, outline)) for outline in outlines]
    columns = {name: np.concatenate([columns[name] for columns in made]) for name in made[0]}
    wanted = columns["press"] < end
    table = _table(spec, task.part, {name: column[wanted] for name, column in columns.items()})
    file = io.BytesIO()
    pq.write_table(table, file, compression="zstd")
    return file.getvalue()


def press_columns(spec: DatasetSpec, presses: OutlinePresses) -> dict[str, np.ndarray]:
    """Labels and readings of the presses of one outline, as columns; presses that did not settle are left out."""
    influence = _influence(spec.pad, presses.preset)
    if spec.backend == "mujoco":
        from mjtactile.press_mujoco import mujoco_readings as readings_of
    else:
        from mjtactile.press_physics import physics_readings as readings_of
    readings, forces, points = readings_of(influence, presses)
    count = len(readings)
    index = presses.first + np.arange(count)
    noise = np.zeros(count)
    for k in range(count):
        readings[k], noise[k] = _as_reported(spec, readings[k], stream(spec.seed, NOISE, int(index[k])))
    shifts = np.repeat([pose.shift for pose in presses.poses], spec.forces, axis=0)
    columns = {
        "press": index,
        "shape": np.full(count, presses.shape),
        "size": np.full(count, presses.size),
        "rotation": np.repeat([pose.rotation for pose in presses.poses], spec.forces),
        "shift_x": shifts[:, 0],
        "shift_y": shifts[:, 1],
        "force_x": forces[:, 0],
        "force_y": forces[:, 1],
        "force_z": forces[:, 2],
        "position_x": points[:, 0],
        "position_y": points[:, 1],
        "free": np.full(count, presses.free),
        "preset": np.full(count, presses.preset),
        "law": np.full(count, presses.law),
        "tangential": np.full(count, presses.tangential),
        "noise": noise,
        "transducer": np.full(count, (spec.transducer or {}).get("name", "none")),
        "readings": readings.reshape(count, -1).astype(np.float32),
    }
    settled = np.isfinite(columns["readings"]).all(axis=1)
    return {name: column[settled] for name, column in columns.items()}


def _as_reported(spec: DatasetSpec, readings: Array, rng: np.random.Generator) -> tuple[Array, float]:
    """Readings [Pa] as the transducer reports them, with noise, and its relative standard deviation."""
    if spec.transducer is not None:
        from mjtactile.press_transducer import reported

        readings = reported(spec.transducer, readings, rng)
    noise = float(rng.uniform(*spec.noise))
    if noise > 0.0:
        readings = readings + noise * np.nanmax(readings) * rng.standard_normal(readings.shape)
    return readings, noise


@lru_cache(maxsize=4)
def _influence(pad: Pad, preset: str) -> InfluenceMatrices:
    from mjtactile.cache import influence_matrices

    return influence_matrices(pad, preset=preset, progress=False)


def _table(spec: DatasetSpec, part: tuple[int, int], columns: dict[str, np.ndarray]) -> pa.Table:
    import pyarrow as pa

    from mjtactile import __version__

    readings = columns["readings"]
    lists = pa.FixedSizeListArray.from_arrays(pa.array(readings.ravel()), readings.shape[1])
    arrays = {name: pa.array(column) for name, column in columns.items() if name != "readings"}
    metadata = {
        "format": FORMAT,
        "version": __version__,
        "part": part,
        "pad": spec.pad.description,
        "pad_fingerprint": spec.pad.fingerprint,
        "reading_shape": spec.pad.reading_shape,
        "spec": spec.description,
        "spec_fingerprint": spec.fingerprint,
    }
    table = pa.table({**arrays, "readings": lists})
    return table.replace_schema_metadata({"mjtactile": json.dumps(metadata)})
