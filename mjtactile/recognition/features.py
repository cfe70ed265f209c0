"""Features of readings for all recognisers: few numbers that do not depend on the magnitude of the force.

Readings are mirrored into an octant of the pad (symmetry.py), projected on the principal components of many presses,
and divided by the norm of the projection, which removes the force's magnitude. The residual of the projection is mostly
noise. Its size is the last feature, which tells recognisers how far small components can be trusted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mjtactile.errors import RecognitionError
from mjtactile.recognition.symmetry import Mirrors, into_octant
from mjtactile.recognition.weight_files import Stored
from mjtactile.units import real_numbers

#: Least noise in the features, relative to the norm of the projection [-].
NOISE_FLOOR = 3e-5
#: Least scale of a principal component [-], so that small components are not amplified beyond noise of this size.
SCALE_FLOOR = 2e-3
#: Noise for the detection of dead taxels [-]: 1 % of the largest reading, which is about a fifth of the norm.
_USUAL_NOISE = 2e-3
#: A taxel counts as dead if it reads less than the first fraction of the value that the other taxels predict [-], if
#: its error is more than the second number times the error of the others, and more than the third fraction of the
#: largest reading [-].
_DEAD, _MISFIT, _LEAST_MISFIT = 0.35, 4.0, 0.02
#: Range of a reading's largest value [Pa] for which single precision serves: sums of squares of its smallest parts keep
#: their digits, those of its largest do not overflow. Readings beyond it are recognised in double precision; beyond the
#: second range, where that fails too, they are refused.
_IN_SINGLE, _IN_DOUBLE = (1e-12, 1e12), (1e-120, 1e120)
#: Largest number of dead taxels that are replaced.
_MOST_MENDED = 12


def noise_feature(noise: Any, logarithm: Callable[[Any], Any]) -> Any:
    """The last feature [-] from noise over the norm of the projection [-], an array or tensor, with its logarithm."""
    return logarithm(noise + NOISE_FLOOR) / 1.5 + 5.0


@dataclass(frozen=True, eq=False)
class Seen:
    """Features of a batch of readings."""

    features: np.ndarray  #: (readings, parts + 1) float32
    size: np.ndarray  #: norm of the projected readings [Pa], (readings,); it is proportional to the force
    noise: np.ndarray  #: root mean square of the projection's residual, relative to `size` [-], (readings,)
    mirrors: Mirrors  #: how each reading was mirrored


@dataclass(frozen=True, eq=False)
class PrincipalComponents:
    """Principal components of a pad's readings."""

    parts: np.ndarray  #: orthonormal components, (taxels, parts) float32
    mean: np.ndarray  #: mean of the normalised projections, (parts,) float32
    scale: np.ndarray  #: factor that scales them, (parts,) float32
    layers: tuple[int, ...]  #: indices of the sensing layers that are used
    reading_shape: tuple[int, int, int]  #: shape of the pad's readings, (layers, rows, columns)

    @classmethod
    def from_stored(cls, stored: Stored) -> PrincipalComponents:
        """The principal components in a file of weights."""
        parts, mean, scale = (stored.arrays[name].astype(np.float32) for name in ("parts", "mean", "scale"))
        return cls(parts, mean, scale, stored.layers, stored.reading_shape)

    @classmethod
    def fitted(
        cls, octants: np.ndarray, parts: int, layers: tuple[int, ...], reading_shape: tuple[int, int, int]
    ) -> PrincipalComponents:
        """Principal components of normalised readings.

        Args:
            octants: readings mirrored into the octant, (presses, layers, rows, columns).
            parts: number of components.
            layers: indices of these sensing layers in the pad.
            reading_shape: shape of the pad's readings, (layers, rows, columns).
        """
        flat = octants.reshape(len(octants), -1)
        unit = flat / np.linalg.norm(flat, axis=1, keepdims=True)
        gram = np.zeros((unit.shape[1],) * 2)
        for chunk in np.array_split(unit, 50):
            gram += chunk.astype(np.float64).T @ chunk
        basis = np.linalg.eigh(gram)[1][:, ::-1][:, :parts].astype(np.float32)
        along = unit @ basis
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        mean, deviation = along.mean(axis=0), along.std(axis=0)
        scale = (1.0 / np.sqrt(deviation**2 + SCALE_FLOOR**2)).astype(np.float32)
        return cls(basis, mean.astype(np.float32), scale, layers, reading_shape)

    def see(self, readings: np.ndarray) -> Seen:
        """Features of readings (n, layers, rows, columns) [Pa] as `checked` returns them."""
        octant, mirrors = into_octant(readings)
        flat = octant.reshape(len(octant), len(self.parts))
        projected = flat @ self.parts
        mended = self._mended(flat, projected)
        if mended is not None:
            # A dead taxel may have moved the readings' centre into another octant.
            octant, again = into_octant(mended.reshape(octant.shape))
            mirrors = mirrors.then(again)
            flat = octant.reshape(len(octant), len(self.parts))
            projected = flat @ self.parts
        return self.seen(projected, self.left_over(flat, projected), mirrors)

    def left_over(self, flat: np.ndarray, projected: np.ndarray) -> np.ndarray:
        """Sum of squares of the residual of readings (n, taxels) with projections (n, parts) [Pa^2], (n,).

        Without noise, it is about a millionth of the readings' sum of squares. So the difference of the sums of squares
        of readings and projections would consist of rounding errors.
        """
        left = flat - projected @ self.parts.T
        return np.einsum("ij,ij->i", left, left)

    @cached_property
    def _trust(self) -> np.ndarray:
        """Fraction of each component's variance in the training presses that is not noise, (parts,)."""
        variance = np.maximum(1.0 / self.scale**2 - SCALE_FLOOR**2, 0.0)
        return (variance / (variance + _USUAL_NOISE**2)).astype(np.float32)

    @cached_property
    def _share(self) -> np.ndarray:
        """Ratio of a taxel's error to its residual after projection, if no other taxel is wrong, (taxels,)."""
        return 1.0 / (1.0 - np.einsum("ij,j,ij->i", self.parts, self._trust, self.parts))

    def _mended(self, flat: np.ndarray, projected: np.ndarray) -> np.ndarray | None:
        """Readings (n, taxels) with dead taxels replaced by predictions; None if there are no dead taxels.

        A taxel's prediction is its conditional mean given all others, for a normal distribution with the covariance of
        the training presses, as represented by the components and their variances. The dead taxel with the largest
        error is replaced first, and so on until none is left.
        """
        size = np.sqrt(np.einsum("ij,ij->i", projected, projected))[:, None]
        expected = projected - (1.0 - self._trust) * (projected - self.mean * size)
        left = flat - expected @ self.parts.T
        any_wrong, mended, rows = False, flat, np.arange(len(flat))
        for _ in range(_MOST_MENDED):
            dead = mended < _DEAD * (mended - left * self._share)
            worst = np.where(dead, -left, 0.0).argmax(axis=1)
            largest = -left[rows, worst]
            spread = np.sqrt((np.einsum("ij,ij->i", left, left) - largest**2) / (flat.shape[1] - 1))
            wrong = np.flatnonzero((largest > _MISFIT * spread) & (largest > _LEAST_MISFIT * flat.max(axis=1)))
            if not len(wrong):
                break
            if not any_wrong:
                any_wrong, mended = True, flat.copy()
            taxel = worst[wrong]
            change = -left[wrong, taxel] * self._share[taxel]
            mended[wrong, taxel] += change
            left[wrong] -= change[:, None] * ((self.parts[taxel] * self._trust) @ self.parts.T)
            left[wrong, taxel] = 0.0
        return mended if any_wrong else None

    def seen(self, projected: np.ndarray, left: np.ndarray, mirrors: Mirrors) -> Seen:
        """Features of readings that were projected before.

        Args:
            projected: projections, (n, parts) [Pa].
            left: sums of squares of the residuals, (n,) [Pa^2].
            mirrors: how each reading was mirrored.
        """
        size = np.sqrt(np.einsum("ij,ij->i", projected, projected))
        taxels, parts = self.parts.shape
        noise = np.sqrt(np.maximum(left, 0.0) / (taxels - parts)) / size
        features = np.empty((len(projected), parts + 1), dtype=np.float32)
        np.multiply(projected / size[:, None] - self.mean, self.scale, out=features[:, :parts])
        features[:, parts] = noise_feature(noise, np.log)
        return Seen(features, size, noise, mirrors)

    def checked(self, readings: np.ndarray) -> tuple[np.ndarray, tuple[int, ...]]:
        """Readings of the used layers (n, layers, rows, columns), and the original batch shape.

        They are float32, or float64 where single precision does not hold their squares.

        Args:
            readings: (..., layers, rows, columns) [Pa], of all the pad's layers or of the used ones.

        Raises:
            RecognitionError: the readings are not real numbers, have another shape, contain NaN, are all zero, or are
                no pressures by their size.
        """
        given = real_numbers(readings)
        if given is None:
            kind = type(readings).__name__ + (f" of {readings.dtype}" if isinstance(readings, np.ndarray) else "")
            raise RecognitionError(f"the readings are of type {kind}; expected an array of numbers, in pascals.")
        own = (len(self.layers), *self.reading_shape[1:])
        if given.ndim < 3 or given.shape[-3:] not in (self.reading_shape, own):
            raise RecognitionError(
                f"the readings have shape {given.shape}; expected (..., {', '.join(map(str, self.reading_shape))}), as "
                "TactileSensor.read or influence.readings return them."
            )
        batch = given.shape[:-3]
        if given.shape[-3:] != own:
            given = given[..., list(self.layers), :, :]
        flat = given.reshape(-1, *own)
        flat = flat if flat.dtype.kind == "f" else flat.astype(float)
        largest, least = flat.max(axis=(1, 2, 3)), float(flat.min(initial=0.0))
        if not (np.isfinite(largest).all() and math.isfinite(least)):
            raise RecognitionError("the readings hold NaN or infinity. Leave such frames out.")
        beyond, faint = max(float(largest.max(initial=0.0)), -least), float(largest[largest > 0.0].min(initial=1.0))
        single = faint >= _IN_SINGLE[0] and beyond <= _IN_SINGLE[1]
        flat = flat.astype(np.float32 if single else np.float64, copy=False)
        # The range comes first: in it, sums do not overflow.
        if beyond > _IN_DOUBLE[1] or faint < _IN_DOUBLE[0]:
            raise RecognitionError(
                f"a frame's largest reading is {beyond if beyond > _IN_DOUBLE[1] else faint:.3g} Pa; expected stresses "
                f"in pascals, from {_IN_DOUBLE[0]:g} to {_IN_DOUBLE[1]:g}."
            )
        if not (flat.sum(axis=(1, 2, 3)) > 0.0).all():
            raise RecognitionError("nothing presses: all readings are zero. Recognise only frames with contact.")
        return flat, batch
