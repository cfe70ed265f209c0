"""Readings as hardware reports them: sensing elements, their imperfections, an array of them and its calibration."""

from mjtactile.errors import TransducerError
from mjtactile.transducer.array import Element, Transducer
from mjtactile.transducer.calibration import Calibration, calibrate
from mjtactile.transducer.capacitive import CapacitiveCell
from mjtactile.transducer.imperfections import TYPICAL, Imperfections
from mjtactile.transducer.piezoresistive import PiezoresistiveElement

__all__ = [
    "TYPICAL",
    "Calibration",
    "CapacitiveCell",
    "Element",
    "Imperfections",
    "PiezoresistiveElement",
    "Transducer",
    "TransducerError",
    "calibrate",
]
