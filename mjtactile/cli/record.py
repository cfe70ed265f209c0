"""The command line: `mjtactile record`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjtactile.cli.options import FidelityOption
from mjtactile.units import MOST_SEED

if TYPE_CHECKING:
    from mjtactile.experiments.grasp.trials import Settings

_LIFT = "lift"


def record(
    what: Annotated[str, typer.Argument(help='"lift", the grasp experiment, or an environment\'s id.')],
    out: Annotated[Path, typer.Option(help="Folder to make.")],
    episodes: Annotated[int, typer.Option(min=1, help="How many.")] = 50,
    seed: Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Of everything.")] = 0,
    touch: Annotated[str, typer.Option(help="What lift's controller is told: true or recognised.")] = "true",
    fps: Annotated[int, typer.Option(min=1, help="Frames per second of lift; touch has 250 readings.")] = 50,
    flat: Annotated[bool, typer.Option("--flat", help="Readings as vectors, not (layers, rows, columns).")] = False,
    fidelity: FidelityOption = "fast",
) -> None:
    """Record grasps, or an environment under random actions, as a LeRobotDataset."""
    from time import perf_counter

    from mjtactile.experiments.grasp.trials import Settings

    start = perf_counter()
    settings = Settings(seed=seed, fidelity=fidelity)
    if what == _LIFT:
        from mjtactile.lerobot.grasp import record_lifts

        results = record_lifts(out, episodes=episodes, settings=settings, condition=touch, fps=fps, flat=flat)
        typer.echo(f"{sum(result['success'] for result in results)} of {episodes} lifted")
    else:
        _record_environment(what, out, episodes, settings, flat)
    typer.echo(f"wrote {episodes} episodes in {perf_counter() - start:.1f} s: {out}")


def _record_environment(name: str, out: Path, episodes: int, settings: Settings, flat: bool) -> None:
    """Random actions; for a policy of one's own there is `LeRobotRecorder`."""
    from mjtactile._progress import progress_bar
    from mjtactile.errors import MjTactileError

    try:
        from mjtactile.envs.single import TactileEnv
        from mjtactile.lerobot.environment import LeRobotRecorder
    except ImportError as error:
        raise MjTactileError(f"environments need gymnasium: pip install 'mjtactile[envs]' ({error}).") from error
    env = TactileEnv(name, observation="pascals", fidelity=settings.fidelity)
    env.action_space.seed(settings.seed)
    recorder = LeRobotRecorder(env, out, flat=flat)
    with progress_bar("recording", episodes) as advance:
        for episode in range(episodes):
            recorder.reset(seed=settings.seed + episode)
            ended = False
            while not ended:
                _, _, terminated, truncated, _ = recorder.step(env.action_space.sample())
                ended = terminated or truncated
            advance(1)
    recorder.close()
