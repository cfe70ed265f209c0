"""The pad in PyTorch: influence matrices as a module, batched, differentiable, on any device."""

from mjtactile._installed import require

require("torch")
from mjtactile.torch.model import PadModel  # noqa: E402

__all__ = ["PadModel"]
