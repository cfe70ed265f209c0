"""Contacts that a new user meets on the first day are read, and read as they are: see rough_cases.py."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import shapely
from bodies_of_model import compare
from rough_cases import CASES, load

import mjtactile
from mjtactile.sim.wrench import contact_wrench

pytestmark = pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")
TOP_MODULUS = mjtactile.Pad().layers[0].young
SHAPE = mjtactile.Pad().reading_shape


def read(name: str, sensor: str = "touch") -> np.ndarray:
    """Readings of a case at rest, (layers, rows, columns) [Pa]; all default pads."""
    model, data = load(name, output="von_mises")
    mujoco.mj_forward(model, data)
    return data.sensor(sensor).data.reshape(SHAPE).copy()


@pytest.mark.parametrize("name", [name for name in CASES if "rim" in name] + ["box from beside"])
def test_what_meets_a_rim_is_read_without_harm(name):
    model, data = load(name)
    for _ in range(CASES[name].steps):
        mujoco.mj_step(model, data)
        readings, wrench = np.split(data.sensor("touch").data, [np.prod(SHAPE)])
        assert np.isfinite(readings).all()
        assert (readings >= 0.0).all()
        expected = contact_wrench(model, data, model.geom("pad").id)
        np.testing.assert_allclose(wrench, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", [name for name in CASES if name.startswith("ball ")])
def test_geoms_that_do_not_collide_change_nothing(name):
    expected = read("ball")
    assert expected.max() > 1e4
    np.testing.assert_allclose(read(name), expected, atol=1e-6 * expected.max())


@pytest.mark.parametrize(
    ("changed", "twin"),
    [("size changed", "size as changed"), ("height field changed", "height field as changed")],
)
def test_a_model_that_changes_while_it_runs_is_followed(changed, twin):
    expected, found = read(twin), read(changed)
    assert expected.max() > 1e4
    # Heights are stored in single precision, and MuJoCo settles in another way.
    assert np.linalg.norm(found - expected) <= 1e-3 * np.linalg.norm(expected)


def test_an_object_asleep_keeps_its_reading():
    model, data = load("asleep", output="von_mises")
    for _ in range(CASES["asleep"].steps):
        mujoco.mj_step(model, data)
        if data.ntree_awake == 0:
            break
    assert data.ntree_awake == 0
    awake = data.sensor("touch").data.copy()
    assert awake.max() > 1e3
    mujoco.mj_step(model, data, 20)
    asleep = data.sensor("touch").data.copy()
    # A steady pose is answered by its wrench basis after a few steps.
    np.testing.assert_allclose(asleep, awake, atol=1e-3 * awake.max())
    mujoco.mj_step(model, data, 100)
    assert data.ntree_awake == 0
    np.testing.assert_array_equal(data.sensor("touch").data, asleep)


CENTRED = [
    "torus mesh", "notched bar", "two rods", "four rods", "wide ring", "ring of 100 mN",
    "cross of bars", "hash of bars",
    "two balls", "two bodies", "frame", "ball", "15 x 15 x 5 mm",
    "edge, 1.5 gf", "edge, 3 gf",
    "2 feet", "3 feet", "4 feet", "5 feet", "6 feet", "25 feet", "edge, 6 gf",
]  # fmt: skip


@pytest.mark.parametrize("name", CENTRED)
def test_what_is_centred_is_read_symmetrically(name):
    readings = read(name)
    assert readings.max() > 1e3
    for axis in CASES[name].mirrors:
        mirrored = np.flip(readings, axis={"x": 2, "y": 1}[axis])
        np.testing.assert_allclose(mirrored, readings, atol=1e-6 * readings.max(), err_msg=f"mirrored along {axis}")


def test_a_ring_moved_by_two_micrometres_is_read_almost_alike():
    centred, moved = read("torus mesh"), read("torus mesh, 2 um aside")
    assert 0.0 < np.linalg.norm(moved - centred) < 0.01 * np.linalg.norm(centred)


@pytest.mark.parametrize("name", ["cross of bars", "hash of bars"])
def test_rounding_does_not_decide_where_bars_along_lines_of_cells_touch(name):
    still, moved = read(name), read(f"{name}, 1 nm aside")
    assert still.max() > 1e3
    np.testing.assert_allclose(moved, still, atol=1e-4 * still.max())


@pytest.mark.parametrize("fidelity", ["fast", "balanced"])
@pytest.mark.parametrize("name", [name for name in CASES if name.startswith("ring of")])
def test_a_ring_loads_the_pad_evenly_along_its_circle(name, fidelity):
    """However narrow it is: a force spread evenly over a circle's line gives the same readings."""
    model, data = load(name, fidelity=fidelity, output="von_mises")
    mujoco.mj_forward(model, data)
    found = data.sensor("touch").data.reshape(SHAPE)
    line = shapely.Point(0.0, 0.0).buffer(4.05e-3, 64) - shapely.Point(0.0, 0.0).buffer(3.95e-3, 64)
    pressure = CASES[name].force / line.area
    influence = mjtactile.influence_matrices(mjtactile.Pad(), fidelity=fidelity)
    even = mjtactile.SurfaceLoad.from_tractions(influence, line, lambda points, normals: -pressure * normals)
    expected = influence.readings(even)
    # Taxels feel the contact's width, of up to 0.2 mm, and the pad's edges draw load from the circle: 0.3 to 1.9 %.
    assert np.linalg.norm(found - expected) <= 0.03 * np.linalg.norm(expected)


