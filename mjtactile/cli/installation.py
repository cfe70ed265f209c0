"""The command line: `mjtactile doctor`, `info`, `build` and `cache`, on the installation and its tables."""

from __future__ import annotations

import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mjtactile._installed import EXTRAS, __version__, install_line
from mjtactile.cli.options import AsJson, FidelityOption, PadOption, json_text
from mjtactile.errors import MjTactileError
from mjtactile.fidelity import DEFAULT

if TYPE_CHECKING:
    from mjtactile.pad import Pad

#: From this version on MuJoCo finds plugins by itself.
_FINDS_PLUGINS = (4, 0)
#: What MuJoCo says when a plugin cannot do what a model asks of it.
_REFUSED = "plugin->init failed"
#: A model with one pad, compiled in a process of its own.
_MODEL = (
    '<mujoco><extension><plugin plugin="mjtactile.pad"/></extension><worldbody>'
    '<geom name="pad" type="box" size="0.0075 0.0075 0.0025"/></worldbody>'
    '<sensor><plugin plugin="mjtactile.pad" objtype="geom" objname="pad">'
    '<config key="fidelity" value="fast"/></plugin></sensor></mujoco>'
)

cache_app = typer.Typer(help="List or remove the tables in the cache of this user.", no_args_is_help=True)


@dataclass(frozen=True)
class Finding:
    """One result of `doctor`."""

    about: str  #: the subject of the check
    says: str  #: the result
    cure: str | None = None  #: how to solve a problem; None if there is no problem


def doctor(as_json: AsJson = False) -> None:
    """Show what is installed, whether it works, and how to repair what does not."""
    findings = [_examined(about, look) for about, look in _LOOKS.items()]
    if as_json:
        typer.echo(json_text([asdict(finding) for finding in findings]))
    else:
        for finding in findings:
            typer.echo(f"{'ok   ' if finding.cure is None else 'WRONG'}  {finding.about}: {finding.says}")
            if finding.cure is not None:
                typer.echo(f"       {' '.join(finding.cure.split())}")
    if any(finding.cure is not None for finding in findings):
        raise typer.Exit(1)


def build(
    fidelity: FidelityOption = DEFAULT,
    pad: PadOption = None,
    force: Annotated[bool, typer.Option("--force", help="Build it even if it exists.")] = False,
) -> None:
    """Build a pad's influence matrices and store them in the cache."""
    from time import perf_counter

    from mjtactile.influence.cache import build_influence, cached_path, influence_matrices, stored_path

    one = _pad(pad)
    present = stored_path(one, fidelity) is not None and not force
    start = perf_counter()
    if force:
        build_influence(one, fidelity).save(cached_path(one, fidelity))
    influence = influence_matrices(one, fidelity)
    action = "found" if present else "built"
    path = stored_path(one, fidelity) or "not kept"
    typer.echo(f"{action} {influence.nbytes / 1e6:.0f} MB in {perf_counter() - start:.2f} s: {path}")


def info(pad: PadOption = None, as_json: AsJson = False) -> None:
    """Show the pad, the indenters, the meshes and the fidelities, and which tables are built."""
    import mujoco

    from mjtactile.cli.press import OTHER_INDENTERS
    from mjtactile.fidelity import MESHES, PRESETS, Fidelity
    from mjtactile.geometry.outlines import INDENTER_NAMES
    from mjtactile.influence.cache import cache_directory, stored_path

    one = _pad(pad)
    facts: dict[str, Any] = {
        "version": __version__,
        "mujoco": mujoco.mj_versionString(),
        "pad": one.summary,
        "punches": list(INDENTER_NAMES),
        "other indenters": list(OTHER_INDENTERS),
        "cache": str(cache_directory()),
        "meshes": {name: _size(stored_path(one, Fidelity(mesh=name))) for name in MESHES},
        "presets": {name: _size(stored_path(one, name)) for name in PRESETS},
    }
    if as_json:
        typer.echo(json_text(facts))
        return
    for name, value in facts.items():
        if isinstance(value, list):
            value = ", ".join(value)
        elif isinstance(value, dict):
            value = ", ".join(
                f"{table} ({'not built' if size is None else f'{size / 1e6:.0f} MB'})" for table, size in value.items()
            )
        typer.echo(f"{name + ':':17}{value}")


def _pad(path: Path | None) -> Pad:
    """The pad of a TOML file; the default pad if None."""
    from mjtactile.pad import Pad
    from mjtactile.pad_names import pad_from_file

    return Pad() if path is None else pad_from_file(path)


@cache_app.command("list")
def cache_list(as_json: AsJson = False) -> None:
    """Show the tables in the cache, the largest first."""
    from mjtactile.influence.cache import cache_directory, cached_tables

    tables = cached_tables()
    if as_json:
        typer.echo(json_text([{**asdict(table), "path": str(table.path)} for table in tables]))
        return
    for table in tables:
        typer.echo(f"{table.size / 1e6:8.1f} MB  {table.path.name}  {table.contents}")
    typer.echo(f"{sum(table.size for table in tables) / 1e6:8.1f} MB  {len(tables)} tables in {cache_directory()}")


