"""A dataset damaged in any way is repaired or refused: no press is lost, and none is read that was not written."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from filelock import FileLock

from mjtactile.dataset import files as dataset_module
from mjtactile.dataset.files import make_dataset, read_dataset
from mjtactile.dataset.seal import UNSEALED, is_whole, sealed
from mjtactile.dataset.spec import parse_spec
from mjtactile.errors import DamagedPartError, DatasetError, DatasetWarning, OutputError

PUNCHES = {"shapes": ["star", "triangle"], "shift": 1.5}
SPEC = parse_spec(
    {"presses": 20, "seed": 4, "fidelity": "fast", "law": "uniform", "poses": 2, "forces": 2, "contact": [PUNCHES]}
)
FIRST, SECOND, LAST = (f"presses-{first:09d}.parquet" for first in (0, 8, 16))


@pytest.fixture(autouse=True)
def _small_parts(monkeypatch):
    monkeypatch.setattr(dataset_module, "_PRESSES_PER_PART", 8)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(dataset_module, "_PRESSES_PER_PART", 8)
        make_dataset(SPEC, folder, progress=False)
    return folder


@pytest.fixture
def folder(made, tmp_path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "presses"))


def parts(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("presses-*"))}


def truncated(folder: Path) -> None:
    content = (folder / SECOND).read_bytes()
    (folder / SECOND).write_bytes(content[: len(content) // 2])


def flipped(folder: Path) -> None:
    content = bytearray((folder / SECOND).read_bytes())
    content[len(content) // 3] ^= 1
    (folder / SECOND).write_bytes(bytes(content))


def empty(folder: Path) -> None:
    (folder / SECOND).write_bytes(b"")


def missing(folder: Path) -> None:
    (folder / SECOND).unlink()


def last_missing(folder: Path) -> None:
    (folder / LAST).unlink()


def swapped(folder: Path) -> None:
    (folder / FIRST).rename(folder / "aside")
    (folder / SECOND).rename(folder / FIRST)
    (folder / "aside").rename(folder / SECOND)


def copied_over(folder: Path) -> None:
    shutil.copy(folder / FIRST, folder / SECOND)


def other_columns(folder: Path) -> None:
    """As a table tool writes it back, metadata and all, without one column."""
    table = pq.read_table(folder / SECOND)
    pq.write_table(table.drop_columns(["rotation"]), folder / SECOND)


def written_back(folder: Path) -> None:
    """As a table tool writes it back after it changed a label."""
    table = pq.read_table(folder / SECOND)
    turned = pa.array(np.zeros(len(table)))
    pq.write_table(table.set_column(table.schema.get_field_index("rotation"), "rotation", turned), folder / SECOND)


def metadata_damaged(folder: Path) -> None:
    content = (folder / SECOND).read_bytes()
    place = content.index(b'"spec_fingerprint": "') + len(b'"spec_fingerprint": "')
    (folder / SECOND).write_bytes(content[:place] + b"0000" + content[place + 4 :])


def no_parquet(folder: Path) -> None:
    (folder / SECOND).write_bytes(b"not a table at all")


REPAIRED: tuple[Callable[[Path], None], ...] = (
    *(truncated, flipped, empty, missing, last_missing, swapped, copied_over, other_columns, written_back),
    *(metadata_damaged, no_parquet),
)


@pytest.mark.parametrize("damage", REPAIRED)
@pytest.mark.filterwarnings("ignore::mjtactile.dataset.files.DatasetWarning")
def test_damage_is_refused_when_read_and_repaired_when_made(damage, folder, made):
    damage(folder)
    with pytest.raises(DatasetError, match="mjtactile dataset"):
        read_dataset(folder)
    with pytest.raises(DatasetError, match="mjtactile dataset"):
        read_dataset(folder, labels_only=True)
    assert make_dataset(SPEC, folder, progress=False) in (4, 8, 16)
    assert parts(folder) == parts(made)
    np.testing.assert_array_equal(read_dataset(folder).readings, read_dataset(made).readings)


def test_what_was_damaged_is_told_and_put_aside_where_readers_pass_over_it(folder):
    """Arrow and Hugging Face's datasets pass over hidden files; polars and DuckDB take all that end in .parquet."""
    no_parquet(folder)
    whole = {path.name for path in folder.glob("*.parquet")}
    aside = f"damaged-0-{Path(SECOND).stem}"
    with pytest.warns(DatasetWarning, match=rf"{SECOND} is damaged.*\.{aside}\."):
        make_dataset(SPEC, folder, progress=False)
    assert (folder / f".{aside}").read_bytes() == b"not a table at all"
    assert len(pq.read_table(folder)) == 20
    assert {path.name for path in folder.iterdir() if path.suffix == ".parquet" or path.name[0] != "."} == whole
    no_parquet(folder)
    with pytest.warns(DatasetWarning, match="damaged-1"):
        make_dataset(SPEC, folder, progress=False)


