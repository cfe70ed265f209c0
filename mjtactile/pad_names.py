"""Pads by name, as one line of text that holds the whole pad, and as TOML files of the same values."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from mjtactile._files import read_text, why_unread
from mjtactile.errors import PadError, SceneError
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import FLAT, surface_from
from mjtactile.pad_shape.taxels import FreeTaxels

#: Name under which models ask for the plugin.
PLUGIN = "mjtactile.pad"
_PAD = frozenset({"size", "layers", "taxels", "depths", "sampling_radius"})
_LAYER = frozenset({"thickness", "young", "poisson"})
_TAXELS = frozenset({"rows", "columns", "pitch", "centre"})
_FREE = frozenset({"points", "radii"})
_MESH = frozenset({"kind", "file", "scale", "frame", "smoothing"})
_LARGEST = 10**18  # of whole numbers: far more than any pad has, and no error in floating point

_pads: dict[str, Pad] = {"default": Pad()}


def pad_text(pad: Pad) -> str:
    """All numbers of a pad as compact JSON in SI units; `pad_from_text` gives the same pad, to the last bit.

    The text may stand wherever a model names a pad: `<config key="pad" value="..."/>`, with `&quot;` for each quote.
    """
    return json.dumps(pad.description, separators=(",", ":"))


def is_pad_text(text: str) -> bool:
    """Whether a text is meant to describe a pad, rather than to name one or a file."""
    return text.lstrip().startswith("{")


def names_file(text: str) -> bool:
    """Whether a text is the name of a file that exists; one that is too long for a name is not."""
    try:
        return Path(text).is_file()
    except OSError:
        return False


def pad_from_text(text: str) -> Pad:
    """The pad that `pad_text` described.

    Raises:
        PadError: when the text is not JSON, lacks a value or has one that a pad does not have, holds something else
            than a number where a number belongs, or describes a pad that cannot exist.
    """
    try:
        values = json.loads(text, object_pairs_hook=_object)
    except PadError:
        raise
    except (ValueError, RecursionError) as error:
        raise PadError(
            f"the pad's text is not JSON ({error}): {_short(text)}. Write it with mjtactile.pad_text."
        ) from error
    return _pad_of(values)


def pad_from_file(path: str | Path) -> Pad:
    """A pad from a TOML file: the values of `pad_text`, of which any may be left out that the default pad has.

    Lengths are metres, moduli pascals. Besides what the text form knows, `taxels` may name a file of points, and
    `surface` a mesh that a patch is fitted to, `{kind = "mesh", file = "tip.stl", scale = 1e-3, frame = [...]}`
    with the arguments of `Pad.from_mesh`; both lie beside the file.

    Raises:
        PadError: when the file cannot be read, has a value that a pad does not have, or describes a pad that cannot
            exist.
    """
    path = Path(path)
    try:
        values = tomllib.loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise PadError(
            f"cannot read {str(path)!r} as a pad's TOML file: {why_unread(error)}. Expected lines such as "
            "size = [15e-3, 15e-3], in metres and pascals."
        ) from error
    try:
        return pad_from_values(values, path.parent)
    except PadError as error:
        raise PadError(f"{path}: {error}") from error


def pad_from_values(values: dict[str, Any], folder: Path) -> Pad:
    """A pad from the values of a TOML file, see `pad_from_file`.

    Args:
        values: by name.
        folder: in which files that it names lie.

    Raises:
        PadError: when there is a value that a pad does not have, or the pad cannot exist.
    """
    whole = json.loads(pad_text(Pad())) | values
    taxels, surface = whole["taxels"], whole.pop("surface", None)
    if isinstance(taxels, str):
        free = FreeTaxels.from_file(folder / taxels)
        taxels = {"points": [list(point) for point in free.points], "radii": free.radii and list(free.radii)}
    elif isinstance(taxels, dict) and "points" in taxels:
        taxels = {"radii": None} | taxels
    elif isinstance(taxels, dict):
        taxels = json.loads(pad_text(Pad()))["taxels"] | taxels
    whole["taxels"] = taxels
    if isinstance(surface, dict) and surface.get("kind") == "mesh":
        given = _checked("a mesh as surface", {"scale": 1.0, "frame": None, "smoothing": None} | surface, _MESH)
        stack = _arguments(whole)
        del stack["surface"]
        how = {name: given[name] for name in ("scale", "frame", "smoothing")}
        try:
            return Pad.from_mesh(folder / str(given["file"]), **how, **stack)
        except FileNotFoundError as error:
            raise PadError(f"there is no mesh {given['file']!r} beside the file.") from error
    return _pad_of(whole if surface is None else whole | {"surface": surface})


def _pad_of(values: Any) -> Pad:
    return Pad(**_arguments(values))


def _arguments(values: Any) -> dict[str, Any]:
    """Arguments of Pad."""
    curved = isinstance(values, dict) and "surface" in values
    values = _checked("the pad", values, _PAD | {"surface"} if curved else _PAD)
    layers = values["layers"]
    if not isinstance(layers, list):
        raise PadError(f'"layers" = {_short(layers)}; expected a list of layers, top first.')
    return {
        "size": _numbers("size", values["size"]),
        "layers": tuple(_layer(layer) for layer in layers),
        "taxels": _taxels(values["taxels"]),
        "depths": _numbers("depths", values["depths"]),
        "sampling_radius": _number("sampling_radius", values["sampling_radius"]),
        "surface": surface_from(values["surface"]) if curved else FLAT,
    }


def _taxels(values: Any) -> TaxelGrid | FreeTaxels:
    if isinstance(values, dict) and "points" in values:
        return FreeTaxels(**_checked("free taxels", values, _FREE))
    taxels = _checked("taxels", values, _TAXELS)
    for name in ("rows", "columns"):
        _number(name, taxels[name])
    return TaxelGrid(**taxels | {name: _numbers(name, taxels[name]) for name in ("pitch", "centre")})


def _layer(values: Any) -> Layer:
    return Layer(**{name: _number(name, value) for name, value in _checked("a layer", values, _LAYER).items()})


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise PadError(f"the pad's text gives one of {', '.join(name for name, _ in pairs)} twice; give each once.")
    return found


def _checked(what: str, values: Any, names: frozenset[str]) -> dict[str, Any]:
    """Values by name, which must be just these."""
    if not isinstance(values, dict):
        raise PadError(f"{what} = {_short(values)}; expected an object with {', '.join(sorted(names))}.")
    if lacking := sorted(names - values.keys()):
        raise PadError(f'{what} lacks "{lacking[0]}"; expected all of {", ".join(sorted(names))}.')
    if unknown := sorted(values.keys() - names):
        raise PadError(f'{what} has no value "{_short(unknown[0])}". Available: {", ".join(sorted(names))}.')
    return values


def _numbers(name: str, values: Any) -> Any:
    """A tuple of numbers; Pad and TaxelGrid count them."""
    if not isinstance(values, list):
        raise PadError(f'"{name}" = {_short(values)}; expected a list of numbers in metres.')
    return tuple(_number(name, value) for value in values)


def _number(name: str, value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PadError(f'"{name}" = {_short(value)}; expected a number in SI units.')
    if isinstance(value, int) and abs(value) > _LARGEST:
        raise PadError(f'"{name}" has {len(str(value))} digits; expected a number in SI units.')
    return value


def _short(value: Any) -> str:
    text = str(value) if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:60]}..."


def register_pad(name: str, pad: Pad) -> None:
    """Make a pad known by a name that models may use: `<config key="pad" value="name"/>`.

    The name is known to this process alone: one that opens such a model has to register the pad as well. A model that
    is to be opened anywhere holds the pad's own numbers in place of a name, see `mjtactile.pad_text`; `attach_pad`
    writes these.

    Raises:
        SceneError: when the name is taken by another pad, or could be a file's or a pad's text.
    """
    if not name or Path(name).suffix or "/" in name or is_pad_text(name):
        raise SceneError(f"{name!r} is no name for a pad: it must not be empty or look like a file's.")
    if _pads.get(name, pad) != pad:
        raise SceneError(f"pad {name!r} exists already and is another one, a {_pads[name].summary}. Use another name.")
    _pads[name] = pad


def named_pad(name: str) -> Pad | None:
    """The pad behind a name, a pad's text or its TOML file; None for a file of saved influence matrices."""
    if name in _pads:
        return _pads[name]
    if Path(name).suffix.lower() == ".toml" and not is_pad_text(name):
        try:
            return pad_from_file(name)
        except PadError as error:
            raise SceneError(f'{PLUGIN}: attribute "pad": {error}') from error
    if is_pad_text(name):
        try:
            return pad_from_text(name)
        except PadError as error:
            raise SceneError(f'{PLUGIN}: attribute "pad": {error}') from error
    if not names_file(name):
        raise SceneError(_no_pad(name))
    return None


def _no_pad(name: str) -> str:
    return (
        f"{no_such_value('pad', name, tuple(_pads))} A file of saved influence matrices serves as well, but there is "
        "none of that name. Make a pad known in this process with mjtactile.register_pad(name, pad), or write its "
        "numbers in place of the name, see mjtactile.pad_text(pad)."
    )


def no_such_value(attribute: str, value: str, known: tuple[str, ...]) -> str:
    """What to say of a value that an attribute of a sensor does not have."""
    return f'{PLUGIN}: {attribute}="{value}" does not exist. Available: {", ".join(known)}.'
