"""Fidelities by name, and what they refuse."""

from __future__ import annotations

import math
import re
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from mjtactile.errors import MeshError, PresetError
from mjtactile.fidelity import (
    DEFAULT,
    MESHES,
    PRESETS,
    Fidelity,
    as_fidelity,
    fidelity_from_text,
    fidelity_summary,
    fidelity_text,
    mesh_name,
)


@pytest.mark.parametrize("name", PRESETS)
def test_preset_is_known_by_name_and_stands_for_itself(name):
    assert as_fidelity(name) == PRESETS[name]
    assert as_fidelity(PRESETS[name]) is PRESETS[name]
    assert PRESETS[name].density == MESHES[str(PRESETS[name].mesh)]


def test_presets_go_from_fast_to_accurate():
    assert list(PRESETS) == ["fast", "balanced", "precise", "accurate"]
    cells = [p.cells for p in PRESETS.values()]
    assert cells == sorted(cells)
    assert PRESETS["accurate"].reduction == 0.0


#: NumPy compares each entry of an array with a name, and then refuses to say whether they are equal.
NAMES = np.array(["float16", "int8"])


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"precision": "float8"}, r"precision 'float8' does not exist. Available: int8, float16, float32, float64"),
        ({"precision": ("float16", "float8")}, r"precision 'float8' does not exist.*or one for each sensing layer"),
        ({"precision": ("float64", "float32")}, r"expected 'float64' for all sensing layers or for none of them"),
        ({"averaging": "median"}, r"averaging 'median' does not exist. Available: points, quarters, mean"),
        ({"averaging": ("mean", "median")}, r"averaging 'median' does not exist.*or one for each sensing layer"),
        ({"averaging": ()}, r"averaging None does not exist"),
        ({"loads": "edges"}, r"loads 'edges' does not exist. Available: nodes, corners"),
        ({"reduction": -0.1}, r"reduction = -0.1; expected a relative error from 0"),
        ({"reduction": 1.0}, "to below 1"),
        ({"reduction": math.nan}, "reduction = nan"),
        ({"reduction": "0.1"}, "reduction = '0.1'"),
        ({"law": "hertz"}, r"contact law 'hertz' does not exist. Available: uniform, foundation, elastic"),
        ({"cells": 0}, r"cells = 0; expected a whole number"),
        ({"cells": 10.5}, r"cells = 10.5"),
        ({"cells": True}, r"cells = True"),
        ({"precision": None}, "precision None does not exist"),
        ({"precision": NAMES}, r"precision array\(.* does not exist"),
        ({"averaging": (NAMES,)}, r"averaging array\(.* does not exist"),
        ({"loads": NAMES}, r"loads array\(.* does not exist"),
        ({"law": NAMES}, r"contact law array\(.* does not exist"),
    ],
)
def test_choices_that_do_not_exist_are_refused(choice: dict[str, Any], message):
    with pytest.raises(PresetError, match=message):
        Fidelity(**choice)


@pytest.mark.parametrize("wrong", ["coarse", [], None, 3])
def test_unknown_names_are_refused_as_everywhere(wrong):
    said = re.escape(f"{wrong!r} does not exist. Available: ")
    with pytest.raises(MeshError, match=f"mesh {said}draft, default, even, fine"):
        Fidelity(mesh=wrong)
    with pytest.raises(PresetError, match=f"fidelity {said}fast, balanced, precise, accurate"):
        as_fidelity(wrong)


def test_numbers_of_numpy_are_as_good_as_pythons():
    given = Fidelity(mesh=replace(MESHES["draft"], most_elements=np.int64(400)), cells=np.int64(60))  # type: ignore[arg-type]
    same = Fidelity(mesh=replace(MESHES["draft"], most_elements=400), cells=60)
    assert given == same
    assert fidelity_text(given) == fidelity_text(same)
    assert replace(MESHES["draft"], rim_grading=np.float32(0.5)) == replace(MESHES["draft"], rim_grading=0.5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"rim_grading": True},
        {"rim_grading": "1"},
        {"rim_grading": -1.0},
        {"in_plane_size": 0.0},
        {"through_size": math.nan},
        {"reference_length": 0.0},
        {"most_elements": 20.5},
        {"most_elements": 2},
        {"points_per_axis": (True,)},
        {"points_per_axis": (0,)},
        {"points_per_axis": ()},
    ],
    ids=str,
)
def test_a_mesh_is_of_numbers_in_their_ranges(wrong):
    with pytest.raises(MeshError, match=f"{next(iter(wrong))} = .*expected"):
        replace(MESHES["draft"], **wrong)


