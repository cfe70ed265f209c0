"""Pads by registered name, as one line of JSON that describes the whole pad, and as TOML files."""

from __future__ import annotations

import json
import tomllib
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mjtactile._files import is_there, path_from, read_text, why_unread
from mjtactile.errors import PadError, SceneError, shortened
from mjtactile.pad import Layer, Pad, TaxelGrid, require_pad
from mjtactile.pad_shape.surfaces import FLAT, surface_from
from mjtactile.pad_shape.taxels import FreeTaxels

#: Name of the plugin in MuJoCo models.
PLUGIN = "mjtactile.pad"
_PAD = frozenset({"size", "layers", "taxels", "depths", "sampling_radius"})
_LAYER = frozenset({"thickness", "young", "poisson"})
_TAXELS = frozenset({"rows", "columns", "pitch", "centre"})
_FREE = frozenset({"points", "radii"})
_MESH = frozenset({"kind", "file", "scale", "frame", "smoothing"})

_pads: dict[str, Pad] = {"default": Pad()}


def pad_text(pad: Pad) -> str:
    """All numbers of a pad as compact JSON in SI units; `pad_from_text` restores exactly the same pad.

    The text is a valid value of the plugin's attribute `<config key="pad" value="..."/>`, with `&quot;` for each quote.

    Raises:
        PadError: `pad` is no pad.
    """
    return json.dumps(require_pad(pad).description, separators=(",", ":"))


def is_pad_text(text: str) -> bool:
    """Whether a text describes a pad, as `pad_text` does; otherwise it is the name of a pad or a file."""
    return text.lstrip().startswith("{")


def pad_from_text(text: str) -> Pad:
    """The pad that `pad_text` described.

    Raises:
        PadError: the text is not JSON, a value is missing, unknown or not a number, or `Pad` refuses the values.
    """
    try:
        values = json.loads(text, object_pairs_hook=_object)
    except PadError:
        raise
    except (ValueError, RecursionError) as error:
        raise PadError(
            f"the pad's text is not JSON ({error}): {shortened(text)}. Write it with mjtactile.pad_text."
        ) from error
    return Pad(**_arguments(values))


def pad_from_file(path: str | Path) -> Pad:
    """A pad from a TOML file with the values of `pad_text`; missing values are those of the default pad.

    Lengths are in metres, moduli in pascals. In addition, `taxels` may be the name of a file of points, and `surface` a
    mesh to fit a patch to, `{kind = "mesh", file = "tip.stl", scale = 1e-3, frame = [...]}` with the arguments of
    `Pad.from_mesh`. Names of files are relative to the folder of the TOML file.

    Raises:
        PadError: the file cannot be read, a value is unknown, or `Pad` refuses the values.
    """
    path = path_from(path, "path", PadError)
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
    """A pad from the values of a TOML file, see `pad_from_file`; names of files are relative to `folder`.

    Raises:
        PadError: a value is unknown, or `Pad` refuses the values.
    """
    whole = json.loads(pad_text(Pad())) | values
    taxels, surface = whole["taxels"], whole.pop("surface", None)
    if isinstance(taxels, str):
        free = FreeTaxels.from_file(folder / taxels)
        taxels = {"points": free.points, "radii": free.radii}
    elif isinstance(taxels, dict):
        taxels = ({"radii": None} if "points" in taxels else asdict(TaxelGrid())) | taxels
    whole["taxels"] = taxels
    if isinstance(surface, dict) and surface.get("kind") == "mesh":
        if "file" not in surface:
            raise PadError(
                'a mesh as surface lacks "file"; expected such as file = "tip.stl" and, if wanted, scale, frame and '
                "smoothing."
            )
        given = _checked("a mesh as surface", {"scale": 1.0, "frame": None, "smoothing": None} | surface, _MESH)
        stack = _arguments(whole)
        del stack["surface"]
        how = {name: given[name] for name in ("scale", "frame", "smoothing")}
        try:
            return Pad.from_mesh(folder / str(given["file"]), **how, **stack)
        except FileNotFoundError as error:
            raise PadError(f"there is no mesh {given['file']!r} beside the file.") from error
    return Pad(**_arguments(whole if surface is None else whole | {"surface": surface}))


