"""The loop: what is recognised decides what happens, and nothing else does."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

from mjtactile import Pad, TactileSensor, indenter_outline
from mjtactile.errors import MjTactileError, OutputError, SceneError
from mjtactile.experiments.loop import tasks
from mjtactile.experiments.loop.clock import Loop, LoopSettings
from mjtactile.experiments.loop.figure import loop_figure
from mjtactile.experiments.loop.known import bin_place, home
from mjtactile.experiments.loop.run import LoopResult, judge
from mjtactile.experiments.loop.scene import loop_scene
from mjtactile.experiments.loop.video import LoopVideo
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.recognition.weight_files import SHIPPED
from mjtactile.units import GRAM_FORCE

needs_weights = pytest.mark.skipif(
    not (SHIPPED / "all" / "registry.json").exists(), reason="recognisers have no weights yet: make weights"
)


class Oracle:
    """Recognisers that are told: MuJoCo's own force, and a name for the arm that presses."""

    loop: Any  # set once there is one

    def __init__(self, scene, said=lambda name: name, off=(0.0, 0.0, 0.0)):
        self.scene, self.said, self.off, self.calls = scene, said, np.array(off), 0

    def force(self, readings):
        self.calls += 1
        return SimpleNamespace(force=self.loop.sensor.wrench(self.loop.data)[:3] + self.off)

    def shape(self, readings, *, among):
        arm = int(np.argmin(np.hypot(*self.loop.targets[:, :2].T)))  # the one over the pad
        name = self.said(self.scene.truth[arm])
        chosen = np.array([shape == name for shape in among], dtype=float)
        return SimpleNamespace(
            shape=name, shapes=tuple(among), probabilities=chosen, confidence=1.0, position=np.zeros(2)
        )


def looped(influence, seed=0, rate=200, noise=0.0, watch=lambda loop: None, **oracle):
    scene = loop_scene(seed)
    sensor = TactileSensor(scene.model, influence=influence, law="uniform")
    told: Any = Oracle(scene, **oracle)
    settings = LoopSettings(rate=rate, noise=noise)
    told.loop = Loop(scene, sensor, (told.force, told.shape), settings, transducer=None, watch=watch)
    return told.loop, told


@pytest.fixture(scope="module")
def done(draft):
    """Presses and sorting with an oracle."""
    loop, _ = looped(draft)
    settings = LoopSettings(presses=2)
    held = tasks.press_forces(loop, 0, tasks.commanded_forces(2, 0))
    put_away = tasks.sort_punches(loop)
    return LoopResult(settings, loop.scene, loop.log, held, put_away, judge(settings, loop, held, put_away))


def test_a_scene_holds_each_punch_once_with_its_face_on_the_pad():
    first, again, other = (loop_scene(seed) for seed in (3, 3, 4))
    assert sorted(first.truth) == sorted(INDENTER_NAMES)
    assert first.truth == again.truth
    np.testing.assert_array_equal(first.shifts, again.shifts)
    assert (first.rotations != other.rotations).all()
    sheet = shapely.box(-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)
    for name, shift, turn in zip(first.truth, first.shifts, first.rotations, strict=True):
        assert sheet.contains(indenter_outline(name, shift=tuple(shift), rotate_deg=np.degrees(turn)))


def test_a_pad_too_small_for_the_punches_is_refused():
    from mjtactile import TaxelGrid

    with pytest.raises(SceneError, match="larger pad"):
        loop_scene(0, pad=Pad(size=(8e-3, 8e-3), taxels=TaxelGrid(rows=3, columns=3)))


def test_racks_and_bins_keep_clear_of_the_pad_and_each_other():
    places = np.array([home(k) for k in range(7)] + [bin_place(k) for k in range(7)])
    assert np.abs(places[:, 1]).min() > 7.5e-3 + 8e-3  # half the pad, and the widest punch's corner with its shift
    flat = places[:, :2]
    apart = np.linalg.norm(flat[:, None] - flat[None], axis=2) + np.eye(len(flat))
    assert apart.min() >= 14e-3 - 1e-12


def test_forces_are_reached_and_punches_end_in_their_bins(done):
    for press in done.judged["presses"]:
        # The servo ends when what it recognises is what was commanded, and the oracle is right.
        assert abs(press["magnitude_error_gf"]) < 0.1
        assert press["direction_error_deg"] < 0.1
        assert press["reached_s"] < 0.5
    assert done.judged["sorted_right"] == 7
    assert [each.looks for each in done.sorted] == [10] * 7


def test_punches_go_where_recognition_says_not_where_they_belong(draft):
    following = dict(zip(INDENTER_NAMES, (*INDENTER_NAMES[1:], INDENTER_NAMES[0]), strict=True))
    loop, _ = looped(draft, seed=1, said=following.__getitem__)
    put_away = tasks.sort_punches(loop)
    judged = judge(LoopSettings(presses=0), loop, [], put_away)
    assert judged["sorted_right"] == 0
    assert [each["bin"] for each in judged["sorted"]] == [following[each["true"]] for each in judged["sorted"]]


