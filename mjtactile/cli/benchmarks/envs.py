"""Speed of environments, one and many at once, with and without pads, beside `mj_step` in the same states."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import mujoco
import numpy as np

from mjtactile.experiments.markdown import markdown_table

#: Environments that are measured, and their options by the name of the row.
_NAMES = ("mjtactile/GraspLift-v0", "mjtactile/PressIdentify-v0")
_OPTIONS: dict[str, dict[str, Any]] = {
    "without": {"observation": "none"},
    "wrench, fast": {"observation": "wrench", "fidelity": "fast"},
    "readings, fast": {"observation": "readings", "fidelity": "fast"},
    "readings, balanced": {"observation": "readings", "fidelity": "balanced"},
}
#: Random actions use this fraction of their range, so that objects stay in contact [-].
_STIR = 0.3
#: Indices of actions that end an episode when they are above 0, by environment. They are kept at -1, because steps are
#: measured and not resets.
_ENDING = {"mjtactile/PressIdentify-v0": [4]}
#: Number of environments at once; number of turns, in each of which all cases run once; steps in a turn of many
#: environments, and of one.
_COUNT, _TURNS, _STEPS, _STEPS_OF_ONE = 64, 25, 2, 40


def envs_benchmark(*, quick: bool = False) -> dict[str, Any]:
    """Time of a step by environment, observation and fidelity: medians over turns, few of one environment if `quick`.

    Returns:
        `mujoco_version`; `count`, the number of environments at once; `threads`, which environments and `mj_step` use;
        and `rows`. Each row has `name` and `pads`, the name of its options; `substeps`, MuJoCo's steps in a step of the
        environment; `one_s` and `many_s`, the time of a step of one environment alone and of one among many [s];
        `plain_s` and `plain_many_s`, the time of one `mj_step` alone, on one thread and on all [s]; `one_share` and
        `many_share`, the environment's speed divided by that of `mj_step` in the same turn [-].

    Raises:
        MissingExtraError: gymnasium is not installed.
    """
    from mjtactile.envs.many import make_vec

    names = _NAMES[:1] if quick else _NAMES
    count, turns = (4, 2) if quick else (_COUNT, _TURNS)
    threads = os.cpu_count() or 1
    rows = []
    for name in names:
        plain = {n: _Plain(name, n, threads) for n in (1, count)}
        cases: dict[Any, _Environments | _Plain] = {("plain", n): one for n, one in plain.items()}
        for pads, options in _OPTIONS.items():
            for n in (1, count):
                cases[pads, n] = _Environments(name, make_vec(name, n, threads=threads, **options))
        times: dict[Any, list[float]] = {key: [] for key in cases}
        for _ in range(turns):
            for key, case in cases.items():
                times[key].append(case.run(_STEPS_OF_ONE if key[1] == 1 else _STEPS))
        substeps = plain[1].substeps
        rows += [
            {
                "name": name,
                "pads": pads,
                "substeps": substeps,
                "one_s": float(np.median(times[pads, 1])),
                "many_s": float(np.median(times[pads, count])) / count,
                "plain_s": float(np.median(times["plain", 1])) / substeps,
                "plain_many_s": float(np.median(times["plain", count])) / (count * substeps),
                "one_share": float(np.median(np.divide(times["plain", 1], times[pads, 1]))),
                "many_share": float(np.median(np.divide(times["plain", count], times[pads, count]))),
            }
            for pads in _OPTIONS
        ]
    return {"mujoco_version": mujoco.__version__, "count": count, "threads": threads, "rows": rows}


class _Actions:
    """Random actions; every instance of the same shape draws the same ones."""

    def __init__(self, name: str, shape: tuple[int, ...]) -> None:
        self._drawn, self._shape, self._ending = np.random.default_rng(0), shape, _ENDING.get(name, [])

    def __call__(self) -> Any:
        actions = (_STIR * self._drawn.uniform(-1.0, 1.0, self._shape)).astype(np.float32)
        actions[:, self._ending] = -1.0
        return actions


class _Environments:
    """A vector environment under random actions."""

    def __init__(self, name: str, envs: Any) -> None:
        self._envs, self._actions = envs, _Actions(name, envs.action_space.shape)
        envs.reset(seed=0)

    def run(self, steps: int) -> float:
        """Time of a step of all environments [s]."""
        actions = [self._actions() for _ in range(steps)]
        start = time.perf_counter()
        for action in actions:
            self._envs.step(action)
        return (time.perf_counter() - start) / steps


class _Plain:
    """`mj_step` alone, on threads, from the states and under the controls of environments without pads.

    The environment takes its step untimed. Then its simulation is wound back, and MuJoCo's part of the step is repeated
    and timed. Timing the model at rest would flatter `mj_step`, which takes several times as long with something in
    the hand.
    """

    def __init__(self, name: str, count: int, threads: int) -> None:
        from mjtactile.envs.single import TactileEnv

        self._envs = [TactileEnv(name, observation="none") for _ in range(count)]
        for k, env in enumerate(self._envs):
            env.reset(seed=k)
        self.substeps = self._envs[0].task.SUBSTEPS
        shape = self._envs[0].action_space.shape or ()
        self._actions, self._threads = _Actions(name, (count, *shape)), min(threads, count)
        self._pool = ThreadPoolExecutor(max(1, self._threads - 1))

    def run(self, steps: int) -> float:
        """Time in which MuJoCo steps all simulations through one step of the environment [s]."""
        return sum(self._step() for _ in range(steps)) / steps

    def _step(self) -> float:
        kind = mujoco.mjtState.mjSTATE_INTEGRATION.value
        simulations = [env.task.simulation.state(0) for env in self._envs]
        before = [np.empty(mujoco.mj_stateSize(model, kind)) for model, _ in simulations]
        for (model, data), state in zip(simulations, before, strict=True):
            mujoco.mj_getState(model, data, state, kind)
        over = [any(env.step(action)[2:4]) for env, action in zip(self._envs, self._actions(), strict=True)]
        for (model, data), state in zip(simulations, before, strict=True):
            controls = data.ctrl.copy()
            mujoco.mj_setState(model, data, state, kind)
            data.ctrl[:] = controls
        start = time.perf_counter()
        # All threads share one iterator, and each takes the next simulation from it.
        left = iter(simulations)
        others = [self._pool.submit(self._advance, left) for _ in range(self._threads - 1)]
        self._advance(left)
        for other in others:
            other.result()
        taken = time.perf_counter() - start
        for env, ended in zip(self._envs, over, strict=True):
            if ended:
                env.reset()
        return taken

    def _advance(self, simulations: Iterator[tuple[mujoco.MjModel, mujoco.MjData]]) -> None:
        for model, data in simulations:
            mujoco.mj_step(model, data, self.substeps)


def envs_table(result: dict[str, Any]) -> str:
    """The benchmark's result as a Markdown table."""
    count, threads = result["count"], result["threads"]
    titles = ["environment", "pads", *(f"{n}: {what}" for n in ("one", count) for what in ("steps/s", "of `mj_step`"))]
    titles += ["MuJoCo's steps in one step", "`mj_step`, one thread: steps/s", f"`mj_step`, {threads} threads: steps/s"]
    rows = []
    for row in result["rows"]:
        rates = [[f"{1.0 / row[f'{kind}_s']:,.0f}", f"{row[f'{kind}_share']:.0%}"] for kind in ("one", "many")]
        plain = [f"{1.0 / row[name]:,.0f}" for name in ("plain_s", "plain_many_s")]
        rows.append([row["name"], row["pads"], *rates[0], *rates[1], str(row["substeps"]), *plain])
    return markdown_table(titles, rows)