@cache_app.command("clear")
def cache_clear(
    unusable: Annotated[bool, typer.Option("--unusable", help="Only tables that can no longer be read.")] = False,
    sure: Annotated[bool, typer.Option("--yes", help="Remove tables that can be read, too.")] = False,
) -> None:
    """Remove tables from the cache; they are built again when they are needed, which may take minutes each."""
    from mjtactile.influence.cache import cache_directory, cached_tables, clear_cache

    if not (unusable or sure):
        tables = cached_tables()
        size = sum(table.size for table in tables) / 1e6
        typer.echo(f"nothing is removed yet: {len(tables)} tables, {size:.1f} MB, in {cache_directory()}. Add --yes.")
        return
    removed = clear_cache(unusable_only=unusable)
    typer.echo(f"removed {len(removed)} tables, {sum(t.size for t in removed) / 1e6:.1f} MB, from {cache_directory()}")


def _examined(about: str, look: Callable[[], Finding]) -> Finding:
    """The result of a check; an error is a finding as well."""
    try:
        return look()
    except MjTactileError as error:
        return Finding(about, "it does not work", str(error))
    except (ImportError, OSError) as error:
        cure = "Install mjtactile again, and what it needs: pip install --force-reinstall mjtactile"
        return Finding(about, f"{type(error).__name__}: {error}", cure)


def _look_at_the_package() -> Finding:
    place = Path(__file__).parents[1]
    return Finding("mjtactile", f"{__version__} in {place}, Python {platform.python_version()}, {platform.platform()}")


def _look_at_mujoco() -> Finding:
    import mujoco

    from mjtactile.plugin.engine import running_layout

    running_layout()
    return Finding("MuJoCo", mujoco.mj_versionString())


def _look_at_the_core() -> Finding:
    from mjtactile._native import instruction_set, library_path

    return Finding("compiled core", f"instruction set {instruction_set()}, {library_path()}")


def _look_at_the_plugin() -> Finding:
    """Check that a new process can read a model with a pad; MuJoCo from 4.0 on needs no import of mjtactile."""
    import mujoco

    from mjtactile._native import library

    library()  # without it, its own error says more than MuJoCo's
    alone = tuple(int(number) for number in mujoco.__version__.split(".")[:2]) >= _FINDS_PLUGINS
    imports = "import mujoco" if alone else "import mujoco, mjtactile"
    code = f"{imports}; print(mujoco.MjModel.from_xml_string({_MODEL!r}).nsensordata)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return Finding("plugin", f"registers by `{imports}`")
    lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
    errors = [number for number, line in enumerate(lines) if line.partition(":")[0].endswith("Error")]
    said, *more = lines[errors[-1] if errors else -1 :]
    if _REFUSED in said and more:  # the plugin is there, and its own words follow MuJoCo's
        return Finding("plugin", f"registers by `{imports}`, but refuses a model", more[0])
    cure = "Install mjtactile again, so that its entry point is known to this Python." if alone else said
    return Finding("plugin", f"does not register by `{imports}`: {said}", cure)


def _look_at_the_tables() -> Finding:
    from mjtactile.fidelity import PRESETS
    from mjtactile.influence.cache import stored_path
    from mjtactile.pad import Pad

    ready = [name for name in PRESETS if stored_path(Pad(), name) is not None]
    later = [name for name in PRESETS if name not in ready]
    said = f"ready for the default pad: {', '.join(ready) or 'none'}"
    return Finding("tables", said + (f"; built when they are first used: {', '.join(later)}" if later else ""))


def _look_at_the_cache() -> Finding:
    import tempfile

    from mjtactile.influence.cache import CACHE_VARIABLE, cache_directory, cached_tables

    folder = cache_directory()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        tables = cached_tables()
    except OSError as error:
        cure = f"Make it a folder that can be read and written, or name another in the variable {CACHE_VARIABLE}."
        return Finding("cache", f"{folder} cannot be used: {error}", cure)
    said = f"{folder}, {len(tables)} tables, {sum(table.size for table in tables) / 1e6:.0f} MB"
    lost = [table for table in tables if not table.usable]
    if lost:
        room = sum(table.size for table in lost) / 1e6
        said += f"; {len(lost)} of them, {room:.0f} MB, are damaged or of another version. Remove them: "
        said += "mjtactile cache clear --unusable"
    return Finding("cache", said)


def _look_at_the_recognisers() -> Finding:
    from mjtactile import recognition

    names = ("force", "shape", "grasp")
    for name in names:
        recognition.load(name)
    return Finding("recognisers", f"weights of {', '.join(names)} are complete")


def _look_at_the_extras() -> Finding:
    there = [name for name, extra in EXTRAS.items() if not extra.missing]
    lines = [f"{extra.purpose}: {install_line(name)}" for name, extra in EXTRAS.items() if extra.missing]
    return Finding("extras", "; ".join([f"installed: {', '.join(there) or 'none'}", *lines]))


#: Checks of `doctor`, in order.
_LOOKS: dict[str, Callable[[], Finding]] = {
    "mjtactile": _look_at_the_package,
    "MuJoCo": _look_at_mujoco,
    "compiled core": _look_at_the_core,
    "plugin": _look_at_the_plugin,
    "tables": _look_at_the_tables,
    "cache": _look_at_the_cache,
    "recognisers": _look_at_the_recognisers,
    "extras": _look_at_the_extras,
}


def _size(path: Path | None) -> int | None:
    return None if path is None else path.stat().st_size