def test_a_punch_counts_where_it_is_not_where_it_was_said_to_go(draft):
    loop, _ = looped(draft)
    loop.tick(0)
    said = tasks.Sorted(arm=0, shape=loop.scene.truth[0], confidence=1.0, looks=10, position=(0.0, 0.0))
    (judged,) = judge(LoopSettings(), loop, [], [said])["sorted"]
    assert judged["bin"] is None
    assert not judged["right"]


def test_a_force_recognised_wrongly_is_pressed_wrongly(draft):
    loop, _ = looped(draft, off=(0.0, 0.0, 0.1))
    held = tasks.press_forces(loop, 0, [np.array([0.0, 0.0, -0.5])])
    judged = judge(LoopSettings(presses=1, sort=False), loop, held, [])
    assert judged["presses"][0]["magnitude_error_gf"] == pytest.approx(0.1 / GRAM_FORCE, rel=0.02)


def test_nothing_is_recognised_where_nothing_presses(draft):
    loop, told = looped(draft)
    for _ in range(5):
        assert loop.tick(0) is None
    assert told.calls == 0
    assert loop.data.time == pytest.approx(0.025)
    assert np.isnan(loop.log.force_time).all()
    assert judge(LoopSettings(), loop, [], [])["rates"] == {"ticks_felt": 0}


@pytest.mark.parametrize("rate", [300, 0, -5, 2000])
def test_a_rate_that_does_not_divide_1000_is_refused(draft, rate):
    with pytest.raises(MjTactileError, match="200, 250 or 500"):
        looped(draft, rate=rate)


def test_the_log_has_a_row_for_each_tick_and_rates_come_from_it(done):
    rates, log = done.judged["rates"], done.log
    lengths = {name: len(values) for name, values in vars(log).items()}
    assert len(set(lengths.values())) == 1
    np.testing.assert_allclose(np.diff(log.time), 5e-3, rtol=1e-6)
    assert rates["ticks_felt"] == sum(seen != "" for seen in log.seen)
    assert rates["simulated_ticks_hz"] == pytest.approx(200.0)
    assert 0.0 < rates["read_ms"]["median"] <= rates["read_ms"]["p99"]


def test_the_figure_shows_forces_shapes_and_times(done, tmp_path):
    figure = loop_figure(done)
    figure.savefig(tmp_path / "loop.png")
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == ["force on the pad", "shape: 7 of 7 in their bins", "time taken in each tick"]
    assert (tmp_path / "loop.png").stat().st_size > 10_000


def test_the_video_has_ten_frames_a_second_that_differ(draft, tmp_path):
    scene = loop_scene(0)
    with LoopVideo(scene.model) as video:
        loop, _ = looped(draft, watch=video)
        tasks.press_forces(loop, 0, [np.array([0.0, 0.0, -0.5])])
        for name in ("loop.gif", "loop.webp"):
            video.save(tmp_path / name)
            with Image.open(tmp_path / name) as film:
                assert getattr(film, "n_frames", 1) == len(video.frames) == int(loop.data.time * 10) + 1
    pictures = np.array(video.frames)
    assert (pictures[len(pictures) // 2] != pictures[0]).any()
    assert pictures[:, :, :480].std() > 10.0  # something is drawn
    with pytest.raises(OutputError, match=r"\.gif or \.webp"):
        video.save(tmp_path / "loop.mp4")


def run_command(*arguments, cwd, **environment):
    return subprocess.run(
        [sys.executable, "-m", "mjtactile", "loop", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, **environment},
    )


@needs_weights
@pytest.mark.slow
def test_the_command_presses_and_sorts_with_shipped_weights(tmp_path):
    done = run_command("--presses", "2", "--seed", "11", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    judged = json.loads(done.stdout)
    assert judged["sorted_right"] == 7
    for press in judged["presses"]:
        # Bounds for recognition with 1 % noise: 0.5 deg median, 1 gf on the mean; twice that for one press.
        assert press["direction_error_deg"] < 1.0
        assert abs(press["magnitude_error_gf"]) < 2.0
    assert {path.name for path in tmp_path.iterdir()} == {"loop.png", "loop.gif"}


@needs_weights
@pytest.mark.slow
def test_one_layer_presses_and_sorts_too(tmp_path):
    done = run_command("--presses", "2", "--seed", "12", "--layers", "top", "--no-record", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    judged = json.loads(done.stdout)
    assert judged["sorted_right"] >= 6
    for press in judged["presses"]:
        # One layer is off by five times as much as four; docs/loop.md has what it reached over eight seeds.
        assert press["direction_error_deg"] < 4.0
        assert abs(press["magnitude_error_gf"]) < 4.0


@needs_weights
def test_without_opengl_there_is_a_figure_but_no_video(tmp_path):
    hidden = {"EGL_PLATFORM": "none", "MUJOCO_GL": "egl", "__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere.json"}
    done = run_command("--presses", "1", "--no-sort", cwd=tmp_path, **hidden)
    assert done.returncode == 0, done.stderr
    assert "no video" in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"loop.png"}