@pytest.mark.parametrize("name", [name for name in CASES if name.startswith("grip")])
def test_no_grip_is_read_harder_than_the_pad_bears(name):
    model, data = load(name, output="von_mises")
    mujoco.mj_forward(model, data)
    for sensor in ("touch", "touch2"):
        readings = data.sensor(sensor).data
        assert 1e3 < readings.max() <= TOP_MODULUS


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["fast", "balanced"])
def test_a_load_on_the_sheets_corner_is_carried_as_near_to_it_as_can_be(fidelity):
    model, data = load("grip by a corner", fidelity=fidelity, output="carried")
    mujoco.mj_forward(model, data)
    for sensor, side in (("touch", 1.0), ("touch2", -1.0)):
        carried = data.sensor(sensor).data
        # The load goes through the corner: the triangle that bears it under the modulus has its middle a third in.
        leg = np.sqrt(2 * -carried[2] / TOP_MODULUS)
        through = np.array([-carried[4], side * carried[3]]) / carried[2]
        # Cells are an eighth of the leg, and do not end where the triangle does: a few per cent of it.
        np.testing.assert_allclose(through, 7.5e-3 - leg / 3, atol=0.02 * leg)


def test_an_edge_at_45_degrees_is_read_below_the_pads_modulus():
    for name in CASES:
        if name.startswith("edge"):
            assert 1e3 < read(name).max() <= TOP_MODULUS


DENSE = [
    "ball", "torus mesh", "notched bar", "O-ring", "wide ring", "O-ring across the sheet's end",
    "two rods", "four rods", "two balls", "two bodies",
    "3 feet", "4 feet", "6 feet", "25 feet", "square below a plate", "balls below a plate", "frame",
    "plane on a narrow pad", "edge, 1.5 gf", "edge, 3 gf", "edge, 6 gf", "capsule", "15 x 15 x 5 mm",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", DENSE)
def test_readings_are_those_of_the_dense_contact(name):
    model, data = load(name, output="von_mises")
    mujoco.mj_forward(model, data)
    # Rings are narrow: on 1,000 cells the dense contact itself is off by up to 13 %.
    # Along the sheet's end, the ring presses with its flank: 7 %, and 11 % if cells do not follow it.
    cells, bound = (2500, 0.09 if "end" in name else 0.06) if "ring" in name else (1000, 0.15)
    if "plate" in name:  # a step, which many cells tell
        cells = 2500
    found = compare(model, data, cells=cells)
    assert found.dense.readings.max() > 1e3
    assert found.error <= bound, f"{100 * found.error:.1f} %"


def at_rest(geom: str, height: float, turned: tuple[float, float, float], fidelity: str) -> tuple[np.ndarray, float]:
    """Readings [Pa] under a body that moves down from a height [m], and the share of its weight that they carry [-]."""
    spec = mujoco.MjSpec.from_string(
        f"""<mujoco>
              <compiler angle="radian"/>
              <option timestep=".001" cone="elliptic" integrator="implicitfast"/>
              <worldbody>
                <body name="finger"/>
                <body pos=".0004 .0009 {height}" euler="{" ".join(map(str, turned))}">
                  <joint type="slide" axis="0 0 1"/>{geom}
                </body>
              </worldbody>
            </mujoco>"""
    )
    mjtactile.attach_pad(spec, body="finger", name="touch", fidelity=fidelity, output="von_mises wrench carried")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    readings, wrench, carried = np.split(data.sensor("touch").data, [-12, -6])
    return readings, carried[2] / wrench[2]


@pytest.mark.parametrize("fidelity", ["fast", "balanced"])
@pytest.mark.parametrize(
    ("length", "diameter", "yaw"),
    [(8e-3, 100e-6, 0.0), (8e-3, 100e-6, 0.02), (20e-3, 300e-6, 0.0), (20e-3, 60e-6, 0.01)],
)
def test_a_thin_wire_is_read_as_a_rod(length, diameter, yaw, fidelity):
    def lying(radius: float) -> str:
        return f'<geom type="capsule" size="{radius} {length / 2}" euler="0 1.5707963267948966 0" mass=".004"/>'

    wire, carried = at_rest(lying(diameter / 2), diameter / 2, (0.0, 0.0, yaw), fidelity)
    rod, _ = at_rest(lying(length / 20), length / 20, (0.0, 0.0, yaw), fidelity)
    assert carried == pytest.approx(1.0)
    # The rod's contact is wider, but narrow as well for taxels at 1 mm depth.
    assert np.linalg.norm(wire - rod) <= 0.1 * np.linalg.norm(rod)


def test_cells_that_are_too_few_to_bear_the_load_are_not_chosen():
    """One end of a box's edge presses. Fewer cells have less energy, because they bear less."""
    for force in np.linspace(0.03, 0.0345, 10):
        box = f'<geom type="box" size=".003 .005 .003" euler="0 .7853981633974483 0" mass="{force / 9.81}"/>'
        _, carried = at_rest(box, 4.3e-3, (0.01, 0.005, 0.2), "fast")
        assert carried == pytest.approx(1.0), force


def test_parts_that_cannot_reach_the_pad_do_not_press_a_face_anew():
    """A handle leans on its edge. Its recessed base is beside the pad, and would touch a larger one."""
    handle = '<geom type="box" size=".006 .0045 .004" mass=".02"/>'
    base = '<geom type="box" size=".006 .02 .004" pos="0 -.03 .0005" mass="0"/>'
    alone, carried = at_rest(handle, 4.3e-3, (0.04, 0.0, 0.0), "fast")
    both, _ = at_rest(handle + base, 4.3e-3, (0.04, 0.0, 0.0), "fast")
    assert carried == pytest.approx(1.0)
    np.testing.assert_allclose(both, alone, rtol=1e-9, atol=1e-9 * alone.max())
