"""Learn to lift what one has never felt before: GraspLift with touch and without, by proximal policy optimisation.

    python training/train_policy.py --out build/policy                       # two arms, five seeds, figure and table
    python training/train_policy.py --out build/look --seeds 1 --steps 20000     # a look

Both arms have the same body, time, networks, steps and settings; one also has its pads' readings, as their moments
(`mjtactile.envs.touch.moments`). Training draws masses and frictions from every second band of their ranges, the test
from the bands between. A run that is there already is not made again; one of other settings is refused. Needs
`pip install mjtactile[train]`.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from concurrent.futures import as_completed
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from arguments import run_script
from policy_environment import StackedLifts
from policy_report import draw_curves, success_table

from mjtactile._files import write_atomically
from mjtactile.cli.benchmarks.tables import table_on_page
from mjtactile.errors import TrialsError, shortened
from mjtactile.units import finite_number, is_whole
from mjtactile.workers import process_pool

#: What is compared: with touch, and without.
ARMS = {"touch": "readings", "no touch": "none"}
#: Arguments that change no run: which runs there are, where they are made and what is drawn of them.
_OUTSIDE = ("out", "seeds", "workers", "page", "figure")
_COUNTS = ("seeds", "steps", "environments", "workers", "test_episodes", "rollout", "epochs", "batch", "width")


@dataclass(frozen=True, kw_only=True)
class Config:
    """Arguments.

    Raises:
        TrialsError: a number is not one that can be trained with.
    """

    out: Path  #: folder for runs, figure and table
    seeds: int = 5  #: of each arm
    steps: int = 150_000  #: of the environment in a run
    environments: int = 32  #: at once
    workers: int = 2  #: runs at a time, on a core each
    test_episodes: int = 416  #: of the final test, as many from each environment
    rollout: int = 16  #: steps of each environment between updates
    epochs: int = 8  #: passes over what a rollout gave
    batch: int = 256  #: steps in a gradient
    rate: float = 1e-3  #: learning rate at first; it falls to nothing
    width: int = 64  #: of the two hidden layers of policy and value
    discount: float = 0.98  #: per step
    page: Path | None = None  #: Markdown file whose table, between its markers, is written anew
    figure: Path | None = None  #: where the learning curves are drawn; by default in the folder

    def __post_init__(self) -> None:
        """Refuse numbers of which nothing comes."""
        for name in _COUNTS:
            value = getattr(self, name)
            if not (is_whole(value) and value >= 1):
                raise TrialsError(f"{name} = {shortened(value)}; expected a whole number of at least 1.")
        if not finite_number(self.rate) > 0.0:
            raise TrialsError(f"rate = {shortened(self.rate)}; expected a positive number.")
        if not 0.0 <= finite_number(self.discount) <= 1.0:
            raise TrialsError(f"discount = {shortened(self.discount)}; expected a number from 0 to 1.")


def run(config: Config, arm: str, seed: int) -> dict[str, Any]:
    """Train one policy and test it."""
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.logger import Logger
    from stable_baselines3.common.utils import FloatSchedule, LinearSchedule

    torch.set_num_threads(1)
    start = time.process_time()
    training = StackedLifts(config.environments, ARMS[arm], "train")
    training.seed(1000 * seed)
    policy = PPO(
        "MlpPolicy",
        training,
        n_steps=config.rollout,
        batch_size=config.batch,
        n_epochs=config.epochs,
        gamma=config.discount,
        gae_lambda=0.95,
        learning_rate=FloatSchedule(LinearSchedule(config.rate, 0.0, 1.0)),
        policy_kwargs={"net_arch": [config.width] * 2, "log_std_init": 0.0},
        seed=seed,
        device="cpu",
    )
    policy.set_logger(Logger(None, []))  # its own makes a folder for a log that nobody reads
    policy.learn(config.steps)
    trained = time.process_time() - start
    tested = test(policy, training, config, arm)
    return {
        "arm": arm,
        "seed": seed,
        "processor_s": trained,
        "processor_s_with_test": time.process_time() - start,
        "curve": training.ended,
        "test": tested,
        "config": _told(config),
    }


def test(policy: Any, trained_in: StackedLifts, config: Config, arm: str) -> dict[str, Any]:
    """What the policy, without its exploration, does with masses and frictions it was never trained on."""
    lifts = StackedLifts(config.environments, ARMS[arm], "test")
    lifts.scale_as(trained_in)
    # The same objects for every policy.
    lifts.seed(987_654_321)
    observation = lifts.reset()
    each = math.ceil(config.test_episodes / config.environments)
    counts = np.zeros(config.environments, int)
    # As many from each environment: the first to end anywhere would be the short ones, which fail.
    while counts.min() < each:
        actions, _ = policy.predict(observation, deterministic=True)
        observation, _, done, _ = lifts.step(actions)
        counts += done
    ended = [one for one in lifts.ended if one["count"] < each]
    return {name: float(np.mean([one[name] for one in ended])) for name in ("success", "dropped", "crushed")}


def main(config: Config) -> None:
    """All runs that are missing, then figure and table.

    Raises:
        TrialsError: a run in the folder is of other settings.
    """
    write = table_on_page(config.page, "policy")
    config.out.mkdir(parents=True, exist_ok=True)
    runs = [(arm, seed) for seed in range(config.seeds) for arm in ARMS]
    missing = [(arm, seed) for arm, seed in runs if not _path(config, arm, seed).exists()]
    for path in (_path(config, *run) for run in runs if run not in missing):
        check_run(path, config)
    start = time.perf_counter()
    for result in _results(config, missing):
        arm, seed = result["arm"], result["seed"]
        _write(_path(config, arm, seed), json.dumps(result))
        print(
            f"{time.perf_counter() - start:.0f} s: {arm}, seed {seed}: {result['test']['success']:.1%} of unseen "
            f"objects lifted, {result['processor_s_with_test']:.0f} s of processor time",
            flush=True,
        )
    results = [json.loads(_path(config, arm, seed).read_text()) for arm in ARMS for seed in range(config.seeds)]
    table = success_table(results)
    _write(config.out / "table.md", table + "\n")
    figure = config.out / "curves.png" if config.figure is None else config.figure
    write_atomically(figure, lambda file: draw_curves(results).savefig(file, format="png", dpi=130))
    write(table)
    print(table)


def check_run(path: Path, config: Config) -> None:
    """Check that a stored run was made with the same settings.

    Raises:
        TrialsError: a setting differs, or the file holds no run.
    """
    try:
        stored = json.loads(path.read_text())["config"]
        own = _told(config)
        other = [
            f"{one.name} {stored.get(one.name)}, not {own[one.name]}"
            for one in fields(config)
            if one.name not in _OUTSIDE and stored.get(one.name) != own[one.name]
        ]
    except (ValueError, LookupError, TypeError, AttributeError):
        raise TrialsError(f"{path} holds no run. Choose another --out or delete that file.") from None
    if other:
        raise TrialsError(
            f"{path} is a run of other settings: {'; '.join(other)}. Choose another --out or delete that file."
        )


def _told(config: Config) -> dict[str, str]:
    """The settings, as they are stored with a run; 1 and 1.0 are one rate."""
    given = {one.name: getattr(config, one.name) for one in fields(config)}
    reals = {one.name for one in fields(config) if isinstance(one.default, float)}
    return {name: str(float(value) if name in reals else value) for name, value in given.items()}


def _results(config: Config, missing: list[tuple[str, int]]) -> Iterator[dict[str, Any]]:
    """Of each run as it ends; in this process for one worker, in others for several."""
    if config.workers == 1:
        yield from (run(config, arm, seed) for arm, seed in missing)
        return
    with process_pool(config.workers) as workers:
        for done in as_completed([workers.submit(run, config, arm, seed) for arm, seed in missing]):
            yield done.result()


def _write(path: Path, text: str) -> None:
    write_atomically(path, lambda file: file.write(text.encode()))


def _path(config: Config, arm: str, seed: int) -> Path:
    return config.out / f"{arm.replace(' ', '_')}-{seed}.json"


if __name__ == "__main__":
    run_script(main, Config, __doc__)
