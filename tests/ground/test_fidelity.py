"""Fidelities by name, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace
from typing import Any

import pytest

from mjtactile.errors import MeshError, PresetError
from mjtactile.fidelity import CONTACT_LAWS, MESHES, PRECISIONS, PRESETS, Fidelity, fidelity, mesh_name, mesh_or_preset


@pytest.mark.parametrize("name", PRESETS)
def test_preset_is_known_by_name_and_stands_for_itself(name):
    assert fidelity(name) == PRESETS[name]
    assert fidelity(PRESETS[name]) is PRESETS[name]
    assert PRESETS[name].density == MESHES[str(PRESETS[name].mesh)]


def test_presets_go_from_fast_to_accurate():
    assert list(PRESETS) == ["fast", "balanced", "precise", "accurate"]
    elements = [p.density.in_plane_size for p in PRESETS.values()]
    assert elements == sorted(elements, reverse=True)
    cells = [p.cells for p in PRESETS.values()]
    assert cells == sorted(cells)
    assert PRESETS["accurate"].reduction == 0.0


def test_unknown_preset_lists_those_that_exist():
    with pytest.raises(
        PresetError, match=r"preset 'quick' does not exist. Available: fast, balanced, precise, accurate"
    ):
        fidelity("quick")


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"precision": "float8"}, r"precision 'float8' does not exist. Available: int8, float16, float32, float64"),
        ({"averaging": "median"}, r"averaging 'median' does not exist. Available: points, deep, mean"),
        ({"loads": "edges"}, r"loads 'edges' does not exist. Available: nodes, corners"),
        ({"reduction": -0.1}, r"reduction = -0.1; expected a relative error from 0"),
        ({"reduction": 1.0}, "to below 1"),
        ({"reduction": math.nan}, "reduction = nan"),
        ({"reduction": "0.1"}, "reduction = '0.1'"),
        ({"law": "hertz"}, r"contact law 'hertz' does not exist. Available: uniform, foundation, elastic"),
        ({"cells": 0}, r"cells = 0; expected a whole number"),
        ({"cells": 10.5}, r"cells = 10.5"),
    ],
)
def test_choices_that_do_not_exist_are_refused(choice: dict[str, Any], message):
    with pytest.raises(PresetError, match=message):
        Fidelity(**choice)


def test_unknown_mesh_of_a_preset_is_refused_as_everywhere():
    with pytest.raises(MeshError, match="Available: draft, default, fine"):
        Fidelity(mesh="coarse")


def test_every_precision_and_law_can_be_chosen():
    for precision in PRECISIONS:
        assert Fidelity(precision=precision).precision == precision
    for law in CONTACT_LAWS:
        assert Fidelity(law=law).law == law


def test_a_fidelity_is_a_value():
    chosen = Fidelity(mesh="draft", reduction=0.01)
    assert chosen == replace(Fidelity(mesh="draft"), reduction=0.01)
    with pytest.raises(FrozenInstanceError):
        chosen.mesh = "fine"  # type: ignore[misc]


def test_a_mesh_alone_is_plain():
    assert mesh_or_preset("draft", None) == Fidelity(
        mesh="draft", precision="float32", reduction=0.0, law="uniform", cells=400
    )
    assert mesh_or_preset(None, None) == Fidelity(mesh="default")
    assert mesh_or_preset(None, "fast") == PRESETS["fast"]


def test_mesh_and_preset_together_are_refused_saying_which_to_drop():
    with pytest.raises(PresetError, match=r"preset 'fast' brings its own mesh, 'draft', but mesh = 'fine'.*Drop mesh="):
        mesh_or_preset("fine", "fast")


def test_densities_are_known_by_name():
    assert mesh_name(MESHES["fine"]) == "fine"
    assert mesh_name(replace(MESHES["fine"], rim_grading=1.23)) is None
