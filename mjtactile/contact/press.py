"""Contacts of footprints with a pad, solved by the compiled core without MuJoCo."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely

from mjtactile._native import library, pointer
from mjtactile._types import Array
from mjtactile.contact.cells.face_cells import placed_cells
from mjtactile.contact.core_pad import core_names, give_shear, give_springs, press_pad
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import ContactOptions, Wrench
from mjtactile.errors import ContactError
from mjtactile.geometry.planar import areal
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import Area, ContactState, SurfaceLoad

#: Grid on which the ends of edges around the area under pressure are matched, over the size of the contact [-].
_GRID = 1e-7

_HeightsFunction = ctypes.CFUNCTYPE(
    None, ctypes.c_size_t, ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_double)
)


class Told(ctypes.Structure):
    """Results for one body: the C structure `mjt_pressed` of native/api/api.h."""

    _fields_ = [
        ("indentation", ctypes.c_double),
        ("slopes", ctypes.c_double * 2),
        ("carried", ctypes.c_double * 6),
        ("area", ctypes.c_double),
        ("peak", ctypes.c_double),
        ("stick", ctypes.c_double),
        ("refused", ctypes.c_int32),
        ("approximated", ctypes.c_int32),
        ("simplified", ctypes.c_int32),
        ("cells", ctypes.c_int32),
        ("edges", ctypes.c_int32),
    ]


class Solved(NamedTuple):
    """The core's result for one body."""

    load: SurfaceLoad  #: its tractions
    #: Whether the law's solution was not found, so that the cells nearest to the force's line of action bear it.
    approximated: bool
    #: Whether no solution with the requested shear was found, so that a simpler tangential choice is used.
    simplified: bool


def _doubles(values: list[float]) -> ctypes.Array[ctypes.c_double]:
    """A few numbers as an argument of a C function, without the overhead of an array."""
    return (ctypes.c_double * len(values))(*values)


class _CoreFootprint:
    """A footprint in the compiled core."""

    def __init__(self, handle: int) -> None:
        self.handle = handle  #: pointer to the core's object, an argument of the core's functions
        self.error: BaseException | None = None  #: exception of a gap function, if any
        self._free = library().mjt_footprint_free

    def __del__(self) -> None:
        self._free(ctypes.c_void_p(self.handle))


