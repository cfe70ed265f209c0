"""Tables on disk: whole or not there, mapped, and refused when damaged or meant for something else."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_pads import COARSE, LAYERED_PAD

import mjtactile.influence.provenance
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import CorruptInfluenceError, InfluenceError, OutputError, StaleInfluenceError
from mjtactile.fem.mesh import mesh_description, sheet_mesh
from mjtactile.fem.symmetry import Parity
from mjtactile.fidelity import MESHES, Fidelity, MeshDensity, fidelity_summary
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.influence.cache import build_influence
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.influence.provenance import influence_fingerprint
from mjtactile.influence.table import FORMAT_VERSION, read_tables, table_name, write_tables
from mjtactile.pad import Pad

TABLES = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1, 2], dtype=np.int32), "c": np.ones(3, dtype=np.float32)}
META = {"note": "äöü", "numbers": [1, 2.5]}


@pytest.fixture(scope="module")
def small() -> InfluenceMatrices:
    return build_influence(LAYERED_PAD, Fidelity(mesh=COARSE), progress=False)


@pytest.fixture
def saved(small, tmp_path) -> Path:
    path = tmp_path / "table.safetensors"
    small.save(path)
    return path


def test_arrays_and_metadata_come_back(tmp_path):
    path = tmp_path / "new" / "folder" / "t.safetensors"
    write_tables(path, dict(TABLES), META)
    tables, metadata = read_tables(path)
    assert metadata == META
    assert set(tables) == set(TABLES)
    for name, array in TABLES.items():
        assert tables[name].dtype == array.dtype
        np.testing.assert_array_equal(tables[name], array)


def test_writing_replaces_an_older_file(tmp_path):
    path = tmp_path / "t.safetensors"
    path.write_bytes(b"old")
    write_tables(path, dict(TABLES), META)
    assert read_tables(path)[1] == META
    assert list(tmp_path.iterdir()) == [path]


def test_written_file_can_be_read_by_others(tmp_path):
    path = tmp_path / "t.safetensors"
    write_tables(path, dict(TABLES), META)
    assert path.stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize("step", ["save_file", "fsync", "replace"])
def test_failure_at_any_step_leaves_nothing_behind(step, tmp_path, monkeypatch):
    """A full disk while writing, flushing or renaming: the old file stays, no partial one does."""
    path = tmp_path / "t.safetensors"
    write_tables(path, dict(TABLES), META)
    before = path.read_bytes()

    def full(*_args, **_kwargs):
        raise OSError(errno.ENOSPC, "No space left on device")

    if step == "save_file":
        monkeypatch.setattr("safetensors.numpy.save_file", full)
    elif step == "fsync":
        monkeypatch.setattr(os, "fsync", full)
    else:
        monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        write_tables(path, {"a": np.zeros(2)}, {})
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == before


def test_a_link_is_followed_and_what_it_leads_to_gets_the_table(small, tmp_path):
    real, link = tmp_path / "real.table", tmp_path / "link.table"
    real.write_bytes(b"old")
    link.symlink_to(real.name)
    small.save(link)
    assert link.is_symlink()
    assert load_influence(real).pad == small.pad


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pipe", r"pipe: it is a pipe"),
        ("folder", r"folder: it is a folder"),
        ("a\0b", r"cannot write"),
        ("file/below/t.table", r"cannot make the folder"),
        ("a\0b/t.table", r"cannot make the folder"),
    ],
)
def test_only_regular_files_are_replaced(name, said, small, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_bytes(b"kept")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(OutputError, match=said) as refusal:
        small.save(tmp_path / name)
    assert ".partial" not in str(refusal.value)
    assert (tmp_path / "pipe").is_fifo()
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("path", [None, 3, b"tables.mjt"], ids=str)
def test_the_name_of_a_table_is_a_text(small, path):
    with pytest.raises(OutputError, match=r"path is of type \w+; expected a path"):
        small.save(path)
    with pytest.raises(InfluenceError, match=r"path is of type \w+; expected a path"):
        load_influence(path)


def test_a_write_protected_table_is_not_replaced(small, saved, monkeypatch):
    before = saved.read_bytes()
    # The tests' user may be root, to whom no file is protected.
    monkeypatch.setattr(os, "access", lambda _path, mode: mode != os.W_OK)
    with pytest.raises(OutputError, match="write-protected"):
        small.save(saved)
    assert saved.read_bytes() == before


def test_a_table_may_have_the_longest_name(small, tmp_path):
    path = tmp_path / ("ä" * 127)
    small.save(path)
    assert list(tmp_path.iterdir()) == [path]


def test_disk_that_fills_up_while_writing_leaves_nothing_behind(tmp_path):
    """The system really refuses to write more than 64 kB here; in a process of its own, since the limit stays."""
    code = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from mjtactile.influence.table import write_tables
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 16, resource.RLIM_INFINITY))
try:
    write_tables(Path(sys.argv[1]), {"a": np.zeros(1 << 16)}, {})
except OSError as error:
    print("refused:", error)
"""
    path = tmp_path / "t.safetensors"
    run = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert run.stdout.startswith("refused:")
    assert list(tmp_path.iterdir()) == []


