"""The environments' ids, known to gymnasium without importing what they need."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
    from gymnasium.vector import VectorEnv

#: Where each environment is.
ENTRY_POINTS = {
    "mjtactile/PressIdentify-v0": "mjtactile.envs.press_identify:PressIdentify",
    "mjtactile/GraspLift-v0": "mjtactile.envs.grasp_lift:GraspLift",
    "mjtactile/EdgeFollow-v0": "mjtactile.envs.edge_follow:EdgeFollow",
    "mjtactile/PegInsert-v0": "mjtactile.envs.peg_insert:PegInsert",
}


def register_environments() -> None:
    """Make the ids known; once is enough, twice is harmless."""
    for name, entry in ENTRY_POINTS.items():
        if name not in gymnasium.registry:
            many: Callable[..., Any] = partial(_many, name)
            gymnasium.register(id=name, entry_point=entry, vector_entry_point=many)


def _many(name: str, num_envs: int = 1, **options: Any) -> VectorEnv[Any, Any, Any]:
    """What `gymnasium.make_vec` calls."""
    from mjtactile.envs.many import make_vec

    return make_vec(name, num_envs, **options)
