"""From the stress at every taxel to the stress that hardware reports.

The steps are those of a real signal: hysteresis and crosstalk in the elastomer, conversion to a voltage with the gain
and offset of each element, noise, the converter's range and resolution, delay. The result is a stress again, decoded
with the nominal element's calibration, since a driver knows no other; `volts` returns the signals.
"""

from __future__ import annotations

from collections import deque
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Mask
from mjtactile.errors import TransducerError, of_type, shortened
from mjtactile.transducer.capacitive import CapacitiveCell
from mjtactile.transducer.checks import require_numbers
from mjtactile.transducer.imperfections import Imperfections, coupled, lagging
from mjtactile.transducer.piezoresistive import PiezoresistiveElement
from mjtactile.units import is_whole

#: The converter's range extends this far below the signal at rest, over the full signal [-], so that noise at rest is
#: not clipped.
HEADROOM = 0.05
#: Kinds of elements by the names that environments and datasets use.
ELEMENTS = {"capacitive": CapacitiveCell, "piezoresistive": PiezoresistiveElement}


@runtime_checkable
class Element(Protocol):
    """A kind of sensing element, such as `CapacitiveCell` and `PiezoresistiveElement`."""

    @property
    def full_signal(self) -> float:
        """Largest signal [V]."""
        ...

    def signal(self, stress: npt.ArrayLike) -> Array:
        """Signal [V] under a stress [Pa] of any shape; it increases with the stress."""
        ...

    def stress(self, signal: npt.ArrayLike) -> Array:
        """Stress [Pa] for a signal [V] of any shape: the inverse of `signal`."""
        ...


def require_element(element: Element) -> Element:
    """A sensing element, unchanged.

    Raises:
        TransducerError: it has not what an `Element` has, or is a class of elements.
    """
    if isinstance(element, type):
        raise TransducerError(f"element is the class {element.__name__}; expected one of it, {element.__name__}().")
    if not isinstance(element, Element):
        raise TransducerError(
            f"element = {shortened(element)}; expected a CapacitiveCell, a PiezoresistiveElement, or another object "
            "with full_signal, signal and stress."
        )
    return element


