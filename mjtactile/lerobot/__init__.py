"""Datasets out to LeRobot: presses, environments and grasps as LeRobotDataset v3, which its package opens.

The files are written with pyarrow alone, after the published format; the package itself, which brings PyTorch and
much else, is not needed to write them. Environments are recorded by `mjtactile.lerobot.environment.LeRobotRecorder`.
"""

from mjtactile.lerobot.features import Feature, tactile_features
from mjtactile.lerobot.writer import LeRobotWriter

__all__ = ["Feature", "LeRobotWriter", "tactile_features"]
