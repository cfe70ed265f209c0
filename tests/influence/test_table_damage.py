"""Tables that are not what was written: flipped, cut, exchanged, of another shape. All of it is found, none used."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_pads import COARSE, LAYERED_PAD

import mjtactile._files.checksums
import mjtactile.influence.table
from mjtactile._files.checksums import checksum
from mjtactile._types import Tables
from mjtactile.errors import CorruptInfluenceError
from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import build_influence
from mjtactile.influence.core_pad import core_pad
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.influence.table import read_tables, write_tables

FLIPS, CUTS = 300, 50
#: Every kind of array there is: indices, points, whole matrices, factors, scales, compliance.
STORED = Fidelity(mesh=COARSE, precision="int8", reduction=0.1, averaging="quarters")


@pytest.fixture(scope="module")
def small() -> InfluenceMatrices:
    return build_influence(LAYERED_PAD, STORED, progress=False)


@pytest.fixture
def saved(small, tmp_path) -> Path:
    path = tmp_path / "table.safetensors"
    small.save(path)
    return path


def header_length(content: bytes) -> int:
    return 8 + int.from_bytes(content[:8], "little")


def rewritten(path: Path, change: Callable[[dict[str, np.ndarray], dict[str, str]], None]) -> None:
    """Change a file's arrays and metadata by way of its container, which keeps no eye on either."""
    from safetensors import safe_open
    from safetensors.numpy import save_file

    with safe_open(path, framework="np") as file:
        about = dict(file.metadata())
        arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    change(arrays, about)
    save_file({name: np.ascontiguousarray(array) for name, array in arrays.items()}, path, about)


def test_every_flipped_bit_is_found(saved):
    """Half of them in the header, which is a small part of the file."""
    content, rng = saved.read_bytes(), np.random.default_rng(11)
    for number in range(FLIPS):
        damaged = bytearray(content)
        place = int(rng.integers(header_length(content) if number % 2 else len(content)))
        damaged[place] ^= 1 << int(rng.integers(8))
        saved.write_bytes(damaged)
        with pytest.raises(CorruptInfluenceError, match=f"{saved.name}.*delete it and rebuild: mjtactile build"):
            load_influence(saved)
    saved.write_bytes(content)
    load_influence(saved)


def test_every_truncation_is_found(saved):
    content, rng = saved.read_bytes(), np.random.default_rng(12)
    lengths = [0, 1, 7, 8, 9, header_length(content), len(content) - 1, *rng.integers(len(content), size=CUTS - 7)]
    for length in lengths:
        saved.write_bytes(content[:length])
        with pytest.raises(CorruptInfluenceError, match=r"not a whole influence table.*delete it and rebuild"):
            load_influence(saved)


def test_what_was_added_or_zeroed_is_found(saved):
    content = saved.read_bytes()
    page = bytearray(content)
    start = header_length(content) + 4096
    page[start : start + 4096] = bytes(4096)
    for damaged in (content + b"\0", content + content, bytes(len(content)), bytes(page)):
        saved.write_bytes(damaged)
        with pytest.raises(CorruptInfluenceError):
            load_influence(saved)


def test_exchanged_arrays_are_found(saved):
    """Any two of one type and shape, in each other's places."""
    content = saved.read_bytes()
    tables, _ = read_tables(saved)
    pairs = [
        (a, b)
        for a in tables
        for b in tables
        if a < b
        and tables[a].shape == tables[b].shape
        and tables[a].dtype == tables[b].dtype
        and not np.array_equal(tables[a], tables[b])
    ]
    assert len(pairs) > 20
    for a, b in pairs:
        saved.write_bytes(content)

        def exchange(arrays, _about, a=a, b=b):
            arrays[a], arrays[b] = arrays[b], arrays[a]

        rewritten(saved, exchange)
        with pytest.raises(CorruptInfluenceError, match="does not match its checksum"):
            load_influence(saved)


def test_arrays_of_another_table_are_found(saved, tmp_path):
    other = tmp_path / "other.safetensors"
    build_influence(replace(LAYERED_PAD, sampling_radius=0.45e-3), STORED, progress=False).save(other)
    theirs, _ = read_tables(other)
    rewritten(saved, lambda arrays, _: arrays.update({"compliance ++": 2.0 * np.array(arrays["compliance ++"])}))
    with pytest.raises(CorruptInfluenceError, match="'compliance \\+\\+' does not match its checksum"):
        load_influence(saved)
    rewritten(saved, lambda arrays, _: arrays.update({name: np.array(table) for name, table in theirs.items()}))
    with pytest.raises(CorruptInfluenceError, match="checksum"):
        load_influence(saved)


@pytest.mark.parametrize("entry", ["mjtactile", "checksums", "header"])
def test_header_without_an_entry_is_refused(entry, saved):
    def drop(_arrays, about):
        del about[entry]

    rewritten(saved, drop)
    with pytest.raises(CorruptInfluenceError, match="the header's metadata has entries"):
        load_influence(saved)


def mended(path: Path, change: Callable[[Tables, dict[str, Any]], object]) -> None:
    """Change a file and give it checksums that fit, as a faulty program of ours might."""
    tables, metadata = read_tables(path)
    copies = {name: np.array(table) for name, table in tables.items()}
    change(copies, metadata)
    write_tables(path, copies, metadata)


