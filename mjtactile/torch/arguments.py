"""Checked arguments of a pad module: influence matrices, sensing layers and floating-point type."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import torch

from mjtactile.errors import InfluenceError, PresetError, shortened
from mjtactile.fidelity import DEFAULT, Fidelity
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.pad import Pad
from mjtactile.pad_names import named_pad
from mjtactile.units import is_whole


def matrices_of(pad: Pad | str | Path | InfluenceMatrices | None, fidelity: str | Fidelity | None) -> InfluenceMatrices:
    """Influence matrices of a pad, as `attach_pad` accepts it; given matrices are returned unchanged.

    Raises:
        CorruptInfluenceError: a file holds no influence matrices.
        PresetError: the fidelity does not exist, or is given together with matrices, which have their own.
        SceneError: no pad or file has that name.
    """
    if isinstance(pad, str | Path):
        pad = named_pad(str(pad)) or Path(pad)
    if fidelity is not None and isinstance(pad, Path | InfluenceMatrices):
        raise PresetError(
            f"fidelity {fidelity!r} was given with influence matrices, which have their own. Leave it out, or give a "
            "pad."
        )
    if isinstance(pad, InfluenceMatrices):
        return pad
    if isinstance(pad, Path):
        return load_influence(pad)
    return influence_matrices(Pad() if pad is None else pad, DEFAULT if fidelity is None else fidelity)


def existing_layers(pad: Pad, layers: Sequence[int] | None) -> tuple[int, ...]:
    """Indices of sensing layers as Python's integers, 0 at the top, by default all; free taxels are one layer.

    Raises:
        InfluenceError: a layer does not exist, or is given twice.
    """
    count = pad.sensing_layers
    chosen = range(count) if layers is None else layers
    known = isinstance(chosen, Sequence) and all(is_whole(k) and 0 <= k < count for k in chosen)
    if not known or not chosen or len(set(chosen)) < len(chosen):
        raise InfluenceError(
            f"layers = {shortened(layers)}; expected some of {tuple(range(count))}, each once, counted from the top."
        )
    return tuple(map(int, chosen))  # PyTorch's safe loading refuses those of NumPy in a checkpoint


def floating(dtype: torch.dtype) -> torch.dtype:
    """The type, after checking that it is torch.float32 or torch.float64.

    Raises:
        InfluenceError: it is another type.
    """
    if dtype not in (torch.float32, torch.float64):
        raise InfluenceError(f"dtype {dtype} is not supported; expected torch.float32 or torch.float64.")
    return dtype
