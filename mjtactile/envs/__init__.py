"""gymnasium environments whose agents feel: see docs/environments.md.

    import gymnasium
    import mjtactile  # its environments are registered by this

    env = gymnasium.make("mjtactile/GraspLift-v0", observation="readings")

Needs gymnasium: `pip install mjtactile[envs]`.
"""

from __future__ import annotations

from mjtactile.envs.many import make_vec
from mjtactile.envs.options import EnvError, TouchOptions
from mjtactile.envs.registration import ENTRY_POINTS, register_environments

__all__ = ["ENTRY_POINTS", "EnvError", "TouchOptions", "make_vec", "register_environments"]

register_environments()
