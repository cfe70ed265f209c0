"""The pad's finite-element mesh: three graded lines of elements and the materials of its element layers.

In the plane, elements shrink toward the free rim, the less the more the pad is curved; across the thickness, toward the
surface, where small contacts concentrate stress. Mesh lines lie on every layer interface.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np

from mjtactile._types import Array
from mjtactile.errors import MeshError, MeshWarning
from mjtactile.fem.line import Line
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.fidelity import MeshDensity
from mjtactile.pad import Layer, Pad
from mjtactile.pad_shape.surfaces import FLAT, Surface

#: Most element layers of a sheet; ordinary pads have five to twenty.
_MOST_ELEMENT_LAYERS = 400
#: Ratio of the sizes of successive elements below the deepest taxels [-].
_GROWTH = 1.5
#: Width of elements over the reference length above which a sheet gets more elements than `most_elements` [-]. Under
#: faces on a skin of 1 mm, readings at "fast" are up to 25 % off with elements 0.9 mm wide, and up to 13 % with 0.6 mm.
_WIDEST_ELEMENTS = 0.6
#: Most elements in the plane of such a sheet over `most_elements` [-].
_MOST_TIMES = 2.5
#: Width of elements over the thickness above which a sheet is refused [-]: readings are 30 % off and more.
_TOO_WIDE = 1.5
#: Angle that a body rolls through from the middle of a pad to a side, from which on elements are of one size [rad].
_ROLLING = math.radians(30.0)
#: Decimals of a vertex [m] in a table's fingerprint.
_PICOMETRES = 12


@dataclass(frozen=True, eq=False)
class SheetMesh:
    """Elements of a whole sheet, or of its quarter x >= 0, y >= 0.

    Under a curved surface the lines are those of the coordinates (x, y, -depth), with depth along the inward normals.
    """

    x: Line  #: elements along x in the pad frame [m]
    y: Line  #: elements along y
    z: Line  #: elements along z, from the base to 0 at the surface
    materials: tuple[Layer, ...]  #: material of each element layer, base first
    outer: Surface = FLAT  #: the outer surface, from which the mesh is swept inwards

    @cached_property
    def shear_modulus(self) -> Array:
        """Shear modulus of each element layer [Pa], base first."""
        return np.array([layer.shear_modulus for layer in self.materials])

    @cached_property
    def lame_lambda(self) -> Array:
        """First Lame parameter of each element layer [Pa], base first."""
        return np.array([layer.lame_lambda for layer in self.materials])

    @property
    def surface(self) -> SurfaceGrid:
        """The grid on which surface loads are integrated."""
        return SurfaceGrid(self.x, self.y, -float(self.z.vertices[0]), self.outer)

    @property
    def interfaces(self) -> tuple[int, ...]:
        """Indices of the vertices of z at which the material changes."""
        pairs = zip(self.materials, self.materials[1:], strict=False)
        return tuple(i + 1 for i, (below, above) in enumerate(pairs) if below != above)

    def quarter(self) -> SheetMesh:
        """The part with x >= 0 and y >= 0; lines of a whole sheet have a vertex at 0.

        A line is kept whole if the outer surface is not symmetric along it.
        """
        lines = ((self.x, self.outer.mirrors[0]), (self.y, self.outer.mirrors[1]))
        x, y = (Line(line.vertices[line.element_count // 2 :]) if mirrored else line for line, mirrored in lines)
        return SheetMesh(x, y, self.z, self.materials, self.outer)


def sheet_mesh(pad: Pad, density: MeshDensity) -> SheetMesh:
    """Mesh of the whole pad, mirror-symmetric, with mesh lines on its layer interfaces.

    Raises:
        MeshError: the elements would be too small for the pad, or too wide for it; the message says what determines
            their size.
    """
    z, materials = _through_line(pad, density)
    counts = _in_plane_counts(pad, density)
    _refuse_too_wide(pad, density, counts)
    gradings = (density.rim_grading ** (1.0 - share) for share in _rolling_shares(pad))
    x, y = (_in_plane_line(*line) for line in zip(pad.size, counts, gradings, strict=True))
    return SheetMesh(x, y, z, materials, pad.surface)


def _rolling_shares(pad: Pad) -> tuple[float, float]:
    """Angles that a body rolls through from the middle to the sides along x and y, over `_ROLLING`; at most 1.

    Where bodies roll, contacts near the sides should be as good as those in the middle, where graded elements are
    largest.
    """
    shares = []
    for half in (np.array([pad.size[0] / 2, 0.0]), np.array([0.0, pad.size[1] / 2])):
        first, last = pad.surface.normals(*np.stack([-half, half], axis=1))
        angle = math.atan2(float(np.linalg.norm(np.cross(first, last))), float(first @ last)) / 2
        shares.append(round(min(angle / _ROLLING, 1.0), 3))  # rounding errors must not change a table's fingerprint
    return shares[0], shares[1]


def mesh_description(mesh: SheetMesh, density: MeshDensity) -> dict[str, object]:
    """The mesh's part of a table's fingerprint, as plain numbers.

    Vertices are rounded: their last bits depend on NumPy's version and on the processor's instructions, and a table
    must fit the same pad on every machine. Zero has no sign, for the same reason.
    """
    lines = {name: (np.round(getattr(mesh, name).vertices, _PICOMETRES) + 0.0).tolist() for name in "xyz"}
    return {**lines, "points_per_axis": asdict(density)["points_per_axis"]}


def _graded_sizes(count: int, grading: float) -> Array:
    """Relative sizes of elements in geometric progression, the first `grading` times the last; they sum to 1."""
    sizes = np.geomspace(grading, 1.0, count) if count > 1 else np.ones(1)
    return sizes / sizes.sum()


def warn_if_coarser(pad: Pad, density: MeshDensity) -> None:
    """Warn if a density's `most_elements` makes the mesh of a pad coarser than its sizes ask for.

    Warns:
        MeshWarning: the mesh is coarser.
    """
    wanted, counts = _wanted_counts(pad, density), _in_plane_counts(pad, density)
    if counts == wanted:
        return
    width = _widest_element(pad, counts) / density.length_for(pad)
    # Counts are whole numbers, so elements may be a little wider than asked for.
    off = "" if width < 1.1 * max(_WIDEST_ELEMENTS, density.in_plane_size) else "; readings may be 15 to 30 % off"
    warnings.warn(
        f"the mesh has {2 * counts[0]} x {2 * counts[1]} elements in the plane; on a sheet this thin or wide its "
        f"accuracy is known for {2 * wanted[0]} x {2 * wanted[1]}. Stress that varies over shorter lengths is "
        f"smoothed{off}. Raise MeshDensity.most_elements for a finer mesh, which takes longer to build.",
        MeshWarning,
        stacklevel=3,
    )


def _refuse_too_wide(pad: Pad, density: MeshDensity, counts: tuple[int, int]) -> None:
    """Refuse a mesh that the bound on elements makes so coarse that readings say little."""
    width = _widest_element(pad, counts) / pad.thickness
    if density.reference_length is not None or width <= max(_TOO_WIDE, density.in_plane_size):
        return
    x, y = _counts_of_size(pad, _WIDEST_ELEMENTS * pad.thickness)
    raise MeshError(
        f"the mesh would have elements {width:.3g} times as wide as the pad is thick ({pad.thickness:.3g} m). Readings "
        f"would be off by 30 % and more; expected at most {_TOO_WIDE:g} times. Make the pad smaller or thicker, or "
        f"give a MeshDensity with most_elements={4 * x * y}, which takes long and much memory; or, to accept the "
        f"error, one with a reference_length of your own, such as {density.length_for(pad):.3g} m."
    )


def _widest_element(pad: Pad, counts: tuple[int, int]) -> float:
    """Largest width of elements that are not graded, with so many along half the sheet in x and y [m]."""
    return max(extent / 2 / count for extent, count in zip(pad.size, counts, strict=True))


def _wanted_counts(pad: Pad, density: MeshDensity) -> tuple[int, int]:
    """Numbers of elements along half the sheet in x and y for elements of the density's size."""
    return _counts_of_size(pad, density.in_plane_size * density.length_for(pad))


