"""A capacitive cell: two square electrodes with a gap between them, which pressure narrows.

The lower electrode is fixed. The upper one lies on a cover, a plate of elastomer clamped along the electrode's edges.
A pressure p deflects the cover by p / k on average; the upper electrode moves with it and stays parallel to the lower:

    C = eps0 a^2 / (g - p / k),    1 / k = 3.891e-4 a^4 / D + 0.03514 a^2 / (5/6 G t),    D = E t^3 / (12 (1 - nu^2))

The first term is the mean deflection of a clamped square plate in bending, the second that in shear, which is large
because the cover is thick. Sources: Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells (1959), section 44,
whose series gives the mean; Mindlin (1951) for the shear, whose shape is Saint-Venant's function of a square (0.1406
a^4 / 4, Timoshenko and Goodier). Fringe fields, the electrodes' stiffness and the air enclosed in the gap are
neglected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import TransducerError, shortened
from mjtactile.transducer.checks import require_positive, require_signal, require_stress
from mjtactile.units import finite_number

#: Permittivity of vacuum [F/m], CODATA 2018; air's is 0.06 % more.
VACUUM_PERMITTIVITY = 8.8541878128e-12
#: Mean deflection of a clamped square plate over p a^4 / D, and of a square membrane in shear over p a^2 / (kappa G t).
BENDING_MEAN, SHEAR_MEAN = 3.891e-4, 0.03514
#: Shear correction factor (Reissner 1945) [-].
SHEAR_CORRECTION = 5.0 / 6.0


@dataclass(frozen=True, kw_only=True)
class CapacitiveCell:
    """A parallel-plate capacitor under elastomer, and the converter that reads it.

    The defaults are the cell of Aoyagi 2008: electrodes 1 mm square, 3 um apart, in PDMS, read through a converter of
    0.1 pF/V. The cover's thickness of 300 um (that of the cast sheet) and the converter's 5 V are assumptions. With
    them the cell saturates at 2.4 kPa, above the heaviest of the paper's weights (1560 Pa). `with_range` makes a
    stiffer one.

    Raises:
        TransducerError: a value is not positive, or the Poisson ratio is outside its range.
    """

    side: float = 1e-3  #: of the square electrodes [m]
    gap: float = 3e-6  #: between them at rest [m]
    cover: float = 300e-6  #: thickness of the elastomer that carries the upper electrode [m]
    young: float = 3e6  #: the cover's Young's modulus [Pa]
    poisson: float = 0.49  #: its Poisson ratio [-]
    conversion: float = 0.1e-12  #: of the converter [F/V]
    full_signal: float = 5.0  #: voltage at which the converter saturates [V]; 0 V is the cell at rest

    def __post_init__(self) -> None:
        for name in ("side", "gap", "cover", "young", "conversion", "full_signal"):
            require_positive(f"CapacitiveCell {name}", getattr(self, name))
        if not 0.0 <= finite_number(self.poisson) <= 0.5:
            raise TransducerError(
                f"CapacitiveCell poisson = {shortened(self.poisson)}; expected 0 to 0.5, for silicone 0.49."
            )

    @classmethod
    def with_range(cls, full_scale: float) -> CapacitiveCell:
        """The paper's cell with a cover of such a stiffness that it saturates at a given stress.

        Args:
            full_scale: stress at saturation [Pa]; readings of the pad under 200 gf on a 3 mm disc are below 100 kPa.

        Raises:
            TransducerError: the stress is not positive.
        """
        require_positive("full_scale", full_scale, "a positive stress in pascals, for example 100e3")
        paper = cls()
        return replace(paper, young=paper.young * full_scale / paper.full_scale)

    @property
    def stiffness(self) -> float:
        """Stiffness k of the cover: pressure over mean deflection [Pa/m]."""
        rigidity = self.young * self.cover**3 / (12.0 * (1.0 - self.poisson**2))
        shear = SHEAR_CORRECTION * self.young / (2.0 * (1.0 + self.poisson)) * self.cover
        return 1.0 / (BENDING_MEAN * self.side**4 / rigidity + SHEAR_MEAN * self.side**2 / shear)

    @property
    def closing_pressure(self) -> float:
        """Pressure at which the electrodes would touch [Pa]."""
        return self.stiffness * self.gap

    @property
    def rest_capacitance(self) -> float:
        """Capacitance without pressure [F]."""
        return VACUUM_PERMITTIVITY * self.side**2 / self.gap

    @property
    def full_scale(self) -> float:
        """Stress at which the converter saturates [Pa]."""
        return float(self.stress(np.array(self.full_signal)))

    def capacitance(self, stress: npt.ArrayLike) -> Array:
        """Capacitance C(p) [F] under a compressive stress [Pa], any shape; infinite where the electrodes touch.

        Raises:
            TransducerError: the stress is not of real numbers.
        """
        share = require_stress(stress) / self.closing_pressure
        with np.errstate(divide="ignore"):
            # The maximum keeps NaN, which is no pressure at which electrodes touch.
            return np.asarray(self.rest_capacitance / np.maximum(1.0 - share, 0.0))

    def signal(self, stress: npt.ArrayLike) -> Array:
        """Output of the converter [V] under a compressive stress [Pa], any shape, without its saturation.

        Raises:
            TransducerError: the stress is not of real numbers.
        """
        return (self.capacitance(stress) - self.rest_capacitance) / self.conversion

    def stress(self, signal: npt.ArrayLike) -> Array:
        """Stress [Pa] for a signal [V], any shape: the inverse of `signal`.

        Raises:
            TransducerError: the signal is not of real numbers.
        """
        added = require_signal(signal) * self.conversion
        return self.closing_pressure * added / (self.rest_capacitance + added)
