"""The environments' ids, known to gymnasium without importing what they need."""

from __future__ import annotations

import gymnasium

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
            gymnasium.register(id=name, entry_point=entry, vector_entry_point=_many(name))


def _many(name: str):  # noqa: ANN202
    def make(num_envs: int = 1, **options):  # noqa: ANN003, ANN202
        from mjtactile.envs.many import make_vec

        return make_vec(name, num_envs, **options)

    return make
