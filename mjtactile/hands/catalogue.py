"""The catalogue of hands: pads with their bodies and poses, read from TOML tables. Lengths are metres."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile._types import Array
from mjtactile.errors import SceneError, of_type, shortened
from mjtactile.pad import Pad
from mjtactile.pad_names import pad_from_values

_TABLES = Path(__file__).parent / "tables"
#: Hands by name.
HANDS = tuple(sorted(path.stem for path in _TABLES.glob("*.toml")))


@dataclass(frozen=True, kw_only=True)
class HandPad:
    """A pad on a body of a hand.

    Attributes:
        name: name of the pad.
        shape: name of its shape in the hand's table.
        pad: the pad.
        body: name of the body.
        pos: origin of the pad frame in the body's frame [m].
        quat: orientation of the pad frame in the body's frame (w, x, y, z).
    """

    name: str
    shape: str
    pad: Pad
    body: str
    pos: tuple[float, float, float]
    quat: tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class ExpectedGeom:
    """A geom that a hand's model must have; it detects versions of the model in which bodies were moved."""

    body: str  #: name of the geom's body
    kind: str  #: "box" or "capsule"
    size: tuple[float, ...]  #: half lengths, or radius and half length [m]
    pos: tuple[float, ...]  #: position of its centre in the body's frame [m]


@dataclass(frozen=True, kw_only=True)
class Hand:
    """A hand and its pads.

    Attributes:
        name: argument of `attach_hand`.
        title: full name of the hand.
        model: the model's files and their publisher.
        source: how to get the model.
        hashes: SHA-256 of the files that the table was made for, by file name, if they were available.
        expects: geoms that the model must have.
        tested: how the table was tested.
        contact: contact parameters of its pads by name, see `attach_pad`.
        proud: least and largest height of each shape's surface above the collision geoms under it [m].
        pads: its pads, in the order in which they are attached.
    """

    name: str
    title: str
    model: str
    source: str
    hashes: Mapping[str, str]
    expects: tuple[ExpectedGeom, ...]
    tested: str
    contact: str
    proud: Mapping[str, tuple[float, float]]
    pads: tuple[HandPad, ...]

    @property
    def taxels(self) -> int:
        """Number of taxels of all pads together."""
        return sum(int(np.prod(one.pad.reading_shape)) for one in self.pads)


def hand(name: str) -> Hand:
    """A hand by name.

    Raises:
        SceneError: there is no such hand; the message lists the existing ones.
    """
    if not (isinstance(name, str) and name in HANDS):
        raise SceneError(f"hand {shortened(name)} does not exist. Available: {', '.join(HANDS)}.")
    return _read(name)


def as_hand(name: object) -> Hand:
    """A hand, or the hand of a name.

    Raises:
        SceneError: there is no such hand, or the argument is neither.
    """
    return hand(name) if isinstance(name, str) else of_type(Hand, "name", name, SceneError, "or its name, see HANDS")


@cache
def _read(name: str) -> Hand:
    """The hand in a table."""
    values = tomllib.loads((_TABLES / f"{name}.toml").read_text())
    pads = {shape: pad_from_values(values["skin"] | of_shape, _TABLES) for shape, of_shape in values["shapes"].items()}
    return Hand(
        name=name,
        title=values["title"],
        model=values["model"],
        source=values["source"],
        hashes=values.get("hashes", {}),
        expects=tuple(
            ExpectedGeom(body=one["body"], kind=one["type"], size=tuple(one["size"]), pos=tuple(one["pos"]))
            for one in values.get("expects", ())
        ),
        tested=values["tested"],
        contact=values.get("contact", "stiff"),
        proud={shape: (low * 1e-3, high * 1e-3) for shape, (low, high) in values["proud_mm"].items()},
        pads=tuple(_placed(one, pads) for one in values["pads"]),
    )


def _placed(values: dict[str, Any], pads: dict[str, Pad]) -> HandPad:
    x, y, z = values["pos"]
    return HandPad(
        name=values["name"],
        shape=values["shape"],
        pad=pads[values["shape"]],
        body=values["body"],
        pos=(x, y, z),
        quat=_quaternion(np.array(values["normal"]), np.array(values["along"])),
    )


def _quaternion(normal: Array, along: Array) -> tuple[float, float, float, float]:
    """Orientation (w, x, y, z) of a pad frame with z along `normal` and y as close to `along` as possible."""
    import mujoco

    z = normal / np.linalg.norm(normal)
    y = along - z * (z @ along)
    y /= np.linalg.norm(y)
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.column_stack([np.cross(y, z), y, z]).ravel())
    w, i, j, k = quat.tolist()
    return w, i, j, k
