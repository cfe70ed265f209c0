"""Weights that are not what was trained: every flipped bit, cut, exchange and loss is found, and none is used."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from mjtactile import recognition
from mjtactile.errors import RecognitionError
from mjtactile.pad import Pad
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.registry import REGISTRY
from mjtactile.recognition.training.examples import EXAMPLES, read_examples
from mjtactile.recognition.weight_files import SHIPPED, read_weights, write_weights

FLIPS, CUTS = 300, 50


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The grasp recogniser, the smallest there is."""
    copy = tmp_path_factory.mktemp("weights") / "grasp"
    shutil.copytree(SHIPPED / "grasp", copy)
    return copy


def flipped(content: bytes, place: int, bit: int) -> bytes:
    damaged = bytearray(content)
    damaged[place] ^= 1 << bit
    return bytes(damaged)


def assert_refused(folder: Path, path: Path, damaged: bytes) -> None:
    whole = path.read_bytes()
    path.write_bytes(damaged)
    try:
        with pytest.raises(RecognitionError, match=path.name.replace(".", "[.]")):
            recognition.load("grasp", folder=folder)
    finally:
        path.write_bytes(whole)


def test_every_flipped_bit_of_shipped_weights_and_their_registry_is_found(folder):
    rng = np.random.default_rng(21)
    paths = [folder / name for name in ("grasp.safetensors", "view.safetensors", REGISTRY)]
    for number in range(FLIPS):
        path = paths[number % len(paths)]
        content = path.read_bytes()
        # Every other one in the header, where there is one.
        most = len(content) if number % 2 else min(len(content), 4096)
        assert_refused(folder, path, flipped(content, int(rng.integers(most)), int(rng.integers(8))))
    recognition.load("grasp", folder=folder)


def test_every_truncation_is_found(folder):
    rng = np.random.default_rng(22)
    for number in range(CUTS):
        path = folder / ("grasp.safetensors", "view.safetensors", REGISTRY)[number % 3]
        content = path.read_bytes()
        # The last byte of the registry ends a line and nothing else.
        assert_refused(folder, path, content[: int(rng.integers(len(content.rstrip())))])


def test_weights_of_another_module_are_found(folder):
    assert_refused(folder, folder / "view.safetensors", (folder / "grasp.safetensors").read_bytes())
    assert_refused(folder, folder / "view.safetensors", (SHIPPED / "all" / "view.safetensors").read_bytes())


@pytest.fixture
def own(tmp_path) -> Path:
    """Weights outside any registry."""
    path = tmp_path / "own.safetensors"
    rng = np.random.default_rng(23)
    arrays = {name: rng.normal(size=(6, 5)).astype(np.float32) for name in ("a", "b")}
    write_weights(path, arrays | {"c": np.arange(9, dtype=np.float16)}, {"kind": "view", "layers": [0, 1]}, Pad())
    return path


def test_files_that_no_registry_knows_find_every_flipped_bit_themselves(own):
    content, rng = own.read_bytes(), np.random.default_rng(24)
    for _ in range(FLIPS):
        own.write_bytes(flipped(content, int(rng.integers(len(content))), int(rng.integers(8))))
        with pytest.raises(RecognitionError, match="make weights"):
            read_weights(own)
    for length in rng.integers(len(content), size=CUTS):
        own.write_bytes(content[:length])
        with pytest.raises(RecognitionError, match="make weights"):
            read_weights(own)
    own.write_bytes(content)
    assert set(read_weights(own).arrays) == {"a", "b", "c"}


@pytest.mark.parametrize("change", ["exchanged", "missing", "misshapen", "of another type", "added"])
def test_arrays_that_were_changed_are_found(change, own):
    from safetensors import safe_open
    from safetensors.numpy import save_file

    with safe_open(own, framework="np") as file:
        about, arrays = file.metadata(), {name: file.get_tensor(name) for name in "abc"}
    if change == "exchanged":
        arrays["a"], arrays["b"] = arrays["b"], arrays["a"]
    elif change == "missing":
        del arrays["c"]
    elif change == "misshapen":
        arrays["a"] = arrays["a"].reshape(5, 6)
    elif change == "of another type":
        arrays["a"] = arrays["a"].view(np.int32)
    else:
        arrays["d"] = arrays["a"]
    save_file(arrays, own, about)
    with pytest.raises(RecognitionError, match="checksum"):
        read_weights(own)


def test_damaged_examples_are_found(tmp_path):
    """They are entered in the registry as modules are."""
    for name in (EXAMPLES, REGISTRY, "view.safetensors"):
        shutil.copy(SHIPPED / "all" / name, tmp_path / name)
    view = PrincipalComponents.from_stored(read_weights(tmp_path / "view.safetensors"))
    content = (tmp_path / EXAMPLES).read_bytes()
    (tmp_path / EXAMPLES).write_bytes(flipped(content, len(content) // 2, 3))
    with pytest.raises(RecognitionError, match="does not match its hash in the registry"):
        read_examples(tmp_path, view)
