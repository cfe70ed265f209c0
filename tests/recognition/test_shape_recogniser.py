from __future__ import annotations

import json
import shutil
import timeit

import numpy as np
import pytest

from mjtactile import INDENTER_NAMES, Pad, force_vector, recognition
from mjtactile.recognition import RecognitionError
from mjtactile.recognition.registry import read_registry, register, stored_module
from mjtactile.recognition.weight_files import SHIPPED, read_weights

DOWN = force_vector(0.098)


@pytest.fixture(scope="module")
def recognise():
    return recognition.load("shape", pad=Pad())


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_shapes_are_recognised_where_how_large_and_how_turned(recognise, pressed, name):
    rotation = 0.3
    readings = pressed(name, DOWN, shift=(0.8e-3, 1.3e-3), rotation=rotation, size=0.9)[0]
    found = recognise(readings)
    assert str(found.shape) == name
    assert found.confidence > 0.9
    np.testing.assert_allclose(found.position, [0.8e-3, 1.3e-3], atol=2e-4)
    assert abs(found.size - 0.9) < 0.05
    orders = {"ellipse": 2, "octagon": 8, "square": 4, "star": 5, "triangle": 3}
    if name in orders:
        turn = orders[name]
        assert abs(np.angle(np.exp(1j * turn * (found.rotation - rotation)))) / turn < np.radians(5)
    else:
        assert np.isnan(found.rotation)


def test_a_sphere_is_no_circle(recognise, pressed):
    found = recognise(pressed("sphere", DOWN)[0])
    assert str(found.shape) == "sphere"
    assert np.isnan(found.size)


def test_batches_are_what_single_readings_are(recognise, pressed):
    readings = np.concatenate([pressed(name, DOWN, shift=(1e-3, 0.2e-3)) for name in INDENTER_NAMES])
    found = recognise(readings)
    assert found.shape.tolist() == list(INDENTER_NAMES)
    assert found.probabilities.shape == (7, len(recognise.shapes))
    np.testing.assert_allclose(found.probabilities.sum(axis=-1), 1.0)
    for k in range(7):
        np.testing.assert_allclose(found.probabilities[k], recognise(readings[k]).probabilities, atol=1e-3)


def test_where_only_some_shapes_can_be_others_are_not_named(recognise, pressed):
    found = recognise(pressed("octagon", DOWN)[0], among=("circle", "square"))
    assert str(found.shape) in ("circle", "square")
    assert found.shapes == ("circle", "square")
    with pytest.raises(RecognitionError, match=r"'blob'.*circle"):
        recognise(pressed("circle", DOWN)[0], among=("blob",))


@pytest.mark.parametrize("among", [["star", "star"], np.array(["star", "star"]), [], 3, [["star"]], "star"], ids=str)
def test_candidates_are_named_once_each(recognise, pressed, among):
    with pytest.raises(RecognitionError, match=r"among = .*; expected names of known shapes, each once"):
        recognise(pressed("star", DOWN)[0], among=among)


def test_modules_of_their_own_add_shapes_and_say_who_did_what(pressed):
    recognise = recognition.load("shape", also=("hexagon", "cross"))
    for name in ("hexagon", "cross", *INDENTER_NAMES):
        found = recognise(pressed(name, DOWN, shift=(0.4e-3, -0.7e-3), rotation=0.2)[0])
        assert str(found.shape) == name
        assert found.modules[f"shape {name}"] == f"shape-{name}.safetensors"


@pytest.mark.parametrize(("layers", "said"), [("all", "cross, hexagon"), ("top", "none")])
def test_a_shape_that_was_not_added_names_those_that_were(layers, said):
    with pytest.raises(RecognitionError, match=rf"no shape 'pentagon'.*besides the standard ones: {said}\."):
        recognition.load("shape", layers=layers, also=["pentagon"])


def test_added_shapes_leave_the_others_modules_as_they_are():
    """The registry knows every file by its hash, and no module was trained with one that was added later."""
    for layers in ("all", "top"):
        for entry in recognition.modules(layers=layers).values():
            assert entry.needs == () or "view" in entry.needs
            assert stored_module(SHIPPED / layers, entry).layers == ((0, 1, 2, 3) if layers == "all" else (0,))
        metadata = json.loads((SHIPPED / layers / "registry.json").read_text())
        optional = {"shape hexagon", "shape cross"} if layers == "all" else set()
        assert {one["name"] for one in metadata["modules"] if one["optional"]} == optional
    for name in INDENTER_NAMES:
        module = read_weights(SHIPPED / "all" / f"shape-{name}.safetensors")
        assert not {"hexagon", "cross"} & set(module.metadata["against"])


def test_a_module_that_was_changed_is_refused_until_it_is_entered_anew(tmp_path):
    folder = tmp_path / "weights"
    shutil.copytree(SHIPPED / "all", folder)
    shutil.copy(folder / "shape-star.safetensors", folder / "shape-square.safetensors")
    with pytest.raises(RecognitionError, match=r"shape-square\.safetensors does not match its hash"):
        recognition.load("shape", folder=folder)
    shutil.copy(SHIPPED / "all" / "shape-square.safetensors", folder / "shape-square.safetensors")
    before = read_registry(folder)
    assert register(folder, "shape-square.safetensors") == before["shape square"]
    assert read_registry(folder) == before


def test_damaged_weights_say_how_to_get_whole_ones(tmp_path):
    folder = tmp_path / "weights"
    shutil.copytree(SHIPPED / "all", folder)
    (folder / "view.safetensors").write_bytes(b"not weights")
    with pytest.raises(RecognitionError, match=r"view\.safetensors.*make weights"):
        recognition.load("force", folder=folder)
    with pytest.raises(RecognitionError, match="make weights"):
        recognition.load("force", folder=tmp_path / "nothing")


def test_one_call_takes_less_than_a_millisecond(recognise, pressed):
    readings = pressed("star", DOWN)[0]
    # The least of many: what else runs on the machine only adds.
    assert min(timeit.repeat(lambda: recognise(readings), number=1, repeat=200)) < 1e-3
