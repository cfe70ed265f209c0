from __future__ import annotations

import shutil
import timeit
from dataclasses import replace

import numpy as np
import pytest

from mjtactile import Pad, force_vector, recognition
from mjtactile.recognition import RecognitionError
from mjtactile.recognition.evaluation.arrays import noisy
from mjtactile.recognition.evaluation.recognisers import angles_between
from mjtactile.recognition.weight_files import SHIPPED


@pytest.fixture(scope="module")
def recognise():
    return recognition.load("force", pad=Pad())


@pytest.fixture(scope="module")
def top():
    return recognition.load("force", layers="top")


FORCE = force_vector(0.8, 14.0, 130.0)


@pytest.mark.parametrize("shape", ["disc", "star", "triangle", "sphere"])
def test_force_and_position_are_found_without_being_told_the_shape(recognise, pressed, shape):
    readings = pressed(shape, FORCE, shift=(1.1e-3, -0.6e-3), rotation=0.4)[0]
    found = recognise(readings)
    assert found.force.shape == (3,)
    # Noise-free: three times the mean errors of docs/recognition.md.
    assert np.degrees(angles_between(found.force, FORCE)) < 0.5
    assert abs(found.magnitude - 0.8) < 0.01
    np.testing.assert_allclose(found.position, [1.1e-3, -0.6e-3], atol=5e-5)


def test_forces_scale_with_the_readings(recognise, pressed):
    readings = pressed("disc", FORCE)[0]
    once, twice = recognise(readings), recognise(2.0 * readings)
    np.testing.assert_allclose(twice.force, 2.0 * once.force, rtol=1e-5)
    np.testing.assert_allclose(twice.position, once.position, atol=1e-9)


