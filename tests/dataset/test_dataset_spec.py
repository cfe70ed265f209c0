from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapely import Polygon

from mjtactile.dataset.sampling import outline_presses
from mjtactile.dataset.shapes import shape_face
from mjtactile.dataset.spec import ContactSpec, DatasetSpec, load_spec, parse_spec, spec_from
from mjtactile.errors import DatasetError, IndenterError, TransducerError
from mjtactile.geometry.solid import extrude
from mjtactile.units import GRAM_FORCE

CONTACT = {"shapes": ["star", "sphere"], "size": [0.7, 1.3], "shift": 2.5, "force": 100, "tilt": [0, 30]}


def test_values_are_read_in_millimetres_gram_force_and_degrees():
    (contact,) = parse_spec({"contact": [CONTACT]}).contacts
    assert contact.shift == pytest.approx((-2.5e-3, 2.5e-3))
    assert contact.force == pytest.approx((100 * GRAM_FORCE, 100 * GRAM_FORCE))
    assert contact.tilt == pytest.approx((0.0, math.radians(30)))
    assert contact.weight == 2.0


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "no .*contact"),
        ({"contact": [CONTACT], "pressses": 3}, "pressses.*Available"),
        ({"contact": [{**CONTACT, "colour": 1}]}, "colour"),
        ({"contact": [{**CONTACT, "size": [2, 1]}]}, "size"),
        ({"contact": [{**CONTACT, "shapes": []}]}, "shapes"),
        ({"contact": [CONTACT], "fidelity": "best"}, "best.*Available: fast"),
        ({"contact": [CONTACT], "presses": 0}, "presses"),
        ({"contact": [CONTACT], "free": 1.5}, "share"),
        ({"contact": [CONTACT], "noise": -0.1}, "noise"),
        ({"contact": [CONTACT], "backend": "real"}, "mujoco"),
        ({"contact": [{**CONTACT, "weight": "2"}]}, "weight = '2'"),
        ({"contact": [{**CONTACT, "upright": 2}]}, "upright = 2.0; expected a share"),
        ({"contact": [{**CONTACT, "size": [1, "x"]}]}, r"size = \[1, 'x'\]; expected \[low, high\]"),
        ({"contact": [{**CONTACT, "tilt": [0, 95]}]}, r"tilt = \[0, 95\] deg; expected values from 0 to 89 deg"),
        ({"contact": [CONTACT], "pad": {"width": 1}}, "width"),
        ({"contact": [CONTACT], "transducer": {"name": "optical"}}, "'optical'.*capacitive"),
    ],
)
def test_what_cannot_be_is_refused_by_name(values, said):
    with pytest.raises(DatasetError, match=said):
        parse_spec(values)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"weight": math.nan}, "weight = nan; expected a positive"),
        ({"weight": 0.0}, "weight"),
        ({"weight": -1.0}, "weight"),
        ({"size": (0.0, 1.0)}, "size"),
        ({"shift": (1e-3, -1e-3)}, r"shift = \[1, -1\] mm; expected \[low, high\]"),
        ({"rotation": (0.0, math.inf)}, "rotation"),
        ({"force": (1.0, math.nan)}, r"force = \(1.0, nan\)"),
        ({"force": 1.0}, r"force = 1.0; expected \[low, high\], such as \[1, 1\]"),
        ({"force": np.ones(3)}, r"force = \[1.0, 1.0, 1.0\]; expected \[low, high\]\."),
        ({"tilt": (0.0, 1.6)}, "tilt"),
        ({"azimuth": ("a", "b")}, "azimuth"),
        ({"upright": -0.1}, "upright = -0.1; expected a share"),
    ],
)
def test_contacts_made_in_python_are_checked_as_those_of_files_are(values, said):
    with pytest.raises(DatasetError, match=said):
        ContactSpec(shapes=("star",), **values)


def test_numbers_of_numpy_become_numbers_of_python():
    numbers: dict[str, Any] = {"weight": np.int64(2), "size": np.array([0.5, 2.0], np.float32)}
    numbers |= {"tilt": (np.float32(0.25), np.float64(0.5)), "upright": np.float32(0.5)}
    counts: dict[str, Any] = {"presses": np.int64(8), "seed": np.uint8(3), "poses": np.int32(2), "forces": np.int16(1)}
    counts |= {"noise": np.zeros(2), "free": np.float32(0.5)}
    counts |= {"transducer": {"name": "capacitive", "full_scale": np.float32(5e4)}}
    of_numpy = DatasetSpec(contacts=(ContactSpec(shapes=("star",), **numbers),), **counts)
    contact = ContactSpec(shapes=("star",), weight=2, size=(0.5, 2.0), tilt=(0.25, 0.5), upright=0.5)
    counts = {"presses": 8, "seed": 3, "poses": 2, "forces": 1, "free": 0.5}
    plain = DatasetSpec(contacts=(contact,), transducer={"name": "capacitive", "full_scale": 5e4}, **counts)
    assert json.dumps(of_numpy.description) == json.dumps(plain.description)
    assert of_numpy.fingerprint == plain.fingerprint
    assert type(of_numpy.contacts[0].tilt[0]) is float


