"""Checks that a hand's model is the one its table was made for: by checksum of the file, and by its geoms."""

from __future__ import annotations

import hashlib
from os import PathLike
from pathlib import Path

import mujoco
import numpy as np

from mjtactile.errors import SceneError
from mjtactile.hands.catalogue import ExpectedGeom, Hand, as_hand

_KINDS = {"box": mujoco.mjtGeom.mjGEOM_BOX, "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE}
#: Tolerance on sizes and positions of geoms [m].
_SAME = 1e-5


def check_model(name: str | Hand, path: str | Path) -> None:
    """Check that a model's file is the one a hand's table was made for.

    Args:
        name: name of the hand, one of `HANDS`; or a Hand.
        path: path of the file.

    Raises:
        SceneError: there is no such hand, the path is none, the table has no checksum for that file name, the file
            cannot be read, or its checksum differs.
    """
    chosen = as_hand(name)
    if not isinstance(path, str | PathLike):
        raise SceneError(f"path is of type {type(path).__name__}; expected the path of the model's file.")
    path = Path(path)
    if path.name not in chosen.hashes:
        known = ", ".join(chosen.hashes) or f"none; it belongs to {chosen.model}"
        raise SceneError(f"the table of hand '{chosen.name}' knows no file {path.name!r}. Known: {known}.")
    try:
        found = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise SceneError(f"cannot read {path} ({error}). Get it from {chosen.source}.") from error
    if found != chosen.hashes[path.name]:
        raise SceneError(
            f"{path} is another version of {path.name} than the table of hand '{chosen.name}' was made for: SHA-256 "
            f"{found}, expected {chosen.hashes[path.name]}. Bodies may have moved: look at every pad with "
            "mjtactile.preview_pad, or take the version of " + chosen.source + "."
        )


def check_geom(spec: mujoco.MjSpec, chosen: Hand, expected: ExpectedGeom, prefix: str) -> None:
    """Check that a body of a model has a geom that a hand's table expects.

    Raises:
        SceneError: the body has no such geom.
    """
    wanted = np.array([*expected.size, *expected.pos])
    for geom in spec.body(prefix + expected.body).geoms:
        if geom.type == _KINDS[expected.kind]:
            found = np.array([*geom.size[: len(expected.size)], *geom.pos])
            if np.abs(found - wanted).max() <= _SAME:
                return
    raise SceneError(
        f"body '{prefix}{expected.body}' has no {expected.kind} of size {list(expected.size)} m at "
        f"{list(expected.pos)} m: this is another version of {chosen.model} than the table of hand '{chosen.name}' was "
        "made for. Attach pads one by one with mjtactile.attach_pad and look at them with mjtactile.preview_pad."
    )
