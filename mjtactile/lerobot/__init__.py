"""Export to LeRobot: presses, environments and grasps as LeRobotDataset v3.

The files are written with pyarrow alone, following the published format. The package lerobot, which requires PyTorch,
is not needed to write them. Environments are recorded by `mjtactile.lerobot.environment.LeRobotRecorder`.

Needs pyarrow and gymnasium: `pip install "mjtactile[lerobot]"`.
"""

from mjtactile._installed import require

require("dataset")
require("envs")
from mjtactile.lerobot.features import Feature, tactile_features  # noqa: E402
from mjtactile.lerobot.writer import LeRobotWriter  # noqa: E402

__all__ = ["Feature", "LeRobotWriter", "tactile_features"]
