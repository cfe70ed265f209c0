"""gymnasium environments with tactile observations: see docs/environments.md.

    import gymnasium
    import mjtactile  # its environments are registered by this

    env = gymnasium.make("mjtactile/GraspLift-v0", observation="readings")

Needs gymnasium: `pip install "mjtactile[envs]"`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mjtactile._installed import require

require("envs")
from mjtactile.envs.registration import ENTRY_POINTS, register_environments  # noqa: E402
from mjtactile.errors import EnvError  # noqa: E402

if TYPE_CHECKING:
    from mjtactile.envs.many import TactileVectorEnv, make_vec
    from mjtactile.envs.options import TouchOptions
    from mjtactile.envs.single import TactileEnv
    from mjtactile.envs.task import Channel, Task

__all__ = [
    "ENTRY_POINTS",
    "Channel",
    "EnvError",
    "TactileEnv",
    "TactileVectorEnv",
    "Task",
    "TouchOptions",
    "make_vec",
    "register_environments",
]

_MODULE_OF = {
    "Channel": "task",
    "TactileEnv": "single",
    "TactileVectorEnv": "many",
    "Task": "task",
    "TouchOptions": "options",
    "make_vec": "many",
}

register_environments()


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'mjtactile.envs' has no attribute {name!r}")
    value = getattr(import_module(f"mjtactile.envs.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
