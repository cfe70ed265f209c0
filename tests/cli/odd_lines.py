"""Odd command lines from seeds: every option of every command with values nobody should give, in odd company."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import trimesh
import typer
from typer.models import OptionInfo

from mjtactile.cli.main import app

HUGE = "9" * 20
NUMBERS = (
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "-1",
    "0",
    "",
    "abc",
    "1,5",
    "٣",
    HUGE,
    "0x10",
    "1e999",
    "--",
)
WORDS = (
    "",
    "nan",
    "None",
    "fast ",
    "FAST",
    "x" * 5000,
    "ü",
    "../..",
    "a b",
    "0",
    "\u202e",
    "precise,fast",
    "-",
    "\x7f",
)
#: Odd values of options by name, besides those of their type.
BY_NAME = {
    "force": (
        *("1e-308N", "1e-320mN", "1e400N", "nanN", "infgf", "-0gf", "0.0.1N", "5kg", "5", "N", "1e308gf", "١N", " N"),
        *("9" * 400 + "N", "9" * 5000 + "gf", "1e-12N", "2.6N", "300gf", "1e3N", "5 N ", "5gf5gf"),
    ),
    "shift": (*("1", "1,2,3", ",", "nan,0", "inf,inf", "1e308,1e308", "-1e308,0", "1e6,0", "a,b", "7.4,7.4", ""),),
    "tilt": ("89.9", "90", "90.0000001", "180", "-40", "1e17"),
    "rotate": ("1e17", "-720.5"),
    "friction": ("1e-300", "1e300", "-0.0"),
    "fidelity": ("fast", "coarse", "fast,precise"),
    "law": ("uniform", "Elastic", "foundation"),
    "tangential": ("stick", "coulomb", "slip"),
    "layers": ("all", "bottom", "4"),
    "rate": ("0", "-200", "3", "1001", "1000000"),
    "ray_address": ("", "auto", "localhost", "127.0.0.1:1", "127.0.0.1:99999", "ray://", ":", "x:y", "[::1]:1"),
    "workers": ("0", "-3", "1000000", HUGE),
}
#: What is given besides, so that only the odd values are odd, and little is built.
BASE: dict[str, tuple[str, ...]] = {
    "press": ("SHAPE", "--fidelity", "fast"),
    "build": ("--fidelity", "fast"),
    "dataset": ("--spec", "good.toml", "--workers", "1"),
}
SPEC = """
presses = 6
fidelity = "fast"
law = "uniform"
poses = 1
forces = 2
[[contact]]
shapes = ["square"]
force = 50
"""
#: Specifications that are wrong in one entry each.
SPECS = (
    *(
        "",
        "\0",
        "presses = [",
        "[" * 20_000,
        f"seed = {'9' * 5000}",
        "contact = 3",
        "contact = [3]",
        "[contact]",
        "[[pad]]",
    ),
    *(f"{entry}\n{SPEC.replace('presses = 6', '')}" for entry in ("presses = 1e5", "presses = 0", f"presses = {HUGE}")),
    *(f"seed = {value}\n{SPEC}" for value in ("-1", HUGE, "true", "nan")),
    *(SPEC.replace("poses = 1", f"poses = {value}") for value in ("0", "1.5", "1000000", HUGE, "'a'")),
    *(SPEC.replace("force = 50", f"force = {value}") for value in ("nan", "[inf, inf]", "-5", "[9, 1]", "1e300", "[]")),
    *(
        SPEC.replace("force = 50", f"force = {value}")
        for value in (f"1{'0' * 400}", "{}", "'50gf'", "true", "[1, 2, 3]")
    ),
    *(
        SPEC + line
        for line in ("size = 0", "size = 1e30", "shift = 1e9", "shift = [nan, 1]", "tilt = 90", "weight = 0")
    ),
    *(SPEC + line for line in ("upright = 2", "upright = 'x'", "weight = 1e400", "rotation = 1e308", "azimuth = [1]")),
    *(
        SPEC + line
        for line in ("colour = 1", "[transducer]", "[transducer]\nname = 3", "[pad]\nsize = 1", "[pad]\nx = 1")
    ),
    *(
        SPEC + f"[transducer]\nname = 'capacitive'\n{line}"
        for line in ("full_scale = nan", "full_scale = 'x'", "x = 1")
    ),
    *(
        SPEC + f"[transducer]\nname = 'capacitive'\nimperfections = {value}"
        for value in ("3", "{noise = 'x'}", "{x = 1}")
    ),
    *(SPEC + f"[pad]\n{line}" for line in ("depths = []", "depths = [nan]", "size = [1e-300, 1]", "layers = [3]")),
    *(SPEC + f"[pad]\n{line}" for line in ("taxels = 3", "layers = [{thickness = -1}]", "sampling_radius = 'x'")),
    *(SPEC.replace('["square"]', shapes) for shapes in ("[]", "3", "[3]", "[[]]", "['']", "['blob']", "['a.stl']")),
    *(SPEC.replace('"fast"', preset) for preset in ("3", "[]", "['fast', 3]", "{}", "'best'")),
    *("backend = ['physics', 'mujoco']\n" + SPEC, "transducer = 'capacitive'\n" + SPEC, "noise = 1e300\n" + SPEC),
)


@dataclass(frozen=True)
class Files:
    """What odd paths lead to, by what they are for; names are relative to the working folder."""

    outputs: tuple[str, ...]
    meshes: tuple[str, ...]
    specs: tuple[str, ...]
    pages: tuple[str, ...]
    results: tuple[str, ...]
    special: tuple[str, ...]  #: that must be what they are when all is over


def make_files(folder: Path) -> Files:
    """Put odd files into a folder."""
    (folder / "folder.npz").mkdir()
    (folder / "notes.txt").write_text("not to be read as anything")
    (folder / "loop").symlink_to(folder / "loop")
    os.mkfifo(folder / "pipe")
    (folder / "to_pipe.npz").symlink_to(folder / "pipe")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(folder / "socket"))
    special = ["pipe", "to_pipe.npz", "socket"]
    try:
        os.mknod(folder / "device.npz", stat.S_IFCHR | 0o666, os.makedev(1, 3))
        special.append("device.npz")
    except PermissionError:
        pass
    names = (
        "",
        ".",
        "/proc/x.npz",
        "folder.npz",
        "loop",
        "nowhere/x.npz",
        "notes.txt/x.npz",
        f"{'n' * 300}.npz",
        "\udcff.npz",
    )
    names += (
        f"{'p/' * 3000}x.npz",
        f"{'m' * 250}.npz",
        "x.xyz",
        "x",
        "ü[/b] $x^.png",
        "x\n.pdf",
        "x.png.",
        "a\0b.npz",
    )
    common = (*names, *special)
    (folder / "good.toml").write_text(SPEC)
    (folder / "binary.md").write_bytes(bytes(range(256)))
    (folder / "plain.md").write_text("# A page without tables\n")
    specs = _numbered(folder, "toml", [text.encode() for text in SPECS] + [b"\xff\xfe"])
    results = _numbered(
        folder, "json", [b"", b"[]", b"3", b"{}", b'{"rows": []}', b'{"rows": [3]}', b"[" * 99_999, b"\xff"]
    )
    return Files(
        outputs=common,
        meshes=(*common, *_meshes(folder)),
        specs=(*common, *specs),
        pages=(*common, "binary.md", "plain.md"),
        results=(*common, *results),
        special=tuple(special),
    )


def lines(files: Files, seed: int, count: int) -> Iterator[list[str]]:
    """Odd command lines: one to three odd values each, given twice, left out or well said now and then."""
    rng = np.random.default_rng(seed)
    commands = dict(_commands(app, ()))
    names = sorted(commands)
    for _ in range(count):
        name = names[rng.integers(len(names))]
        # The commands that take most get most.
        if rng.random() < 0.4:
            name = (("press",), ("dataset",))[rng.integers(2)]
        yield _line(rng, name, commands[name], files)


def _line(rng: np.random.Generator, name: tuple[str, ...], options: list[Option], files: Files) -> list[str]:
    shape = files.meshes[rng.integers(len(files.meshes))] if rng.random() < 0.4 else "star"
    line = [*name, *(word.replace("SHAPE", shape) for word in BASE.get(name[0], ()))]
    for _ in range(rng.integers(1, 4) if options else 0):
        option = options[rng.integers(len(options))]
        kind = rng.random()
        if kind < 0.05:
            return [*line, option.word]
        line += [option.word, _odd(rng, option, files)]
        if kind > 0.95:
            line += [option.word, _odd(rng, option, files)]
    if rng.random() < 0.05:
        line.append(("--no-such-option", "one too many", "--json=3", "")[rng.integers(4)])
    return line


def _odd(rng: np.random.Generator, option: Option, files: Files) -> str:
    own = BY_NAME.get(option.name, ())
    by_purpose = {"spec": files.specs, "page": files.pages, "measured": files.results}
    if option.name in by_purpose:
        values = by_purpose[option.name]
    elif Path in option.types:
        values = files.outputs
    elif int in option.types or float in option.types:
        values = (*own, *NUMBERS)
    else:
        values = own if own and rng.random() < 0.8 else WORDS
    return values[rng.integers(len(values))]


@dataclass(frozen=True)
class Option:
    """An option that takes a value."""

    name: str
    word: str  #: as on the command line
    types: tuple[type, ...]


def _commands(group: typer.Typer, name: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], list[Option]]]:
    """Options by command, from what the functions behind the commands say of themselves."""
    for one in group.registered_groups:
        assert one.typer_instance is not None
        yield from _commands(one.typer_instance, (*name, one.name or ""))
    for command in group.registered_commands:
        assert command.callback is not None
        hints = get_type_hints(command.callback, include_extras=True)
        yield (
            (*name, command.name or command.callback.__name__),
            [option for parameter, hint in hints.items() if (option := _option(parameter, hint)) is not None],
        )


def _option(parameter: str, hint: Any) -> Option | None:
    """The option behind a parameter; None for arguments and flags."""
    kind, *about = get_args(hint) or (hint,)
    types = get_args(kind) or (kind,)
    if not (about and isinstance(about[0], OptionInfo)) or bool in types:
        return None
    # A name of its own comes first: as a default, where an annotation holds it.
    named = about[0].param_decls or [about[0].default]
    word = named[0] if isinstance(named[0], str) else f"--{parameter.replace('_', '-')}"
    return Option(parameter, word, types)


def _numbered(folder: Path, ending: str, contents: list[bytes]) -> list[str]:
    names = [f"odd-{number}.{ending}" for number in range(len(contents))]
    for name, content in zip(names, contents, strict=True):
        (folder / name).write_bytes(content)
    return names


def _meshes(folder: Path) -> list[str]:
    """Mesh files that are damaged, no solids, or of odd sizes and names."""
    box = trimesh.creation.box((6e-3, 6e-3, 4e-3))
    whole = bytes(box.export(file_type="stl"))  # type: ignore[arg-type]
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    contents: dict[str, bytes] = {
        "good.stl": whole,
        "empty.stl": b"",
        "cut.stl": whole[: len(whole) // 2],
        "header.stl": whole[:80] + b"\xff\xff\xff\xff" + whole[84:],
        "none.stl": whole[:80] + bytes(4),
        "words.stl": b"solid of words",
        "not_finite.stl": whole[:96] + np.array([np.nan, np.inf, 1e38], "<f4").tobytes() + whole[108:],
        "empty.obj": b"",
        "beyond.obj": text + b"f 1 2 99\n",
        "points.obj": text,
        "flat.obj": text + b"f 1 2 3\nf 3 2 1\n",
        "huge.obj": b"v 1e308 0 0\nv -1e308 0 0\nv 0 1e308 0\nv 0 0 1e308\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n",
        "bytes.obj": bytes(range(256)),
        "bytes.ply": b"ply\nformat ascii 1.0\nelement vertex 99999999\nend_header\n",
        "bytes.glb": b"glTF" + bytes(range(64)),
        "bytes.off": b"OFF\n3 1 0\n0 0\n",
        "bytes.zip": b"PK\x03\x04",
        "pad.stl": whole,
        "<b>&.stl": whole,
        "\x01.stl": whole,
        "[red]$x^$.stl": whole,
        "mesh.toml": whole,
        "tiny.stl": bytes(box.copy().apply_scale(1e-9).export(file_type="stl")),  # type: ignore[arg-type]
        "large.stl": bytes(box.copy().apply_scale(1e3).export(file_type="stl")),  # type: ignore[arg-type]
        "thin.stl": bytes(trimesh.creation.box((6e-3, 6e-3, 1e-9)).export(file_type="stl")),  # type: ignore[arg-type]
        "needle.stl": bytes(trimesh.creation.cone(3e-3, 4e-3).export(file_type="stl")),  # type: ignore[arg-type]
    }
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    return list(contents)
