"""Recorded frames, to be replayed in the page or saved to a file."""

from __future__ import annotations

import json
import zipfile
from bisect import bisect_right
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile._files import unusable, why_unread, write_atomically
from mjtactile.errors import ViewError
from mjtactile.view.frame import Frame, ShownPad

#: Largest number of frames of a recording, about 300 MB with five default pads.
MOST_FRAMES = 20_000
_FORMAT = 1
_BODIES = ("xpos", "xmat", "mocap_pos", "mocap_quat")
_PAD = ("readings", "wrench", "position", "quat")


class Recording:
    """Frames of one simulation in order of time.

    Attributes:
        frames: recorded so far.
    """

    def __init__(self, frames: list[Frame] | None = None) -> None:
        self.frames = [] if frames is None else frames

    @property
    def duration(self) -> float:
        """Simulated time from the first frame to the last [s]."""
        return self.frames[-1].time - self.frames[0].time if self.frames else 0.0

    @property
    def full(self) -> bool:
        """Whether the recording has the largest number of frames."""
        return len(self.frames) >= MOST_FRAMES

    def append(self, frame: Frame) -> None:
        """Add a frame; a frame that is not later than the last, as after a reset, begins a new recording."""
        if self.frames and frame.time <= self.frames[-1].time:
            self.frames.clear()
        self.frames.append(frame)

    def at(self, after: float) -> Frame:
        """The last frame that is at most a time `after` later than the first frame [s].

        Raises:
            ViewError: nothing was recorded.
        """
        if not self.frames:
            raise ViewError("nothing was recorded. Record first: the page's Record button, or Viewer.record().")
        found = bisect_right(self.frames, self.frames[0].time + after, key=lambda frame: frame.time)
        return self.frames[max(found - 1, 0)]

    def save(self, path: str | Path) -> None:
        """Write everything to an .npz file; it appears complete or not at all.

        Raises:
            ViewError: nothing was recorded.
            OutputError: the file cannot be written.
        """
        first = self.at(0.0)
        arrays: dict[str, Any] = {"time": np.array([frame.time for frame in self.frames])}
        arrays |= {name: np.stack([getattr(frame, name) for frame in self.frames]) for name in _BODIES}
        for place, pad in enumerate(first.pads):
            felt = [frame.pads[pad] for frame in self.frames]
            arrays |= {f"{place}/{name}": np.stack([getattr(one, name) for one in felt]) for name in _PAD}
            arrays[f"{place}/segments"] = np.array([len(one.outline) for one in felt])
            arrays[f"{place}/outline"] = np.concatenate([one.outline for one in felt])
        about = json.dumps({"format": _FORMAT, "pads": list(first.pads)})
        write_atomically(Path(path), lambda file: np.savez_compressed(file, about=np.array(about), **arrays))

    @classmethod
    def load(cls, path: str | Path) -> Recording:
        """Read a file written by `save`.

        Raises:
            ViewError: the file is not a recording.
        """
        path = Path(path)
        try:
            if (found := unusable(path)) is not None:
                raise ViewError(f"{path} is {found}, not a recording.")
            if path.is_file() and not zipfile.is_zipfile(path):
                raise ViewError(
                    f"{path} is not a recording of the live view. Expected a file that Recording.save wrote."
                )
            with np.load(path, allow_pickle=False) as file:
                arrays = dict(file)
            about = json.loads(str(arrays["about"]))
            if about["format"] != _FORMAT:
                raise ViewError(f"{path} is a recording of another version of mjtactile. Replay it with that version.")
            return cls(_frames(arrays, about["pads"]))
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
            if isinstance(error, ViewError):
                raise
            raise ViewError(
                f"{path} is not a recording of the live view: {why_unread(error)}. Expected a file that "
                "Recording.save wrote."
            ) from error


def _frames(arrays: dict[str, Any], pads: list[str]) -> list[Frame]:
    ends = {place: np.cumsum(arrays[f"{place}/segments"]) for place in range(len(pads))}
    frames = []
    for k, time in enumerate(arrays["time"]):
        felt = {}
        for place, pad in enumerate(pads):
            end = int(ends[place][k])
            outline = arrays[f"{place}/outline"][end - int(arrays[f"{place}/segments"][k]) : end]
            felt[pad] = ShownPad(**{name: arrays[f"{place}/{name}"][k] for name in _PAD}, outline=outline)
        frames.append(Frame(time=float(time), **{name: arrays[name][k] for name in _BODIES}, pads=felt))
    return frames
