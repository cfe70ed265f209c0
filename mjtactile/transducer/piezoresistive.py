"""A piezoresistive element: a pillar on a silicon diaphragm whose four resistors measure three components of force.

A force on the pillar bends the diaphragm. A normal force strains all four resistors equally; a shear force tilts the
pillar and strains the two resistors along its direction with opposite signs. With resistors at +x, +y, -x and -y

    dR/R = K f,    K = [[s, 0, n], [0, s, n], [-s, 0, n], [0, -s, n]]

so that sums give the normal force and differences the shear. The element is linear up to the full scale and saturates
beyond it. Source of the layout: Aoyagi 2008, section 2 (linear in z from 0 to 200 gf); the sensitivities are assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import TransducerError
from mjtactile.transducer.checks import require_positive, require_signal, require_stress, require_vectors
from mjtactile.units import GRAM_FORCE

#: Components of `InfluenceMatrices.stress` that act on a horizontal face: zx, yz, zz.
_FACE = (5, 4, 2)


@dataclass(frozen=True, kw_only=True)
class PiezoresistiveElement:
    """A pillar on a diaphragm with four piezoresistors, each in a quarter bridge with an amplifier.

    `signal` and `stress` are its scalar channel for the normal stress; `voltages` and `forces` have all three axes.

    Raises:
        TransducerError: a value is outside its range.
    """

    full_force: float = 200.0 * GRAM_FORCE  #: largest force along the normal [N]
    area: float = 1.5625e-6  #: over which the stress acts on the pillar [m^2]; by default the pitch of 1.25 mm squared
    normal_sensitivity: float = 5e-3  #: n: relative change of resistance per newton of normal force [1/N]
    shear_sensitivity: float = 15e-3  #: s: relative change of resistance per newton of shear force [1/N]
    full_signal: float = 5.0  #: output at the full scale [V]

    def __post_init__(self) -> None:
        for name in ("full_force", "area", "normal_sensitivity", "shear_sensitivity", "full_signal"):
            require_positive(f"PiezoresistiveElement {name}", getattr(self, name))

    @classmethod
    def with_range(cls, full_scale: float) -> PiezoresistiveElement:
        """The default element with such a full force that it saturates at a given stress [Pa].

        Raises:
            TransducerError: the stress is not positive.
        """
        require_positive("full_scale", full_scale, "a positive stress in pascals, for example 100e3")
        return cls(full_force=full_scale * cls.area)

    @property
    def full_scale(self) -> float:
        """Stress at which the element saturates [Pa]."""
        return self.full_force / self.area

    def signal(self, stress: npt.ArrayLike) -> Array:
        """Output of the normal channel [V] under a compressive stress [Pa], any shape, without saturation.

        Raises:
            TransducerError: the stress is not of real numbers.
        """
        return require_stress(stress) * (self.full_signal / self.full_scale)

    def stress(self, signal: npt.ArrayLike) -> Array:
        """Stress [Pa] for a signal [V], any shape: the inverse of `signal`.

        Raises:
            TransducerError: the signal is not of real numbers.
        """
        return require_signal(signal) * (self.full_scale / self.full_signal)

    @property
    def strain_matrix(self) -> Array:
        """K: relative change of each resistor per newton along x, y and into the element [1/N], shape (4, 3)."""
        s, n = self.shear_sensitivity, self.normal_sensitivity
        return np.array([[s, 0.0, n], [0.0, s, n], [-s, 0.0, n], [0.0, -s, n]])

    @property
    def _amplification(self) -> float:
        """Output per relative change of resistance [V], such that the full normal force gives the full signal."""
        return self.full_signal / (self.normal_sensitivity * self.full_force)

    def voltages(self, force: npt.ArrayLike) -> Array:
        """Outputs of the four resistors' bridges [V].

        Args:
            force: on the pillar along x, y and into the element [N], shape (..., 3).

        Returns:
            (..., 4) [V]: resistors at +x, +y, -x, -y; each saturates at plus and minus the full signal.

        Raises:
            TransducerError: the force has another shape, or is not of real numbers.
        """
        vectors = require_vectors("force", force, 3, "forces along x, y and into the element, in newtons")
        outputs = vectors @ self.strain_matrix.T * self._amplification
        return np.clip(outputs, -self.full_signal, self.full_signal)

    def forces(self, voltages: npt.ArrayLike) -> Array:
        """Force (..., 3) along x, y and into the element [N] from bridge outputs (..., 4) [V], by least squares.

        Raises:
            TransducerError: the outputs have another shape, or are not of real numbers.
        """
        inverse = np.linalg.pinv(self.strain_matrix).astype(np.float64)
        outputs = require_vectors("voltages", voltages, 4, "outputs of the four bridges, in volts")
        return outputs @ inverse.T / self._amplification

    def pillar_force(self, stress: npt.ArrayLike) -> Array:
        """Force on each pillar from the stress tensor at it.

        Args:
            stress: (6, ...) [Pa], components xx, yy, zz, xy, yz, zx, tension positive: `InfluenceMatrices.stress`.

        Returns:
            Force along x, y and into the element [N], shape (..., 3). A positive s_zx pulls the element along +x.

        Raises:
            TransducerError: the first axis is not the six components, or they are not real numbers.
        """
        tensor = require_stress(stress)
        if tensor.ndim == 0 or tensor.shape[0] != 6:
            raise TransducerError(
                f"the stress has shape {tensor.shape}; expected (6, ...), one tensor per taxel, as "
                "InfluenceMatrices.stress gives it."
            )
        face = tensor[list(_FACE)] * self.area
        face[2] *= -1.0
        return np.moveaxis(face, 0, -1)