def test_missing_file_says_how_to_make_it(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"InfluenceMatrices\.save writes such a file"):
        load_influence(tmp_path / "nothing.safetensors")


@pytest.mark.parametrize(
    "content",
    [b"garbage" * 1000, b"\0" * 4096, b"\xff" * 4096, b"\x08" + b"\0" * 7 + b"not json"],
    ids=lambda b: str(b[:9]),
)
def test_garbage_is_refused(content, saved):
    saved.write_bytes(content)
    with pytest.raises(CorruptInfluenceError, match="mjtactile build"):
        load_influence(saved)


def test_file_of_another_program_is_refused(tmp_path):
    from safetensors.numpy import save_file

    path = tmp_path / "weights.safetensors"
    save_file({"weights": np.zeros(3)}, path)
    with pytest.raises(CorruptInfluenceError, match="not a whole influence table"):
        load_influence(path)


@pytest.mark.parametrize(
    "metadata", [{}, {"pad": {"size": 3}}, {"pad": None, "density": None, "fingerprint": ""}], ids=str
)
def test_table_without_a_pad_is_refused(metadata, tmp_path):
    path = tmp_path / "t.safetensors"
    write_tables(path, dict(TABLES), metadata)
    with pytest.raises(CorruptInfluenceError, match="describes no pad"):
        load_influence(path)


def test_saved_matrices_come_back_without_naming_the_pad(small, saved):
    loaded = load_influence(saved)
    assert loaded.pad == small.pad
    assert loaded.density == small.density
    assert set(loaded.tables) == set(small.tables)
    for name, table in small.tables.items():
        np.testing.assert_array_equal(loaded.tables[name], table)
        assert loaded.tables[name].dtype == table.dtype


VARIANTS = [
    {"precision": "float64"},
    {"precision": "float16"},
    {"reduction": 0.1},
    {"precision": "float16", "reduction": 0.1, "law": "elastic", "cells": 50},
    {"precision": "int8", "reduction": 0.1},
    {"precision": ("float16", "int8"), "reduction": 0.1},
    {"averaging": "mean"},
    {"averaging": "quarters", "loads": "corners", "precision": "int8"},
]


@pytest.mark.parametrize("choices", VARIANTS, ids=str)
def test_every_storage_comes_back(choices, tmp_path):
    chosen = Fidelity(mesh=COARSE, **choices)
    built = build_influence(LAYERED_PAD, chosen, progress=False)
    path = tmp_path / "t.safetensors"
    built.save(path)
    loaded = load_influence(path)
    assert loaded.fidelity == chosen
    assert load_influence(path, fidelity=chosen).fidelity == chosen
    assert set(loaded.tables) == set(built.tables)
    footprint = Footprint.from_outline(indenter_outline("star", scale=0.4), built.surface)
    load = contact_load(built, footprint, (0.02, 0.01, -0.1))
    np.testing.assert_array_equal(loaded.readings(load), built.readings(load))
    np.testing.assert_array_equal(loaded.stress(load), built.stress(load))
    with pytest.raises(StaleInfluenceError, match="the pad, the mesh, the storage or the version"):
        load_influence(path, fidelity=Fidelity(mesh=COARSE))


def test_each_layer_is_stored_in_its_own_precision():
    """The upper layer of the pad in half precision, the lower one in bytes; whole matrices, so each is one array."""
    chosen = Fidelity(mesh=COARSE, precision=("float16", "int8"))
    built = build_influence(LAYERED_PAD, chosen, progress=False)
    assert LAYERED_PAD.sensing_layers > 1
    for parity in built.mirrors.classes:
        for kind in ("deviatoric", "mean"):
            dtypes = [built.tables[table_name(kind, parity, k)].dtype for k in range(LAYERED_PAD.sensing_layers)]
            assert dtypes == [np.float16, *[np.int8] * (LAYERED_PAD.sensing_layers - 1)]
    # Deep layers lose what bytes lose, the top one what half precision does.
    whole = build_influence(LAYERED_PAD, Fidelity(mesh=COARSE), progress=False)
    load = contact_load(
        whole, Footprint.from_outline(indenter_outline("star", scale=0.4), whole.surface), (0.02, 0.01, -0.1)
    )
    found, expected = built.readings(load), whole.readings(load)
    errors = np.linalg.norm(found - expected, axis=(1, 2)) / np.linalg.norm(expected, axis=(1, 2))
    assert errors[0] < 3e-4
    assert (errors[1:] > 1e-5).all()
    assert (errors[1:] < 1e-2).all()