def checked_shape(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The shape of one set of readings, checked.

    Raises:
        TransducerError: it is not (layers, rows, columns) or (taxels,), of whole numbers from 1 on.
    """
    if not (isinstance(shape, list | tuple) and len(shape) in (1, 3) and all(is_whole(n) and n >= 1 for n in shape)):
        raise TransducerError(
            f"shape = {shortened(shape)}; expected (layers, rows, columns), for example (4, 13, 13), or (taxels,)."
        )
    return tuple(int(n) for n in shape)


def finite_readings(readings: npt.ArrayLike) -> Array:
    """Readings [Pa] as an array, checked.

    Raises:
        TransducerError: they are not finite numbers.
    """
    stress = require_numbers("readings", readings, "an array of stresses in pascals")
    if not np.isfinite(stress).all():
        raise TransducerError("the readings hold NaN or infinite values; expected finite stresses in pascals.")
    return stress


class Transducer:
    """An array of elements with their imperfections: `transducer(readings)` is what the array reports.

    Gains, offsets and dead taxels belong to the array and are drawn once from the seed; noise is drawn at each call.
    The same seed and the same calls give the same bits; `reset` goes back to the start. A batch holds several presses
    on this one array, each with noise of its own. Hysteresis and delay act on each entry of a batch by itself: entry k
    follows entry k of the call before.

    Args:
        element: kind of the elements; by default the paper's capacitive cell, which saturates at 2.4 kPa.
        imperfections: how they differ from it; by default not at all.
        shape: of one set of readings, `Pad.reading_shape`: (layers, rows, columns), or (taxels,) for free taxels.
        seed: of everything drawn.

    Raises:
        TransducerError: the element or the imperfections are none, the shape is no array of taxels, a dead taxel is
            outside it, the seed is negative or no whole number, or there is crosstalk between free taxels, which have
            no neighbours.
    """

    def __init__(
        self,
        element: Element | None = None,
        imperfections: Imperfections | None = None,
        *,
        shape: tuple[int, ...] = (4, 13, 13),
        seed: int = 0,
    ) -> None:
        self.element = CapacitiveCell() if element is None else require_element(element)
        how = Imperfections() if imperfections is None else imperfections
        self.imperfections = of_type(Imperfections, "imperfections", how, TransducerError, "Imperfections(noise=0.01)")
        self.shape = checked_shape(shape)
        if not (is_whole(seed) and seed >= 0):
            raise TransducerError(f"seed = {shortened(seed)}; expected a whole number of at least 0.")
        self.seed = int(seed)
        if len(self.shape) == 1 and self.imperfections.crosstalk:
            raise TransducerError(
                f"crosstalk = {self.imperfections.crosstalk} goes to neighbours on a grid, but readings of shape "
                f"{self.shape} are of free taxels. Leave crosstalk out, or give the pad a TaxelGrid."
            )
        self.gains, self.offsets, self.dead = self._drawn_array()
        self.reset()

    def reset(self) -> None:
        """Forget earlier calls and start the noise anew; gains, offsets and dead taxels stay."""
        self._noise = np.random.default_rng([self.seed, 1])
        self._lagged: Array | None = None
        self._delayed: deque[Array] = deque()

    def __call__(self, readings: npt.ArrayLike) -> Array:
        """The stress that the array reports for readings, decoded with the nominal element's calibration.

        Args:
            readings: von Mises stress [Pa], shape `shape` or (batch, *shape).

        Returns:
            The same shape [Pa]. Noise and offsets at rest may make it a little less than zero.

        Raises:
            TransducerError: the readings have another shape or are not finite; or, with hysteresis or delay, the batch
                has another size than in the call before.
        """
        return self.element.stress(self.volts(readings))

    def volts(self, readings: npt.ArrayLike) -> Array:
        """Signals [V] of the array, same shape as the readings; arguments and errors are those of `__call__`.

        Each call is one sample: it advances hysteresis, delay and noise.
        """
        stress = self._checked(readings)
        how = self.imperfections
        if how.hysteresis > 0.0:
            before = np.zeros_like(stress) if self._lagged is None else self._lagged
            self._lagged = stress = lagging(stress, before, how.hysteresis)
        full = self.element.full_signal
        ideal = self.element.signal(coupled(stress, how.crosstalk))
        # An element beyond its range may have an infinite signal; the next steps need finite numbers.
        signal = np.minimum(ideal, 2.0 * full) * self.gains + self.offsets * full
        if how.noise > 0.0:
            signal = signal + how.noise * full * self._noise.standard_normal(signal.shape)
        if how.signal_noise > 0.0:
            signal = signal * (1.0 + how.signal_noise * self._noise.standard_normal(signal.shape))
        return self._late(self._counted(np.where(self.dead, 0.0, signal)))

    def _counted(self, signal: Array) -> Array:
        """Signals after the converter: clipped to its range and rounded to whole counts [V]."""
        full = self.element.full_signal
        clipped = np.clip(signal, -HEADROOM * full, full)
        if self.imperfections.adc_bits is None:
            return clipped
        # Zero, the signal at rest, is a whole count.
        count = full * (1.0 + HEADROOM) / (2**self.imperfections.adc_bits - 1)
        return np.clip(np.round(clipped / count) * count, -HEADROOM * full, full)

    def _late(self, signal: Array) -> Array:
        """The signal of `delay` calls ago; zero, the signal at rest, before that many calls."""
        if self.imperfections.delay == 0:
            return signal
        self._delayed.append(signal)
        if len(self._delayed) > self.imperfections.delay:
            return self._delayed.popleft()
        return np.zeros_like(signal)

    def _drawn_array(self) -> tuple[Array, Array, Mask]:
        """Gains [-], offsets over the full signal [-], and which taxels are dead, each of shape `shape`."""
        how = self.imperfections
        drawn = np.random.default_rng([self.seed, 0])
        gains = 1.0 + how.gain_spread * drawn.standard_normal(self.shape)
        offsets = how.offset_spread * drawn.standard_normal(self.shape)
        dead = drawn.random(self.shape) < how.dead
        for taxel in how.dead_taxels:
            if len(taxel) != len(self.shape) or not all(k < n for k, n in zip(taxel, self.shape, strict=True)):
                raise TransducerError(
                    f"dead taxel {taxel} is outside the array of {self.shape}; expected (layer, row, column), or "
                    "(taxel,) for free taxels."
                )
            dead[tuple(taxel)] = True
        # A gain below zero would invert the signal. At the widest spread allowed it is 3.3 standard deviations away.
        return np.maximum(gains, 0.0), offsets, dead

    def _checked(self, readings: npt.ArrayLike) -> Array:
        stress = finite_readings(readings)
        if stress.shape not in (self.shape, stress.shape[:1] + self.shape):
            raise TransducerError(
                f"the readings have shape {stress.shape}, but the transducer was made for {self.shape} or batches of "
                "it. Make one with shape=pad.reading_shape."
            )
        known = self._lagged if self._lagged is not None else next(iter(self._delayed), None)
        if known is not None and known.shape != stress.shape:
            raise TransducerError(
                f"the readings have shape {stress.shape}, but had {known.shape} in the call before, and hysteresis or "
                "delay needs the same. Call reset() before a batch of another size."
            )
        return stress
