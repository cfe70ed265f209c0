"""How fast environments step: one and many, with pads and without, beside a plain step of MuJoCo."""

from __future__ import annotations

import time
from typing import Any

import mujoco
import numpy as np

from mjtactile.errors import MjTactileError

#: Environments measured, and what is seen of their pads.
_NAMES = ("mjtactile/GraspLift-v0", "mjtactile/PressIdentify-v0")
_OBSERVATIONS = ("none", "wrench", "readings")
#: Random actions have this share of their range, so that things are held and pressed rather than thrown about.
_STIR = 0.3
_COUNT, _RUNS = 64, 5


def envs_benchmark(*, quick: bool = False) -> dict[str, Any]:
    """Steps per second, by environment and by what is seen of the pads; medians of runs that take turns.

    Args:
        quick: few and short runs, for tests.

    Raises:
        MjTactileError: gymnasium is not installed.
    """
    try:
        from mjtactile.envs.many import make_vec
    except ImportError as error:
        raise MjTactileError(f"environments need gymnasium: pip install 'mjtactile[envs]' ({error}).") from error
    names = _NAMES[:1] if quick else _NAMES
    count, runs, steps = (4, 1, 10) if quick else (_COUNT, _RUNS, 100)
    rows = []
    for name in names:
        cases = {(seen, n): _Runner(make_vec(name, n, observation=seen)) for seen in _OBSERVATIONS for n in (1, count)}
        plain = _Plain(cases["none", 1].model)
        times: dict[Any, list[float]] = {key: [] for key in (*cases, "plain")}
        for _ in range(runs):
            times["plain"].append(plain.run(steps))
            for (seen, n), case in cases.items():
                times[seen, n].append(case.run(max(5, steps // 10) if n > 1 else steps))
        medians = {key: float(np.median(values)) for key, values in times.items()}
        substeps = cases["none", 1].substeps
        rows += [
            {
                "name": name,
                "observation": seen,
                "substeps": substeps,
                "plain_s": medians["plain"],
                "one_s": medians[seen, 1],
                "many_s": medians[seen, count] / count,
            }
            for seen in _OBSERVATIONS
        ]
    return {"mujoco_version": mujoco.__version__, "count": count, "rows": rows}


class _Runner:
    """A vector environment under random actions."""

    def __init__(self, envs: Any) -> None:
        self._envs, self._drawn = envs, np.random.default_rng(0)
        self.model, self.substeps = envs.task.simulation.model, envs.task.SUBSTEPS
        envs.reset(seed=0)

    def run(self, steps: int) -> float:
        """Time of a step of all environments [s]."""
        actions = _STIR * self._drawn.uniform(-1.0, 1.0, (steps, *self._envs.action_space.shape)).astype(np.float32)
        start = time.perf_counter()
        for action in actions:
            self._envs.step(action)
        return (time.perf_counter() - start) / steps


class _Plain:
    """`mj_step` on the same model without pads' sensors, from the model's rest."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model, self._data = model, mujoco.MjData(model)

    def run(self, steps: int) -> float:
        """Time of a step [s]."""
        mujoco.mj_resetData(self._model, self._data)
        start = time.perf_counter()
        mujoco.mj_step(self._model, self._data, 20 * steps)
        return (time.perf_counter() - start) / (20 * steps)


def envs_table(result: dict[str, Any]) -> str:
    """The benchmark's result as a Markdown table."""
    count = result["count"]
    lines = [
        f"| environment | pads | one: steps/s | {count}: steps/s | MuJoCo's steps in one step | one: MuJoCo's "
        f"steps/s | {count}: MuJoCo's steps/s | plain `mj_step`, steps/s |",
        f"|{' --- |' * 8}",
    ]
    for row in result["rows"]:
        pads = "without" if row["observation"] == "none" else row["observation"]
        one, many, plain = 1.0 / row["one_s"], 1.0 / row["many_s"], 1.0 / row["plain_s"]
        inner = row["substeps"]
        lines.append(
            f"| {row['name']} | {pads} | {one:,.0f} | {many:,.0f} | {inner} | {one * inner:,.0f} | {many * inner:,.0f} "
            f"| {plain:,.0f} |"
        )
    return "\n".join(lines)
