"""The per-user cache: built once, repaired when damaged, and never in the way."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from filelock import FileLock
from small_pads import COARSE, LAYERED_PAD

import mjtactile.fem.mesh
import mjtactile.influence.build
import mjtactile.influence.cache
import mjtactile.influence.low_rank
import mjtactile.influence.provenance
from mjtactile.attach import attach_pad
from mjtactile.errors import InfluenceError, InfluenceWarning, PresetError
from mjtactile.fidelity import PRESETS, Fidelity, MeshDensity, as_fidelity
from mjtactile.influence.cache import CACHE_VARIABLE, build_influence, cache_directory, cached_path, influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.influence.storage import in_storage, narrowing_steps, plain_fidelity
from mjtactile.pad import Pad

#: The smallest mesh there is; builds in a few hundredths of a second.
TINY = MeshDensity(in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(1,))
TINY_FIDELITY = Fidelity(mesh=TINY)


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv(CACHE_VARIABLE, str(folder))
    return folder


@pytest.fixture
def builds(monkeypatch) -> list[Pad]:
    """The pads that were built, in order."""
    built = []
    build = mjtactile.influence.cache.build_influence

    def counted(pad, density, *, progress=True):
        built.append(pad)
        return build(pad, density, progress=progress)

    monkeypatch.setattr(mjtactile.influence.cache, "build_influence", counted)
    return built


def tiny(pad: Pad | None = None, *, cache: bool = True) -> InfluenceMatrices:
    return influence_matrices(pad, TINY_FIDELITY, progress=False, cache=cache)


@pytest.mark.parametrize("whole_is_cached", [False, True])
def test_tables_are_built_where_numpy_takes_rounding_to_zero_for_an_error(whole_is_cached):
    """Of far taxels, single precision rounds some responses to 0."""
    pad, fast = Pad(size=(20e-3, 20e-3)), as_fidelity("fast")
    if whole_is_cached:
        influence_matrices(pad, plain_fidelity(fast), progress=False)
    with np.errstate(all="raise"):
        assert influence_matrices(pad, fast, progress=False).fidelity == fast


def assert_same(first: InfluenceMatrices, second: InfluenceMatrices) -> None:
    assert set(first.tables) == set(second.tables)
    for name, table in first.tables.items():
        np.testing.assert_array_equal(second.tables[name], table)


def files(folder: Path) -> list[str]:
    """Names in the cache, lock files apart."""
    return sorted(p.name for p in folder.iterdir() if p.suffix != ".lock") if folder.exists() else []


def test_second_request_comes_from_the_cache(builds, cache):
    first, second = tiny(), tiny()
    assert len(builds) == 1
    assert_same(first, second)
    assert files(cache) == [cached_path(Pad(), TINY_FIDELITY).name]
    assert isinstance(first.tables["compliance ++"].base, np.memmap)


def test_pads_and_meshes_have_files_of_their_own(builds, cache):
    tiny()
    tiny(replace(Pad(), sampling_radius=0.5e-3))
    influence_matrices(Pad(), Fidelity(mesh=replace(TINY, points_per_axis=(2,))), progress=False)
    assert len(builds) == 3
    assert len(files(cache)) == 3


STORAGES = [
    {"precision": "float64"},
    {"precision": "float16"},
    {"precision": "int8"},
    {"reduction": 0.3},
    {"reduction": 0.1},
    {"averaging": "mean"},
    {"averaging": "quarters"},
    {"loads": "corners"},
]


def test_storages_have_files_of_their_own(cache):
    """And the plain table serves all that can be made of it."""
    chosen = [Fidelity(mesh=TINY, **choices) for choices in ({}, *STORAGES)]
    assert len({cached_path(Pad(), c) for c in chosen}) == len(chosen)
    assert cached_path(Pad(), chosen[0]) == cached_path(Pad(), TINY_FIDELITY)
    for c in chosen:
        found = influence_matrices(fidelity=c, progress=False)
        assert found.fidelity == c
        assert isinstance(found.tables["compliance ++"].base, np.memmap)
        again = build_influence(Pad(), c, progress=False)
        assert_same(found, again)
    assert len(files(cache)) == len(chosen)


def test_storage_is_derived_from_the_plain_table_where_there_is_one(builds):
    tiny()
    influence_matrices(fidelity=Fidelity(mesh=TINY, precision="float16"), progress=False)
    influence_matrices(fidelity=Fidelity(mesh=TINY, reduction=0.1), progress=False)
    assert len(builds) == 1
    influence_matrices(fidelity=Fidelity(mesh=TINY, precision="float64"), progress=False)  # float32 has lost too much
    assert len(builds) == 2


def test_storage_alone_is_built_without_keeping_the_plain_table(builds, cache):
    chosen = Fidelity(mesh=TINY, precision="float16")
    influence_matrices(fidelity=chosen, progress=False)
    assert len(builds) == 1
    assert files(cache) == [cached_path(Pad(), chosen).name]


def test_contact_law_and_cells_share_a_table(builds):
    tiny()
    for chosen in (Fidelity(mesh=TINY, law="elastic", cells=7), Fidelity(mesh=TINY, law="foundation")):
        assert influence_matrices(fidelity=chosen, progress=False).fidelity == chosen
        assert influence_matrices(fidelity=chosen, progress=False, cache=False).fidelity == chosen
    assert len(builds) == 3  # the first, and two that were told not to look


def test_a_coarser_mesh_is_warned_of_once_each_time_it_is_asked_for(cache):
    """By who builds the table, by who finds it in the cache, by who loads the file, and by the plugin."""
    pad, few = Pad(size=(30e-3, 30e-3)), Fidelity(mesh=replace(TINY, in_plane_size=0.5, most_elements=16))

    def plugin() -> None:
        spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="finger"/></worldbody></mujoco>')
        attach_pad(spec, body="finger", name="ff", pad=pad, fidelity=few)
        attach_pad(spec, body="finger", name="mf", pad=pad, fidelity=few)
        model = spec.compile()
        mujoco.mj_step(model, mujoco.MjData(model))

    asking = [
        lambda: influence_matrices(pad, few, cache=False),
        lambda: influence_matrices(pad, few),
        lambda: influence_matrices(pad, few),
        lambda: load_influence(cached_path(pad, few)),
        plugin,
    ]
    for ask in asking:
        with pytest.warns() as told:
            ask()
        assert [str(one.message)[:34] for one in told] == ["the mesh has 6 x 6 elements in the"]


def test_unknown_fidelity_lists_those_that_exist(builds):
    with pytest.raises(PresetError, match="Available: fast, balanced, precise, accurate"):
        influence_matrices(fidelity="quick")
    assert builds == []


@pytest.mark.parametrize("share", [0.0, 0.001, 0.7])
def test_truncated_file_is_rebuilt_with_a_warning(share, builds):
    first = tiny(cache=False)
    tiny()
    path = cached_path(Pad(), TINY_FIDELITY)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.warns(InfluenceWarning, match="cannot be used and is built anew.*not a whole influence table"):
        repaired = tiny()
    assert_same(first, repaired)
    assert len(builds) == 3
    tiny()
    assert len(builds) == 3


def test_table_of_another_pad_under_this_name_is_rebuilt(cache):
    other = replace(Pad(), sampling_radius=0.5e-3)
    tiny(other)
    cached_path(other, TINY_FIDELITY).rename(cached_path(Pad(), TINY_FIDELITY))
    with pytest.warns(InfluenceWarning, match="built for a"):
        assert tiny().pad == Pad()
    assert tiny().pad == Pad()


def test_new_format_version_is_built_anew(builds, monkeypatch):
    tiny()
    monkeypatch.setattr(
        mjtactile.influence.provenance, "FORMAT_VERSION", mjtactile.influence.provenance.FORMAT_VERSION + 1
    )
    tiny()
    assert len(builds) == 2


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_table_fits_on_machines_whose_numpy_rounds_otherwise(fidelity, monkeypatch):
    """As of another version of NumPy, or on a processor without some instructions."""
    mesh, density = mjtactile.fem.mesh, as_fidelity(fidelity).density
    here, graded = cached_path(Pad(), fidelity), mesh._graded_sizes
    vertices = mesh.sheet_mesh(Pad(), density).z.vertices
    monkeypatch.setattr(mesh, "_graded_sizes", lambda *arguments: np.nextafter(graded(*arguments), 1.0))
    assert (mesh.sheet_mesh(Pad(), density).z.vertices != vertices).any()
    assert cached_path(Pad(), fidelity) == here


def test_without_cache_nothing_is_read_or_written(builds, cache):
    tiny(cache=False)
    assert not cache.exists()
    tiny()
    tiny(cache=False)
    assert len(builds) == 3


def test_folder_that_cannot_be_made_costs_a_warning_only(cache):
    cache.write_text("a file stands where the folder should")
    with pytest.warns(InfluenceWarning, match=f"could not be kept in .*Free space there, or point {CACHE_VARIABLE}"):
        found = tiny()
    assert_same(found, tiny(cache=False))


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_folder_that_cannot_be_written_costs_a_warning_only(cache):
    cache.mkdir(mode=0o500)
    with pytest.warns(InfluenceWarning, match="could not be kept"):
        assert tiny().pad == Pad()


def test_lock_that_cannot_be_had_costs_a_warning_only(monkeypatch):
    """Some network drives know no locks."""

    def refuse(*_args, **_kwargs):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("filelock.FileLock.acquire", refuse)
    with pytest.warns(InfluenceWarning, match="No locks available"):
        assert tiny().pad == Pad()


def test_full_disk_costs_a_warning_only(cache, monkeypatch):
    def full(*_args, **_kwargs):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("safetensors.numpy.save_file", full)
        with pytest.warns(InfluenceWarning, match="No space left on device"):
            found = tiny()
    assert files(cache) == []
    assert_same(found, tiny())


def test_two_processes_at_once_make_one_table(cache):
    """Both ask before either has built; one builds, the other waits, and both have the same."""
    code = """
