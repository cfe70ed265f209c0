"""The live view: a simulation and its pads in a browser, with controls to pause, drag bodies, record and replay.

Needs viser and mjviser: `pip install "mjtactile[view]"`.
"""

from mjtactile._installed import require

require("figures")
require("view")
from mjtactile.view.recording import Recording  # noqa: E402
from mjtactile.view.viewer import Viewer  # noqa: E402

__all__ = ["Recording", "Viewer"]
