"""A pad as text: the same pad again, and nothing else but a pad."""

import json

import pytest

from mjtactile.errors import PadError, SceneError
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_names import pad_from_text, pad_text, register_pad

LAYERED = Pad(
    size=(22e-3, 0.1 + 0.2),
    layers=(Layer(thickness=1e-3, young=1e6 / 3, poisson=0.45), Layer(thickness=2e-3, young=5e6, poisson=0.3)),
    taxels=TaxelGrid(rows=4, columns=7, pitch=(2e-3, 3e-3), centre=(1e-3, -1e-4)),
    depths=(5e-4, 2.5e-3),
    sampling_radius=1e-4 / 3,
)


@pytest.mark.parametrize("pad", [Pad(), LAYERED])
def test_text_gives_the_same_pad_to_the_last_bit(pad):
    assert pad_from_text(pad_text(pad)) == pad
    assert pad_from_text(pad_text(pad)).fingerprint == pad.fingerprint
    assert "\n" not in pad_text(pad)


def changed(**values):
    return json.dumps(json.loads(pad_text(Pad())) | values)


TAXELS = {"rows": 2, "columns": 2, "pitch": [1e-3, 1e-3], "centre": [0, 0]}
WRONG = {
    "{": "not JSON",
    '{"size": [0.015, 0.015]} or so': "not JSON",
    "[" * 100_000: "not JSON",
    '{"depths": [' + "9" * 5000 + "]}": "not JSON",
    "{}": 'lacks "depths"',
    "[]": "expected an object",
    pad_text(Pad())[:-1] + ',"size":[0.01,0.01]}': "twice",
    changed(colour="red"): "no value 'colour'",
    changed(size=15e-3): "expected two numbers",
    changed(size=[15e-3]): "expected two numbers",
    changed(size=["15e-3", 15e-3]): "expected a number",
    changed(size=[True, 15e-3]): "expected a number",
    changed(size=[-15e-3, 15e-3]): "15 mm is 15e-3",
    changed(size=[float("nan"), 15e-3]): "positive lengths",
    changed(size=[10**400, 15e-3]): "size = .*; expected two positive lengths",
    changed(layers={}): "list of layers",
    changed(layers=[]): "at least one Layer",
    changed(layers=[{"thickness": 5e-3, "young": 3e6}]): 'lacks "poisson"',
    changed(layers=[{"thickness": "5e-3", "young": 3e6, "poisson": 0.4}]): "expected a number",
    changed(taxels=None): "expected an object",
    changed(taxels=TAXELS | {"rows": 2.5}): "whole number",
    changed(taxels=TAXELS | {"rows": None}): "rows = None; expected a whole number",
    changed(taxels=TAXELS | {"pitch": [1e-3, 1e-3, 1e-3]}): "two numbers",
    changed(taxels=TAXELS | {"pitch": [True, 1e-3]}): "pitch = True; expected a number",
    changed(depths=[]): "depths is empty",
    changed(depths=None): "depths = None; expected numbers",
    changed(depths="1e-3"): "depths = '1e-3'; expected numbers",
    changed(sampling_radius=None): "expected a number",
}


@pytest.mark.parametrize("text", WRONG, ids=[f"{text[:30]} {says}" for text, says in WRONG.items()])
def test_anything_else_is_refused_with_the_cure(text):
    with pytest.raises(PadError, match=WRONG[text]) as caught:
        pad_from_text(text)
    assert len(str(caught.value)) < 400


def test_where_pads_are_named_a_text_names_one_as_well():
    from mjtactile.plugin.attributes import known_pad

    assert known_pad(pad_text(LAYERED)) == LAYERED
    with pytest.raises(SceneError, match=r'mjtactile\.pad.*"pad".*lacks'):
        known_pad("{}")
    with pytest.raises(SceneError, match="does not exist"):
        known_pad("x" * 5000)
    with pytest.raises(SceneError, match=r'"pad".*not a whole influence table.*TOML'):
        known_pad(__file__)


@pytest.mark.parametrize("name", [5, None, "", "a.b", "pads/mine.mjt", "{a", "{mine}"])
def test_what_is_no_name_of_a_pad_is_refused(name):
    with pytest.raises(SceneError, match="cannot be the name of a pad"):
        register_pad(name, Pad())