def test_every_flipped_bit_of_a_part_is_noticed(made):
    whole = (made / LAST).read_bytes()
    assert is_whole(whole)
    rng = np.random.default_rng(5)
    # Anywhere, and all over the footer, where the schema, the metadata and the checksum itself are.
    places = [*rng.integers(len(whole), size=300), *range(len(whole) - 600, len(whole))]
    footer = len(whole) - int.from_bytes(whole[-8:-4], "little") - 8
    places += list(rng.integers(footer, len(whole), size=300))
    for place in places:
        content = bytearray(whole)
        content[place] ^= 1 << int(rng.integers(8))
        assert not is_whole(bytes(content)), f"byte {place} of {len(whole)}"


def test_readers_that_know_nothing_of_this_package_can_notice_flipped_bits_too(folder):
    content = bytearray((folder / SECOND).read_bytes())
    content[len(content) // 3] ^= 1  # within the readings
    (folder / SECOND).write_bytes(bytes(content))
    with pytest.raises(OSError, match="CRC"):
        pq.read_table(folder / SECOND, page_checksum_verification=True)


def test_a_file_of_somebody_else_is_refused_and_left_alone(folder):
    table = pa.table({"mine": [1, 2, 3]})
    pq.write_table(table.replace_schema_metadata({"other": "x"}), folder / SECOND)
    before = parts(folder)
    for attempt in (lambda: read_dataset(folder), lambda: make_dataset(SPEC, folder, progress=False)):
        with pytest.raises(DatasetError, match="not a part of a dataset"):
            attempt()
    assert parts(folder) == before


def test_a_part_of_another_dataset_is_refused_and_left_alone(folder, tmp_path):
    make_dataset(replace(SPEC, seed=5), tmp_path / "other", progress=False)
    shutil.copy(tmp_path / "other" / SECOND, folder / SECOND)
    before = parts(folder)
    with pytest.raises(DatasetError, match="another dataset"):
        read_dataset(folder)
    with pytest.raises(DatasetError, match="another specification"):
        make_dataset(SPEC, folder, progress=False)
    assert parts(folder) == before


def test_a_whole_part_with_other_columns_is_refused(folder):
    table = pq.read_table(folder / SECOND)
    file = pa.BufferOutputStream()
    renamed = table.rename_columns(["turn" if name == "rotation" else name for name in table.column_names])
    renamed = renamed.replace_schema_metadata({b"mjtactile": table.schema.metadata[b"mjtactile"]})
    with pq.ParquetWriter(file, renamed.schema) as writer:
        writer.write_table(renamed)
        writer.add_key_value_metadata(UNSEALED)
    (folder / SECOND).write_bytes(sealed(file.getvalue().to_pybytes()))
    with pytest.raises(DamagedPartError, match="other columns"):
        read_dataset(folder)


@pytest.mark.parametrize("presses", [1, 8, 9, 19])
def test_fewer_presses_than_are_there_are_refused_and_nothing_is_lost(folder, presses):
    before = parts(folder)
    with pytest.raises(DatasetError, match=r"20 presses, but \d+ were asked for.*at least 20"):
        make_dataset(replace(SPEC, presses=presses), folder, progress=False)
    assert parts(folder) == before


def test_fewer_presses_are_refused_even_where_the_parts_beyond_are_damaged(folder):
    for name in (FIRST, SECOND, LAST):
        (folder / name).write_bytes(b"")
    with pytest.raises(DatasetError, match="at least 17"):
        make_dataset(replace(SPEC, presses=9), folder, progress=False)
    assert set(parts(folder)) == {FIRST, SECOND, LAST}


def test_more_presses_are_added(folder, made):
    assert make_dataset(replace(SPEC, presses=30), folder, progress=False) == 8 + 6
    np.testing.assert_array_equal(read_dataset(folder).readings[:20], read_dataset(made).readings)


def test_what_a_killed_process_left_is_cleared_away(folder):
    (folder / ".abc.partial").write_bytes(b"half a part")
    make_dataset(SPEC, folder, progress=False)
    assert not (folder / ".abc.partial").exists()


def test_two_processes_do_not_make_one_dataset(folder):
    with FileLock(folder / ".lock"), pytest.raises(DatasetError, match="another process"):
        make_dataset(SPEC, folder, progress=False)


def test_more_than_the_disk_holds_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(DatasetError, match="GB left"):
        make_dataset(replace(SPEC, presses=10**9 - 1), tmp_path, progress=False)
    with pytest.raises(DatasetError, match="presses = 1000000000"):
        replace(SPEC, presses=10**9)


def test_a_pipe_under_the_name_of_a_part_stays_one(folder):
    (folder / SECOND).unlink()
    os.mkfifo(folder / SECOND)
    for attempt in (lambda: read_dataset(folder), lambda: make_dataset(SPEC, folder, progress=False)):
        with pytest.raises((DatasetError, OutputError), match="pipe"):
            attempt()
    assert (folder / SECOND).is_fifo()