@pytest.mark.parametrize("counts", [{"poses": 0}, {"forces": 1.5}])
def test_counts_made_in_python_are_checked_as_those_of_files_are(counts):
    with pytest.raises(DatasetError, match=r"(poses|forces) = .*expected a whole number from 1 to 10000"):
        DatasetSpec(contacts=(ContactSpec(shapes=("star",)),), **counts)


@pytest.mark.parametrize(
    ("chosen", "said"),
    [
        ({"backend": "mujcoco"}, "backend 'mujcoco' does not exist. Available: physics, mujoco"),
        ({"presets": ("quick",)}, "presets 'quick' does not exist. Available: fast"),
        ({"laws": ("elastic", "soft")}, "laws 'soft' does not exist. Available: uniform"),
        ({"laws": ()}, "laws is empty"),
        ({"tangential": ("coulomb",)}, "tangential 'coulomb' does not exist. Available: proportional, stick"),
        ({"contacts": ()}, r"contacts = \(\); expected at least one ContactSpec"),
        ({"contacts": ("star",)}, "expected at least one ContactSpec"),
        ({"poses": 200, "forces": 60}, "poses = 200 times forces = 60 presses share one outline"),
        ({"pad": "dome.toml"}, "pad is of type str; expected a mjtactile.Pad"),
    ],
)
def test_names_and_types_in_python_are_checked_as_those_of_files_are(chosen, said):
    with pytest.raises(DatasetError, match=said):
        DatasetSpec(**{"contacts": (ContactSpec(shapes=("star",)),), **chosen})


@pytest.mark.parametrize("shapes", ["star", (), (3,)])
def test_shapes_of_a_contact_are_a_list_of_names(shapes):
    with pytest.raises(DatasetError, match="expected a list of names"):
        ContactSpec(shapes=shapes)


def test_laws_and_distributions_of_shear_that_do_not_go_together_are_refused():
    mixed = {"contact": [CONTACT], "law": ["elastic", "foundation"], "tangential": ["proportional", "stick"]}
    with pytest.raises(DatasetError, match=r"'stick' needs law='elastic'; law 'foundation' knows"):
        parse_spec(mixed)
    parse_spec({**mixed, "law": "elastic"})
    parse_spec({**mixed, "tangential": "proportional"})


@pytest.mark.parametrize("name", ["delay", "hysteresis"])
def test_imperfections_that_act_from_one_sample_to_the_next_are_refused(name):
    transducer = {"name": "capacitive", "imperfections": {name: 3}}
    with pytest.raises(DatasetError, match=rf"{name} = 3 acts from one sample to the next.*Leave it out"):
        parse_spec({"contact": [CONTACT], "transducer": transducer})
    transducer["imperfections"] = {name: 0}
    parse_spec({"contact": [CONTACT], "transducer": transducer})


@pytest.mark.parametrize(
    ("force", "axis"),
    [
        ({"force": 255}, "z"),
        ({"force": [5, 300], "tilt": 45, "upright": 0.1}, "z"),
        ({"force": [5, 300], "tilt": [40, 60]}, "x"),
        ({"force": [5, 300], "tilt": 60, "azimuth": [200, 280]}, "y"),
    ],
)
def test_forces_that_press_scenes_cannot_make_are_refused(force, axis):
    """The actuators make 2.5 N, 254.9 gf, along each axis."""
    values = {"contact": [{"shapes": ["star"], **force}]}
    with pytest.raises(DatasetError, match=rf"along {axis}, but with backend 'mujoco' a press has at most 254 gf"):
        parse_spec({**values, "backend": "mujoco"})
    parse_spec(values)


def test_forces_that_press_scenes_just_make_are_accepted():
    for force in ({"force": 254.9}, {"force": 350, "tilt": 45}, {"force": 290, "tilt": 60, "azimuth": [20, 60]}):
        parse_spec({"backend": "mujoco", "contact": [{"shapes": ["star"], **force}]})


