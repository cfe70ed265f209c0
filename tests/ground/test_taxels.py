"""Taxels anywhere: points, files of them, and points that are not in the pad."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mjtactile.errors import PadError
from mjtactile.pad import Layer, Pad
from mjtactile.pad_names import pad_from_text, pad_text
from mjtactile.pad_shape.surfaces import SphereCap
from mjtactile.pad_shape.taxels import FreeTaxels

POINTS = [[0.0, 0.0, -1e-3], [2e-3, -1e-3, -2e-3], [7.5e-3, 0.0, 0.0]]


def test_points_are_a_pads_taxels():
    pad = Pad(taxels=np.array(POINTS))  # type: ignore[arg-type]
    assert pad.reading_shape == (3,)
    assert pad.depths == ()
    assert pad.sensed_depths == (1e-3, 2e-3, 0.0)
    assert pad == Pad(taxels=POINTS)  # type: ignore[arg-type]
    assert "3 free taxels" in pad.summary
    assert pad_from_text(pad_text(pad)) == pad


def test_the_mark_that_spreadsheets_put_before_a_text_is_none_of_it(tmp_path):
    (tmp_path / "taxels.csv").write_text("x,y,z\n0,0,-0.001\n", encoding="utf-8-sig")
    (tmp_path / "taxels.json").write_text("[[0,0,-0.001]]", encoding="utf-8-sig")
    for name in ("taxels.csv", "taxels.json"):
        assert Pad(taxels=str(tmp_path / name)).reading_shape == (1,)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["x;y;z\n0;0;-0.001\n", "x;y;z\n0,0;0,0;-0,001\n"])
def test_other_separators_are_refused_with_the_right_ones(tmp_path, text):
    (tmp_path / "taxels.csv").write_text(text)
    with pytest.raises(PadError, match="separated by commas, with decimal points"):
        Pad(taxels=str(tmp_path / "taxels.csv"))  # type: ignore[arg-type]


def test_a_file_that_cannot_be_read_is_refused_in_words(tmp_path):
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00")
    for name, says in (
        ("none.csv", "there is no such file"),
        (".", "it is a folder"),
        ("bytes.csv", "it is not UTF-8 text"),
    ):
        with pytest.raises(PadError, match=f"cannot be read: {says}"):
            Pad(taxels=str(tmp_path / name))  # type: ignore[arg-type]


def test_a_csv_file_whose_quote_does_not_end_is_refused(tmp_path):
    (tmp_path / "taxels.csv").write_text('x,y,z\n"' + "0," * 70_000)
    with pytest.raises(PadError, match="holds no taxels"):
        FreeTaxels.from_file(tmp_path / "taxels.csv")


@pytest.mark.parametrize("name", ["taxels.csv", "plain.csv", "taxels.json", "rows.json"])
def test_files_hold_taxels(tmp_path, name):
    path, radii = tmp_path / name, [3e-4, 4e-4, 5e-4]
    if name == "taxels.csv":
        rows = [f"{r},{y},{x},{z}" for (x, y, z), r in zip(POINTS, radii, strict=True)]
        path.write_text("\n".join(["radius, y, x, z", *rows, ""]))
    elif name == "plain.csv":
        rows = [f"{x},{y},{z},{r}" for (x, y, z), r in zip(POINTS, radii, strict=True)]
        path.write_text("\n".join(rows))
    elif name == "taxels.json":
        path.write_text(json.dumps({"points": POINTS, "radii": radii}))
    else:
        path.write_text(json.dumps(POINTS))
        radii = None
    assert Pad(taxels=path).taxels == FreeTaxels(POINTS, radii)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "", "empty"),
        ("a.csv", "x,y\n1,2", "its columns are x, y"),
        ("a.csv", "x,y,z\n1,2", "row 1 is"),
        ("a.csv", "x,y,z\n1,2,deep", "row 1 is"),
        ("a.json", "{", "holds no taxels"),
        ("a.json", '{"places": []}', 'expected an object with "points"'),
        ("a.json", "[[0, 0], [1, 1]]", r"points of shape \(2, 2\)"),
        ("a.json", "[[0, 0, NaN]]", "not finite"),
    ],
)
def test_files_without_taxels_say_why(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(PadError, match=said):
        Pad(taxels=tmp_path / name)


def test_a_coordinate_of_thousands_of_digits_is_refused():
    with pytest.raises(PadError, match="a very large number have points that are no numbers"):
        FreeTaxels([[10**5000, 0, 0]])  # type: ignore[arg-type]


@pytest.mark.parametrize("path", [None, 3, b"taxels.csv"], ids=str)
def test_the_name_of_a_file_is_a_text(path):
    with pytest.raises(PadError, match=r"path is of type .*; expected a path"):
        FreeTaxels.from_file(path)


@pytest.mark.parametrize("points", [[[0.0, 0.0, "-1e-3"]], np.array([[0.0, 0.0, 1j - 1e-3]])], ids=["text", "complex"])
def test_coordinates_are_real_numbers(points):
    with pytest.raises(PadError, match="have points that are no numbers"):
        FreeTaxels(points)


@pytest.mark.parametrize("point", [[0.0, 0.0, 1e-4], [0.0, 0.0, -5.1e-3], [7.6e-3, 0.0, -1e-3], [0.0, -8e-3, -1e-3]])
def test_a_point_outside_a_flat_pad_is_named(point):
    with pytest.raises(PadError, match=f"taxel 1 at .*{point[2]}.* lies outside the pad"):
        Pad(taxels=[[0.0, 0.0, -1e-3], point])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("point", "inside"),
    [
        ([0.0, 0.0, -1.9e-3], True),
        ([0.0, 0.0, -2.1e-3], False),
        ([4.9e-3, 0.0, -0.9e-3], False),  # above the dome, though below its apex
        ([4.9e-3, 0.0, -1.2e-3], True),
        ([4.9e-3, 0.0, -2.9e-3], False),  # beyond the side, which runs along the normal
    ],
)
def test_inside_a_dome_is_between_its_offset_surfaces_and_its_sides(point, inside):
    make = {
        "size": (10e-3, 10e-3),
        "layers": (Layer(thickness=2e-3, young=1e6, poisson=0.4),),
        "sampling_radius": 0.2e-3,
        "surface": SphereCap(12e-3),
    }
    if inside:
        assert Pad(**make, taxels=[point]).reading_shape == (1,)  # type: ignore[arg-type]
    else:
        with pytest.raises(PadError, match="taxel 0"):
            Pad(**make, taxels=[point])  # type: ignore[arg-type]


def test_free_taxels_have_depths_and_radii_of_their_own():
    with pytest.raises(PadError, match="Leave depths out"):
        Pad(taxels=POINTS, depths=(1e-3,))  # type: ignore[arg-type]
    with pytest.raises(PadError, match=r"radii of shape \(2,\)"):
        FreeTaxels(POINTS, (1e-4, 1e-4))  # type: ignore[arg-type]
    with pytest.raises(PadError, match=r"taxel 1 .* no positive radius"):
        FreeTaxels(POINTS, (1e-4, 0.0, 1e-4))  # type: ignore[arg-type]
    with pytest.raises(PadError, match=r"taxel 2 has a radius of 1\.0 m"):
        Pad(taxels=FreeTaxels(POINTS, (1e-4, 1e-4, 1.0)))  # type: ignore[arg-type]
    with pytest.raises(PadError, match="taxels on a grid"):
        _ = Pad(taxels=POINTS).grid  # type: ignore[arg-type]
