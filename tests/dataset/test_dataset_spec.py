from __future__ import annotations

import math

import pytest

from mjtactile.dataset.spec import load_spec, parse_spec, spec_from
from mjtactile.errors import DatasetError, IndenterError, TransducerError
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
        ({"contact": [{**CONTACT, "tilt": [0, 95]}]}, "tilt"),
        ({"contact": [{**CONTACT, "shapes": []}]}, "shapes"),
        ({"contact": [CONTACT], "fidelity": "best"}, "best.*Available: fast"),
        ({"contact": [CONTACT], "presses": 0}, "presses"),
        ({"contact": [CONTACT], "free": 1.5}, "share"),
        ({"contact": [CONTACT], "noise": -0.1}, "noise"),
        ({"contact": [CONTACT], "backend": "real"}, "mujoco"),
        ({"contact": [CONTACT], "pad": {"width": 1}}, "width"),
    ],
)
def test_what_cannot_be_is_refused_by_name(values, said):
    with pytest.raises(DatasetError, match=said):
        parse_spec(values)


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
