from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from mjtactile import Footprint, Pad, contact_load, influence_matrices
from mjtactile.dataset import files as dataset_module
from mjtactile.dataset.by_law import physics_readings
from mjtactile.dataset.files import make_dataset, read_dataset
from mjtactile.dataset.part import press_columns
from mjtactile.dataset.sampling import outline_presses
from mjtactile.dataset.shapes import placed, shape_indenter, sized_face
from mjtactile.dataset.spec import parse_spec
from mjtactile.errors import DatasetError, DatasetWarning, DistributeError, OutputError, SceneError

PUNCHES = {"shapes": ["star", "triangle", "cross"], "size": [0.7, 1.0], "shift": 1.5}
SPEC = parse_spec({"presses": 20, "seed": 4, "fidelity": "fast", "poses": 2, "forces": 2, "contact": [PUNCHES]})


@pytest.fixture(autouse=True)
def _small_parts(monkeypatch):
    monkeypatch.setattr(dataset_module, "_PRESSES_PER_PART", 8)


@pytest.fixture(scope="module")
def fast():
    return influence_matrices(fidelity="fast", progress=False)


def same(one, other):
    np.testing.assert_array_equal(one.readings, other.readings)
    for name, column in one.labels.items():
        np.testing.assert_array_equal(column, other.labels[name], err_msg=name)


def test_readings_are_those_of_the_contact_the_labels_describe(tmp_path, fast):
    make_dataset(SPEC, tmp_path, progress=False)
    data = read_dataset(tmp_path)
    assert data.readings.shape == (20, 4, 13, 13)
    for k in (0, 7, 19):
        labels = {name: column[k] for name, column in data.labels.items()}
        face = sized_face(labels["shape"], labels["size"])
        at = placed(face, (labels["shift_x"], labels["shift_y"]), labels["rotation"])
        load = contact_load(fast, Footprint.from_outline(at, fast.surface), data.forces[k])
        np.testing.assert_allclose(data.readings[k], fast.readings(load), rtol=0, atol=2e-4 * data.readings[k].max())
        force, moment = load.resultant()
        np.testing.assert_allclose([moment[1], -moment[0]] / -force[2], data.positions[k], atol=1e-9)


def test_an_interrupted_dataset_goes_on_to_the_same_presses(tmp_path):
    make_dataset(SPEC, tmp_path / "whole", progress=False)
    make_dataset(replace(SPEC, presses=9), tmp_path / "parts", progress=False)
    assert read_dataset(tmp_path / "parts").labels["press"].tolist() == list(range(9))
    (tmp_path / "parts" / "presses-000000000.parquet").unlink()
    assert make_dataset(SPEC, tmp_path / "parts", progress=False) == 20
    assert make_dataset(SPEC, tmp_path / "parts", progress=False) == 0
    same(read_dataset(tmp_path / "whole"), read_dataset(tmp_path / "parts"))


@pytest.mark.slow
def test_presses_do_not_depend_on_how_many_workers_there_are(tmp_path):
    make_dataset(SPEC, tmp_path / "one", workers=1, progress=False)
    make_dataset(SPEC, tmp_path / "two", workers=2, progress=False)
    same(read_dataset(tmp_path / "one"), read_dataset(tmp_path / "two"))


def test_another_seed_gives_other_presses_and_no_two_are_alike(tmp_path):
    make_dataset(SPEC, tmp_path / "one", progress=False)
    make_dataset(replace(SPEC, seed=5), tmp_path / "other", progress=False)
    one, other = read_dataset(tmp_path / "one").readings, read_dataset(tmp_path / "other").readings
    assert len(np.unique(np.concatenate([one, other]).reshape(40, -1), axis=0)) == 40


def test_a_folder_of_another_dataset_is_refused(tmp_path):
    make_dataset(SPEC, tmp_path, progress=False)
    with pytest.raises(DatasetError, match="another specification"):
        make_dataset(replace(SPEC, seed=5), tmp_path, progress=False)