def test_defaults_leave_no_trace_in_the_fingerprint():
    """Tables from before loads and averaging could be chosen stay valid, but for those whose ranks parted pairs."""
    mesh = mesh_description(sheet_mesh(Pad(), MESHES["draft"]), MESHES["draft"])

    def before(reduction: float) -> str:
        said = [FORMAT_VERSION, Pad().description, mesh, "float16", reduction]
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()

    chosen, known = Fidelity(mesh="draft", precision="float16"), before(0.0)
    assert influence_fingerprint(Pad(), chosen) == known
    assert influence_fingerprint(Pad(), replace(chosen, reduction=0.01)) != before(0.01)
    others = [
        replace(chosen, loads="corners"),
        replace(chosen, averaging="mean"),
        replace(chosen, averaging="quarters"),
    ]
    assert len({known, *(influence_fingerprint(Pad(), other) for other in others)}) == 4


def test_contact_law_may_change_without_the_table(saved):
    chosen = Fidelity(mesh=COARSE, law="elastic", cells=60)
    assert load_influence(saved, fidelity=chosen).fidelity == chosen


@pytest.mark.parametrize("wrong", [{"precision": "float8"}, {"colour": "blue"}, 3], ids=str)
def test_table_of_an_unknown_storage_is_refused(wrong, saved):
    tables, metadata = read_tables(saved)
    metadata["fidelity"] = wrong
    write_tables(saved, {name: np.array(table) for name, table in tables.items()}, metadata)
    with pytest.raises(CorruptInfluenceError, match="mjtactile build"):
        load_influence(saved)


def test_wrong_pad_is_refused_naming_both(saved):
    wrong = replace(LAYERED_PAD, sampling_radius=0.4e-3, depths=(1e-3,))
    with pytest.raises(StaleInfluenceError) as refusal:
        load_influence(saved, wrong)
    assert LAYERED_PAD.summary in str(refusal.value)
    assert wrong.summary in str(refusal.value)
    assert "mjtactile build" in str(refusal.value)


@pytest.mark.parametrize("mesh", ["draft", replace(COARSE, points_per_axis=(3,)), replace(COARSE, rim_grading=1.6)])
def test_wrong_mesh_is_refused(mesh: str | MeshDensity, saved):
    assert load_influence(saved, fidelity=Fidelity(mesh=COARSE)).density == COARSE
    chosen = Fidelity(mesh=mesh)
    with pytest.raises(StaleInfluenceError, match="Ask for its fidelity, or leave fidelity out") as refusal:
        load_influence(saved, fidelity=chosen)
    for said in (Fidelity(mesh=COARSE), chosen):
        assert f"at fidelity {fidelity_summary(said)}" in str(refusal.value)


def test_other_format_version_is_refused(saved, monkeypatch):
    monkeypatch.setattr(
        mjtactile.influence.provenance, "FORMAT_VERSION", mjtactile.influence.provenance.FORMAT_VERSION + 1
    )
    with pytest.raises(StaleInfluenceError, match="version"):
        load_influence(saved)


def test_named_table_is_loaded_fast(draft, tmp_path):
    path = tmp_path / "draft.safetensors"
    draft.save(path)
    took = []
    for _ in range(3):  # other tests may run beside one of them
        start = time.perf_counter()
        load_influence(path, Pad(), Fidelity(mesh="draft"))
        took.append(time.perf_counter() - start)
    assert min(took) <= 0.2


def test_loading_maps_and_does_not_copy(tmp_path):
    """A table of 256 MB is compared with its checksums without coming into this process's own memory."""
    code = """
import sys
from pathlib import Path
from mjtactile.influence.table import read_tables
def own():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("RssAnon"))
read_tables(Path(sys.argv[1]).with_name("small.safetensors"))
before = own()
tables, _ = read_tables(Path(sys.argv[1]))
assert tables["a"][-1] == 0.0
print(own() - before)
"""
    if not Path("/proc/self/status").exists():
        pytest.skip("only Linux tells a process's own memory from what it maps")
    write_tables(tmp_path / "small.safetensors", dict(TABLES), META)
    path = tmp_path / "large.safetensors"
    write_tables(path, {"a": np.zeros(1 << 25)}, META)
    run = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert int(run.stdout) < 16 * 1024  # kB, of 262,144


def test_mapped_tables_cannot_be_changed(saved):
    table = next(iter(load_influence(saved).tables.values()))
    with pytest.raises(ValueError, match="read-only"):
        table[...] = 0


def test_tables_are_named_by_class_and_layer():
    assert table_name("deviatoric", Parity(1, -1), 3) == "deviatoric +- 3"
    assert table_name("compliance", Parity(-1, 1)) == "compliance -+"


def test_size_is_that_of_all_arrays(small):
    assert small.nbytes == sum(table.nbytes for table in small.tables.values())
    assert MESHES.keys() == {"draft", "default", "even", "fine"}
