"""A video of the loop: the scene, the readings of four layers, and the recognised force and shape."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._files import write_atomically
from mjtactile._installed import require
from mjtactile._types import Array
from mjtactile.errors import OutputError
from mjtactile.experiments.loop.clock import Loop
from mjtactile.sim.render import Renderer
from mjtactile.units import GRAM_FORCE

Picture = npt.NDArray[np.uint8]

#: Frames per simulated second; the video runs as fast as the simulated clock.
FRAMES_PER_SECOND = 10
_WIDTH, _HEIGHT = 480, 360
#: Width of a taxel in the picture of a layer [pixels].
_TAXEL = 13
#: Formats of videos by the ending of their file name; Pillow writes them without another program.
VIDEO_KINDS = {".gif": "GIF", ".webp": "WEBP"}


class LoopVideo:
    """Draws frames at a fixed rate: `run_loop(watch=video)`. A context manager, since it holds an OpenGL context.

    Raises:
        RenderError: there is no working OpenGL.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._renderer = Renderer(model, _WIDTH, _HEIGHT)
        self._next = 0.0
        self._peak = 1.0
        self.frames: list[Picture] = []  #: RGB images drawn so far, (height, width, 3) each

    def __enter__(self) -> LoopVideo:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.free()

    def __call__(self, loop: Loop) -> None:
        """Draw a frame if the next one is due."""
        if loop.data.time < self._next:
            return
        self._next += 1.0 / FRAMES_PER_SECOND
        self.frames.append(self._frame(loop))

    def save(self, path: Path) -> None:
        """Write the video file.

        Raises:
            OutputError: nothing was drawn, the file name does not end in .gif or .webp, or the file cannot be written.
        """
        require("figures")
        from PIL import Image

        check_video_path(path)
        if not self.frames:
            raise OutputError(f"there are no frames to write to {path}: the loop was not run with this video.")
        first, *others = (Image.fromarray(frame) for frame in self.frames)
        kind = VIDEO_KINDS[path.suffix.lower()]
        pause = round(1000 / FRAMES_PER_SECOND)
        write_atomically(
            path,
            lambda file: first.save(file, format=kind, save_all=True, append_images=others, duration=pause, loop=0),
        )

    def _frame(self, loop: Loop) -> Picture:
        require("figures")
        from PIL import Image, ImageDraw

        maps = self._maps(loop.readings)
        frame = np.full((_HEIGHT, _WIDTH + maps.shape[1] + 20, 3), 24, dtype=np.uint8)
        frame[:, :_WIDTH] = self._renderer.picture(loop.scene.model, loop.data, "loop")
        frame[10 : 10 + maps.shape[0], _WIDTH + 10 : _WIDTH + 10 + maps.shape[1]] = maps
        image = Image.fromarray(frame)
        draw = ImageDraw.Draw(image)
        for k, line in enumerate(self._lines(loop)):
            draw.text((10, 8 + 14 * k), line, fill=(255, 255, 255))
        return np.asarray(image)

    def _lines(self, loop: Loop) -> list[str]:
        commanded = loop.log.commanded[-1]
        lines = [f"{loop.data.time:5.2f} s"]
        if not np.isnan(commanded).any():
            lines.append("commanded   " + _vector(commanded))
        if loop.felt is not None:
            lines.append("recognised  " + _vector(loop.felt.force.force))
            lines.append(f"{loop.felt.shape.shape}, {float(loop.felt.shape.confidence):.0%}")
        return lines

    def _maps(self, readings: Array) -> Picture:
        """The first four layers in a 2 x 2 picture, rows upwards, scaled by the largest recent reading."""
        require("figures")
        from matplotlib import colormaps

        colours: Any = colormaps["magma"]
        self._peak = max(0.9 * self._peak, float(readings.max()), 1.0)
        layers = list(np.clip(readings[:4] / self._peak, 0.0, 1.0))
        layers += [np.zeros_like(layers[0])] * (-len(layers) % 2)
        tiles = [
            np.pad(np.kron(colours(layer[::-1])[..., :3], np.ones((_TAXEL, _TAXEL, 1))), ((0, 4), (0, 4), (0, 0)))
            for layer in layers
        ]
        pairs = [np.hstack(tiles[k : k + 2]) for k in range(0, len(tiles), 2)]
        return (np.vstack(pairs) * 255).astype(np.uint8)


def check_video_path(path: Path) -> None:
    """Check the file name of a video before the loop runs.

    Raises:
        OutputError: the file name does not end in .gif or .webp.
        MissingExtraError: matplotlib or Pillow is not installed.
    """
    require("figures")
    if path.suffix.lower() not in VIDEO_KINDS:
        raise OutputError(f"cannot write a video to {path}; expected a name that ends in {' or '.join(VIDEO_KINDS)}.")


def _vector(force: Array) -> str:
    return "({:6.1f}, {:6.1f}, {:6.1f}) gf".format(*(force / GRAM_FORCE))