def _arguments(values: Any) -> dict[str, Any]:
    """Arguments of `Pad` from the values of a description."""
    curved = isinstance(values, dict) and "surface" in values
    values = _checked("the pad", values, _PAD, optional=frozenset({"surface"}))
    layers = values["layers"]
    if not isinstance(layers, list):
        raise PadError(f'"layers" = {shortened(layers)}; expected a list of layers, top first.')
    return {
        **values,
        "layers": tuple(Layer(**_checked("a layer", layer, _LAYER)) for layer in layers),
        "taxels": _taxels(values["taxels"]),
        "surface": surface_from(values["surface"]) if curved else FLAT,
    }


def _taxels(values: Any) -> TaxelGrid | FreeTaxels:
    if isinstance(values, dict) and "points" in values:
        return FreeTaxels(**_checked("free taxels", values, _FREE))
    return TaxelGrid(**_checked("taxels", values, _TAXELS))


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise PadError(f"the pad's text gives one of {', '.join(name for name, _ in pairs)} twice; give each once.")
    return found


def _checked(
    what: str, values: Any, names: frozenset[str], *, optional: frozenset[str] = frozenset()
) -> dict[str, Any]:
    """The values, after checking that they are a table with these names, and no others but optional ones."""
    if not isinstance(values, dict):
        raise PadError(f"{what} = {shortened(values)}; expected an object with {', '.join(sorted(names))}.")
    if lacking := sorted(names - values.keys()):
        raise PadError(f'{what} lacks "{lacking[0]}"; expected all of {", ".join(sorted(names))}.')
    if unknown := sorted(values.keys() - names - optional):
        known = ", ".join(sorted(names | optional))
        raise PadError(f"{what} has no value {shortened(unknown[0])}. Available: {known}.")
    return values


def register_pad(name: str, pad: Pad) -> None:
    """Register a pad under a name for models: `<config key="pad" value="name"/>`.

    Only this process knows the name; every process that opens such a model must register the pad. For models that can
    be opened anywhere, use the text of the pad instead of a name, see `mjtactile.pad_text`; `attach_pad` does so.

    Raises:
        PadError: `pad` is no pad.
        SceneError: another pad has the name, or the name could be that of a file or the text of a pad.
    """
    if not isinstance(name, str) or not name or Path(name).suffix or "/" in name or is_pad_text(name):
        raise SceneError(
            f"{shortened(name)} cannot be the name of a pad: expected a text that is not empty and does not look like "
            "the name of a file or the text of a pad, such as 'thumb'."
        )
    require_pad(pad)
    if _pads.get(name, pad) != pad:
        raise SceneError(f"pad {name!r} exists already and is another one, a {_pads[name].summary}. Use another name.")
    _pads[name] = pad


def named_pad(name: str) -> Pad | None:
    """The pad of a registered name, a text or a TOML file; None for the file of a saved table.

    Raises:
        SceneError: the text or the TOML file does not describe a pad.
    """
    if name in _pads:
        return _pads[name]
    if is_pad_text(name) or Path(name).suffix.lower() == ".toml":
        try:
            return pad_from_text(name) if is_pad_text(name) else pad_from_file(name)
        except PadError as error:
            raise SceneError(f'{PLUGIN}: attribute "pad": {error}') from error
    if not is_there(Path(name)):
        raise SceneError(
            f"{no_such_value('pad', name, tuple(_pads))} A file of saved influence matrices serves as well, but there "
            "is none of that name. Make a pad known in this process with mjtactile.register_pad(name, pad), or write "
            "its numbers in place of the name, see mjtactile.pad_text(pad)."
        )
    return None


def no_such_value(attribute: str, value: str, known: tuple[str, ...]) -> str:
    """Error message for a sensor attribute with an unknown value."""
    return f'{PLUGIN}: {attribute}="{value}" does not exist. Available: {", ".join(known)}.'
