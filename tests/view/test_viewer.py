"""The viewer in a loop, without a browser: somebody who looks is a number here."""

from __future__ import annotations

import threading
import time
import timeit
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
from pressed_boxes import WEIGHT, boxes_on_pads, pad_with_free_taxels, spec_of_boxes_on_pads
from typer.testing import CliRunner

from mjtactile.cli.main import app
from mjtactile.errors import ViewError
from mjtactile.sensor import TactileSensor
from mjtactile.sim.press_scene import press_scene
from mjtactile.view.recording import Recording
from mjtactile.view.server import check_host
from mjtactile.view.viewer import Viewer

pytest.importorskip("mjviser", reason="the live view is not installed: pip install 'mjtactile[view]'")


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return boxes_on_pads(2)


@pytest.fixture
def viewer(model: mujoco.MjModel) -> Iterator[Viewer]:
    with Viewer(model, mujoco.MjData(model), port=0, rate=50.0) as opened:
        yield opened


def steps(viewer: Viewer, count: int) -> None:
    for _ in range(count):
        mujoco.mj_step(viewer.model, viewer.data)
        viewer.sync()


def shown(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Times of the frames that the page is given from now on."""
    times: list[float] = []
    show = viewer._page.show
    monkeypatch.setattr(viewer._page, "show", lambda frame, said: (times.append(frame.time), show(frame, said)))
    return times


def test_other_machines_are_kept_out_unless_told(model: mujoco.MjModel):
    for host in ("0.0.0.0", "192.168.1.5", "::", "example.org"):
        with pytest.raises(ViewError, match="other machines"):
            check_host(host, anyone=False)
        check_host(host, anyone=True)
    for host in ("127.0.0.1", "::1", "localhost"):
        check_host(host, anyone=False)
    with pytest.raises(ViewError, match="--anyone"):
        Viewer(model, mujoco.MjData(model), host="0.0.0.0")


def test_nothing_is_shown_while_nobody_looks(viewer: Viewer, monkeypatch: pytest.MonkeyPatch):
    times = shown(viewer, monkeypatch)
    assert viewer.url.startswith("http://127.0.0.1:")
    steps(viewer, 20)
    assert times == []


def test_while_nobody_looks_a_step_costs_no_more_than_two_percent(viewer: Viewer):
    """Least times of many: what else runs on the machine only adds."""
    steps(viewer, 200)
    step = min(timeit.repeat(lambda: mujoco.mj_step(viewer.model, viewer.data), number=1, repeat=300))
    sync = min(timeit.repeat(viewer.sync, number=100, repeat=30)) / 100
    assert sync < 0.02 * step


def test_the_page_is_renewed_at_its_rate(viewer: Viewer, monkeypatch: pytest.MonkeyPatch):
    viewer._watchers, times = 1, shown(viewer, monkeypatch)
    start, passed = time.perf_counter(), 0.0
    while passed < 0.5 or (len(times) < 2 and passed < 10.0):  # longer only where the machine is busy
        steps(viewer, 1)
        passed = time.perf_counter() - start
    assert 2 <= len(times) <= passed * 50 + 1
    assert times == sorted(times)


def test_a_pause_holds_the_loop_and_a_step_lets_it_go_by_one(viewer: Viewer):
    viewer._watchers, viewer.controls.paused = 1, True
    loop = threading.Thread(target=steps, args=(viewer, 3))
    loop.start()
    time.sleep(0.3)
    assert viewer.data.time == pytest.approx(0.002)
    viewer.controls.steps += 1
    time.sleep(0.3)
    assert viewer.data.time == pytest.approx(0.004)
    viewer._watchers = 0  # whoever paused has left
    loop.join(timeout=5.0)
    assert viewer.data.time == pytest.approx(0.006)


def test_who_leaves_lets_go(viewer: Viewer):
    viewer.controls.paused, viewer.controls.dragged_to = True, np.zeros(3)
    viewer._count_watchers(None)
    assert not viewer.controls.holds
    assert viewer.controls.dragged_to is None


def test_a_dragged_body_follows_and_its_own_forces_come_back(viewer: Viewer):
    body, before = viewer.model.body("box1").id, np.array([0.0, 0.0, -0.2, 0.0, 0.0, 0.0])
    viewer._watchers, viewer.controls.body = 1, body
    viewer.data.xfrc_applied[body] = before
    steps(viewer, 50)
    viewer.controls.dragged_to = viewer.data.xpos[body] + [0.0, 0.0, 0.05]
    steps(viewer, 300)
    assert viewer.data.xpos[body, 2] > 0.03
    assert viewer.data.xfrc_applied[body, 2] > 0.0
    viewer.controls.dragged_to = None
    steps(viewer, 1)
    assert np.array_equal(viewer.data.xfrc_applied[body], before)


def test_sliders_write_controls():
    model = mujoco.MjModel.from_xml_path(str(Path(__file__).parents[2] / "scenes" / "grasp.xml"))
    with Viewer(model, mujoco.MjData(model), port=0) as viewer:
        viewer._watchers = 1
        viewer.controls.controls[model.actuator("grip").id] = 2.5
        steps(viewer, 1)
        assert viewer.data.ctrl[model.actuator("grip").id] == 2.5


def test_recordings_are_even_in_simulated_time_and_need_nobody(viewer: Viewer):
    viewer.record()
    steps(viewer, 100)
    recording = viewer.stop_recording()
    times = [frame.time for frame in recording.frames]
    assert np.allclose(np.diff(times), 0.02)
    assert len(times) == 10
    force = recording.frames[-1].pads["pad0"].wrench[2]
    assert force == pytest.approx(-WEIGHT, rel=0.05)
    steps(viewer, 10)
    assert len(recording.frames) == 10


def test_a_replay_shows_what_was_recorded_and_then_the_loop_goes_on(viewer: Viewer, monkeypatch: pytest.MonkeyPatch):
    viewer.record()
    steps(viewer, 100)
    recording = viewer.stop_recording()
    viewer._watchers, times = 1, shown(viewer, monkeypatch)
    viewer.replay()
    start = time.perf_counter()
    steps(viewer, 1)
    assert time.perf_counter() - start > recording.duration
    assert not viewer.controls.replaying
    assert times[1] == recording.frames[0].time
    assert times[-1] == recording.frames[-1].time
    assert viewer.data.time == pytest.approx(101 * 2e-3)


def test_recordings_of_other_models_are_not_replayed(viewer: Viewer):
    with pytest.raises(ViewError, match="nothing was recorded"):
        viewer.replay()
    other = boxes_on_pads(1)
    with Viewer(other, mujoco.MjData(other), port=0) as one:
        one.record()
        steps(one, 1)
    with pytest.raises(ViewError, match="Open the model that was recorded"):
        viewer.replay(one.recording)


def test_models_without_pads_are_refused_but_sensors_of_one_s_own_will_do():
    model = press_scene("star")
    data = mujoco.MjData(model)
    with pytest.raises(ViewError, match="attach_pad"):
        Viewer(model, data, port=0)
    with Viewer(model, data, pads={"mine": TactileSensor(model, fidelity="fast")}, port=0) as viewer:
        viewer.record()
        steps(viewer, 1)
        assert list(viewer.stop_recording().frames[0].pads) == ["mine"]


@pytest.mark.parametrize("rate", [0, -5.0, float("nan"), float("inf"), "30", None])
def test_a_rate_is_a_positive_number(model: mujoco.MjModel, rate):
    with pytest.raises(ViewError, match="positive number of updates per second"):
        Viewer(model, mujoco.MjData(model), port=0, rate=rate)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            {"host": "300.1.1.1", "anyone": True},
            "cannot listen on host '300.1.1.1'.*Expected an address of this machine",
        ),
        ({"host": "192.0.2.1", "anyone": True}, "cannot listen on host '192.0.2.1'"),  # RFC 5737: nobody's address
        ({"port": -1}, "port = -1; expected a whole number from 1 to 65535"),
        ({"port": 70000}, "port = 70000"),
        ({"port": "8080"}, "port = '8080'"),
    ],
)
def test_an_address_that_cannot_be_listened_on_is_refused_at_once(model: mujoco.MjModel, options, says: str):
    """viser waited for ever for its server."""
    with pytest.raises(ViewError, match=says):
        Viewer(model, mujoco.MjData(model), **{"port": 0, **options})


def test_what_does_not_belong_together_is_refused(model: mujoco.MjModel):
    other = boxes_on_pads(1)
    data, sensor = mujoco.MjData(model), TactileSensor(other, fidelity="fast", geom="pad0_pad")
    with pytest.raises(ViewError, match=r"expected a mujoco\.MjModel"):
        Viewer("hand.xml", data, port=0)  # type: ignore[arg-type]
    for strange in (mujoco.MjData(other), None):
        with pytest.raises(ViewError, match="data does not belong to the model"):
            Viewer(model, strange, port=0)  # type: ignore[arg-type]
    for pads in ({}, ["pad0"], {"pad0": "pad0"}):
        with pytest.raises(ViewError, match="not a dict of sensors by name"):
            Viewer(model, data, pads=pads, port=0)  # type: ignore[arg-type]
    with pytest.raises(ViewError, match="'mine' belongs to another model"):
        Viewer(model, data, pads={"mine": sensor}, port=0)


def test_what_is_replayed_is_a_recording(viewer: Viewer):
    with pytest.raises(ViewError, match=r"Recording.load\(path\)"):
        viewer.replay("grasp.npz")  # type: ignore[arg-type]


def test_the_command_runs_without_a_display_and_records(tmp_path: Path):
    out = tmp_path / "grasp.npz"
    command = ["view", "--scene", "grasp", "--port", "0", "--seconds", "0.7", "--record", str(out)]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "open http://127.0.0.1:" in done.output
    last = Recording.load(out).frames[-1]
    assert last.time == pytest.approx(0.7, abs=0.04)
    assert last.pads["left"].readings.max() > 1e3


def test_the_command_shows_and_records_free_taxels_without_a_display(tmp_path: Path):
    model, out = tmp_path / "model.xml", tmp_path / "free.npz"
    model.write_text(spec_of_boxes_on_pads(1, pad_with_free_taxels()).to_xml())
    command = ["view", str(model), "--port", "0", "--seconds", "0.3", "--record", str(out)]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    readings = Recording.load(out).frames[-1].pads["pad0"].readings
    assert readings.shape == (6,)
    assert readings[:4].min() > 3 * readings[4:].max()  # those below the box, and those beside it


def test_free_taxels_reach_the_page_of_who_looks(monkeypatch: pytest.MonkeyPatch):
    model = boxes_on_pads(1, pad_with_free_taxels())
    with Viewer(model, mujoco.MjData(model), port=0, rate=50.0) as viewer:
        viewer._watchers = 1
        times = shown(viewer, monkeypatch)
        steps(viewer, 40)
        assert times


def test_the_command_says_what_is_wrong(tmp_path: Path):
    run = CliRunner().invoke
    assert isinstance(run(app, ["view", "--scene", "dance"]).exception, ViewError)
    assert isinstance(run(app, ["view", "--scene", "grasp", "--host", "0.0.0.0"]).exception, ViewError)
    assert run(app, ["view"]).exit_code == 2
    assert "there is no such file" in str(run(app, ["view", str(tmp_path / "missing.xml")]).exception)
    assert "it is not a file" in str(run(app, ["view", str(tmp_path)]).exception)
    (tmp_path / "text.xml").write_text("no")
    assert "Expected a model in MJCF" in str(run(app, ["view", str(tmp_path / "text.xml")]).exception)
    refused = run(app, ["view", "--scene", "grasp", "--seconds", "-1"])
    assert (refused.exit_code, "expected a positive number" in refused.output) == (2, True)
