"""A dataclass as a command line: every field an option, its comment the help."""

from __future__ import annotations

import argparse
import inspect
import re
import sys
import types
import typing
from collections.abc import Callable
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar

from mjtactile.errors import MjTactileError

Config = TypeVar("Config")


def parsed(config: type[Config], about: str | None, arguments: list[str] | None = None) -> Config:
    """An instance of a dataclass from command-line arguments.

    Args:
        config: a dataclass whose fields are str, int, float, bool, Path, a tuple of one of these, or one of them or
            None.
        about: what the script does.
        arguments: by default those of the process.
    """
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    comments: dict[str, str] = {}
    for each in reversed(config.__mro__[:-1]):
        comments.update(re.findall(r"^\s+(\w+):.*?#:\s*(.*)$", inspect.getsource(each), flags=re.MULTILINE))
    kinds = typing.get_type_hints(config)
    for field in fields(config):  # type: ignore[arg-type]
        option: dict[str, Any] = {"help": comments.get(field.name, "").replace("%", "%%"), "dest": field.name}
        if field.default is MISSING:
            option["required"] = True
        else:
            option["default"] = field.default
            option["help"] += f" [default: {field.default}]".replace("%", "%%")
        parser.add_argument(f"--{field.name.replace('_', '-')}", **option, **_kind(kinds[field.name]))
    given = vars(parser.parse_args(arguments))
    return config(**{name: tuple(value) if isinstance(value, list) else value for name, value in given.items()})


def run_script(main: Callable[[Config], None], config: type[Config], about: str | None) -> None:
    """Run a script with the arguments of the process; of an error of the package, print the message alone.

    Args:
        main: the script.
        config: see `parsed`.
        about: see `parsed`.

    Raises:
        SystemExit: the arguments are invalid or the script raised an error of the package; the status is 2.
    """
    given = parsed(config, about)
    try:
        main(given)
    except MjTactileError as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None


def _kind(kind: Any) -> dict[str, Any]:
    if typing.get_origin(kind) is types.UnionType:
        kind = next(one for one in typing.get_args(kind) if one is not type(None))
    if typing.get_origin(kind) is tuple:
        return {"type": typing.get_args(kind)[0], "nargs": "+"}
    if kind is bool:
        return {"action": argparse.BooleanOptionalAction}
    return {"type": Path if kind is Path else kind}
