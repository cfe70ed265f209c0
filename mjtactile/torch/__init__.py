"""The pad in PyTorch: influence matrices as a module, batched, differentiable, on any device."""

from mjtactile.torch.model import PadModel

__all__ = ["PadModel"]
