"""In every press scene of scenes/, with the pad first or last and under every law, tractions add up to MuJoCo's wrench.

MuJoCo puts a sphere before a box in a contact wherever they stand; test_gap_sensor.py has pairs in both orders.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import mujoco
import pytest

from mjtactile.cli.benchmarks.extremes import left_over
from mjtactile.pad import force_vector
from mjtactile.sensor import TactileSensor
from mjtactile.sim.assets import asset_path
from mjtactile.sim.press_scene import press
from mjtactile.sim.wrench import contact_wrench

SCENES = sorted(path.name for path in asset_path("scenes/press.xml").parent.glob("press*.xml"))
LAWS = [
    ("uniform", "proportional"),
    ("foundation", "proportional"),
    ("elastic", "proportional"),
    ("elastic", "stick"),
    ("elastic", "coulomb"),
]


def loaded(name: str, *, pad_first: bool) -> mujoco.MjModel:
    """A scene, its pad before or after everything else."""
    root = ElementTree.parse(asset_path(f"scenes/{name}")).getroot()
    world = root.find("worldbody")
    assert world is not None
    pad = next(body for body in world.iter("body") if body.get("name") == "pad")
    world.remove(pad)
    world.insert(0 if pad_first else len(world), pad)
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))


def test_there_are_scenes():
    assert len(SCENES) >= 2


@pytest.mark.parametrize("pad_first", [True, False])
@pytest.mark.parametrize("name", SCENES)
def test_tractions_add_up_to_mujocos_wrench(name, pad_first, coarse_square):
    model = loaded(name, pad_first=pad_first)
    data = mujoco.MjData(model)
    press(model, data, force_vector(0.3, 15.0, 40.0))
    pad = model.geom("pad").id
    expected = contact_wrench(model, data, pad)
    for law, tangential in LAWS:
        load = TactileSensor(model, influence=coarse_square, law=law, tangential=tangential).load(data)
        assert load is not None
        assert left_over(load, expected[:3], expected[3:], 5e-3) <= 1e-9, (law, tangential)