class _CurvedFootprint(_CoreFootprint):
    """The footprint of a curved body, whose heights the core obtains through a callback."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint, self._call = footprint, _HeightsFunction(self._heights)
        bounds = np.array(footprint.bounds)
        super().__init__(library().mjt_footprint_heights(self._call, pointer(bounds)))

    def _heights(self, count: int, points: Any, to: Any) -> None:
        heights: float | Array = np.inf
        try:
            if self.error is not None:
                pass
            elif count == 1:  # faster without an array
                heights = self._footprint.height(points[0], points[1])
            else:
                heights = self._footprint.heights(np.ctypeslib.as_array(points, (count, 2)))
        except BaseException as error:  # exceptions cannot pass through C: it is raised after the call
            self.error = error
        if count == 1:
            to[0] = heights
        else:
            np.ctypeslib.as_array(to, (count,))[:] = heights


def _core_footprint(footprint: Footprint, cells: int, widest: float) -> _CoreFootprint:
    if footprint.gap is None:
        made, place = placed_cells(footprint.outline, cells, widest)
        return _CoreFootprint(library().mjt_footprint_flat(made.handle, pointer(place)))
    return _CurvedFootprint(footprint)


class Press:
    """Solves contacts of footprints with one pad; use it in one thread at a time.

    Args:
        influence: of the pad.
        options: law, friction and tilt.
        strength: largest pressure on a cell [Pa]; None: the top layer's modulus, as for the plugin's sensors; 0: no
            bound.
        springs: areas and stiffnesses for law "foundation", see `foundation_springs`.
        narrowest: width of the narrowest cells [m]; 0: determined by the resolution of the pad's taxels.
    """

    def __init__(
        self,
        influence: InfluenceMatrices,
        options: ContactOptions,
        *,
        springs: tuple[Array, Array] | None = None,
        strength: float | None = None,
        narrowest: float = 0.0,
    ) -> None:
        law = options.contact_law
        pad = press_pad(influence, compliant=law.shapes)
        if springs is not None:
            give_springs(pad, *springs)
        if options.choice.couples:
            give_shear(pad, influence)
        self._surface, self._options = influence.surface, options
        self._widest = options.widest_cells(influence.pad)
        core = library()
        self._handle = ctypes.c_void_p(
            core.mjt_press_new(
                pad.handle,
                *core_names(options),
                ctypes.c_int(options.tilting),
                ctypes.c_double(-1.0 if options.friction is None else options.friction),
                ctypes.c_size_t(options.cells),
                ctypes.c_double(influence.pad.layers[0].young if strength is None else strength),
                ctypes.c_double(narrowest),
            )
        )
        weakref.finalize(self, core.mjt_press_free, self._handle)

    def loads(self, footprints: Sequence[Footprint], wrenches: Sequence[Wrench]) -> list[Solved]:
        """Loads of bodies that press at the same time.

        Raises:
            ContactError: no part of a pressing body can touch the pad, or a footprint was made for another surface.
            Exception: any exception of a gap function.
        """
        count, nodes = len(footprints), self._surface.node_shape
        for one in footprints:
            if not self._surface.matches(one.surface):
                raise ContactError(
                    f"the footprint was made on {one.surface.summary}, but the pad's is {self._surface.summary}. "
                    "Make it with influence.surface of the pad that is pressed."
                )
        made = [_core_footprint(one, self._options.cells, self._widest) for one in footprints]
        handles = (ctypes.c_void_p * count)(*(one.handle for one in made))
        forces = _doubles([part for wrench in wrenches for part in (*wrench.force.tolist(), *wrench.moment.tolist())])
        points = _doubles([coordinate for footprint in footprints for coordinate in footprint.centroid])
        nodal, told = np.empty((count, *nodes, 3)), (Told * count)()
        library().mjt_press_bodies(self._handle, ctypes.c_size_t(count), handles, forces, points, pointer(nodal), told)
        for one in made:
            if one.error is not None:
                raise one.error
        return [self._solved(k, nodal[k], told[k], footprints[k], wrenches[k]) for k in range(count)]

    def _solved(self, body: int, nodal: Array, told: Told, footprint: Footprint, wrench: Wrench) -> Solved:
        if told.refused:
            raise ContactError(
                "no part of the body touches the pad: it is too far from the pad everywhere, or too narrow for its "
                "lowest point to be found. Check its gap function, or pass its outline=... to from_gap."
            )
        ends = np.empty((told.edges, 2, 2))
        library().mjt_press_rim(self._handle, ctypes.c_size_t(body), pointer(ends))
        covered = Rim(ends)
        slips = self._options.choice.slips
        state = ContactState(
            # Near the place of contact, heights along the normal are those along z times the normal's rise.
            indentation=told.indentation - footprint.above * float(wrench.outward[2]),
            # The body moves down by indentation + slope . (x, y), so it rotates by (-slope y, slope x).
            tilts=(0.0 - told.slopes[1], told.slopes[0]),
            contact_area=told.area,
            peak_pressure=told.peak,
            stick_area=told.stick if slips else np.nan,
        )
        carried = np.array(told.carried)
        left_force, left_moment = wrench.force - carried[:3], wrench.moment - carried[3:]
        load = SurfaceLoad(nodal, self._surface, covered, left_force, left_moment, state)
        return Solved(load, bool(told.approximated), bool(told.simplified))

    def parts(self) -> Array | None:
        """Nodal forces of the linear parts of the load of one body, after `loads` [N], (parts, nodes y, nodes x, 3).

        None if the load is not linear in the wrench.
        """
        core, nothing = library(), pointer(None)
        count = int(core.mjt_press_parts(self._handle, ctypes.c_size_t(0), nothing))
        if count == 0:
            return None
        nodal = np.empty((count, *self._surface.node_shape, 3))
        core.mjt_press_parts(self._handle, ctypes.c_size_t(0), pointer(nodal))
        return nodal

    def weights(self, wrench: Wrench, parts: int) -> Array | None:
        """Factor of each part in the load of a wrench, (parts,); None if the load is not a sum of these parts."""
        weights, six = np.empty(parts), np.concatenate([wrench.force, wrench.moment])
        found = library().mjt_press_weights(self._handle, pointer(six), pointer(weights))
        return weights if found else None


class Rim:
    """Outline of the area under pressure, computed from its edges at the first call.

    The edges have the area on their left, (edges, 2 ends, 2) [m].
    """

    def __init__(self, ends: Array) -> None:
        self._ends = ends

    def __call__(self) -> Area:
        """The area [m]; empty without edges."""
        if not len(self._ends):
            return shapely.Polygon()
        grid = _GRID * float(np.ptp(self._ends.reshape(-1, 2), axis=0).max())
        lines = shapely.union_all(shapely.linestrings(self._ends), grid_size=grid)
        pieces = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
        under = [
            piece for piece in pieces if self._winds_about(shapely.get_coordinates(piece.representative_point())[0])
        ]
        return areal(shapely.union_all(under, grid_size=grid))

    def _winds_about(self, point: Array) -> bool:
        """Whether the edges enclose a point: their winding number about it is not zero."""
        start, end = self._ends[:, 0] - point, self._ends[:, 1] - point
        upward = (start[:, 1] <= 0.0) & (end[:, 1] > 0.0)
        downward = (start[:, 1] > 0.0) & (end[:, 1] <= 0.0)
        left = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
        return bool((upward & (left > 0.0)).sum() > (downward & (left < 0.0)).sum())
