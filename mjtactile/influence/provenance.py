"""Metadata of a table: enough to restore its pad and fidelity, and to refuse a table for another one."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mjtactile.errors import CorruptInfluenceError, StaleInfluenceError
from mjtactile.fem.mesh import mesh_description, sheet_mesh
from mjtactile.fidelity import Fidelity, MeshDensity, as_fidelity, fidelity_summary, mesh_name
from mjtactile.influence.table import FORMAT_VERSION, SWEPT_VERSION
from mjtactile.influence.taxel_mean import material_cuts
from mjtactile.pad import Pad, require_pad
from mjtactile.pad_names import pad_from_text


def influence_metadata(pad: Pad, fidelity: Fidelity) -> dict[str, Any]:
    """A table's provenance as plain values."""
    return {
        "pad": pad.description,
        "density": asdict(fidelity.density),
        "fidelity": {name: value for name, value in asdict(fidelity).items() if name != "mesh"},
        "fingerprint": influence_fingerprint(pad, fidelity),
    }


def check_provenance(
    path: str | Path, metadata: dict[str, Any], pad: Pad | None, fidelity: str | Fidelity | None
) -> tuple[Pad, Fidelity]:
    """The pad and the fidelity of a table, by default those that its metadata name; see `matrices.load_influence`.

    Raises:
        CorruptInfluenceError: the metadata is not in the form that `influence_metadata` writes.
        StaleInfluenceError: the table is for another pad, mesh, storage or format version.
        PresetError: there is no such fidelity.
        PadError: `pad` is no pad.
    """
    try:
        own_pad, own_fidelity = pad_from_text(json.dumps(metadata["pad"])), _fidelity_from(metadata)
        fingerprint = metadata["fingerprint"]
    except (KeyError, TypeError, ValueError) as error:
        raise CorruptInfluenceError(
            f"{path} describes no pad ({error}). Delete it and rebuild: mjtactile build"
        ) from error
    pad = own_pad if pad is None else require_pad(pad)
    wanted = own_fidelity if fidelity is None else as_fidelity(fidelity)
    if fingerprint != influence_fingerprint(pad, wanted):
        is_whole = pad == own_pad and fingerprint == influence_fingerprint(own_pad, own_fidelity)
        raise StaleInfluenceError(
            f"{path} was built for a {own_pad.summary}, at fidelity {fidelity_summary(own_fidelity)}. It does not fit "
            f"the {pad.summary}, at fidelity {fidelity_summary(wanted)}, that was asked for: the pad, the mesh, the "
            "storage or the version of mjtactile differs. "
            + ("Ask for its fidelity, or leave fidelity out." if is_whole else "Rebuild it: mjtactile build")
        )
    return pad, wanted


def influence_fingerprint(pad: Pad, fidelity: Fidelity) -> str:
    """SHA-256 over what a table's numbers depend on: pad, mesh, storage and format version, but not the contact law."""
    mesh = mesh_description(sheet_mesh(pad, fidelity.density), fidelity.density)
    description: list[Any] = [FORMAT_VERSION, pad.description, mesh, fidelity.precision, float(fidelity.reduction)]
    # Added only if not default, so that tables of versions without these choices stay valid.
    if fidelity.averaging != "points":
        description.append({"averaging": fidelity.averaging})
        if any(any(material_cuts(pad, layer)) for layer in range(pad.sensing_layers)):
            description.append({"means": "of halves of each material"})
    if fidelity.loads != "nodes":
        # "fitted" distinguishes these tables from those of a version that fitted columns to rounding errors, too.
        description.append({"loads": fidelity.loads, "fitted": "to what is felt"})
    if fidelity.reduction > 0.0:
        description.append({"ranks": "part no pairs"})
    if not pad.surface.is_flat:
        description.append({"swept": SWEPT_VERSION})
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()


def _fidelity_from(metadata: dict[str, Any]) -> Fidelity:
    """The fidelity that a file's metadata describe, with the name of its mesh where it has one."""
    stored = metadata["density"]
    density = MeshDensity(**{**stored, "points_per_axis": tuple(stored["points_per_axis"])})
    return Fidelity(mesh=mesh_name(density) or density, **metadata["fidelity"])