import os, sys, time
from pathlib import Path
import mjtactile.influence.cache as cache
from mjtactile.fidelity import Fidelity
from mjtactile.pad import Pad
from mjtactile.fem.mesh import MeshDensity
build = cache.build_influence
def slow(*args, **kwargs):
    print("builds", flush=True)
    time.sleep(1.0)
    return build(*args, **kwargs)
cache.build_influence = slow
density = MeshDensity(in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(1,))
ready = Path(sys.argv[1])
ready.touch()
deadline = time.monotonic() + 60
while len(list(ready.parent.glob("ready-*"))) < 2 and time.monotonic() < deadline:
    time.sleep(0.01)
found = cache.influence_matrices(Pad(), Fidelity(mesh=density), progress=False)
print("sum", found.tables["compliance ++"].sum().hex(), flush=True)
"""
    ready = cache.parent / "ready"
    ready.mkdir()
    runs = [
        subprocess.Popen(
            [sys.executable, "-W", "error", "-c", code, str(ready / f"ready-{i}")], stdout=subprocess.PIPE, text=True
        )
        for i in range(2)
    ]
    output = [run.communicate(timeout=120)[0].split("\n") for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    sums = {line for lines in output for line in lines if line.startswith("sum")}
    assert len(sums) == 1
    assert sum(lines.count("builds") for lines in output) == 1
    assert len(files(cache)) == 1


def test_what_killed_builders_left_is_removed_unless_somebody_writes_it(cache):
    """The same table's and other tables', but not one whose lock is held, nor anybody else's file."""
    cache.mkdir()
    own, other = cached_path(Pad(), TINY_FIDELITY), cached_path(LAYERED_PAD, Fidelity(mesh=COARSE))
    busy = cache / "influence-0123456789abcdef0123.safetensors"
    dead = [cache / f".{path.stem}-k2_x1a8z.partial" for path in (own, other)]
    alive = [cache / f".{busy.stem}-abcdefgh.partial", cache / ".another-program.partial"]
    for partial in (*dead, *alive):
        partial.write_bytes(b"half")
    with FileLock(busy.with_suffix(".lock")):
        tiny()
    assert [p.exists() for p in dead] == [False, False]
    assert [p.exists() for p in alive] == [True, True]
    tiny(replace(Pad(), sampling_radius=0.5e-3))
    assert [p.exists() for p in alive] == [False, True]


