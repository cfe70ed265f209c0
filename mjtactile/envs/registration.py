"""Registration of the environments' ids with gymnasium, without importing their modules."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import gymnasium

from mjtactile.errors import EnvError, shortened

if TYPE_CHECKING:
    from mjtactile.envs.task import Task

#: Module and class of each environment's task.
ENTRY_POINTS = {
    "mjtactile/PressIdentify-v0": "mjtactile.envs.press_identify:PressIdentify",
    "mjtactile/GraspLift-v0": "mjtactile.envs.grasp_lift:GraspLift",
    "mjtactile/EdgeFollow-v0": "mjtactile.envs.edge_follow:EdgeFollow",
    "mjtactile/PegInsert-v0": "mjtactile.envs.peg_insert:PegInsert",
}


def register_environments() -> None:
    """Register the ids; further calls have no effect."""
    for name in ENTRY_POINTS:
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point="mjtactile.envs.single:TactileEnv",
                vector_entry_point="mjtactile.envs.many:make_vec",
                kwargs={"task": name},
            )


def task_of(task: str | type[Task]) -> type[Task]:
    """The task of an environment's id; a task is returned unchanged.

    Raises:
        EnvError: there is no such id, or it is no task.
    """
    # Imported here, so that registering does not import SciPy.
    from mjtactile.envs.task import Task

    if isinstance(task, type) and issubclass(task, Task):
        return task
    if not isinstance(task, str):
        raise EnvError(
            f"task = {shortened(task)}; expected the id of an environment, one of {', '.join(ENTRY_POINTS)}, or a "
            "subclass of mjtactile.envs.Task."
        )
    if task not in ENTRY_POINTS:
        raise EnvError(f"environment {task!r} does not exist in mjtactile. Available: {', '.join(ENTRY_POINTS)}.")
    module, name = ENTRY_POINTS[task].split(":")
    return getattr(import_module(module), name)
