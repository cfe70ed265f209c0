from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from pressed_boxes import boxes_on_pads

from mjtactile.errors import ViewError
from mjtactile.view.frame import Frame, ShownPad, pads_of, take_frame
from mjtactile.view.recording import Recording


@pytest.fixture(scope="module")
def recording() -> Recording:
    model = boxes_on_pads(2)
    data, pads, made = mujoco.MjData(model), pads_of(model), Recording()
    data.qpos[2] += 2e-3  # falls onto its pad
    for _ in range(30):
        mujoco.mj_step(model, data)
        made.append(take_frame(data, pads))
    return made


def same(one: Frame, other: Frame) -> bool:
    bodies = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("xpos", "xmat", "mocap_pos"))
    names = ShownPad.__dataclass_fields__
    pads = all(
        np.array_equal(getattr(one.pads[pad], name), getattr(other.pads[pad], name))
        for pad in one.pads
        for name in names
    )
    return one.time == other.time and list(one.pads) == list(other.pads) and bodies and pads


def test_a_recording_is_read_back_as_it_was(recording: Recording, tmp_path: Path):
    recording.save(tmp_path / "fall.npz")
    back = Recording.load(tmp_path / "fall.npz")
    assert len(back.frames) == 30
    assert all(same(one, other) for one, other in zip(recording.frames, back.frames, strict=True))
    counts = {len(frame.pads["pad0"].outline) for frame in back.frames}
    assert 0 in counts  # in the air
    assert len(counts) > 1


def test_frames_are_found_by_time(recording: Recording):
    assert recording.duration == pytest.approx(29 * 2e-3)
    assert recording.at(0.0) is recording.frames[0]
    assert recording.at(0.0111) is recording.frames[5]
    assert recording.at(99.0) is recording.frames[-1]


def test_a_simulation_that_was_reset_is_recorded_anew(recording: Recording):
    again = Recording(list(recording.frames))
    again.append(recording.frames[3])
    assert again.frames == [recording.frames[3]]


def test_what_is_no_recording_is_refused(tmp_path: Path):
    with pytest.raises(ViewError, match="nothing was recorded"):
        Recording().save(tmp_path / "empty.npz")
    (tmp_path / "text.npz").write_text("no")
    (tmp_path / "nothing.npz").touch()
    np.savez(tmp_path / "other.npz", time=np.zeros(3))
    np.save(tmp_path / "array.npy", np.zeros(3))
    for name in ("text.npz", "nothing.npz", "other.npz", "array.npy", "missing.npz", "."):
        with pytest.raises(ViewError, match="recording"):
            Recording.load(tmp_path / name)
    with pytest.raises(ViewError, match=r"there is no such file\. Expected"):
        Recording.load(tmp_path / "missing.npz")
    with pytest.raises(
        ViewError, match=r"text.npz is not a recording of the live view\. Expected"
    ):  # no advice of NumPy's
        Recording.load(tmp_path / "text.npz")


def test_a_file_may_be_named_by_a_text(recording: Recording, tmp_path: Path):
    recording.save(str(tmp_path / "some.npz"))
    assert len(Recording.load(str(tmp_path / "some.npz")).frames) == len(recording.frames)