def test_builder_killed_while_it_writes_leaves_nothing_for_long(cache):
    code = """
import os, signal
import safetensors.numpy
import mjtactile.influence.cache as cache
from mjtactile.fidelity import Fidelity
from mjtactile.fem.mesh import MeshDensity
write = safetensors.numpy.save_file
def die(*args, **kwargs):
    write(*args, **kwargs)
    os.kill(os.getpid(), signal.SIGKILL)
safetensors.numpy.save_file = die
density = MeshDensity(in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(1,))
cache.influence_matrices(fidelity=Fidelity(mesh=density), progress=False)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert run.returncode == -9
    assert [name.endswith(".partial") for name in files(cache)] == [True]
    tiny()
    assert files(cache) == [cached_path(Pad(), TINY_FIDELITY).name]


def test_a_build_says_what_it_does_and_where_it_is_kept_once(cache, capfd):
    for lines in (1, 0):
        influence_matrices(fidelity=TINY_FIDELITY)
        said = capfd.readouterr().err.splitlines()
        assert len(said) == lines
        assert all("building influence matrices at fidelity" in one and str(cache) in one for one in said)
    cached_path(Pad(), TINY_FIDELITY).unlink()
    tiny()
    assert capfd.readouterr().err == ""


def test_who_waits_for_another_builder_says_for_what(cache, capfd, monkeypatch):
    """As for a builder that was stopped; one that is quick is waited for in silence."""
    monkeypatch.setattr(mjtactile.influence.cache, "_SILENT_WAIT", 0.2)
    cache.mkdir()
    lock = FileLock(cached_path(Pad(), TINY_FIDELITY).with_suffix(".lock"), thread_local=False)
    for held, lines in ((0.05, 0), (0.6, 1)):
        lock.acquire()
        released = threading.Timer(held, lock.release)
        released.start()
        tiny()
        released.join()
        said = capfd.readouterr().err
        assert said.count("waiting for another process") == lines
        assert (lock.lock_file in said and CACHE_VARIABLE in said) == bool(lines)
        cached_path(Pad(), TINY_FIDELITY).unlink()


def test_oblong_layered_pads_are_cached_too():
    first = influence_matrices(LAYERED_PAD, Fidelity(mesh=COARSE), progress=False)
    assert_same(first, influence_matrices(LAYERED_PAD, Fidelity(mesh=COARSE), progress=False, cache=False))


def test_cache_is_where_the_variable_says(cache, monkeypatch):
    assert cache_directory() == cache
    monkeypatch.setenv(CACHE_VARIABLE, "~/elsewhere")
    assert cache_directory() == Path.home() / "elsewhere"
    monkeypatch.delenv(CACHE_VARIABLE)
    assert cache_directory().name == "mjtactile"


@pytest.mark.parametrize("chosen", [None, "~/tables", "~no-such-user/tables"])
def test_a_home_folder_that_nobody_knows_is_an_error_that_says_what_to_set(chosen, monkeypatch):
    """As for a user id of a container that the container has no user for."""

    def unknown(_user):
        raise KeyError("no such user")

    monkeypatch.setattr("pwd.getpwuid", unknown)
    for name in ("HOME", "XDG_CACHE_HOME", CACHE_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    if chosen is not None:
        monkeypatch.setenv(CACHE_VARIABLE, chosen)
    with pytest.raises(InfluenceError, match=f"no such home folder.*in the variable {CACHE_VARIABLE}"):
        influence_matrices(fidelity="fast", progress=False)


def test_progress_counts_every_step():
    """What the progress bar was promised is what it gets."""
    steps = []
    for pad, density in ((Pad(), TINY), (LAYERED_PAD, COARSE)):
        steps.clear()
        for _ in mjtactile.influence.build.build_tables(pad, density, on_step=lambda: steps.append(1)):
            pass
        assert len(steps) == mjtactile.influence.build.build_steps(pad, density)


@pytest.mark.parametrize("reduction", [0.0, 0.1])
def test_the_bar_moves_until_the_table_is_whole(reduction, cache, monkeypatch):
    """Reducing takes a quarter of the time; a bar that was full before would say nothing through it."""
    asked, moved, reduced = [], [], []

    @contextmanager
    def bar(_, total, **__):
        asked.append(total)
        yield moved.append

    layer = mjtactile.influence.low_rank._reduced_layer
    monkeypatch.setattr(mjtactile.influence.cache, "progress_bar", bar)
    monkeypatch.setattr(
        mjtactile.influence.low_rank, "_reduced_layer", lambda *a: (reduced.append(sum(moved) / asked[0]), layer(*a))[1]
    )
    build_influence(Pad(), Fidelity(mesh=TINY, reduction=reduction))
    assert sum(moved) == pytest.approx(asked[0])
    assert len(reduced) == (2 * Pad().sensing_layers if reduction else 0)
    assert reduced == sorted(set(reduced))  # a little further with every layer
    assert all(share < 1.0 for share in reduced)


def test_a_table_derived_from_another_counts_every_step(cache, monkeypatch):
    steps = []
    plain = build_influence(Pad(), Fidelity(mesh=TINY), progress=False)
    chosen = Fidelity(mesh=TINY, precision="float16")
    in_storage(plain, chosen, lambda: steps.append(1))
    assert len(steps) == narrowing_steps(Pad(), plain.fidelity, chosen) == 2 * Pad().sensing_layers


def test_cached_table_starts_without_the_finite_element_library(cache):
    tiny()
    code = """
import sys
import mjtactile.influence.cache as cache
from mjtactile.fidelity import Fidelity
from mjtactile.fem.mesh import MeshDensity
density = MeshDensity(in_plane_size=2.0, through_size=0.5, rim_grading=1.0, base_grading=1.0, points_per_axis=(1,))
cache.influence_matrices(fidelity=Fidelity(mesh=density))
print(sorted({"skfem", "torch", "mujoco", "matplotlib"} & set(sys.modules)))
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
