"""The live view: a simulation and its pads in a browser, watched, held, pushed, recorded and replayed.

Needs viser and mjviser: `pip install mjtactile[view]`. They are imported when a viewer is opened.
"""

from mjtactile.view.recording import Recording
from mjtactile.view.viewer import Viewer

__all__ = ["Recording", "Viewer"]
