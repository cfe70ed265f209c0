"""mjtactile: a sense of touch for robot hands in MuJoCo."""

from mjtactile.pad import Layer, Pad, TaxelGrid

__version__ = "0.1.0"
__all__ = ["Layer", "Pad", "TaxelGrid"]
