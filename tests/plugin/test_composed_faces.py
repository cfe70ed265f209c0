"""Faces in one plane, of several geoms of a body, press as one face: that of what they cover together."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, affinity, box, union_all
from shapely.geometry.base import BaseGeometry

import mjtactile

pytestmark = pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")

#: Boxes [mm]: middle, then width and height.
Boxes = Sequence[tuple[float, float, float, float]]
BODIES: dict[str, Boxes] = {
    "T of boxes side by side": [(0, 2, 8, 2), (0, -1.5, 2, 5)],
    "T of boxes that overlap": [(0, 2, 8, 2), (0, -1, 2, 6)],
    "plus": [(0, 0, 8, 2), (0, 0, 2, 8)],
    "L": [(0, 0, 2, 8), (2.5, -3, 3, 2)],
    "boxes that overlap": [(-1, 0, 5, 4), (1, 0.5, 5, 4)],
    "box within another": [(0, 0, 6, 5), (0.5, 0, 2, 2)],
    "twice the same box": [(0, 0, 6, 5), (0, 0, 6, 5)],
    "frame": [(0, 3, 8, 1), (0, -3, 8, 1), (3.5, 0, 1, 5), (-3.5, 0, 1, 5)],
    "frame with its corners covered twice": [(0, 3, 8, 1), (0, -3, 8, 1), (3.5, 0, 1, 7), (-3.5, 0, 1, 7)],
    "boxes that touch at a corner": [(-1.5, -1.5, 3, 3), (1.5, 1.5, 3, 3)],
    "two feet and a bar": [(-3, 0, 2, 6), (3, 0, 2, 6), (0, 0, 4, 1)],
}


def covered(boxes: Boxes) -> BaseGeometry:
    """What the boxes cover together [m]."""
    return union_all([box(x - w / 2, y - h / 2, x + w / 2, y + h / 2) for x, y, w, h in boxes], grid_size=1e-9)


def model_of(geoms: str, fidelity: str = "fast") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"""<mujoco><compiler angle="degree"/>
      <option timestep=".001" integrator="implicitfast" cone="elliptic" jacobian="dense" gravity="0 0 -9.81"/>
      <extension><plugin plugin="mjtactile.pad"/></extension>
      <worldbody>
        <geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025" priority="10" condim="4" solref=".005 1"/>
        <body name="body"><joint type="slide" axis="0 0 1" damping="1"/>{geoms}</body></worldbody>
      <sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
        <config key="fidelity" value="{fidelity}"/><config key="tilt" value="fixed"/></plugin></sensor></mujoco>""")


def of_boxes(boxes: Boxes, frame: str = "") -> str:
    geoms = "".join(
        f'<geom type="box" size="{w / 2000} {h / 2000} .003" pos="{x / 1000} {y / 1000} .003" mass=".002"/>'
        for x, y, w, h in boxes
    )
    return f"<frame {frame}>{geoms}</frame>"


def read(model: mujoco.MjModel) -> tuple[mjtactile.SurfaceLoad, np.ndarray]:
    """Load and wrench of a body that was let down on the pad."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 60)
    sensor = mjtactile.TactileSensor(model, "touch")
    load = sensor.load(data)
    assert load is not None
    return load, sensor.wrench(data)


def area(outline: BaseGeometry) -> float:
    return 1e-6 * outline.area


@pytest.mark.parametrize("name", BODIES)
def test_all_that_the_geoms_cover_bears_pressure(name):
    load, _ = read(model_of(of_boxes(BODIES[name])))
    assert load.state.contact_area == pytest.approx(area(covered(BODIES[name])), rel=1e-9)


@pytest.mark.parametrize("name", ["T of boxes side by side", "plus", "boxes that overlap", "frame"])
@pytest.mark.parametrize("degrees", [0.0, 17.0])
def test_the_face_reads_as_its_outline_pressed_without_mujoco(name, degrees):
    shift = (0.7e-3, -0.4e-3)
    frame = f'pos="{shift[0]} {shift[1]} 0" euler="0 0 {degrees}"'
    load, wrench = read(model_of(of_boxes(BODIES[name], frame), "balanced"))
    influence = mjtactile.influence_matrices(mjtactile.Pad(), fidelity="balanced")
    outline = affinity.translate(
        affinity.rotate(affinity.scale(covered(BODIES[name]), 1e-3, 1e-3, origin=(0, 0)), degrees, origin=(0, 0)),
        *shift,
    )
    alone = mjtactile.contact_load(
        influence,
        mjtactile.Footprint.from_outline(outline, influence.surface),
        force=wrench[:3],
        moment=wrench[3:],
        tilt="fixed",
    )
    expected = influence.readings(alone)
    off = np.linalg.norm(influence.readings(load) - expected) / np.linalg.norm(expected)
    assert off < 0.01


#: Sizes and places on a grid of a quarter of a millimetre, so that many sides lie along each other.
WHOLE = st.integers(-8, 8).map(lambda count: count / 4)
SIDE = st.integers(1, 16).map(lambda count: count / 4)
BOX = st.tuples(WHOLE, WHOLE, SIDE, SIDE)


@given(st.lists(BOX, min_size=2, max_size=6))
@settings(max_examples=60, deadline=None)
def test_any_boxes_press_with_all_that_they_cover(boxes):
    load, _ = read(model_of(of_boxes(boxes)))
    # Some small cell in a notch may not press.
    assert load.state.contact_area == pytest.approx(area(covered(boxes)), rel=1e-3)


def test_a_round_end_joins_a_bar():
    bar, end = [(0, 0, 6, 3)], (3.0, 0.0, 1.5)
    disc = f'<geom type="cylinder" size=".0015 .003" pos="{end[0] / 1000} 0 .003" mass=".002"/>'
    load, _ = read(model_of(of_boxes(bar) + disc))
    # The disc is a polygon of 64 corners with the disc's area.
    radius = end[2] * math.sqrt(math.tau / 64 / math.sin(math.tau / 64))
    angles = np.arange(64) * math.tau / 64
    polygon = Polygon(np.column_stack([end[0] + radius * np.cos(angles), radius * np.sin(angles)]))
    assert polygon.area == pytest.approx(Point(0, 0).buffer(end[2], quad_segs=4096).area, rel=1e-6)
    assert load.state.contact_area == pytest.approx(area(union_all([covered(bar), polygon])), rel=1e-6)


def test_a_lower_box_presses_alone():
    """Faces count as one only if they are in one plane."""
    lower = '<geom type="box" size=".002 .002 .003" pos="0 0 .0029" mass=".002"/>'
    load, _ = read(model_of(of_boxes([(0, 0, 6, 5)]) + lower))
    assert load.state.contact_area == pytest.approx(16e-6, rel=0.05)