STORAGES = [
    STORED,
    Fidelity(mesh=COARSE),
    Fidelity(mesh=COARSE, precision="float64", averaging="mean"),
    Fidelity(mesh=COARSE, precision="float16", reduction=0.3),
]


@pytest.mark.parametrize("chosen", STORAGES, ids=lambda chosen: f"{chosen.precision} {chosen.averaging}")
def test_missing_misshapen_and_foreign_arrays_are_refused_by_name(chosen):
    """Every array in turn: what is wrong is said at once, not by what uses it."""
    whole = build_influence(LAYERED_PAD, chosen, progress=False)
    whole.check()
    for name, table in whole.tables.items():
        others = {key: array for key, array in whole.tables.items() if key != name}
        for damaged in (table[:-1], table[..., None], table.astype(np.complex64), table[:0], None):
            tables = others if damaged is None else {**others, name: damaged}
            with pytest.raises(CorruptInfluenceError, match=r"array '.*(missing|expected).*mjtactile build"):
                replace(whole, tables=tables).check()
    with pytest.raises(CorruptInfluenceError, match="does not have: 'compliance'"):
        replace(whole, tables={**whole.tables, "compliance": np.zeros(2)}).check()


def test_file_that_lacks_an_array_is_refused_though_its_checksums_fit(saved):
    mended(saved, lambda tables, _: tables.pop("mean +- 1 right"))
    with pytest.raises(CorruptInfluenceError, match=f"{saved.name} is not a whole.*'mean [+]- 1.*missing"):
        load_influence(saved)


INDICES = ["sampling indices 0", "sampling indptr 0", "sampling indices 2", "sampling indptr 2"]


@pytest.mark.parametrize("name", INDICES)
@pytest.mark.parametrize("value", [-1, 1, 1 << 20, -(1 << 31), (1 << 31) - 1])
def test_indices_that_point_outside_are_refused_before_they_are_used(name, value, small, saved):
    rng = np.random.default_rng(13)
    place = int(rng.integers(len(small.tables[name])))
    wrong = small.tables[name].copy()
    wrong[place] = value if value != 1 or "indptr" in name else 1 << 30

    def damage(tables, _metadata):
        tables[name] = wrong

    mended(saved, damage)
    with pytest.raises(CorruptInfluenceError, match="sample points of sensing layer"):
        load_influence(saved)
    by_hand = InfluenceMatrices(small.pad, small.fidelity, {**small.tables, name: wrong})
    with pytest.raises(CorruptInfluenceError, match="sample points of sensing layer"):
        _ = by_hand.averages
    with pytest.raises(CorruptInfluenceError, match="sample points of sensing layer"):
        core_pad(by_hand)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 2.0, -1.0])
def test_weights_that_are_no_mean_are_refused(wrong, saved):
    def damage(tables, _metadata):
        tables["sampling data 0"][3] = wrong

    mended(saved, damage)
    with pytest.raises(CorruptInfluenceError, match="do not sum to 1"):
        load_influence(saved)


@pytest.mark.parametrize("place", ["deviatoric ++ 0 right", "deviatoric +- 2 left", "mean -- 1 right", "compliance -+"])
def test_matrices_made_by_hand_do_not_reach_the_core_misshapen(place, small):
    assert place in small.tables
    tables = {**small.tables, place: small.tables[place][:-1]}
    with pytest.raises(CorruptInfluenceError, match=f"array '{place.replace('+', '[+]')}"):
        core_pad(replace(small, tables=tables), stress=True)


def test_a_file_is_compared_once_per_process_until_it_changes(saved, monkeypatch):
    compared = []
    monkeypatch.setattr(mjtactile._files.checksums, "checksum", lambda table: compared.append(1) or checksum(table))
    count = len(json.loads(_about(saved)["checksums"]))
    load_influence(saved)
    load_influence(saved)
    assert len(compared) == 2 * count  # just written: the file system's clock may not show the next change
    monkeypatch.setattr(mjtactile.influence.table, "_SETTLED", -60.0)
    load_influence(saved)
    compared.clear()
    load_influence(saved)
    assert compared == []
    os.utime(saved, ns=(1, 1))
    load_influence(saved)
    assert len(compared) == count


def _about(path: Path) -> dict[str, str]:
    from safetensors import safe_open

    with safe_open(path, framework="np") as file:
        return file.metadata()


@pytest.mark.parametrize("size", [0, 1, 7, 4095, 4096, 4097, 3 * 4096 * 128 + 5])
def test_checksum_depends_on_every_bit(size):
    rng = np.random.default_rng(size)
    content = rng.integers(256, size=size, dtype=np.uint8)
    own = checksum(content)
    assert checksum(content.copy()) == own
    assert checksum(np.append(content, np.uint8(0))) != own
    for _ in range(50 if size else 0):
        changed = content.copy()
        changed[rng.integers(size)] ^= 1 << rng.integers(8)
        assert checksum(changed) != own


def test_checksum_sees_words_and_pages_that_change_places():
    content = np.random.default_rng(3).integers(1 << 60, size=512 * 300)
    own = checksum(content)
    for a, b in ((0, 1), (5, 5 + 512), (7, 512 * 299)):
        changed = content.copy()
        changed[[a, b]] = content[[b, a]]
        assert checksum(changed) != own
    pages = content.reshape(-1, 512)[::-1]
    assert checksum(pages) != own
