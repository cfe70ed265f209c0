"""Stress in an endless elastic sheet of layers on a rigid base, under tractions on rectangles: by Fourier series.

Nothing here is discretised in space, and each layer is solved exactly across its thickness, so the solution shows what
meshes, storage and averaging of the package's tables cost. Sources: Burmister, The general theory of stresses and
displacements in layered systems, J. Appl. Phys. 16 (1945); Kausel and Roesset, Stiffness matrices for layered soils,
Bull. Seismol. Soc. Am. 71 (1981), for waves of one wave number layer by layer.

Loads repeat with a period in x and y. For each wave vector k, s is the direction along it, t the one across it and d
the depth. With u_s = -i U e^(iks), u_d = W e^(iks) and u_t = V e^(iks), and with q = k d, Navier's equations leave four
solutions (U, W) and two V in a layer, the second of each kind growing from the layer's base at q = H:

    (e^-q, e^-q),  (q e^-q, (q + c) e^-q),  (e^(q-H), -e^(q-H)),  (-(q-H) e^(q-H), (q-H-c) e^(q-H)),  c = 3 - 4 nu;
    e^-q,  e^(q-H).

The traction at the surface, continuity of displacement and traction at interfaces, and the fixed base give their
factors. They depend on the length of k alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Indices
from mjtactile.pad import Layer, Pad

#: Wave numbers times the least depth asked for, up to which they are summed: there the terms have fallen by e^-15.
_WAVES_PER_DEPTH = 15.0
#: Wave numbers whose equations are solved at once, to bound memory.
_AT_ONCE = 4096


@dataclass(frozen=True)
class PatchTraction:
    """A constant traction on a rectangle."""

    middle: tuple[float, float]  #: [m]
    size: tuple[float, float]  #: along x and y [m]
    traction: tuple[float, float, float]  #: on the sheet, pad frame [Pa]: pressing is -z


@dataclass(frozen=True)
class LayeredSheet:
    """Layers on a rigid base, top first, in a square cell that repeats."""

    layers: tuple[Layer, ...]
    period: float  #: side of the cell [m]; loads of neighbouring cells must be too far away to matter
    least_depth: float  #: at which stress is asked for [m], more than 0; sets the number of waves

    def stress(self, loads: Sequence[PatchTraction], depth: float) -> StressPlane:
        """Stress at one depth [m]; at an interface, that of the layer above."""
        most, step = self._waves_to(max(depth, self.least_depth)), 2 * np.pi / self.period
        kx = step * np.arange(-most, most + 1, dtype=np.float64)
        ky = kx[most:]  # the others are conjugate
        squares = np.add.outer(np.arange(most + 1) ** 2, np.arange(-most, most + 1) ** 2)
        length = step * np.sqrt(np.maximum(squares, 1))
        cosine, sine = kx / length, ky[:, None] / length
        cosine[0, most] = 1.0  # k = 0 has no direction; any one will do
        known, place = np.unique(squares, return_inverse=True)
        answers = (one[..., place.reshape(squares.shape)] for one in self._answers(known, depth))
        pressed, sheared, twisted = answers
        tx, ty, tz = np.moveaxis(_coefficients(loads, kx, ky, self.period), -1, 0)
        along, across = -1j * (cosine * tx + sine * ty), sine * tx - cosine * ty
        ss, tt, dd, sd = pressed * tz + sheared * along
        sd, td, st = -1j * sd, twisted[0] * across, 1j * twisted[1] * across
        double = 2 * cosine * sine * st
        parts = (
            cosine**2 * ss + sine**2 * tt - double,
            sine**2 * ss + cosine**2 * tt + double,
            dd,
            cosine * sine * (ss - tt) + (cosine**2 - sine**2) * st,
            -(sine * sd + cosine * td),  # depth runs against z
            -(cosine * sd - sine * td),
        )
        return StressPlane(kx, ky, np.stack(parts))

    def _waves_to(self, depth: float) -> int:
        """Number of waves along half an axis that reach a depth."""
        return int(np.ceil(_WAVES_PER_DEPTH / depth * self.period / (2 * np.pi)))

    def _lengths(self, squares: Indices) -> Array:
        """Wave numbers [1/m]; for k = 0 stands a wave a thousand times as long as the sheet is thick."""
        thickness = sum(layer.thickness for layer in self.layers)
        return np.where(squares > 0, 2 * np.pi / self.period * np.sqrt(squares), 1e-3 / thickness)

    def _answers(self, squares: Indices, depth: float) -> tuple[Array, Array, Array]:
        """Stress amplitudes at a depth under unit tractions dd, sd / -i and td at the surface.

        Args:
            squares: of wave numbers, over that of the period's wave.
            depth: [m].

        Returns:
            ss, tt, dd and sd / -i under the first, and under the second, each (4, waves); td and st / i under the
            third, (2, waves).
        """
        floors = np.cumsum([layer.thickness for layer in self.layers])
        layer_index = int(np.searchsorted(floors, depth * (1 - 1e-12)))
        layer = self.layers[layer_index]
        within, k = depth - (floors[layer_index] - layer.thickness), self._lengths(squares)
        known, plane, twist = self._factors
        kept = np.searchsorted(known, squares)
        plane, twist = plane[kept, 4 * layer_index : 4 * layer_index + 4], twist[kept, 2 * layer_index :][:, :2]
        pressed, sheared = np.moveaxis(_plane_stress(layer, k, within) @ plane, (2, 1, 0), (0, 1, 2))
        return pressed, sheared, (_twist_stress(layer, k, within) @ twist)[..., 0].T

    @cached_property
    def _factors(self) -> tuple[Indices, Array, Array]:
        """Squares of all wave numbers, and factors of the solutions under unit tractions, (waves, solutions, loads)."""
        numbers = np.arange(self._waves_to(self.least_depth) + 1) ** 2
        squares = np.unique(np.add.outer(numbers, numbers))
        some = np.array_split(self._lengths(squares), len(squares) // _AT_ONCE + 1)
        plane, twist = (
            np.concatenate([wave_factors(self.layers, state, k) for k in some]) for state in (plane_state, _twist_state)
        )
        return squares, plane, twist


@dataclass(frozen=True, eq=False)
class StressPlane:
    """Stress at one depth as a Fourier series."""

    kx: Array  #: wave numbers [1/m]
    ky: Array  #: those from 0 on [1/m]
    parts: npt.NDArray[np.complex128]  #: amplitudes of xx, yy, zz, xy, yz, zx in the pad frame [Pa], (6, ky, kx)

    def at(self, x: Array, y: Array) -> Array:
        """Stress [Pa] on a grid of points, (rows, columns, 6), x (columns,) and y (rows,) [m]; tension positive."""
        along_x, along_y = np.exp(1j * np.outer(self.kx, x)), np.exp(1j * np.outer(y, self.ky))
        along_y[:, 1:] *= 2.0  # for the conjugate ones
        return np.moveaxis((along_y @ self.parts @ along_x).real, 0, -1)


def wave_factors(layers: Sequence[Layer], state: Callable[[Layer, Array, float], Array], k: Array) -> Array:
    """Factors of the solutions of all layers under unit tractions at the surface, (waves, solutions, loads).

    Args:
        layers: on a rigid base, top first.
        state: displacements, and tractions over k, of a layer's solutions at a depth in it: `plane_state`, for example.
        k: wave numbers [1/m].
    """
    unit = layers[0].shear_modulus
    tops, bottoms = ([state(layer, k, share * layer.thickness) for layer in layers] for share in (0.0, 1.0))
    count, half = tops[0].shape[1], tops[0].shape[1] // 2
    scale = np.repeat([1.0, 1.0 / unit], half)[:, None]  # displacements and tractions become alike in size
    equations = np.zeros((len(k), count * len(layers), count * len(layers)))
    equations[:, :half, :count] = tops[0][:, half:] / unit
    for place, bottom in enumerate(bottoms):
        rows, own = half + count * place, slice(count * place, count * place + count)
        if place + 1 < len(layers):
            equations[:, rows : rows + count, own] = scale * bottom
            equations[:, rows : rows + count, own.stop : own.stop + count] = -scale * tops[place + 1]
        else:
            equations[:, rows:, own] = bottom[:, :half]
    known = np.zeros((len(k), count * len(layers), half))
    known[:, np.arange(half), np.arange(half)] = 1.0 / (unit * k[:, None])
    factors: Array = np.linalg.solve(equations, known).astype(np.float64)
    return factors


def plane_waves(layer: Layer, k: Array, depth: float) -> tuple[Array, Array, Array, Array]:
    """U, W and their derivatives along q of the four solutions at a depth in a layer, each (k, 4)."""
    c, q, p = 3 - 4 * layer.poisson, k * depth, k * (depth - layer.thickness)
    down, up, zero = np.exp(-q), np.exp(p), np.zeros_like(q)
    u = np.stack([down, q * down, up, -p * up], axis=-1)
    w = np.stack([down, (q + c) * down, -up, (p - c) * up], axis=-1)
    du = np.stack([-down, (1 - q) * down, up, -(1 + p) * up], axis=-1)
    dw = np.stack([-down, (1 - q - c) * down, -up, (1 + p - c) * up], axis=-1)
    return u + zero[:, None], w, du, dw


def _plane_stress(layer: Layer, k: Array, depth: float) -> Array:
    """ss, tt, dd and sd / -i of the four solutions [Pa/m], (k, 4 stresses, 4)."""
    u, w, du, dw = plane_waves(layer, k, depth)
    spread, shear = layer.lame_lambda * (u + dw), layer.shear_modulus
    return k[:, None, None] * np.stack([spread + 2 * shear * u, spread, spread + 2 * shear * dw, shear * (du - w)], 1)


def plane_state(layer: Layer, k: Array, depth: float) -> Array:
    """U, W, and dd and sd / -i over k, of the four solutions, (k, 4, 4)."""
    u, w, _, _ = plane_waves(layer, k, depth)
    return np.concatenate([np.stack([u, w], 1), _plane_stress(layer, k, depth)[:, 2:] / k[:, None, None]], axis=1)


def _twist_waves(layer: Layer, k: Array, depth: float) -> tuple[Array, Array]:
    down, up = np.exp(-k * depth), np.exp(k * (depth - layer.thickness))
    return np.stack([down, up], axis=-1), np.stack([-down, up], axis=-1)


def _twist_stress(layer: Layer, k: Array, depth: float) -> Array:
    """td and st / i of the two solutions V [Pa/m], (k, 2 stresses, 2)."""
    v, dv = _twist_waves(layer, k, depth)
    return layer.shear_modulus * k[:, None, None] * np.stack([dv, v], axis=1)


def _twist_state(layer: Layer, k: Array, depth: float) -> Array:
    """V, and td over k, of the two solutions, (k, 2, 2)."""
    v, dv = _twist_waves(layer, k, depth)
    return np.stack([v, layer.shear_modulus * dv], axis=1)


def _coefficients(loads: Sequence[PatchTraction], kx: Array, ky: Array, period: float) -> Array:
    """Fourier coefficients of the tractions [Pa], (ky, kx, 3)."""
    found = np.zeros((len(ky), len(kx), 3), dtype=complex)
    for load in loads:
        sides = [
            width / period * np.sinc(k * width / (2 * np.pi)) * np.exp(-1j * k * middle)
            for k, width, middle in zip((kx, ky), load.size, load.middle, strict=True)
        ]
        found += np.multiply.outer(np.outer(sides[1], sides[0]), load.traction)
    return found


def von_mises(stress: Array) -> Array:
    """Von Mises stress of stresses (..., 6) as `LayeredSheet.stress` gives them."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(stress, -1, 0)
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + zx**2))


