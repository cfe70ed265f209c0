"""What older versions of MuJoCo do otherwise, so that a test of ours says nothing there."""

import mujoco
import pytest


def older_than(version: str) -> bool:
    """Whether the running MuJoCo is older than a version such as "3.14"."""
    running, wanted = (tuple(int(part) for part in one.split(".")[:2]) for one in (mujoco.__version__, version))
    return running < wanted


def since(version: str, why: str) -> pytest.MarkDecorator:
    """Skip a test on a MuJoCo older than this, for what that MuJoCo does."""
    return pytest.mark.skipif(older_than(version), reason=f"MuJoCo before {version}: {why}")