def test_each_sensing_layer_may_have_its_own_averaging_and_the_last_repeats():
    chosen = Fidelity(averaging=("points", "quarters", "mean"))
    assert [chosen.averaging_at(layer) for layer in range(5)] == ["points", "quarters", "mean", "mean", "mean"]
    assert [Fidelity(averaging="mean").averaging_at(layer) for layer in range(2)] == ["mean", "mean"]


def test_each_sensing_layer_may_have_its_own_precision_and_the_last_repeats():
    chosen = Fidelity(precision=("float16", "float32", "int8"))
    assert [chosen.precision_at(layer) for layer in range(4)] == ["float16", "float32", "int8", "int8"]
    assert chosen.widest_precision == "float32"
    assert Fidelity(precision=("float64", "float64")) == Fidelity(precision="float64")
    assert Fidelity(precision="int8").widest_precision == "int8"
    assert fidelity_from_text(fidelity_text(chosen)) == chosen


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        (("mean",), "mean"),
        (("mean", "mean"), "mean"),
        (["quarters", "mean", "mean"], ("quarters", "mean")),
        (("mean", "points", "mean"), ("mean", "points", "mean")),
    ],
)
def test_the_same_averaging_is_an_equal_fidelity(given, kept):
    assert Fidelity(averaging=given).averaging == kept
    assert Fidelity(averaging=given) == Fidelity(averaging=kept)


def test_a_fidelity_is_a_value():
    chosen = Fidelity(mesh="draft", reduction=0.01)
    assert chosen == replace(Fidelity(mesh="draft"), reduction=0.01)
    with pytest.raises(FrozenInstanceError):
        chosen.mesh = "fine"  # type: ignore[misc]


def test_a_mesh_alone_is_plain():
    assert Fidelity(mesh="draft") == Fidelity(
        mesh="draft", precision="float32", reduction=0.0, averaging="points", loads="nodes", law="uniform", cells=400
    )


@pytest.mark.parametrize(
    "chosen",
    [*PRESETS.values(), Fidelity(mesh="draft"), Fidelity(mesh=replace(MESHES["fine"], rim_grading=0.1), reduction=0.1)],
    ids=str,
)
def test_a_fidelity_is_read_back_from_its_text(chosen):
    assert fidelity_from_text(fidelity_text(chosen)) == chosen


def test_presets_are_named_in_texts_and_one_of_them_is_the_default():
    assert [fidelity_text(preset) for preset in PRESETS.values()] == list(PRESETS)
    assert fidelity_text(DEFAULT) == "balanced"


@pytest.mark.parametrize(
    "text", ["quick", "{", '{"mesh": 3}', '{"colour": 1}', '{"mesh": {"rim_grading": 1}}', '{"law": "x"}', "{" * 10**5]
)
def test_texts_that_say_no_fidelity_are_refused(text):
    with pytest.raises((MeshError, PresetError)):
        fidelity_from_text(text)


def test_densities_are_known_by_name():
    assert mesh_name(MESHES["fine"]) == "fine"
    assert mesh_name(replace(MESHES["fine"], rim_grading=1.23)) is None


@pytest.mark.parametrize(
    ("fidelity", "words"),
    [
        (PRESETS["precise"], "precise"),
        (Fidelity(mesh="fine"), "mesh fine"),
        (Fidelity(mesh=MESHES["draft"], precision="int8", cells=20), "mesh draft, precision int8, cells 20"),
        (Fidelity(mesh=replace(MESHES["draft"], most_elements=50)), "mesh of its own"),
        (Fidelity(mesh="fine", averaging=("points", "mean")), "mesh fine, averaging points, then mean"),
        (
            Fidelity(precision=("float16", "int8"), averaging=("points", "points", "mean")),
            "mesh default, precision float16, then int8, averaging points in 2 layers, then mean",
        ),
    ],
)
def test_a_summary_says_what_differs_from_a_plain_mesh(fidelity, words):
    assert fidelity_summary(fidelity) == words
