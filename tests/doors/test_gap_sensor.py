"""Curved and flat bodies press through law "elastic": MuJoCo's wrench goes in whole, whatever the shape."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mjtactile.cli.benchmarks.extremes import left_over
from mjtactile.geometry.indenter import indenter_solid
from mjtactile.sensor import TactileSensor
from mjtactile.sim.wrench import contact_wrench

PAD = """<body name="pad"><geom name="pad" type="box" size="0.0075 0.0075 0.0025" pos="0 0 -0.0025" priority="1"
    condim="4" solref="0.003 1" friction="1 0.0005 0.0001"/></body>"""
#: Geom, turn [deg], height of its middle when it just touches [m].
BODIES = {
    "sphere": ('type="sphere" size=".004"', "0 0 0", 4e-3),
    "cylinder on its side": ('type="cylinder" size=".003 .003"', "0 90 0", 3e-3),
    "flat box": ('type="box" size=".002 .003 .002"', "0 0 0", 2e-3),
    "edge": ('type="box" size=".003 .003 .003"', "45 0 0", 3e-3 * np.sqrt(2.0)),
    "corner": ('type="box" size=".003 .003 .003"', "45 35.26438968 0", 3e-3 * np.sqrt(3.0)),
    "star": ('type="mesh" mesh="star"', "0 0 0", 0.0),
}


def pressed(name: str, *, pad_first: bool, place=(1e-3, -5e-4)) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A body that slides without turning, pulled down with 0.2 N and sideways with a tenth of that."""
    geom, turn, height = BODIES[name]
    solid = indenter_solid("star")
    vertices, faces = (" ".join(map(repr, a.ravel().tolist())) for a in (solid.vertices, solid.faces))
    body = f"""<body name="b" pos="{place[0]} {place[1]} {height - 2e-6}">
        <joint type="slide" axis="1 0 0" damping="5"/><joint type="slide" axis="0 1 0" damping="5"/>
        <joint type="slide" axis="0 0 1"/><frame euler="0 0 20"><geom {geom} euler="{turn}" mass="0.01"/></frame>
        </body>"""
    bodies = PAD + body if pad_first else body + PAD
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="0.001" integrator="implicitfast"
        cone="elliptic" impratio="100" jacobian="dense" gravity="2 0 -20"/>
        <asset><mesh name="star" vertex="{vertices}" face="{faces}" inertia="exact"/></asset>
        <worldbody>{bodies}</worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 60)
    return model, data


# An ideal edge or corner strains any pad beyond the linear range, as the warning rightly says.
@pytest.mark.filterwarnings("ignore:.*strains are no longer small")
@pytest.mark.parametrize("pad_first", [True, False])
@pytest.mark.parametrize("name", BODIES)
def test_loads_resultant_is_mujocos_wrench(name, pad_first, draft):
    model, data = pressed(name, pad_first=pad_first)
    expected = contact_wrench(model, data, model.geom("pad").id)
    assert expected[2] < -0.1
    load = TactileSensor(model, influence=draft, law="elastic").load(data)
    assert load is not None
    assert left_over(load, expected[:3], expected[3:], 1e-2) <= 1e-9


def test_two_balls_press_as_one_by_one(draft):
    ball = (
        '<body pos="{} 0 .00399"><joint type="slide" axis="0 0 1"/><geom type="sphere" size=".004" mass=".01"/></body>'
    )
    loads = []
    for places in ((-4e-3, 4.5e-3), (-4e-3,), (4.5e-3,)):
        bodies = "".join(ball.format(x) for x in places)
        model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{PAD}{bodies}</worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 300)
        load = TactileSensor(model, influence=draft, law="elastic").load(data)
        assert load is not None
        loads.append(load.forces)
    np.testing.assert_allclose(loads[0], loads[1] + loads[2], atol=1e-4 * np.abs(loads[0]).max())
