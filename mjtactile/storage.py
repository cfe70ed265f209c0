"""From whole matrices to the storage that a fidelity asks for: reduced or not, in one of three precisions."""

from __future__ import annotations

from dataclasses import replace

from mjtactile.fem import PARITIES
from mjtactile.influence import InfluenceMatrices
from mjtactile.matrix import stored_matrix
from mjtactile.preset import Fidelity
from mjtactile.table import Tables, table_name


def in_storage(plain: InfluenceMatrices, chosen: Fidelity) -> InfluenceMatrices:
    """Influence matrices in the storage of a fidelity.

    Args:
        plain: whole matrices on the fidelity's mesh, in float64 where the fidelity asks for that, else in float32.
        chosen: the fidelity.
    """
    if chosen.reduction == 0.0 and chosen.precision == plain.fidelity.precision:
        return replace(plain, fidelity=chosen)
    others = {name: table for name, table in plain.tables.items() if not name.startswith(("deviatoric", "mean"))}
    if chosen.reduction > 0.0:
        from mjtactile.reduction import reduced_tables

        stresses = reduced_tables(plain, chosen.reduction, chosen.precision)
    else:
        stresses = _narrowed(plain, chosen.precision)
    return InfluenceMatrices(plain.pad, chosen, others | stresses)


def _narrowed(plain: InfluenceMatrices, precision: str) -> Tables:
    """All stress matrices, whole, in another precision."""
    tables: Tables = {}
    for kind in ("deviatoric", "mean"):
        for k in range(len(plain.pad.depths)):
            for parity in PARITIES:
                name = table_name(kind, parity, k)
                tables |= stored_matrix(name, (plain.tables[name],), precision)
    return tables
