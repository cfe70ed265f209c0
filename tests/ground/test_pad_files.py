"""Pads as TOML files: any value may be left out, and what is wrong is named."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

import mjtactile
from mjtactile.errors import PadError, SceneError
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_names import named_pad, pad_from_file
from mjtactile.pad_shape.surfaces import CylinderSector, SphereCap
from mjtactile.pad_shape.taxels import FreeTaxels, as_taxels

DOME = """
size = [12e-3, 12e-3]
depths = [0.75e-3, 1.5e-3]
sampling_radius = 0.4e-3
surface = { kind = "sphere", radius = 12e-3 }
taxels = { rows = 11, columns = 11, pitch = [1e-3, 1e-3] }

[[layers]]
thickness = 1e-3
young = 1e6
poisson = 0.49

[[layers]]
thickness = 2e-3
young = 3e6
poisson = 0.49
"""


def in_file(tmp_path, text):
    path = tmp_path / "pad.toml"
    path.write_text(text)
    return path


def test_a_mark_before_the_text_is_none_of_it(tmp_path):
    path = tmp_path / "pad.toml"
    path.write_text(DOME, encoding="utf-8-sig")
    assert pad_from_file(path) == pad_from_file(in_file(tmp_path, DOME))


def test_a_date_is_no_number(tmp_path):
    with pytest.raises(PadError, match=r"2026, 1, 1.*expected a number"):
        pad_from_file(in_file(tmp_path, "size = [2026-01-01, 15e-3]"))


def test_a_file_describes_a_dome(tmp_path):
    layers = Layer(thickness=1e-3, young=1e6, poisson=0.49), Layer(thickness=2e-3, young=3e6, poisson=0.49)
    assert pad_from_file(in_file(tmp_path, DOME)) == Pad(
        size=(12e-3, 12e-3),
        layers=layers,
        taxels=TaxelGrid(rows=11, columns=11, pitch=(1e-3, 1e-3)),
        depths=(0.75e-3, 1.5e-3),
        sampling_radius=0.4e-3,
        surface=SphereCap(12e-3),
    )


def test_what_a_file_leaves_out_is_the_default_pads(tmp_path):
    assert pad_from_file(in_file(tmp_path, "")) == Pad()
    found = pad_from_file(in_file(tmp_path, 'surface = {kind = "cylinder", radius = 9e-3}\ntaxels = {rows = 3}'))
    assert found == Pad(surface=CylinderSector(9e-3), taxels=TaxelGrid(rows=3))


def test_taxels_may_be_points_or_a_file_of_them_beside_it(tmp_path):
    points = [[0.0, 0.0, -1e-3], [1e-3, 2e-3, -2e-3]]
    assert pad_from_file(in_file(tmp_path, f"[taxels]\npoints = {points}")) == Pad(taxels=as_taxels(points))
    (tmp_path / "points.json").write_text(json.dumps({"points": points, "radii": [3e-4, 4e-4]}))
    found = pad_from_file(in_file(tmp_path, 'taxels = "points.json"'))
    assert found == Pad(taxels=FreeTaxels(as_taxels(points).points, (3e-4, 4e-4)))


def test_a_surface_may_be_a_mesh_beside_it(tmp_path):
    trimesh.creation.icosphere(subdivisions=4, radius=12.0).export(tmp_path / "tip.stl")
    frame = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 12e-3], [0, 0, 0, 1]]
    text = DOME.replace(
        '{ kind = "sphere", radius = 12e-3 }', f'{{ kind = "mesh", file = "tip.stl", scale = 1e-3, frame = {frame} }}'
    )
    found = pad_from_file(in_file(tmp_path, text))
    assert found.surface.kind == "patch"
    x = np.linspace(-6e-3, 6e-3, 9)
    np.testing.assert_allclose(found.surface.height(x, x), SphereCap(12e-3).height(x, x), atol=2e-5)
    with pytest.raises(PadError, match=r"there is no mesh 'other.stl' beside the file"):
        pad_from_file(in_file(tmp_path, text.replace("tip.stl", "other.stl")))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("size = ", "cannot read .* as a pad's TOML file"),
        ("colour = 3", "no value 'colour'"),
        ("taxels = {lines = 3}", "taxels has no value 'lines'"),
        ('size = "12 mm"', r"size = '12 mm'; expected two numbers \(x, y\) in metres"),
        ("size = [12, 12]", "lengths in metres"),
        ('surface = {kind = "cone"}', "one of flat, sphere, cylinder, ellipsoid, patch"),
        ('surface = {kind = "sphere"}', 'needs radius|"sphere" does not have just'),
        ('surface = {kind = "sphere", radius = 6e-3}', "at x = "),
        (
            'surface = {kind = "mesh"}',
            'a mesh as surface lacks "file"; expected such as file = "tip.stl" and, if wanted',
        ),
        ('taxels = "nowhere.csv"', "cannot be read"),
        ("layers = [{thickness = 1e-3}]", 'a layer lacks "poisson"'),
    ],
)
def test_what_is_wrong_is_named_with_the_file(tmp_path, text, says):
    with pytest.raises(PadError, match=says) as caught:
        pad_from_file(in_file(tmp_path, text))
    assert "pad.toml" in str(caught.value)


def test_models_may_name_a_file(tmp_path):
    path = in_file(tmp_path, DOME)
    assert named_pad(str(path)) == mjtactile.pad_from_file(path)
    with pytest.raises(SceneError, match=r"cannot read .*nowhere\.toml"):
        named_pad("nowhere.toml")


@pytest.mark.parametrize("path", [None, 3, b"pad.toml"], ids=str)
def test_the_name_of_a_pads_file_is_a_text(path):
    with pytest.raises(PadError, match=r"path is of type .*; expected a path"):
        pad_from_file(path)
