"""The registry of modules: a JSON file in the folder of weights with kind, training and hash of each module.

Adding a module adds an entry; other entries and their files do not change.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mjtactile._files import why_unread, write_atomically
from mjtactile.errors import RecognitionError
from mjtactile.recognition.weight_files import Stored, file_hash, read_weights

REGISTRY = "registry.json"
#: Entry with the registry's own checksum.
_CHECKSUM = "sha256 of modules"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One module."""

    name: str  #: such as "force" or "shape star"
    #: "view", "familiarity", "position", "size", "orientation", "force", "grasp", "shape" or "examples"
    kind: str
    file: str  #: name of its file in the registry's folder
    sha256: str  #: SHA-256 of the file
    needs: tuple[str, ...] = ()  #: names of the modules whose results are its inputs
    optional: bool = False  #: whether it is used only on request, see `recognition.load`


def needed(kind: str) -> tuple[str, ...]:
    """Names of the modules whose results are inputs of modules of a kind."""
    if kind == "view":
        return ()
    return ("view", "position", "size", "orientation") if kind == "shape" else ("view",)


def register(folder: Path, file: str, *, optional: bool = False) -> Entry:
    """Add a module's file to the registry in its folder, or update its entry; it may be for use on request only.

    Raises:
        RecognitionError: the file is not a module.
    """
    stored = read_weights(folder / file)
    kind = stored.metadata["kind"]
    name = f"shape {stored.metadata['shape']}" if kind == "shape" else kind
    entry = Entry(
        name=name, kind=kind, file=file, sha256=file_hash(folder / file), needs=needed(kind), optional=optional
    )
    entries = {**(read_registry(folder) if (folder / REGISTRY).is_file() else {}), name: entry}
    modules = [asdict(entries[key]) for key in sorted(entries)]
    content = json.dumps({"modules": modules, _CHECKSUM: _checksum(modules)}, indent=2) + "\n"
    write_atomically(folder / REGISTRY, lambda out: out.write(content.encode()))
    return entry


def read_registry(folder: Path, subfolders: Sequence[str] | None = None) -> dict[str, Entry]:
    """The modules registered in a folder of weights, by name.

    Args:
        folder: folder of the registry.
        subfolders: names of its subfolders that would do as well, for the error message; None for any.

    Raises:
        RecognitionError: there is no registry, or it cannot be read, or it is damaged.
    """
    path = folder / REGISTRY
    try:
        content = json.loads(path.read_text())
        listed: list[dict[str, Any]] = content["modules"]
        if content[_CHECKSUM] != _checksum(listed):
            raise ValueError("it does not match its checksum")
        return {one["name"]: Entry(**{**one, "needs": tuple(one["needs"])}) for one in listed}
    except (FileNotFoundError, NotADirectoryError):
        inside = sorted(path.parent.name for path in folder.glob(f"*/{REGISTRY}"))
        suited = [name for name in inside if subfolders is None or name in subfolders]
        cure = f"Give one of its subfolders: {', '.join(suited)}." if suited else "Train them: make weights"
        nor = f", nor in its subfolder {' or '.join(subfolders)}" if subfolders and inside and not suited else ""
        file = " It is a file: give the folder of its registry." if folder.is_file() else ""
        raise RecognitionError(f"there are no recognisers in {folder}{nor}.{file} {cure}") from None
    except OSError as error:
        raise RecognitionError(f"{path} cannot be read: {why_unread(error)}. Give a folder of weights.") from error
    except (ValueError, KeyError, TypeError) as error:
        raise RecognitionError(
            f"{path} is not a registry of modules ({error}). Train the modules again: make weights"
        ) from error


def stored_module(folder: Path, entry: Entry) -> Stored:
    """A module's weights, verified with the hash in the registry.

    Raises:
        RecognitionError: the file does not exist, or its hash differs.
    """
    path = folder / entry.file
    if path.is_file() and file_hash(path) != entry.sha256:
        raise RecognitionError(
            f"{path} does not match its hash in the registry. Restore it, or train it again (make weights). If it was "
            "changed on purpose, register it again: mjtactile.recognition.registry.register"
        )
    return read_weights(path)


def _checksum(modules: list[dict[str, Any]]) -> str:
    """SHA-256 of the registry's entries."""
    return hashlib.sha256(json.dumps(modules, sort_keys=True).encode()).hexdigest()