def test_files_carry_the_pads_fingerprint_for_readers_without_this_package(tmp_path):
    make_dataset(SPEC, tmp_path, progress=False)
    table = pq.read_table(tmp_path)
    metadata = json.loads(table.schema.metadata[b"mjtactile"])
    assert metadata["pad_fingerprint"] == Pad().fingerprint
    assert metadata["spec"]["seed"] == 4
    assert table["readings"].type.list_size == 676
    assert len(read_dataset(tmp_path, labels_only=True).readings) == 0


def test_noise_is_what_was_asked_for_and_comes_from_the_presses_seed(tmp_path):
    make_dataset(SPEC, tmp_path / "quiet", progress=False)
    make_dataset(replace(SPEC, noise=(0.01, 0.01)), tmp_path / "noisy", progress=False)
    quiet, noisy = read_dataset(tmp_path / "quiet").readings, read_dataset(tmp_path / "noisy").readings
    relative = (noisy - quiet).reshape(20, -1).std(axis=1) / quiet.max(axis=(1, 2, 3))
    np.testing.assert_allclose(relative, 0.01, rtol=0.15)


def test_a_transducer_reports_in_its_own_counts(tmp_path):
    transducer = {"name": "piezoresistive", "full_scale": 1e5, "imperfections": {"adc_bits": 6}}
    make_dataset(replace(SPEC, presses=4, transducer=transducer), str(tmp_path), progress=False)
    assert len(np.unique(read_dataset(str(tmp_path)).readings)) < 64


@pytest.mark.parametrize("transducer", [None, {"name": "piezoresistive"}])
def test_presses_that_do_not_settle_are_left_out_whatever_reports_them(monkeypatch, transducer):
    spec = replace(SPEC, transducer=transducer, noise=(0.01, 0.01))
    presses = outline_presses(spec, 0)
    whole = press_columns(spec, presses)

    def but_one(influence, presses):
        readings, forces, points = physics_readings(influence, presses)
        readings[1] = np.nan
        return readings, forces, points

    monkeypatch.setattr("mjtactile.dataset.by_law.physics_readings", but_one)
    settled = press_columns(spec, presses)
    assert settled["press"].tolist() == [0, 2, 3]
    np.testing.assert_array_equal(settled["readings"], whole["readings"][[0, 2, 3]])


def test_a_folder_without_presses_says_how_to_make_some(tmp_path):
    with pytest.raises(DatasetError, match="mjtactile dataset"):
        read_dataset(tmp_path)


@pytest.mark.parametrize("free", [False, True])
def test_mujoco_and_the_contact_laws_agree_within_the_creep_of_a_press(tmp_path, free):
    kinds = [{"shapes": ["triangle"], "shift": 1.0}, {"shapes": ["sphere"], "shift": 1.0, "weight": 1}]
    spec = parse_spec(
        {"presses": 8, "fidelity": "fast", "poses": 2, "forces": 1, "free": float(free), "seed": 6, "contact": kinds}
    )
    make_dataset(spec, tmp_path / "physics", progress=False)
    make_dataset(replace(spec, backend="mujoco"), tmp_path / "mujoco", progress=False)
    physics, mujoco = read_dataset(tmp_path / "physics"), read_dataset(tmp_path / "mujoco")
    assert set(physics.labels["shape"]) == {"triangle", "sphere"}
    # A press drags the indenter along by up to 20 micrometres and is settled within 1e-4 of its force.
    np.testing.assert_allclose(mujoco.positions, physics.positions, atol=30e-6)
    np.testing.assert_allclose(mujoco.forces, physics.forces, atol=3e-4 * 2)
    largest = physics.readings.max(axis=(1, 2, 3), keepdims=True)
    np.testing.assert_allclose(mujoco.readings / largest, physics.readings / largest, atol=0.04)


def test_a_dataset_is_not_continued_with_another_mesh_of_the_same_name(tmp_path):
    mesh = tmp_path / "tool.stl"
    shape_indenter("square", 0.4).solid.export(mesh)
    spec = parse_spec({"presses": 4, "fidelity": "fast", "law": "uniform", "contact": [{"shapes": [str(mesh)]}]})
    make_dataset(spec, tmp_path / "set", progress=False)
    shape_indenter("square", 0.6).solid.export(mesh)
    with pytest.raises(DatasetError, match="with other mesh files"):
        make_dataset(replace(spec, presses=8), tmp_path / "set", progress=False)