def readings(pad: Pad, loads: Sequence[PatchTraction], *, period: float, points: int = 4) -> Array:
    """Readings of a flat pad's taxels on a grid under given tractions, as if the pad had no sides.

    Args:
        pad: the layers and taxels.
        loads: tractions.
        period: of the loads [m].
        points: along the radius and the height of each part of a ball that lies in one layer.

    Returns:
        mean von Mises stress over the taxels' balls [Pa], (sensing layers, rows, columns).
    """
    radius = pad.sampling_radius
    nodes, weights = np.polynomial.legendre.leggauss(points)
    turns = 2 * np.pi * (np.arange(2 * points) + 0.5) / (2 * points)
    means = np.zeros(pad.grid_shape)
    for mean, middle in zip(means, pad.depths, strict=True):
        ends = np.clip([middle - radius, middle + radius], 0.0, pad.thickness)
        edges = np.array([ends[0], *(-z for z in pad.interfaces if ends[0] < -z < ends[1]), ends[1]])
        half = np.diff(edges)[:, None] / 2
        depths = (edges[:-1, None] + half * (1 + nodes)).ravel()
        reaches = np.sqrt(radius**2 - (depths - middle) ** 2)
        shares = (half * weights).ravel() * reaches**2
        sheet = LayeredSheet(pad.layers, period, float(depths.min()))
        for depth, reach, share in zip(depths, reaches, shares / shares.sum(), strict=True):
            plane = sheet.stress(loads, float(depth))
            for ring, part in zip(reach * np.sqrt((1 + nodes) / 2), weights / 2, strict=True):
                for turn in turns:
                    stress = plane.at(pad.grid.x + ring * np.cos(turn), pad.grid.y + ring * np.sin(turn))
                    mean += share * part / len(turns) * von_mises(stress)
    return means
