"""Trained recognisers on disk: safetensors files with the fingerprint of their pad, refused for any other pad."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile._files import make_folder, write_atomically
from mjtactile._files.checksums import METADATA, check_arrays, check_header, with_checksums
from mjtactile.errors import RecognitionError, of_type
from mjtactile.pad import Pad
from mjtactile.recognition.symmetry import NEEDED, is_symmetric

#: Folder of the package's weights.
SHIPPED = Path(__file__).resolve().parent / "weights"


@dataclass(frozen=True, eq=False)
class Stored:
    """Arrays by name, with their metadata and the path of their file."""

    arrays: dict[str, np.ndarray]
    metadata: dict[str, Any]
    path: Path

    @property
    def layers(self) -> tuple[int, ...]:
        """Indices of the sensing layers that are used, 0 at the top."""
        return tuple(self.metadata["layers"])

    @property
    def reading_shape(self) -> tuple[int, int, int]:
        """Shape of the pad's readings, (layers, rows, columns)."""
        layers, rows, columns = self.metadata["reading_shape"]
        return layers, rows, columns


def write_weights(path: Path, arrays: dict[str, np.ndarray], metadata: dict[str, Any], pad: Pad) -> None:
    """Write weights, completely or not at all, with metadata, the pad's fingerprint and checksums.

    The metadata are plain values, among them "layers", the indices of the sensing layers that are used.

    Raises:
        OutputError: the file or its folder cannot be written.
    """
    from safetensors.numpy import save

    make_folder(path.parent)
    about = {
        **metadata,
        "pad": pad.description,
        "pad_summary": pad.summary,
        "pad_fingerprint": pad.fingerprint,
        "fingerprint_of_layers": replace(pad, depths=tuple(pad.depths[k] for k in metadata["layers"])).fingerprint,
        "reading_shape": pad.reading_shape,
    }
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    content = save(arrays, with_checksums(arrays, json.dumps(about)))
    write_atomically(path, lambda file: file.write(content))


def read_weights(path: Path) -> Stored:
    """Read weights and metadata that `write_weights` wrote, and verify the file's checksums.

    Raises:
        RecognitionError: there is no such file, or it is damaged.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise RecognitionError(f"the file of weights {path} does not exist. Train them: make weights")
    try:
        with safe_open(path, framework="np") as file:
            about = file.metadata() or {}
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        check_header(arrays, about)
        check_arrays(arrays, about)
        metadata = json.loads(about[METADATA])
    except (SafetensorError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise RecognitionError(
            f"{path} does not hold complete weights ({error}). Train them again: make weights"
        ) from error
    return Stored(arrays, metadata, path)


def check_pad(stored: Stored, pad: Pad | None) -> None:
    """Check that weights are for a pad, or for that pad with only the sensing layers that they use; None passes.

    Raises:
        RecognitionError: the weights are for another pad; the message names both.
    """
    if pad is None:
        return
    of_type(Pad, "pad", pad, RecognitionError)
    known = stored.metadata["fingerprint_of_layers"], stored.metadata["pad_fingerprint"]
    if pad.fingerprint not in known:
        cure = "Train recognisers for it: make weights, with the pad in training/presses.toml."
        if not is_symmetric(pad):
            cure = f"None can be trained for it: {NEEDED}. Use its readings or MuJoCo's wrench."
        raise RecognitionError(
            f"{stored.path.name} was trained for a {stored.metadata['pad_summary']} (fingerprint {known[1][:12]}), but "
            f"the pad is a {pad.summary} ({pad.fingerprint[:12]}). {cure}"
        )


def file_hash(path: Path) -> str:
    """SHA-256 of a file, for the registry."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