@pytest.mark.parametrize("dead", [[5], [[0, 0, 0.5]], 5])
def test_dead_taxels_that_cannot_be_are_refused_as_the_file_is_read(tmp_path, dead):
    path = tmp_path / "spec.toml"
    path.write_text(
        f'transducer = {{ name = "capacitive", imperfections = {{ dead_taxels = {dead} }} }}\n'
        '[[contact]]\nshapes = ["star"]\n'
    )
    with pytest.raises(TransducerError, match=r"dead_taxels = .*layer, row, column"):
        load_spec(str(path))


def test_an_unknown_shape_is_refused_with_those_there_are():
    with pytest.raises(IndenterError, match=r"blob.*hexagon"):
        parse_spec({"contact": [{"shapes": ["blob"]}]})


def test_a_file_that_is_no_toml_is_one_clear_error(tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text("presses = [")
    with pytest.raises(DatasetError, match=r"spec\.toml"):
        load_spec(path)


def test_a_description_gives_the_specification_back():
    spec = parse_spec({"contact": [CONTACT], "pad": {"depths": [1e-3]}, "law": ["elastic", "uniform"], "seed": 5})
    assert spec_from(spec.description) == spec
    assert spec_from(spec.description).fingerprint == spec.fingerprint


def test_the_fingerprint_knows_the_seed_but_not_how_many():
    spec = parse_spec({"contact": [CONTACT], "presses": 10})
    assert parse_spec({"contact": [CONTACT], "presses": 20}).fingerprint == spec.fingerprint
    assert parse_spec({"contact": [CONTACT], "seed": 1}).fingerprint != spec.fingerprint


def _tool(path: Path, width: float) -> None:
    """A mesh of a square punch of this width [m]."""
    half = width / 2
    extrude(Polygon([(-half, -half), (half, -half), (half, half), (-half, half)]), 5e-3).export(path)


def _area(mesh: Path) -> float:
    face = shape_face(str(mesh))
    assert face is not None
    return face.area


def test_the_fingerprint_knows_what_a_mesh_file_contains_not_only_its_name(tmp_path):
    mesh = tmp_path / "tool.stl"
    _tool(mesh, 4e-3)
    spec = parse_spec({"contact": [{"shapes": [str(mesh), "star"]}]})
    before = spec.fingerprint
    assert _area(mesh) == pytest.approx(16e-6)
    _tool(mesh, 6e-3)
    assert spec.fingerprint != before
    assert _area(mesh) == pytest.approx(36e-6)
    _tool(mesh, 4e-3)
    assert spec.fingerprint == before
    mesh.unlink()
    with pytest.raises(IndenterError, match=r"tool\.stl: there is no such file"):
        _ = spec.fingerprint


def test_fingerprints_without_meshes_stay_what_they_were():
    """Otherwise no dataset made before could be continued."""
    spec = parse_spec({"contact": [CONTACT]})
    assert spec.fingerprint == "6640e3f0cba3bab937ce6fa1d20a8c2afa08e55d313d43378dee9532bc150407"


def test_a_specification_is_the_same_from_wherever_its_file_is_named(tmp_path, monkeypatch):
    (tmp_path / "set").mkdir()
    _tool(tmp_path / "set" / "tool.stl", 4e-3)
    (tmp_path / "set" / "set.toml").write_text('[[contact]]\nshapes = ["tool.stl", "star"]\n')
    monkeypatch.chdir(tmp_path / "set")
    one, other = load_spec("set.toml"), load_spec(tmp_path / "set" / "set.toml")
    assert one.contacts[0].shapes == ("tool.stl", "star")
    assert one.fingerprint == other.fingerprint


def test_weights_whose_sum_is_too_large_for_a_number_are_shares_all_the_same():
    huge = parse_spec({"contact": [{**CONTACT, "weight": 1e308}, {**CONTACT, "weight": 1e308, "size": 2}]})
    plain = parse_spec({"contact": [{**CONTACT, "weight": 1}, {**CONTACT, "weight": 1, "size": 2}]})
    sizes = [[outline_presses(spec, index).size for index in range(50)] for spec in (huge, plain)]
    assert sizes[0] == sizes[1]
    assert 10 < np.sum(np.array(sizes[0]) == 2.0) < 40


def test_equal_specifications_have_one_hash_with_a_transducer_too():
    values = {"contact": [CONTACT], "transducer": {"name": "capacitive", "imperfections": {"dead": 0.1}}}
    assert hash(parse_spec(values)) == hash(parse_spec(values))


@pytest.mark.parametrize("path", [None, 3, b"set.toml"])
def test_what_is_no_path_is_refused(path):
    with pytest.raises(DatasetError, match=r"path is of type .*expected a path"):
        load_spec(path)
