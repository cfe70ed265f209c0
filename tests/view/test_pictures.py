"""Heat maps, outlines and arrows, without a browser."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
import pytest
from curved_pads import CURVED
from PIL import Image
from pressed_boxes import WEIGHT, boxes_on_pads, pressed

from mjtactile.pad import Pad
from mjtactile.pad_shape.surfaces import SphereCap
from mjtactile.pad_shape.taxels import FreeTaxels
from mjtactile.sim.wrench import centre_of_pressure
from mjtactile.view.arrows import force_arrow, torsion_arrow
from mjtactile.view.frame import Frame, pads_of, take_frame
from mjtactile.view.heat_map import LEAST_SCALE, Scale, heat_map, heat_map_html, palette
from mjtactile.view.tiles import Tiles


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


def test_free_taxels_are_discs_where_they_stand_in_a_tile_per_layer_of_the_sensor():
    points = [(4e-3, -2e-3, -1e-3), (-5e-3, 6e-3, -1e-3), (0.0, 0.0, -1.8e-3)]
    tiles = Tiles.of(Pad(taxels=FreeTaxels(tuple(points)), sampling_radius=6e-4))
    assert tiles.depths == ("1 mm", "1.8 mm")
    shown = tiles.laid_out(np.array([1e3, 2e3, 3e3], np.float32))
    assert np.isnan(shown).mean() > 0.9
    rows, columns = shown.shape[1:]
    for tile, value, (x, y, _) in ((0, 1e3, points[0]), (0, 2e3, points[1]), (1, 3e3, points[2])):
        row, column = np.nonzero(shown[tile] == value)
        # Pixels are .23 mm wide.
        assert (column.mean() + 0.5) / columns * 15e-3 - 7.5e-3 == pytest.approx(x, abs=1.2e-4)
        assert (row.mean() + 0.5) / rows * 15e-3 - 7.5e-3 == pytest.approx(y, abs=1.2e-4)
        assert len(row) * (15e-3 / columns) ** 2 == pytest.approx(np.pi * 6e-4**2, rel=0.2)


def test_every_taxel_of_a_curved_pad_is_seen_however_small_and_the_upper_of_two():
    surface = SphereCap(12e-3)
    feet = np.array([(4e-3, 1e-3, 1e-3), (4e-3, 1e-3, 1.2e-3), (-4e-3, -1e-3, 1e-3)])
    taxels = FreeTaxels(surface.positions(*feet.T))  # type: ignore[arg-type]
    pad = Pad(size=(12e-3, 12e-3), taxels=taxels, sampling_radius=3e-4, surface=surface)
    shown = Tiles.of(pad).laid_out(np.array([1e3, 2e3, 3e3], np.float32))
    assert len(shown) == 1
    assert set(shown[np.isfinite(shown)].tolist()) == {1e3, 3e3}
    column = np.nonzero(shown[0] == 1e3)[1]
    assert (column.mean() + 0.5) / 64 * 12e-3 - 6e-3 == pytest.approx(4e-3, abs=1.2e-4)  # over its foot
    tiny = Pad(
        taxels=FreeTaxels(tuple((x, y, -1e-3) for x in (-6e-3, 0.0, 6e-3) for y in (-3e-3, 1e-5))), sampling_radius=1e-6
    )
    assert set(Tiles.of(tiny).taxel.ravel().tolist()) == {-1, 0, 1, 2, 3, 4, 5}


def test_where_there_is_no_taxel_nothing_is_drawn():
    readings = np.array([[[np.nan, 0.0, 5e3]]], np.float32)
    nothing, none, most = heat_map(readings, 5e3)[0].tolist()
    assert (none, most) == (palette()[0].tolist(), palette()[-1].tolist())
    assert nothing[0] == nothing[1] == nothing[2] > 0


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
    text = heat_map_html('a "pad"', "1 < 2", picture, frame.pads["pad0"].outline, Tiles.of(Pad()))
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
        arrow = force_arrow(frame.pads[name].wrench, 0.01, Pad())
        assert arrow is not None
        assert np.allclose(arrow[1] - arrow[0], [0.0, 0.0, -0.01 * force], atol=1e-5)
        assert np.allclose(arrow[0], 0.0, atol=1e-4)
    assert force_arrow(np.zeros(6), 0.01, Pad()) is None


def test_the_centre_of_pressure_lies_on_a_curved_surface():
    pad = Pad(surface=SphereCap(15e-3))
    place = pad.surface.positions(3e-3, -2e-3)
    force = np.array([0.3, -0.2, -1.0])
    wrench = np.concatenate([force, np.cross(place, force)])
    np.testing.assert_allclose(centre_of_pressure(wrench, pad), place, atol=1e-9)
    arrow = force_arrow(wrench, 0.01, pad)
    assert arrow is not None
    np.testing.assert_allclose(arrow, [place, place + 0.01 * force], atol=1e-9)
    assert torsion_arrow(wrench, 5.0, pad) is None


@pytest.mark.parametrize("name", list(CURVED))
def test_about_the_centre_of_pressure_a_wrench_turns_along_the_normal(name):
    pad = CURVED[name]
    half = np.array(pad.size) / 2
    for x, y in np.random.default_rng(0).uniform(-0.9, 0.9, (20, 2)) * half:
        place, (along, across, normal) = pad.surface.positions(x, y), pad.surface.frames(x, y)
        force = -2.0 * normal + 0.8 * along - 0.3 * across
        if force[2] > -0.1:
            continue
        wrench = np.concatenate([force, np.cross(place, force) + 2e-3 * normal])
        # A patch is bicubic in the core.
        np.testing.assert_allclose(centre_of_pressure(wrench, pad), place, atol=1e-9)
        torsion = torsion_arrow(wrench, 5.0, pad)
        assert torsion is not None
        np.testing.assert_allclose(torsion[1] - torsion[0], 1e-2 * normal, atol=1e-7)


def test_the_centre_of_pressure_stays_on_the_pad():
    pad = Pad(surface=SphereCap(15e-3))
    force = np.array([0.0, 0.0, -1.0])
    beyond = np.concatenate([force, np.cross([9e-3, -2e-3, 0.0], force)])
    expected = pad.surface.positions(pad.size[0] / 2, -2e-3)
    np.testing.assert_allclose(centre_of_pressure(beyond, pad), expected, atol=1e-12)
    # A line that passes over the dome presses nowhere.
    force = np.array([1.0, 0.0, -0.01])
    over = np.concatenate([force, np.cross([0.0, 0.0, 1e-3], force)])
    assert np.array_equal(centre_of_pressure(over, pad), np.zeros(3))


def test_the_centre_of_pressure_and_the_torsion_about_it():
    place, force, torsion = np.array([2e-3, -1e-3, 0.0]), np.array([0.3, 0.2, -2.0]), 4e-3
    wrench = np.concatenate([force, np.cross(place, force) + np.array([0.0, 0.0, torsion])])
    assert np.allclose(centre_of_pressure(wrench), place)
    arrow = torsion_arrow(wrench, 5.0, Pad())
    assert arrow is not None
    assert np.allclose(arrow, [place, place + np.array([0.0, 0.0, 5.0 * torsion])])
    assert torsion_arrow(np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]), 5.0, Pad()) is None
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
    assert force_arrow(pad.wrench, 0.01, Pad()) is None