@pytest.mark.parametrize("scale", [1e-100, 1e-40, 1e-20, 1e20, 1e30, 1e100])
def test_readings_of_any_size_are_recognised(recognise, pressed, scale):
    """Single precision holds neither their squares nor, in part, themselves."""
    readings = pressed("disc", FORCE)[0]
    once, far = recognise(readings), recognise(np.stack([readings, scale * readings]))
    for k, size in enumerate((1.0, scale)):
        # As between batches, which round differently.
        np.testing.assert_allclose(far.force[k] / size, once.force, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(far.confidence[k], once.confidence, rtol=1e-4)


def test_integers_are_readings_too(recognise, pressed):
    readings = np.round(100.0 * pressed("disc", FORCE)[0])
    np.testing.assert_array_equal(recognise(readings.astype(int)).force, recognise(readings).force)


def test_mirrored_readings_give_the_mirrored_force(recognise, pressed):
    readings = pressed("star", FORCE, shift=(1.0e-3, 0.4e-3))[0]
    one, other = recognise(readings), recognise(readings[:, :, ::-1])
    np.testing.assert_allclose(other.force, one.force * [-1, 1, 1], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(other.position, one.position * [-1, 1], atol=1e-8)
    turned = recognise(readings.swapaxes(1, 2))
    np.testing.assert_allclose(turned.force, one.force[[1, 0, 2]], rtol=1e-4, atol=1e-6)


def test_batches_of_any_shape_are_what_single_readings_are(recognise, pressed):
    forces = np.array([force_vector(0.5, 10, a) for a in (0, 60, 120, 200, 250, 300)])
    readings = pressed("ellipse", forces, shift=(0.3e-3, 0.9e-3), rotation=0.3)
    batch = recognise(readings.reshape(2, 3, 4, 13, 13))
    assert batch.force.shape == (2, 3, 3)
    assert batch.confidence.shape == (2, 3)
    for k in range(6):
        np.testing.assert_allclose(batch.force.reshape(6, 3)[k], recognise(readings[k]).force, rtol=1e-4, atol=1e-5)


def test_confidence_falls_with_noise_and_deviations_tell_the_errors(recognise, pressed):
    forces = np.array([force_vector(0.6, 12.0, azimuth) for azimuth in np.linspace(0, 350, 120)])
    readings = pressed("square", forces, shift=(0.7e-3, -0.2e-3), rotation=0.2)
    before = recognise(readings).confidence.mean()
    found = recognise(noisy(readings, 0.01, seed=3))
    assert found.confidence.mean() < before
    errors = angles_between(found.force, forces)
    ratio = np.sqrt((errors**2).mean() / (found.direction_deviation**2).mean())
    assert 0.6 < ratio < 1.6


def test_dead_taxels_are_mended(recognise, pressed):
    readings = pressed("circle", FORCE, shift=(0.5e-3, 0.2e-3))[0]
    whole = recognise(readings)
    broken = readings.copy()
    for layer in (0, 1):  # the two taxels that read most in each
        broken[layer].flat[np.argsort(readings[layer], axis=None)[-2:]] = 0.0
    mended = recognise(broken)
    # Not mended, these four turn the force by 0.7 degrees.
    assert np.degrees(angles_between(mended.force, whole.force)) < 0.35


def test_the_top_layer_alone_takes_its_own_readings_or_all(top, pressed):
    readings = pressed("disc", FORCE)[0]
    np.testing.assert_array_equal(top(readings).force, top(readings[:1]).force)
    assert np.degrees(angles_between(top(readings).force, FORCE)) < 0.5


@pytest.mark.parametrize(
    ("readings", "said"),
    [
        (np.ones((3, 13, 13)), r"\(3, 13, 13\).*4, 13, 13"),
        (np.ones((13, 13)), "expected"),
        (np.full((4, 13, 13), np.nan), "NaN"),
        (np.zeros((4, 13, 13)), "nothing presses"),
        ("strong", "type str; expected an array"),
        (np.full((4, 13, 13), "1e3"), "type ndarray of <U3; expected an array"),
        (np.full((4, 13, 13), 1e3 + 1j), "type ndarray of complex128; expected an array"),
        (np.full((4, 13, 13), 1e300), r"largest reading is 1e\+300 Pa; expected stresses in pascals"),
        (np.full((4, 13, 13), 1e-300), "largest reading is 1e-300 Pa; expected stresses"),
        (np.full((4, 13, 13), -1e3), "nothing presses"),
        (np.where(np.arange(13) == 3, -np.inf, np.ones((4, 13, 13))), "NaN or infinity"),
    ],
)
def test_readings_that_say_nothing_are_refused(recognise, readings, said):
    with pytest.raises(RecognitionError, match=said):
        recognise(readings)


@pytest.mark.parametrize("name", ["force", "grasp", "shape"])
def test_no_readings_are_no_results(name):
    found = recognition.load(name)(np.zeros((0, 4, 13, 13)))
    assert len(found.shape if name == "shape" else found.force) == 0


def test_another_pad_is_refused_and_named():
    other = Pad(size=(16e-3, 16e-3))
    with pytest.raises(RecognitionError, match=f"{Pad().fingerprint[:12]}.*16 x 16 mm.*make weights"):
        recognition.load("force", pad=other)
    with pytest.raises(RecognitionError, match="trained for"):
        recognition.load("force", pad=replace(Pad(), depths=(1e-3,)))
    recognition.load("force", layers="top", pad=replace(Pad(), depths=(1e-3,)))
    recognition.load("force", layers="top", pad=Pad())


def test_what_does_not_exist_is_refused():
    with pytest.raises(RecognitionError, match=r"'taste'.*'force'"):
        recognition.load("taste")  # type: ignore[call-overload]
    with pytest.raises(RecognitionError, match=r"pad is of type str; expected a mjtactile\.Pad"):
        recognition.load("force", pad="default")  # type: ignore[call-overload]
    with pytest.raises(RecognitionError, match=r"'bottom'.*'top'"):
        recognition.modules(layers="bottom")
    with pytest.raises(RecognitionError, match=r"'bottom'.*'top'"):
        recognition.load("force", layers="bottom")
    names = np.array(["all", "top"])
    with pytest.raises(RecognitionError, match="does not exist"):
        recognition.load(names)  # type: ignore[call-overload]
    with pytest.raises(RecognitionError, match="'all', 'top'"):
        recognition.load("force", layers=names)  # type: ignore[call-overload]


@pytest.mark.parametrize("name", ["force", "grasp"])
def test_shapes_are_for_the_shape_recogniser_alone(name):
    with pytest.raises(RecognitionError, match=rf"also = \['hexagon'\] is for the shape recogniser; '{name}'"):
        recognition.load(name, also=["hexagon"])
    recognition.load(name, also=())


@pytest.mark.parametrize("also", [None, 3, "hexagon"])
def test_shapes_are_a_list(also):
    with pytest.raises(RecognitionError, match=r"also = .*; expected a list of shapes"):
        recognition.load("shape", also=also)


def test_a_folder_of_weights_is_a_folder(tmp_path):
    file = tmp_path / "view.safetensors"
    file.write_bytes(b"")
    for look in (
        lambda folder: recognition.load("force", folder=folder),
        lambda folder: recognition.modules(folder=folder),
    ):
        with pytest.raises(RecognitionError, match=r"no recognisers in .*safetensors\. It is a file: give the folder"):
            look(file)
        with pytest.raises(RecognitionError, match="cannot be read"):
            look(tmp_path / ("a" * 5000))
        with pytest.raises(RecognitionError, match="folder is of type int"):
            look(3)


def test_layers_that_a_folders_weights_do_not_use_are_refused(tmp_path):
    every, top = SHIPPED / "all", SHIPPED / "top"
    for layers, folder in (("top", every), ("all", top)):
        with pytest.raises(RecognitionError, match=rf"layers = '{layers}', but the recognisers in .* use layers \["):
            recognition.load("force", layers=layers, folder=folder)
        with pytest.raises(RecognitionError, match=f"layers = '{layers}', but"):
            recognition.modules(layers=layers, folder=folder)
    assert recognition.load("force", folder=top).view.layers == (0,)
    assert recognition.load("force", layers="top", folder=top).view.layers == (0,)
    # A folder of such folders serves as well.
    assert recognition.load("force", layers="top", folder=SHIPPED).view.layers == (0,)
    assert recognition.load("shape", folder=SHIPPED).view.layers == (0, 1, 2, 3)
    recognition.load("grasp", folder=SHIPPED)
    assert recognition.modules(layers="top", folder=SHIPPED) == recognition.modules(layers="top")
    shutil.copytree(top, tmp_path / "top")
    with pytest.raises(RecognitionError, match=r"no recognisers in .*Give one of its subfolders: top"):
        recognition.load("force", folder=tmp_path)


def test_subfolders_that_do_not_serve_are_not_advised(tmp_path):
    for name in ("all", "grasp"):
        shutil.copytree(SHIPPED / name, tmp_path / name)
    with pytest.raises(RecognitionError, match=r"no recognisers in .*, nor in its subfolder top\. Train them"):
        recognition.load("force", layers="top", folder=tmp_path)
    shutil.rmtree(tmp_path / "all")
    with pytest.raises(RecognitionError, match=r"nor in its subfolder all or top\. Train them"):
        recognition.load("force", folder=tmp_path)
    (tmp_path / "grasp").rename(tmp_path / "all")
    with pytest.raises(RecognitionError, match=r"nor in its subfolder grasp\. Train them"):
        recognition.load("grasp", folder=tmp_path)


def test_one_call_takes_less_than_a_millisecond(recognise, pressed):
    readings = pressed("disc", FORCE)[0]
    # The least of many: what else runs on the machine only adds.
    assert min(timeit.repeat(lambda: recognise(readings), number=1, repeat=200)) < 1e-3
