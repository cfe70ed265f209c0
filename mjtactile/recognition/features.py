"""What every recogniser looks at: readings in one octant, in few numbers, whatever the force.

Readings are mirrored into an octant of the pad (symmetry.py), projected on the principal parts of many presses, and
divided by the length of what comes out, so that the force's magnitude drops out. What the parts leave over is noise
for the most part, and its size is the last feature: a recogniser can trust faint parts as far as the noise lets it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjtactile.recognition.symmetry import Mirrors, into_octant
from mjtactile.recognition.weight_files import RecognitionError, Stored

#: Noise below this is as good as none [-]; relative to the length of the projection.
NOISE_FLOOR = 3e-5
#: Noise that scales the principal parts: fainter ones are not blown up beyond it [-].
SCALE_FLOOR = 2e-3
#: Noise at which taxels are judged [-]: 1 % of the largest reading, which is about a fifth of the length.
_USUAL_NOISE = 2e-3
#: A taxel is dead when it reads less than this share of what the others imply,
_DEAD = 0.35
#: is off by this many times what the others are, and by this share of the largest reading.
_MISFIT, _LEAST_MISFIT = 4.0, 0.02
#: Dead taxels that are mended, at most.
_MOST_MENDED = 12


@dataclass(frozen=True, eq=False)
class Seen:
    """Some readings as recognisers see them.

    Attributes:
        features: (readings, parts + 1) float32.
        size: length of the projected readings (readings,) [Pa], in proportion to the force.
        noise: root mean square of what the parts leave over, over `size` (readings,) [-].
        mirrors: how each was mirrored.
    """

    features: np.ndarray
    size: np.ndarray
    noise: np.ndarray
    mirrors: Mirrors


@dataclass(frozen=True, eq=False)
class PrincipalComponents:
    """Principal parts of a pad's readings.

    Attributes:
        parts: orthonormal, (taxels, parts) float32.
        mean, scale: of the projections over their length, (parts,) float32.
        layers: which sensing layers are looked at.
        reading_shape: of the pad.
    """

    parts: np.ndarray
    mean: np.ndarray
    scale: np.ndarray
    layers: tuple[int, ...]
    reading_shape: tuple[int, int, int]

    @classmethod
    def from_stored(cls, stored: Stored) -> PrincipalComponents:
        """The view in a file of weights."""
        parts, mean, scale = (stored.arrays[name].astype(np.float32) for name in ("parts", "mean", "scale"))
        return cls(parts, mean, scale, stored.layers, stored.reading_shape)

    @classmethod
    def fitted(
        cls, octants: np.ndarray, parts: int, layers: tuple[int, ...], reading_shape: tuple[int, int, int]
    ) -> PrincipalComponents:
        """Principal parts of readings over their length.

        Args:
            octants: readings (presses, layers, rows, columns) mirrored into the octant.
            parts: how many.
            layers: which sensing layers these are.
            reading_shape: of the pad.
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
        flat = octant.reshape(len(octant), -1)
        projected = flat @ self.parts
        mended = self._mended(flat, projected)
        if mended is not None:
            # A dead taxel may have moved the readings' middle into another octant.
            octant, again = into_octant(mended.reshape(octant.shape))
            mirrors = mirrors.then(again)
            flat = octant.reshape(len(octant), -1)
            projected = flat @ self.parts
        return self.seen(projected, self.left_over(flat, projected), mirrors)

    def left_over(self, flat: np.ndarray, projected: np.ndarray) -> np.ndarray:
        """Sum of squares (n,) [Pa^2] of what the parts leave of readings (n, taxels) with projections (n, parts).

        Without noise it is a millionth of the readings': as a difference of two sums it would be rounding.
        """
        left = flat - projected @ self.parts.T
        return np.einsum("ij,ij->i", left, left)

    @cached_property
    def _trust(self) -> np.ndarray:
        """Share of each projection that is not noise, where presses vary as those did that were learnt from."""
        variance = np.maximum(1.0 / self.scale**2 - SCALE_FLOOR**2, 0.0)
        return (variance / (variance + _USUAL_NOISE**2)).astype(np.float32)

    @cached_property
    def _share(self) -> np.ndarray:
        """A taxel's error over the residual of its reading after projection, where it alone is wrong, (taxels,)."""
        return 1.0 / (1.0 - np.einsum("ij,j,ij->i", self.parts, self._trust, self.parts))

    def _mended(self, flat: np.ndarray, projected: np.ndarray) -> np.ndarray | None:
        """Readings (n, taxels) with those taxels mended that read next to nothing where they should; None without any.

        What a taxel should read follows from all others by the covariance of the presses learnt from, of which the
        parts and their variances are what there is: the conditional mean of a normal distribution. The dead taxel
        that is furthest off is set to it, until there is none.
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
        """Features of projections (n, parts) [Pa] of readings whose squares sum to `left` (n,) more."""
        size = np.sqrt(np.einsum("ij,ij->i", projected, projected))
        taxels, parts = self.parts.shape
        noise = np.sqrt(np.maximum(left, 0.0) / (taxels - parts)) / size
        features = np.empty((len(projected), parts + 1), dtype=np.float32)
        np.multiply(projected / size[:, None] - self.mean, self.scale, out=features[:, :parts])
        features[:, parts] = np.log(noise + NOISE_FLOOR) / 1.5 + 5.0
        return Seen(features, size, noise, mirrors)

    def checked(self, readings: np.ndarray) -> tuple[np.ndarray, tuple[int, ...]]:
        """Readings of the layers looked at, float32, one batch axis in front; and the batch axes as given.

        Args:
            readings: (..., layers, rows, columns) [Pa], of all the pad's layers or of just those looked at.

        Raises:
            RecognitionError: for another shape, NaN, or readings of nothing.
        """
        given = np.asarray(readings, dtype=np.float32)
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
        sums = flat.sum(axis=(1, 2, 3))
        if not np.isfinite(sums).all():
            raise RecognitionError("the readings hold NaN or infinity. Leave such frames out.")
        if not (sums > 0.0).all():
            raise RecognitionError("nothing presses: all readings are zero. Recognise only frames with contact.")
        return flat, batch
