"""The command line: `mjtactile dataset` and `mjtactile record`, which write data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjtactile.cli.options import FidelityOption, RayAddressOption, RayOption, WorkersOption
from mjtactile.fidelity import DEFAULT
from mjtactile.units import MOST_PRESSES, MOST_SEED

if TYPE_CHECKING:
    from mjtactile.experiments.grasp.trials import TrialSettings

_LIFT = "lift"
#: File that marks a temporary folder of presses, which is deleted in the end.
_MARKER = ".mjtactile-temporary"
#: Where lift's controller gets its forces from.
_TOUCHES = ("true", "recognised")


def dataset(
    spec: Annotated[Path, typer.Option(help="TOML file that specifies the presses; see docs/datasets.md.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to.  [default: the file's name without .toml]")
    ] = None,
    presses: Annotated[
        int | None, typer.Option(min=1, max=MOST_PRESSES, help="Number of presses, instead of the file's.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, max=MOST_SEED, help="Seed, instead of the file's.")] = None,
    form: Annotated[
        str, typer.Option("--format", help="parquet, or lerobot with one episode per outline.")
    ] = "parquet",
    flat: Annotated[bool, typer.Option("--flat", help="For lerobot: store readings as vectors.")] = False,
    workers: WorkersOption = 2,
    ray: RayOption = False,
    ray_address: RayAddressOption = None,
) -> None:
    """Make a dataset of presses; run it again to continue after an interruption."""
    from dataclasses import replace
    from time import perf_counter

    from mjtactile.dataset.files import make_dataset
    from mjtactile.dataset.spec import load_spec
    from mjtactile.workers import Workers

    who = Workers(count=workers, ray=ray, ray_address=ray_address)
    wanted = load_spec(spec)
    if presses is not None:
        wanted = replace(wanted, presses=presses)
    if seed is not None:
        wanted = replace(wanted, seed=seed)
    folder = spec.with_suffix("") if out is None else out
    presses_folder = _presses_folder(folder, form)
    if flat and form != "lerobot":
        raise typer.BadParameter(f"format {form} has no flat readings, only lerobot has. Leave out --flat.")
    start = perf_counter()
    made = make_dataset(wanted, presses_folder, workers=who)
    typer.echo(f"made {made} of {wanted.presses} presses in {perf_counter() - start:.1f} s: {presses_folder}")
    if form == "lerobot":
        import shutil

        from mjtactile.lerobot.presses import presses_to_lerobot

        written = presses_to_lerobot(presses_folder, folder, flat=flat)
        shutil.rmtree(presses_folder)
        typer.echo(f"wrote {written} episodes: {folder}")


def _presses_folder(folder: Path, form: str) -> Path:
    """Folder in which the presses are made. For other formats than Parquet, a temporary one is made beside `folder`.

    It stays after an interruption, so that the presses need not be made again, and has a marker: no other is deleted.

    Raises:
        DatasetError: there is no such format, the dataset of another format exists already, or the temporary folder is
            not this command's own.
        OutputError: the temporary folder cannot be made.
    """
    from mjtactile._files import check_writable, make_folder
    from mjtactile.errors import DatasetError

    if form not in ("parquet", "lerobot"):
        raise DatasetError(f"format {form!r} does not exist. Available: parquet, lerobot.")
    if form == "parquet":
        return folder
    if folder.exists():
        raise DatasetError(f"{folder} exists already. Name another folder with --out, or delete that one.")
    temporary = folder.with_name(f".{folder.name}.presses")
    make_folder(temporary)
    if not (temporary / _MARKER).is_file() and any(temporary.iterdir()):
        raise DatasetError(
            f"{temporary}, where the presses would be made for a while, exists and is not of this command. Name "
            "another folder with --out, or move that one."
        )
    check_writable(temporary / _MARKER)
    (temporary / _MARKER).touch()
    return temporary


def record(
    what: Annotated[str, typer.Argument(help='"lift" for the grasp experiment, or the id of an environment.')],
    out: Annotated[Path, typer.Option(help="Folder of the new dataset.")],
    episodes: Annotated[int, typer.Option(min=1, help="Number of episodes.")] = 50,
    seed: Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Seed of all random numbers.")] = 0,
    touch: Annotated[
        str | None, typer.Option(help="Forces that lift's controller gets: true or recognised.  [default: true]")
    ] = None,
    fps: Annotated[
        int | None, typer.Option(min=1, help="Frames per second of lift; it must divide 250.  [default: 50]")
    ] = None,
    flat: Annotated[
        bool, typer.Option("--flat", help="Store readings as vectors, not (layers, rows, columns).")
    ] = False,
    fidelity: FidelityOption = DEFAULT,
) -> None:
    """Record grasps, or an environment under random actions, as a LeRobotDataset."""
    from time import perf_counter

    from mjtactile.experiments.grasp.trials import TrialSettings

    if touch is not None and touch not in _TOUCHES:
        raise typer.BadParameter(f"{touch!r} does not exist. Available: {', '.join(_TOUCHES)}.", param_hint="--touch")
    start = perf_counter()
    settings = TrialSettings(seed=seed, fidelity=fidelity)
    if what == _LIFT:
        from mjtactile.lerobot.grasp import record_lifts

        results = record_lifts(
            out, episodes=episodes, settings=settings, condition=touch or "true", fps=fps or 50, flat=flat
        )
        typer.echo(f"{sum(result['success'] for result in results)} of {episodes} lifted")
    else:
        _check_environment(what, {"--touch": touch, "--fps": fps})
        _record_environment(what, out, episodes, settings, flat)
    typer.echo(f"wrote {episodes} episodes in {perf_counter() - start:.1f} s: {out}")


def _check_environment(name: str, options: dict[str, object]) -> None:
    """Refuse what is no environment, and options of lift, by name, that are not None."""
    from mjtactile.envs.registration import ENTRY_POINTS

    if name not in ENTRY_POINTS:
        known = ", ".join((_LIFT, *ENTRY_POINTS))
        raise typer.BadParameter(f"{name!r} cannot be recorded. Available: {known}.", param_hint="WHAT")
    for option, value in options.items():
        if value is not None:
            raise typer.BadParameter(f"{name} has no {option}, only lift has. Leave out {option}.")


def _record_environment(name: str, out: Path, episodes: int, settings: TrialSettings, flat: bool) -> None:
    """Record an environment under random actions; to record a policy, use `LeRobotRecorder`."""
    from mjtactile._progress import progress_bar
    from mjtactile.envs.single import TactileEnv
    from mjtactile.lerobot.environment import LeRobotRecorder

    env = TactileEnv(name, observation="pascals", fidelity=settings.fidelity)
    env.action_space.seed(settings.seed)
    recorder = LeRobotRecorder(env, out, flat=flat)
    with progress_bar("recording", episodes) as advance:
        for episode in range(episodes):
            recorder.reset(seed=_episode_seed(settings.seed, episode))
            ended = False
            while not ended:
                _, _, terminated, truncated, _ = recorder.step(env.action_space.sample())
                ended = terminated or truncated
            advance(1)
    recorder.close()


def _episode_seed(seed: int, episode: int) -> int:
    """Seed of an episode of the environment; other seeds of the recording have other episodes."""
    import numpy as np

    return int(np.random.SeedSequence([seed, episode]).generate_state(1, np.uint64)[0])