def _counts_of_size(pad: Pad, size: float) -> tuple[int, int]:
    x, y = (max(2, math.ceil(extent / 2 / size - 1e-9)) for extent in pad.size)
    return x, y


def _in_plane_counts(pad: Pad, density: MeshDensity) -> tuple[int, int]:
    """Numbers of elements as in `_wanted_counts`, reduced where the bound on elements requires it.

    The bound is `most_elements` of the density, but not so low that elements are wider than `_WIDEST_ELEMENTS` allows,
    unless there would be more than `_MOST_TIMES` as many of them.
    """
    wanted = _wanted_counts(pad, density)
    widest = max(density.in_plane_size, _WIDEST_ELEMENTS)
    counts = _bounded(wanted, density.most_elements)
    if _widest_element(pad, counts) / density.length_for(pad) <= widest:
        return counts
    return _bounded(_counts_of_size(pad, widest * density.length_for(pad)), int(_MOST_TIMES * density.most_elements))


def _bounded(wanted: tuple[int, int], most: int) -> tuple[int, int]:
    """Numbers of elements along half the sheet, reduced alike until the sheet has at most `most` of them."""
    total = 4 * math.prod(wanted)
    if total <= most:
        return wanted
    share = math.sqrt(most / total)
    counts = [max(2, math.floor(count * share)) for count in wanted]
    # A narrow sheet keeps four elements across its width and gets fewer along its length.
    x, y = (min(n, max(2, most // (4 * other))) for n, other in zip(counts, counts[::-1], strict=True))
    return x, y


def _in_plane_line(extent: float, half_count: int, grading: float) -> Line:
    half = extent / 2 * np.concatenate([[0.0], np.cumsum(_graded_sizes(half_count, grading))])
    half[-1] = extent / 2
    return Line(np.concatenate([-half[:0:-1], half]))


def _through_line(pad: Pad, density: MeshDensity) -> tuple[Line, tuple[Layer, ...]]:
    """Element line across the thickness and the layer of each element, base first."""
    depths = _wanted_depths(pad, density)
    numbers = np.arange(len(depths), dtype=float)
    vertices, materials, top = [0.0], [], 0.0
    for layer in pad.layers:
        bottom = top + layer.thickness
        # Element indices of the graded line, interpolated at the layer's ends, give its number of elements.
        start, end = np.interp([top, bottom], depths, numbers)
        own = max(1, round(end - start))
        fractions = np.interp(np.linspace(start, end, own + 1), numbers, depths)
        fractions = (fractions - fractions[0]) / (fractions[-1] - fractions[0])
        vertices += (-(top + layer.thickness * fractions[1:])).tolist()
        materials += [layer] * own
        top = bottom
    vertices[-1] = -pad.thickness
    return Line(np.array(vertices[::-1])), tuple(materials[::-1])


def _wanted_depths(pad: Pad, density: MeshDensity) -> Array:
    """Depths of the element ends of a sheet without interfaces [m], from 0 to the thickness.

    Elements have the density's size down to the deepest taxels and grow below them.
    """
    length = density.length_for(pad)
    sensed = max(length, float(np.max(np.add(pad.sensed_depths, pad.sensed_radii))))
    size = density.through_size * length
    if min(sensed, pad.thickness) > _MOST_ELEMENT_LAYERS * size:
        raise MeshError(
            f"the mesh would have {min(sensed, pad.thickness) / size:.3g} element layers of {size:.3g} m down to the "
            f"deepest taxels; expected at most {_MOST_ELEMENT_LAYERS}. Raise the sampling radius or the shallowest "
            "depth, which set their size, or give a MeshDensity with reference_length or through_size of your own."
        )
    if sensed + size >= pad.thickness:
        count = max(1, round(pad.thickness / size))
        return pad.thickness * np.concatenate([[0.0], np.cumsum(_graded_sizes(count, density.base_grading))])
    count = max(1, round(sensed / size))
    # Sizes s, s g, s g^2 ... fill the rest when s (g^n - 1) / (g - 1) reaches it.
    below = pad.thickness - sensed
    more = max(1, round(math.log1p(below * (_GROWTH - 1) / (size * _GROWTH)) / math.log(_GROWTH)))
    growing = sensed + below * np.cumsum(_graded_sizes(more, _GROWTH ** (1 - more)))
    return np.concatenate([np.linspace(0.0, sensed, count + 1), growing])
