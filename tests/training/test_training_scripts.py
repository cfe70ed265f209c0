"""Every training script from presses to weights, in seconds: what comes out loads, and says how it was made."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from mjtactile import Pad, TaxelGrid, recognition
from mjtactile.dataset.files import make_dataset
from mjtactile.dataset.spec import load_spec, parse_spec
from mjtactile.errors import IndenterError
from mjtactile.recognition.network import Network
from mjtactile.recognition.registry import read_registry, register
from mjtactile.recognition.training.fitting import perceptron, set_weights
from mjtactile.recognition.training.presses import see_presses
from mjtactile.recognition.weight_files import SHIPPED, read_weights, write_weights

TRAINING = Path(__file__).parents[2] / "training"
PATH = os.pathsep.join(sys.path)
SPEC = parse_spec(
    {
        "presses": 240,
        "seed": 2,
        "fidelity": "fast",
        "law": "uniform",
        "poses": 2,
        "forces": 2,
        "contact": [{"shapes": ["star", "square", "circle"], "size": [0.8, 1.2], "shift": 1.0}],
    }
)


@pytest.fixture(scope="module")
def scripts():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TRAINING))
        names = ("train_view", "train_familiarity", "train_force", "train_pose", "train_shapes", "add_shape")
        yield {name: importlib.import_module(name) for name in names}


@pytest.mark.slow
def test_scripts_train_what_can_be_loaded_and_a_new_shape_touches_no_other_module(tmp_path, scripts):
    presses, weights = tmp_path / "presses", tmp_path / "weights"
    make_dataset(SPEC, presses, progress=False)

    def run(name, **arguments):
        script = scripts[name]
        script.main(script.Config(weights=weights, **arguments))

    run("train_view", data=presses, parts=40)
    run("train_force", data=presses, width=24, depth=1, steps=60)
    assert recognition.load("force", folder=weights)(np.ones((4, 13, 13))).familiarity is None
    run("train_familiarity", data=presses, presses=90, false_alarms=0.1)
    for module in ("position", "size", "orientation"):
        run("train_pose", module=module, data=presses, width=16, steps=20)
    run("train_force", data=presses, width=24, depth=1, steps=20, start=weights / "force.safetensors", seed=8)
    with pytest.raises(recognition.RecognitionError, match="no examples"):
        run("add_shape", shape="hexagon")
    run("train_shapes", data=presses, width=16, steps=60, examples=90)
    before = read_registry(weights)
    files = {path: path.read_bytes() for path in weights.glob("*.safetensors")}
    run("add_shape", shape="hexagon", presses=48, workers=1, draws=1, steps=20)

    after = read_registry(weights)
    assert set(after) - set(before) == {"shape hexagon"}
    assert {name: after[name] for name in before} == before
    assert {path: path.read_bytes() for path in files} == files
    recognise = recognition.load("shape", folder=weights, also=["hexagon"], pad=Pad())
    assert set(recognise.shapes) == {"circle", "hexagon", "square", "star"}
    assert set(recognition.load("shape", folder=weights).shapes) == {"circle", "square", "star"}
    force = recognition.load("force", folder=weights)
    assert np.isfinite(force(np.random.default_rng(0).random((2, 4, 13, 13))).force).all()
    uniform = force(np.ones((4, 13, 13))).familiarity
    assert uniform is not None
    assert force.taught is not None
    assert not uniform.familiar
    assert uniform.false_alarms == 0.1
    view = force.view
    seen = see_presses(presses, view)
    others = force.taught.distances(view.see(seen.readings[seen.outline % 2 == 1])) > uniform.limit
    assert 0.05 < others.mean() < 0.15
    about = read_weights(weights / "force.safetensors").metadata
    assert about["pad_fingerprint"] == Pad().fingerprint
    assert (about["before"]["seed"], about["config"]["seed"]) == (1, 8)
    assert about["versions"]["torch"]
    assert about["dataset"]["spec"]["seed"] == 2


def test_arguments_come_from_the_dataclass(scripts):
    arguments = importlib.import_module("arguments")
    config = scripts["train_view"].Config
    given = arguments.parsed(config, "about", ["--data", "a", "--weights", "b", "--layers", "0", "2"])
    assert given == config(data=Path("a"), weights=Path("b"), layers=(0, 2))
    with pytest.raises(SystemExit):
        arguments.parsed(config, "about", ["--data", "a"])


def test_scripts_end_with_the_message_of_an_error_alone(tmp_path):
    script = [sys.executable, str(TRAINING / "train_view.py"), "--data", str(tmp_path), "--weights", str(tmp_path)]
    done = subprocess.run(script, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": PATH})
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("error: ")
    assert str(tmp_path) in done.stderr


def test_a_network_begins_only_as_one_of_its_own_sizes():
    network = perceptron([3, 4, 2])
    weights = tuple(np.full(size, 0.5, dtype=np.float32) for size in ((3, 4), (4, 2)))
    biases = tuple(np.zeros(size, dtype=np.float32) for size in (4, 2))
    stored = Network(weights, biases)
    set_weights(network, stored)
    inputs = np.ones((1, 3), dtype=np.float32)
    np.testing.assert_allclose(network(torch.tensor(inputs)).detach().numpy(), stored(inputs), rtol=1e-6)
    with pytest.raises(recognition.RecognitionError, match=r"\(3, 4\).*same width"):
        set_weights(perceptron([3, 5, 2]), stored)


def test_a_new_shape_is_pressed_as_the_others_were(scripts):
    spec = load_spec(TRAINING / "presses.toml")
    config = scripts["add_shape"].Config(shape="cross", weights=Path("weights"))
    new = scripts["add_shape"].of_shape(spec, config)
    (contact,) = new.contacts
    assert contact == replace(spec.contacts[0], shapes=("cross",))
    assert (new.presets, new.laws, new.free, new.pad) == (spec.presets, spec.laws, spec.free, spec.pad)
    assert new.seed != spec.seed


def test_a_new_shape_takes_no_other_shapes_name(tmp_path, scripts):
    add = scripts["add_shape"]
    weights = tmp_path / "weights"
    shutil.copytree(SHIPPED / "all", weights)
    one, other, star = tmp_path / "tool.stl", tmp_path / "other" / "tool.stl", tmp_path / "star.stl"
    other.parent.mkdir()
    for content, mesh in ((b"1", one), (b"2", other), (b"3", star)):
        mesh.write_bytes(content)

    def check(shape, name=None):
        config = add.Config(shape=str(shape), weights=weights, name=name)
        add.check_name(config)
        return config

    module = {"kind": "shape", "shape": "tool", "layers": (0,), "source": check(one).source}
    write_weights(weights / "shape-tool.safetensors", {}, module, Pad())
    register(weights, "shape-tool.safetensors", optional=True)
    assert check(one).called == "tool"
    file = weights / "shape-tool.safetensors"
    one.write_bytes(b"edited")
    with pytest.raises(recognition.RecognitionError, match=r"to replace that shape, first delete .*shape-tool\.safe"):
        check(one)
    kept = file.read_bytes()
    file.unlink()
    assert check(one).called == "tool"
    write_weights(file, {}, {name: value for name, value in module.items() if name != "source"}, Pad())
    register(weights, file.name, optional=True)
    assert check(one).called == "tool"  # made before sources were told
    one.write_bytes(b"1")
    file.write_bytes(kept)
    register(weights, file.name, optional=True)
    assert check(other, "second").called == "second"
    assert check("hexagon").called == "hexagon"
    with pytest.raises(recognition.RecognitionError, match=r"'star' is one of the package's shapes.*with --name"):
        add.main(add.Config(shape=str(star), weights=weights))
    with pytest.raises(recognition.RecognitionError, match=r"has a shape 'tool' already.*with --name"):
        add.main(add.Config(shape=str(other), weights=weights))
    with pytest.raises(recognition.RecognitionError, match="'circle' is one of the package's shapes"):
        check("hexagon", "circle")
    with pytest.raises(recognition.RecognitionError, match="'a/b' is that of no file"):
        check(one, "a/b")
    with pytest.raises(IndenterError, match="'hexagn' does not exist"):
        check("hexagn")


def test_a_mesh_file_is_called_as_its_file_and_as_no_other_shape(scripts):
    names_of = scripts["train_shapes"].names_of
    found = names_of(np.array(["star", "/tools/my_tool.stl", "disc", "star"]))
    np.testing.assert_array_equal(found, ["star", "my_tool", "disc", "star"])
    for shapes in (["a/tool.stl", "b/tool.stl"], ["a/star.stl", "circle"]):
        with pytest.raises(recognition.RecognitionError, match=r"a/\w+\.stl would be called .* Rename"):
            names_of(np.array(shapes))


@pytest.mark.slow
def test_modules_and_examples_of_meshes_have_the_names_of_their_files(tmp_path, scripts):
    tool, presses, weights = tmp_path / "my_tool.stl", tmp_path / "presses", tmp_path / "weights"
    trimesh.creation.box(extents=(8e-3, 4e-3, 5e-3)).export(tool)
    contacts = tuple(replace(one, shapes=("star", str(tool))) for one in SPEC.contacts)
    make_dataset(replace(SPEC, contacts=contacts), presses, progress=False)

    def run(name, **arguments):
        scripts[name].main(scripts[name].Config(weights=weights, data=presses, **arguments))

    run("train_view", parts=40)
    for module in ("position", "size", "orientation"):
        run("train_pose", module=module, width=16, steps=5)
    run("train_shapes", width=16, steps=5, examples=60)
    assert {path.stem for path in weights.iterdir() if "shape" in path.stem} == {"shape-star", "shape-my_tool"}
    assert recognition.load("shape", folder=weights).shapes == ("my_tool", "star")
    assert read_weights(weights / "examples.safetensors").metadata["shapes"] == ["my_tool", "star"]
    with pytest.raises(recognition.RecognitionError, match=r"--favour disc: no press .* one of .*star"):
        run("train_force", favour="disc", steps=1)


def test_a_view_takes_the_layers_and_parts_that_a_pad_has(tmp_path, scripts):
    pad = Pad(taxels=TaxelGrid(rows=4, columns=4), depths=(1e-3, 2e-3))
    make_dataset(replace(SPEC, presses=48, pad=pad), tmp_path, progress=False)

    def parts(**arguments):
        scripts["train_view"].main(scripts["train_view"].Config(data=tmp_path, weights=tmp_path, **arguments))
        stored = read_weights(tmp_path / "view.safetensors")
        return stored.layers, stored.arrays["parts"].shape

    # Noise is what the parts leave over: some taxels' worth is left to it.
    assert parts() == ((0, 1), (32, 22))
    assert parts(layers=(0,)) == ((0,), (16, 11))
    for layers in ((0, 2), (-1,), (1, 1)):
        with pytest.raises(recognition.RecognitionError, match=r"2 depths; expected some of \[0, 1\]"):
            parts(layers=layers)
    with pytest.raises(recognition.RecognitionError, match=r"32 principal parts of 32 taxels; .* fewer"):
        parts(parts=32)


def test_only_symmetric_pads_are_trained_for(tmp_path, scripts):
    odd = replace(SPEC, presses=8, pad=Pad(size=(15e-3, 15.2e-3), depths=(1e-3,)))
    make_dataset(odd, tmp_path, progress=False)
    with pytest.raises(recognition.RecognitionError, match="not symmetric"):
        scripts["train_view"].main(scripts["train_view"].Config(data=tmp_path, weights=tmp_path, layers=(0,), parts=8))
