"""Many environments at once: on `mujoco.batch` where this MuJoCo has it, one after the other where not."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from mjtactile.envs.options import EnvError
from mjtactile.envs.registration import ENTRY_POINTS


def make_vec(
    name: str,
    count: int,
    *,
    threads: int = 0,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    copy: bool = True,
    batched: bool | None = None,
    **options: Any,
) -> VectorEnv[Any, Any, Any]:
    """A vector environment whose results are those of as many single ones, bit by bit.

    Environment i of `reset(seed=s)` is `gymnasium.make(name)` with `reset(seed=s + i)`.

    Args:
        name: id of one of the environments here.
        count: how many.
        threads: that simulate, on `mujoco.batch`; 0 for as many as there are processors.
        autoreset_mode: see `gymnasium.vector.AutoresetMode`.
        copy: whether observations are copies; if not, the next step overwrites them.
        batched: whether on `mujoco.batch`; None: where there is one.
        options: of the environments, see `TactileEnv`.

    Raises:
        EnvError: there is no such environment, or no `mujoco.batch` where it was asked for, or fewer than one.
    """
    if name not in ENTRY_POINTS:
        raise EnvError(f"environment {name!r} does not exist here. Available: {', '.join(ENTRY_POINTS)}.")
    if count < 1:
        raise EnvError(f"count = {count}; expected at least one environment.")
    mode = AutoresetMode(autoreset_mode)
    kind: Any = load_env_creator(ENTRY_POINTS[name])
    if batched is None:
        batched = find_spec("mujoco.batch") is not None
    if not batched:
        return SyncVectorEnv([lambda: kind(**options)] * count, copy=copy, autoreset_mode=mode)
    try:
        from mjtactile.envs.batch import BatchVectorEnv
    except ImportError as error:
        raise EnvError(f"this MuJoCo has no mujoco.batch ({error}): update it, or leave out batched=True.") from error
    many = BatchVectorEnv(kind, count, threads=threads, autoreset_mode=mode, copy=copy, **options)
    many.spec = gymnasium.spec(name) if name in gymnasium.registry else None
    return many
