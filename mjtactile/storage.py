"""From whole matrices to the storage of a fidelity: columns, averaging, reduction and precision."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mjtactile.fem import PARITIES
from mjtactile.influence import EVEN, ODD_IN_X, ODD_IN_Y, InfluenceMatrices
from mjtactile.matrix import stored_matrix
from mjtactile.preset import Fidelity
from mjtactile.table import Tables, table_name

_STRESSES = ("deviatoric", "mean")


def in_storage(plain: InfluenceMatrices, chosen: Fidelity) -> InfluenceMatrices:
    """Influence matrices in the storage of a fidelity.

    Args:
        plain: whole matrices on the fidelity's mesh, in float64 where the fidelity asks for that, else in float32.
        chosen: the fidelity.

    Raises:
        PresetError: for loads on the corners of a mesh with an odd number of elements along an axis.
    """
    whole = plain
    if chosen.loads == "corners":
        whole = _on_corners(whole)
    if chosen.averaging != "points":
        whole = _averaged(whole, chosen.averaging)
    if chosen.reduction == 0.0 and chosen.precision == plain.fidelity.precision:
        return replace(whole, fidelity=chosen)
    others = {name: table for name, table in whole.tables.items() if not name.startswith(_STRESSES)}
    if chosen.reduction > 0.0:
        from mjtactile.reduction import reduced_tables

        stresses = reduced_tables(whole, chosen.reduction, chosen.precision)
    else:
        stresses = _narrowed(whole, chosen.precision)
    return InfluenceMatrices(plain.pad, chosen, others | stresses)


def _on_corners(whole: InfluenceMatrices) -> InfluenceMatrices:
    """Columns of the elements' corners only; the surface compliance keeps all."""
    from mjtactile.corner_tables import corner_tables

    tables = whole.tables | corner_tables(whole, _STRESSES)
    return InfluenceMatrices(whole.pad, replace(whole.fidelity, loads="corners"), tables)


def _averaged(whole: InfluenceMatrices, averaging: str) -> InfluenceMatrices:
    """One point per taxel, with the mean stress over its ball; "deep": in all layers but the shallowest."""
    from mjtactile.averaging import mean_tables

    odd = {"deviatoric": (ODD_IN_X, ODD_IN_Y), "mean": (EVEN, EVEN)}
    layers = list(range(len(whole.pad.depths)))
    if averaging == "deep":
        layers.remove(int(np.argmin(whole.pad.depths)))
    tables = whole.tables | mean_tables(whole.pad, whole.tables, odd, layers)
    return InfluenceMatrices(whole.pad, replace(whole.fidelity, averaging=averaging), tables)


def _narrowed(whole: InfluenceMatrices, precision: str) -> Tables:
    """All stress matrices, whole, in another precision."""
    tables: Tables = {}
    for kind in _STRESSES:
        for k in range(len(whole.pad.depths)):
            for parity in PARITIES:
                name = table_name(kind, parity, k)
                tables |= stored_matrix(name, (whole.tables[name],), precision)
    return tables
