"""Recognition of a contact's force, position and shape from readings alone, fast enough for control loops.

    recognise = mjtactile.recognition.load("force")
    result = recognise(sensor.read(data))  # result.force [N], result.position [m], result.confidence
    result.familiarity.familiar  # whether the readings look like what was taught

Weights for the default pad come with the package. Recognisers are functions of NumPy arrays. They do not need torch and
take about half a millisecond per call.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, overload

from mjtactile._files import is_there
from mjtactile.errors import RecognitionError, shortened
from mjtactile.pad import Pad
from mjtactile.pad_names import pad_from_values
from mjtactile.recognition.familiarity import Familiarity, TaughtPresses
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.force import ForceRecogniser, ForceResult
from mjtactile.recognition.grasp import GraspRecogniser, GraspResult
from mjtactile.recognition.pose import POSE_KINDS, PoseModule
from mjtactile.recognition.registry import REGISTRY, Entry, read_registry, stored_module
from mjtactile.recognition.shape import ShapeModule, ShapeRecogniser, ShapeResult
from mjtactile.recognition.weight_files import SHIPPED, Stored, check_pad

__all__ = [
    "Familiarity",
    "ForceRecogniser",
    "ForceResult",
    "GraspRecogniser",
    "GraspResult",
    "RecognitionError",
    "ShapeRecogniser",
    "ShapeResult",
    "load",
    "modules",
    "trained_pad",
]

#: Folders of shipped weights, named after the sensing layers they use.
LAYERS = ("all", "top")
#: Folder of the grasp recogniser, which has principal components of its own.
_GRASP = "grasp"


@overload
def load(
    name: Literal["force"], *, layers: str | None = None, pad: Pad | None = None, folder: str | Path | None = None
) -> ForceRecogniser: ...
@overload
def load(
    name: Literal["grasp"], *, layers: str | None = None, pad: Pad | None = None, folder: str | Path | None = None
) -> GraspRecogniser: ...
@overload
def load(
    name: Literal["shape"],
    *,
    layers: str | None = None,
    pad: Pad | None = None,
    folder: str | Path | None = None,
    also: Sequence[str] = (),
) -> ShapeRecogniser: ...
def load(
    name: str,
    *,
    layers: str | None = None,
    pad: Pad | None = None,
    folder: str | Path | None = None,
    also: Sequence[str] = (),
) -> ForceRecogniser | GraspRecogniser | ShapeRecogniser:
    """A trained recogniser, called with readings (..., layers, rows, columns) [Pa].

    Args:
        name: "force": force and position of a contact. "grasp": force and torsional moment of a grasped body, whose
            face covers the pad. "shape": name, position, size and rotation of the body's shape.
        layers: "all" for all four sensing layers, or "top" for the one at 1 mm depth, which "grasp" does not have; by
            default all, or those of the weights in `folder`.
        pad: the pad that is read; weights for another pad are refused. None: only the shape of readings is checked.
        folder: folder of other weights, or one whose subfolder "all", "top" or "grasp" they are in; by default those of
            the package.
        also: optional shapes to recognise besides the standard ones; the package has "hexagon" and "cross", for all
            layers.

    Returns:
        The recogniser. Its result for readings is a ForceResult, GraspResult or ShapeResult with their batch axes.

    Raises:
        RecognitionError: there is no such recogniser or shape, its weights are for another pad or other layers, or
            shapes are given to a recogniser of forces.
    """
    if not (isinstance(name, str) and name in ("force", "grasp", "shape")):
        raise RecognitionError(f"recogniser {name!r} does not exist. Available: 'force', 'grasp', 'shape'.")
    if name == "grasp" and layers not in (None, "all"):
        raise RecognitionError("the grasp recogniser needs all sensing layers. Leave out layers=.")
    if not isinstance(also, Sequence) or isinstance(also, str):
        raise RecognitionError(f"also = {shortened(also)}; expected a list of shapes, such as ['hexagon'].")
    if also and name != "shape":
        raise RecognitionError(
            f"also = {shortened(also)} is for the shape recogniser; {name!r} recognises no shapes. Leave it out."
        )
    where, registry = _weights(layers, folder, grasp=name == "grasp")
    view = _view(registry, where, layers)
    check_pad(view, pad)
    seen_by = PrincipalComponents.from_stored(view)
    # A script of its own stores them, so weights may have none: training/train_familiarity.py.
    known = "familiarity" in registry
    taught = TaughtPresses.from_stored(_stored(registry, "familiarity", where), seen_by.scale) if known else None
    if name != "shape":
        recogniser = GraspRecogniser if name == "grasp" else ForceRecogniser
        return recogniser.from_stored(seen_by, _stored(registry, name, where), taught)
    position, size, orientation = (PoseModule.from_stored(_stored(registry, kind, where)) for kind in POSE_KINDS)
    names = [entry.name for entry in registry.values() if entry.kind == "shape" and not entry.optional]
    if unknown := [shape for shape in also if f"shape {shape}" not in registry]:
        added = [entry.name.removeprefix("shape ") for entry in registry.values() if entry.optional]
        raise RecognitionError(
            f"also = {shortened(also)}: there is no shape {shortened(unknown[0])} in {where}. Available besides the "
            f"standard ones: {', '.join(sorted(added)) or 'none'}. training/add_shape.py adds one."
        )
    names += [f"shape {shape}" for shape in also]
    shapes = tuple(ShapeModule.from_stored(_stored(registry, one, where)) for one in dict.fromkeys(names))
    return ShapeRecogniser(seen_by, (position, size, orientation), shapes, taught)


def modules(*, layers: str | None = None, folder: str | Path | None = None) -> dict[str, Entry]:
    """The registered modules by name: kind, file, hash and the modules that each depends on.

    Args:
        layers: as in `load`.
        folder: as in `load`.

    Raises:
        RecognitionError: there are no weights for these layers, or no registry, or it is damaged.
    """
    where, registry = _weights(layers, folder)
    if layers is not None and folder is not None:
        _view(registry, where, layers)
    return registry


def trained_pad(*, layers: str | None = None, folder: str | Path | None = None) -> Pad:
    """The pad that recognisers were trained for.

    Args:
        layers: as in `load`.
        folder: as in `load`.

    Raises:
        RecognitionError: there are no weights for these layers, or no registry, or it is damaged.
    """
    where, registry = _weights(layers, folder)
    return pad_from_values(_view(registry, where, layers).metadata["pad"], where)


def _weights(layers: str | None, folder: str | Path | None, *, grasp: bool = False) -> tuple[Path, dict[str, Entry]]:
    """The folder of weights and its registry: the given folder or its subfolder, or one of the package.

    For some layers, or for grasps.
    """
    if layers is not None and not (isinstance(layers, str) and layers in LAYERS):
        raise RecognitionError(f"layers = {layers!r}; expected one of {', '.join(map(repr, LAYERS))}.")
    if not isinstance(folder, str | Path | None):
        raise RecognitionError(f"folder is of type {type(folder).__name__}; expected the name of a folder of weights.")
    names = (_GRASP,) if grasp else LAYERS if layers is None else (layers,)
    where = SHIPPED / names[0] if folder is None else Path(folder)
    if not is_there(where / REGISTRY) and is_there(where / names[0] / REGISTRY):
        where /= names[0]
    return where, read_registry(where, names)


def _view(registry: dict[str, Entry], where: Path, layers: str | None) -> Stored:
    """The principal components in a folder, whose layers must be those that are asked for."""
    stored = _stored(registry, "view", where)
    count = stored.reading_shape[0]
    if layers is not None and stored.layers != {"all": tuple(range(count)), "top": (0,)}[layers]:
        raise RecognitionError(
            f"layers = {layers!r}, but the recognisers in {where} use layers {list(stored.layers)} of {count}, counted "
            "from the top. Give the folder of others, or ask for the layers that these use."
        )
    return stored


def _stored(registry: dict[str, Entry], name: str, folder: Path) -> Stored:
    if name not in registry:
        raise RecognitionError(f"there is no module '{name}' in {folder}. Available: {', '.join(sorted(registry))}.")
    return stored_module(folder, registry[name])
