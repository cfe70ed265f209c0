"""Heat maps, outlines and arrows, without a browser."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image
from pressed_boxes import WEIGHT, boxes_on_pads, pressed

from mjtactile.pad import Pad
from mjtactile.pad_shape.surfaces import SphereCap
from mjtactile.view.arrows import centre_of_pressure, force_arrow, twist_arrow
from mjtactile.view.frame import Frame, pads_of, take_frame
from mjtactile.view.heat_map import LEAST_SCALE, Scale, heat_map, heat_map_html, palette


@pytest.fixture(scope="module")
def frame() -> Frame:
    model = boxes_on_pads(2)
    return take_frame(pressed(model, 0, 1.0), pads_of(model))


def test_layers_stand_side_by_side_rows_upwards():
    readings = np.zeros((4, 13, 13), np.float32)
    readings[2, 0, 5] = 8e3  # the third layer's lowest row
    picture = heat_map(readings, 8e3)
    assert picture.shape == (13, 4 * 13 + 3, 3)
    bright = np.argwhere((picture == palette()[-1]).all(axis=2))
    assert bright.tolist() == [[12, 2 * 14 + 5]]
    assert (picture[:, 13] == 255).all()


def test_the_scale_follows_the_largest_reading_and_falls_slowly():
    scale = Scale()
    assert scale.follow([np.zeros((1, 2, 2), np.float32)]) == LEAST_SCALE
    nothing = np.zeros((1, 2, 2), np.float32)
    assert scale.follow([np.full((1, 2, 2), 9e3, np.float32), nothing]) == 10e3
    assert scale.follow([nothing]) == 10e3
    assert [scale.follow([nothing]) for _ in range(200)][-1] == LEAST_SCALE
    assert scale.follow([np.full((1, 2, 2), 20e3, np.float32)]) == 20e3
    assert scale.follow([np.full((1, 2, 2), 20.1e3, np.float32)]) == 50e3


def test_the_page_s_picture_is_that_of_the_readings(frame: Frame):
    readings = frame.pads["pad0"].readings
    picture = heat_map(readings, float(readings.max()))
    text = heat_map_html('a "pad"', "1 < 2", picture, frame.pads["pad0"].outline, Pad())
    found = re.search(r"base64,([^\"]*)", text)
    assert found is not None
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(base64.b64decode(found[1])))), picture)
    assert "1 &lt; 2" in text
    assert "&quot;pad&quot;" in text
    assert text.count("<path") == 4


def test_the_outline_runs_around_what_presses(frame: Frame):
    ends = frame.pads["pad0"].outline.reshape(-1, 2)
    # The box is 8 mm by 6 mm; the surface grid's cells are 1.5 mm.
    assert np.allclose(ends.max(axis=0), [4e-3, 3e-3], atol=1.5e-3)
    assert np.allclose(ends.min(axis=0), [-4e-3, -3e-3], atol=1.5e-3)


def test_the_force_s_arrow_is_mujoco_s_contact_force(frame: Frame):
    for name, force in (("pad0", WEIGHT + 1.0), ("pad1", WEIGHT)):
        arrow = force_arrow(frame.pads[name].wrench, 0.01)
        assert arrow is not None
        assert np.allclose(arrow[1] - arrow[0], [0.0, 0.0, -0.01 * force], atol=1e-5)
        assert np.allclose(arrow[0], 0.0, atol=1e-4)
    assert force_arrow(np.zeros(6), 0.01) is None


def test_the_centre_of_pressure_lies_on_a_curved_surface():
    pad = Pad(surface=SphereCap(15e-3))
    place = pad.surface.positions(3e-3, -2e-3)
    force = np.array([0.3, -0.2, -1.0])
    wrench = np.concatenate([force, np.cross(place, force)])
    np.testing.assert_allclose(centre_of_pressure(wrench, pad), place, atol=1e-9)
    arrow = force_arrow(wrench, 0.01, pad)
    assert arrow is not None
    np.testing.assert_allclose(arrow, [place, place + 0.01 * force], atol=1e-9)
    assert twist_arrow(wrench, 5.0, pad) is None


def test_the_centre_of_pressure_and_the_twist_about_it():
    place, force, twist = np.array([2e-3, -1e-3, 0.0]), np.array([0.3, 0.2, -2.0]), 4e-3
    wrench = np.concatenate([force, np.cross(place, force) + np.array([0.0, 0.0, twist])])
    assert np.allclose(centre_of_pressure(wrench), place)
    arrow = twist_arrow(wrench, 5.0)
    assert arrow is not None
    assert np.allclose(arrow, [place, place + np.array([0.0, 0.0, 5.0 * twist])])
    assert twist_arrow(np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]), 5.0) is None
    assert np.array_equal(centre_of_pressure(np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])), np.zeros(3))


def test_nothing_is_drawn_of_a_pad_that_nothing_touches():
    model = boxes_on_pads(1)
    data = pressed(model, 0, 0.0)
    data.qpos[2] = 0.2
    import mujoco

    mujoco.mj_forward(model, data)
    pad = take_frame(data, pads_of(model)).pads["pad0"]
    assert not pad.readings.any()
    assert pad.outline.shape == (0, 2, 2)
    assert force_arrow(pad.wrench, 0.01) is None
