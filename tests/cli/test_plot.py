import numpy as np
import pytest
from shapely import Point

from mjtactile.cli.plot import press_figure
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import FLAT, SphereCap


@pytest.mark.parametrize(
    "pad",
    [Pad(), Pad(depths=(1e-3,)), Pad(layers=(Layer(thickness=1e-3, young=1e6, poisson=0.4),) * 5, depths=(2e-3, 3e-3))],
)
def test_one_map_per_layer_with_the_outline_and_a_section(pad):
    readings = np.random.default_rng(0).uniform(0, 1e4, pad.reading_shape)
    outline = indenter_outline("doughnut")
    figure = press_figure(pad, readings, outline, title="t", picture=np.zeros((4, 6, 3), np.uint8))
    titles = [axes.get_title() for axes in figure.axes]
    assert [t for t in titles if "deep" in t] == [f"{d * 1e3:g} mm deep" for d in pad.depths]
    assert sum("section" in t for t in titles) == 1
    assert "scene" in titles
    first_map = figure.axes[0]
    drawn = [line for line in first_map.lines if np.size(line.get_xdata()) > 100]
    assert len(drawn) == 2  # outer ring and hole
    assert np.max(np.hypot(*drawn[0].get_data())) == pytest.approx(5.0, rel=1e-3)
    np.testing.assert_array_equal(first_map.images[0].get_array(), readings[0] * 1e-3)
    figure.canvas.draw()


def test_without_a_picture_the_scene_is_left_out():
    figure = press_figure(Pad(), np.ones(Pad().reading_shape), indenter_outline("star"))
    assert "scene" not in [axes.get_title() for axes in figure.axes]


@pytest.mark.parametrize("surface", [FLAT, SphereCap(12e-3)], ids=["flat", "dome"])
def test_free_taxels_are_drawn_in_bands_of_depth_and_where_the_section_cuts_them(surface):
    feet = np.array([(0.0, 0.0, 1e-3), (3e-3, 2e-3, 1.1e-3), (-4e-3, 2e-3, 3e-3)])
    pad = Pad(size=(12e-3, 12e-3), taxels=surface.positions(*feet.T), surface=surface, sampling_radius=4e-4)
    figure = press_figure(pad, np.array([1e3, 4e3, 2e3]), Point(0, 0).buffer(1e-3))
    titles = [axes.get_title() for axes in figure.axes]
    assert [t for t in titles if "deep" in t] == ["1 to 1.1 mm deep", "3 mm deep"]
    (discs,) = figure.axes[0].collections
    np.testing.assert_allclose(np.asarray(discs.get_array()), [4.0, 1.0])  # the uppermost last, on top
    (section,) = [axes for axes in figure.axes if "section" in axes.get_title()]
    cut = section.collections[0].get_offsets()
    np.testing.assert_allclose(np.asarray(cut), surface.positions(*feet[1:].T)[:, [0, 2]] * 1e3)
    figure.canvas.draw()


def test_a_single_row_of_taxels_can_be_drawn():
    pad = Pad(taxels=TaxelGrid(rows=1, columns=1), depths=(1e-3,))
    press_figure(pad, np.ones((1, 1, 1)), indenter_outline("star")).canvas.draw()


def test_the_section_of_a_dome_is_curved_and_shows_taxels_where_they_are():
    layers = Layer(thickness=1e-3, young=1e6, poisson=0.4), Layer(thickness=2e-3, young=3e6, poisson=0.4)
    taxels = TaxelGrid(rows=5, columns=7, pitch=(1.5e-3, 2e-3))
    pad = Pad(size=(12e-3, 12e-3), layers=layers, taxels=taxels, depths=(1e-3, 2e-3), surface=SphereCap(12e-3))
    readings = np.ones(pad.reading_shape)
    readings[0, 3, 2] = 2.0  # the section goes through row 3, at y = 2 mm
    figure = press_figure(pad, readings, Point(1e-3, 2e-3).buffer(1e-3))
    (section,) = [axes for axes in figure.axes if "section at y = 2 mm" in axes.get_title()]
    interface, dots, pressed = (np.asarray(line.get_data()) for line in section.lines)
    # Around the sphere's middle, seen along y, points at depth d of the row's plane lie on a circle of their own.
    middle = -12.0
    through = 12.0**2 - 2.0**2
    for line, depth in ((interface, 1.0), (pressed, 0.0)):
        share = 1 - depth / 12.0
        np.testing.assert_allclose(line[0] ** 2 + (line[1] - middle) ** 2, share**2 * through, rtol=1e-9)
    points = np.concatenate([pad.taxel_points(k).reshape(5, 7, 3)[3] for k in range(2)]) * 1e3
    np.testing.assert_allclose(dots.T, points[:, [0, 2]], atol=1e-9)
    assert pressed[0].min() == pytest.approx(0.0, abs=1e-6)
    assert pressed[0].max() == pytest.approx(2.0, abs=1e-6)
    figure.canvas.draw()