@pytest.mark.parametrize("backend", ["physics", "mujoco"])
def test_a_body_that_would_miss_the_pad_is_refused_before_any_press_is_made(tmp_path, monkeypatch, backend):
    kinds = [{"shapes": ["star", "sphere"], "shift": 11 if backend == "physics" else 15}]
    values = {"presses": 400, "fidelity": "fast", "law": "uniform", "contact": kinds, "backend": backend}
    spec = parse_spec(values)
    monkeypatch.setattr(dataset_module, "make_files", lambda *_: pytest.fail("work began"))
    with pytest.raises(DatasetError, match=r"press \d+, a (star|sphere).*misses the pad.*shift.*smaller shift"):
        make_dataset(spec, tmp_path, progress=False)
    assert not list(tmp_path.glob("*.parquet"))


@pytest.mark.parametrize("backend", ["physics", "mujoco"])
def test_bodies_that_reach_over_the_edge_may_press(tmp_path, backend):
    kinds = [{"shapes": ["star", "sphere"], "shift": 10, "tilt": 0}]
    values = {"presses": 24, "fidelity": "fast", "law": "uniform", "contact": kinds, "backend": backend}
    spec = parse_spec(values)
    assert make_dataset(spec, tmp_path, progress=False) == 24
    assert np.abs(read_dataset(tmp_path).shifts).max() > 7.5e-3


# Friction of 0.8 holds forces tilted by up to 38.7 degrees; under larger ones bodies slide.
SLIDING = parse_spec(
    {
        **{"presses": 12, "fidelity": "fast", "law": "uniform", "poses": 1, "forces": 2, "backend": "mujoco"},
        "contact": [{"shapes": ["square"], "force": 50, "tilt": 60, "upright": 0.5}],
    }
)


def test_how_many_presses_did_not_settle_is_said(tmp_path):
    with pytest.warns(DatasetWarning, match=r"^\d+ of 12 presses were left out: bodies did not settle") as said:
        made = make_dataset(SLIDING, tmp_path, progress=False)
    assert 0 < made < 12
    assert str(said[0].message).startswith(f"{12 - made} of 12")
    assert len(read_dataset(tmp_path).readings) == made


def test_a_dataset_of_which_nothing_settled_is_refused_each_time(tmp_path):
    contact = replace(SLIDING.contacts[0], upright=0.0)
    for _ in range(2):
        with pytest.raises(DatasetError, match=r"all 4 presses were left out: bodies did not settle.*is empty"):
            make_dataset(replace(SLIDING, contacts=(contact,), presses=4), tmp_path, progress=False)


def test_a_press_that_is_refused_is_not_one_that_did_not_settle(monkeypatch):
    """Only a press whose simulation began is left out."""
    monkeypatch.setattr("mjtactile.dataset.spec._check_forces", lambda _: None)
    contact = replace(SLIDING.contacts[0], force=(5.0, 5.0))
    spec = replace(SLIDING, contacts=(contact,))
    with pytest.raises(SceneError, match="exceeds the actuators' range"):
        press_columns(spec, outline_presses(spec, 0))


def test_workers_may_be_whole_numbers_of_numpy(tmp_path):
    workers: Any = np.int64(1)
    assert make_dataset(replace(SPEC, presses=4), tmp_path, workers=workers, progress=False) == 4


@pytest.mark.parametrize("workers", [None, 1.0, True, "ray", "2"])
def test_workers_that_are_no_number_are_refused(tmp_path, workers):
    with pytest.raises(DistributeError, match=r"workers = .*expected a whole number of at least 1"):
        make_dataset(SPEC, tmp_path, workers=workers, progress=False)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", [None, 3, b"set"])
def test_a_folder_that_is_no_path_is_refused(path):
    for use in (lambda: read_dataset(path), lambda: make_dataset(SPEC, path, progress=False)):
        with pytest.raises(DatasetError, match=r"folder is of type .*expected a path"):
            use()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "file").write_text("kept")
    with pytest.raises(OutputError, match="is not a folder"):
        make_dataset(SPEC, tmp_path / "file", progress=False)
