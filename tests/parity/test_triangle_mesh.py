"""Triangle meshes as the compiled core makes, searches and describes them, against trimesh and plain NumPy."""

import ctypes
import functools
import weakref
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
import shapely
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from lower_surfaces import Pose, Rectangle, TriangleMesh
from scipy.spatial.transform import Rotation
from shapely import Polygon

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array

PART = Rectangle(-10e-3, -10e-3, 10e-3, 10e-3)
#: What nothing of a body may reach beyond a facet by [m].
GAP = 50e-6
#: Single precision rounds corners of a body of a centimetre by this [m].
ROUNDING = 1e-9


class Facet(NamedTuple):
    normal: Array
    offset: float
    area: float
    loops: list[Array]


class NativeMesh:
    """A mesh as the core holds it."""

    def __init__(self, handle: int) -> None:
        core = library()
        self.handle = ctypes.c_void_p(handle)
        self._finalizer = weakref.finalize(self, core.mjt_mesh_free, self.handle)
        counts, self.vertices, self.triangles, *_ = self._data(GAP)
        self.closed = bool(counts[2])

    @classmethod
    def of(cls, vertices: Array, faces: npt.ArrayLike) -> "NativeMesh":
        points = np.ascontiguousarray(vertices, dtype=np.float32).reshape(-1, 3)
        corners = np.ascontiguousarray(faces, dtype=np.int32).reshape(-1, 3)
        make = library().mjt_mesh_new
        make.restype = ctypes.c_void_p
        return cls(make(ctypes.c_size_t(len(points)), pointer(points), ctypes.c_size_t(len(corners)), pointer(corners)))

    @classmethod
    def of_field(cls, size: npt.ArrayLike, data: Array) -> "NativeMesh":
        make = library().mjt_mesh_new_field
        make.restype = ctypes.c_void_p
        return cls(make(*field_arguments(size, data)))

    def heights(
        self, pose: Pose, points: Array, *, part: Rectangle = PART, floor: float = -np.inf, reach: float = np.inf
    ) -> tuple[Array, float]:
        """Heights (n,) over points (n, 2), and the least over the part."""
        return self._shadow(pose, part, floor, reach, contiguous(points))[:2]

    def bottoms(self, pose: Pose, *, part: Rectangle = PART, floor: float = -np.inf, reach: float = np.inf) -> Array:
        return self._shadow(pose, part, floor, reach, np.empty((0, 2)), 600)[2]

    def facets(self, gap: float = GAP) -> list[Facet]:
        _, _, _, planes, loops, points = self._data(gap)
        outlines = np.split(points, np.cumsum(loops[:, 1].astype(int))[:-1])
        return [
            Facet(plane[:3], plane[3], plane[4], [outlines[i] for i in np.flatnonzero(loops[:, 0] == number)])
            for number, plane in enumerate(planes)
        ]

    def _shadow(
        self, pose: Pose, part: Rectangle, floor: float, reach: float, points: Array, most: int = 0
    ) -> tuple[Array, float, Array]:
        find = library().mjt_mesh_shadow
        find.restype = ctypes.c_size_t
        where, over = contiguous([*pose.position, *pose.rotation.ravel()]), contiguous(part)
        heights, lowest, bottoms = np.empty(len(points)), ctypes.c_double(), np.empty((most, 3))
        found = find(
            self.handle,
            pointer(where),
            pointer(over),
            ctypes.c_double(floor),
            ctypes.c_double(reach),
            ctypes.c_size_t(len(points)),
            pointer(points),
            pointer(heights),
            ctypes.byref(lowest),
            ctypes.c_size_t(most),
            pointer(bottoms),
        )
        return heights, lowest.value, bottoms[:found]

    def _data(self, gap: float) -> tuple[Any, ...]:
        find, counts = library().mjt_mesh_data, (ctypes.c_size_t * 6)()
        find(self.handle, ctypes.c_double(gap), counts, *[None] * 5)
        vertices, triangles = np.empty((counts[0], 3)), np.empty((counts[1], 3), dtype=np.int32)
        planes, loops, points = (
            np.empty((counts[3], 5)),
            np.empty((counts[4], 2), dtype=np.uint64),
            np.empty((counts[5], 3)),
        )
        arrays = vertices, triangles, planes, loops, points
        find(self.handle, ctypes.c_double(gap), counts, *(pointer(one) for one in arrays))
        return counts, *arrays


def field_arguments(size: npt.ArrayLike, data: Array) -> tuple[object, ...]:
    heights, numbers = np.ascontiguousarray(data, dtype=np.float32), contiguous(size)
    rows, columns = heights.shape
    # Views of ctypes do not keep their arrays.
    measure, values = (np.ctypeslib.as_ctypes(one.ravel()) for one in (numbers, heights))
    return ctypes.c_size_t(rows), ctypes.c_size_t(columns), measure, values


def star() -> trimesh.Trimesh:
    angle = np.linspace(0.0, 2 * np.pi, 10, endpoint=False)
    radius = np.where(np.arange(10) % 2, 0.45, 1.0)
    outline = Polygon(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    return trimesh.creation.extrude_polygon(outline, 0.7)


def bowl() -> trimesh.Trimesh:
    ball = trimesh.creation.icosphere(3)
    return trimesh.Trimesh(ball.vertices, ball.faces[ball.triangles_center[:, 2] < 0.3], process=False)


def grid() -> trimesh.Trimesh:
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-1.0, 1.0, 9))
    number = np.arange(81).reshape(9, 9)
    here, right, up, across = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    faces = np.concatenate([np.column_stack([here, right, across]), np.column_stack([here, across, up])])
    return trimesh.Trimesh(np.column_stack([x.ravel(), y.ravel(), 0.2 * np.sin(3 * x.ravel())]), faces, process=False)


#: Solids of about unit size.
SOLIDS = {
    "box": lambda: trimesh.creation.box((1.2, 0.9, 1.5)),
    "torus": lambda: trimesh.creation.torus(0.8, 0.25, major_sections=40, minor_sections=24),
    "star": star,
    "ball": lambda: trimesh.creation.icosphere(3),
    "cone": lambda: trimesh.creation.cone(0.8, 1.2, sections=40),
    "annulus": lambda: trimesh.creation.annulus(0.4, 0.9, 0.6, sections=50),
    "bowl": bowl,
    "grid": grid,
    "fine_ball": lambda: trimesh.creation.uv_sphere(count=[224, 224]),
}
OPEN = ("bowl", "grid")


@functools.cache
def solid(name: str, size: float = 7e-3) -> trimesh.Trimesh:
    """A solid in metres, its corners rounded to single precision."""
    made = SOLIDS[name]()
    vertices = (size * made.vertices).astype(np.float32).astype(float)
    return trimesh.Trimesh(vertices, made.faces, process=False)


def joined(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return trimesh.Trimesh(np.concatenate([part.vertices for part in parts]), np.concatenate(faces), process=False)


def soup(one: trimesh.Trimesh) -> NativeMesh:
    """Made from triangles that share no vertices, as files have them."""
    return NativeMesh.of(one.vertices[one.faces], np.arange(3 * len(one.faces)))


def surface(mesh: NativeMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.triangles.astype(np.int64), closed=mesh.closed)


def least_height(mesh: TriangleMesh, pose: Pose, part: Rectangle, floor: float) -> float:
    """Least height over a part [m]: at a corner of what its triangles leave when they are clipped to it."""
    corners = pose.points(mesh.vertices)[mesh.triangles]
    flat = np.asarray(shapely.polygons(corners[..., :2]))
    counter_clockwise = shapely.is_ccw(shapely.get_exterior_ring(flat))  # from below those that face down are not
    kept = np.flatnonzero((shapely.area(flat) > 0.0) & ~(counter_clockwise & mesh.closed))
    clipped = shapely.intersection(flat[kept], shapely.box(*part))
    rim, owner = shapely.get_coordinates(clipped, return_index=True)
    first, *sides = (corners[kept[owner], k] for k in range(3))
    normal = np.cross(sides[0] - first, sides[1] - first)
    heights = first[:, 2] - (normal[:, :2] * (rim - first[:, :2])).sum(axis=1) / normal[:, 2]
    return float(heights[heights >= floor].min(initial=np.inf))


@functools.cache
def both(name: str) -> tuple[NativeMesh, TriangleMesh]:
    mesh = soup(solid(name))
    return mesh, surface(mesh)


def random_pose(seed: int, height: float = 5e-3) -> Pose:
    draw = np.random.default_rng(seed)
    return Pose(draw.uniform(-1.0, 1.0, 3) * (8e-3, 8e-3, height), Rotation.random(rng=draw).as_matrix())


def points_over(part: Rectangle, count: int = 400) -> Array:
    draw = np.random.default_rng(7).random((count, 2))
    return np.array([part.west, part.south]) + draw * (part.east - part.west, part.north - part.south)


def assert_same_heights(found: Array, expected: Array) -> None:
    """Infinite at the same points, and equal elsewhere but for the rounding of lengths of some millimetres."""
    met = np.isfinite(found)
    assert np.array_equal(met, np.isfinite(expected))
    assert found[met] == pytest.approx(expected[met], abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 90.0, 37.0])
@pytest.mark.parametrize("name", SOLIDS)
def test_heights_over_a_grid_are_those_of_the_reference(name, angle, instruction_set):
    """Points on a grid, however it is turned, are looked at triangle by triangle."""
    turn = Rotation.from_euler("z", angle, degrees=True).as_matrix()[:2, :2]
    lines = np.linspace(-4e-3, 4e-3, 33), np.linspace(-5e-3, 3e-3, 13)
    points = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2) @ turn.T + (1e-3, 0.3e-3)
    mesh, reference = both(name)
    for seed in range(6):
        pose, floor = random_pose(seed), (-np.inf, 0.0)[seed % 2]
        found = mesh.heights(pose, points, floor=floor)[0]
        assert_same_heights(found, reference.heights(pose, points[:, 0], points[:, 1], floor))


@pytest.mark.parametrize(("across", "count"), [(0.8e-3, 64), (2.5e-3, 40), (9e-3, 7)])
@pytest.mark.parametrize("name", SOLIDS)
def test_heights_over_a_small_or_a_coarse_grid_are_those_of_the_reference(name, across, count):
    """Only what lies over the points is looked at: triangle by triangle, or point by point where those are few."""
    lines = np.linspace(-across / 2, across / 2, count)
    mesh, reference = both(name)
    for seed in range(4):
        middle = np.random.default_rng(seed).uniform(-3e-3, 3e-3, 2)
        points = np.stack(np.meshgrid(lines, lines), axis=-1).reshape(-1, 2) + middle
        points = points[(np.abs(points) < (PART.east, PART.north)).all(axis=1)]
        found = mesh.heights(random_pose(seed), points)[0]
        assert_same_heights(found, reference.heights(random_pose(seed), points[:, 0], points[:, 1], -np.inf))


@pytest.mark.parametrize("name", ["box", "ball", "fine_ball"])
def test_a_mesh_is_over_its_outermost_vertices(name, instruction_set):
    """Its bounds are computed by kernels, vertices elsewhere: a point that is beyond by rounding is not beside it."""
    mesh, _ = both(name)
    part = Rectangle(-30e-3, -30e-3, 30e-3, 30e-3)
    for seed in range(40):
        pose = random_pose(seed)
        vertices = pose.points(mesh.vertices)
        outermost = vertices[[pick(vertices[:, axis]) for axis in (0, 1) for pick in (np.argmin, np.argmax)]]
        # One by one, since points that are looked at together are set against all triangles near them.
        found = [mesh.heights(pose, vertex[None, :2], part=part)[0][0] for vertex in outermost]
        assert found == pytest.approx(outermost[:, 2], abs=1e-9)


def assert_heights_are_those_of_the_reference(name: str, seed: int, floor: float) -> None:
    mesh, reference = both(name)
    pose, points = random_pose(seed), points_over(PART)
    found, lowest = mesh.heights(pose, points, floor=floor)
    assert_same_heights(found, reference.heights(pose, points[:, 0], points[:, 1], floor))
    assert lowest <= found.min(initial=np.inf) + 1e-15
    if lowest > floor:
        assert lowest == pytest.approx(least_height(reference, pose, PART, floor), abs=1e-12)


@pytest.mark.parametrize("name", [name for name in SOLIDS if name != "fine_ball"])
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6), floor=st.sampled_from([-np.inf, -3e-3, 0.0]))
def test_heights_are_those_of_the_reference(name, seed, floor):
    assert_heights_are_those_of_the_reference(name, seed, floor)


@pytest.mark.parametrize(("seed", "floor"), [(1, -np.inf), (4, 0.0)])
def test_heights_of_a_fine_ball_are_those_of_the_reference(seed, floor):
    """Its 200,000 triangles are in clusters. The reference takes seconds."""
    assert_heights_are_those_of_the_reference("fine_ball", seed, floor)


@pytest.mark.parametrize("name", ["torus", "star", "ball", "grid", "fine_ball"])
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), reach=st.floats(1e-5, 3e-3), floor=st.sampled_from([-np.inf, -1e-3]))
def test_a_reach_leaves_out_only_what_is_higher(name, seed, reach, floor):
    mesh, _ = both(name)
    part = Rectangle(-3e-3, -5e-3, 4e-3, 2e-3)
    pose, points = random_pose(seed), points_over(part)
    whole, lowest = mesh.heights(pose, points, part=part, floor=floor)
    found, again = mesh.heights(pose, points, part=part, floor=floor, reach=reach)
    assert again == lowest
    # Where few triangles are left each is set against all points: the same to rounding.
    near = whole <= lowest + reach
    np.testing.assert_allclose(found[near], whole[near], rtol=0, atol=1e-15)
    assert (found[~near] > lowest + reach - 1e-15).all()


@pytest.mark.parametrize("name", SOLIDS)
def test_heights_over_another_part_are_the_same(name):
    mesh, _ = both(name)
    part = Rectangle(-2e-3, 1e-3, 3e-3, 1.5e-3)
    points = points_over(part)
    for seed in range(20):
        pose = random_pose(seed)
        whole, narrow = (mesh.heights(pose, points, part=one)[0] for one in (PART, part))
        assert whole == pytest.approx(narrow, abs=1e-13)


@pytest.mark.parametrize("name", SOLIDS)
def test_vertices_are_welded_as_trimesh_does(name):
    one = solid(name)
    expected = trimesh.Trimesh(one.vertices[one.faces].reshape(-1, 3), np.arange(3 * len(one.faces)).reshape(-1, 3))
    mesh = soup(one)
    assert len(mesh.vertices) == len(expected.vertices)
    assert len(mesh.triangles) == len(expected.faces)
    assert mesh.closed == (expected.is_watertight and expected.is_winding_consistent) == (name not in OPEN)
    assert trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).volume == pytest.approx(
        expected.volume, rel=1e-9
    )


def test_vertices_within_rounding_are_one():
    near = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 1e-2
    near[3] += 2e-9
    assert len(NativeMesh.of(near, np.arange(6)).vertices) == 4
    near[3] += 3e-8
    assert len(NativeMesh.of(near, np.arange(6)).vertices) == 5


def test_a_mesh_inside_out_is_turned():
    one = solid("star")
    mesh = NativeMesh.of(one.vertices, one.faces[:, ::-1])
    assert mesh.closed
    assert trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).volume == pytest.approx(one.volume)


def test_triangles_that_disagree_make_an_open_mesh():
    one = solid("ball")
    faces = one.faces.copy()
    faces[17] = faces[17, ::-1]
    assert not NativeMesh.of(one.vertices, faces).closed
    assert not NativeMesh.of(one.vertices, np.concatenate([one.faces, one.faces[:1]])).closed


def test_triangles_that_lose_a_corner_are_left_out_and_the_mesh_stays_closed():
    one = solid("box")
    vertices = np.concatenate([one.vertices, one.vertices[:1] + 1e-9])
    degenerate = [[0, len(one.vertices), 3], [2, 2, 5], [1, 1, 1]]
    mesh = NativeMesh.of(vertices, np.concatenate([one.faces, degenerate]))
    assert (len(mesh.triangles), mesh.closed) == (12, True)


def test_triangles_that_do_not_exist_are_left_out():
    one = solid("box")
    vertices = one.vertices.copy()
    touched = (one.faces == 3).any(axis=1)
    vertices[3, 1] = np.nan
    mesh = NativeMesh.of(vertices, np.concatenate([one.faces, [[0, 1, 900], [-1, 0, 2]]]))
    assert (len(mesh.triangles), mesh.closed) == (len(one.faces) - touched.sum(), False)
    found, lowest = mesh.heights(random_pose(3), points_over(PART))
    assert np.isfinite(found).any()
    assert np.isfinite(lowest)


@pytest.mark.parametrize("faces", [[], [[0, 0, 1]], [[0, 1, 7]]])
def test_an_empty_mesh_is_nowhere(faces):
    mesh = NativeMesh.of(np.eye(3), faces)
    found, lowest = mesh.heights(random_pose(0), points_over(PART))
    assert np.isinf(found).all()
    assert np.isinf(lowest)
    assert len(mesh.bottoms(random_pose(0))) == 0
    assert mesh.facets() == []
    assert (len(mesh.triangles), mesh.closed) == (0, False)


def test_a_part_of_no_extent_is_looked_at():
    mesh, reference = both("ball")
    pose = Pose(np.zeros(3), np.eye(3))
    for east in (1e-3, np.nextafter(1e-3, 1.0)):
        part = Rectangle(1e-3, -2e-3, east, 3e-3)
        found, lowest = mesh.heights(pose, np.array([[1e-3, 1e-3]]), part=part)
        assert found == pytest.approx(reference.heights(pose, np.array([1e-3]), np.array([1e-3]), -np.inf), abs=1e-12)
        assert lowest <= found[0]


def field(rows: int, columns: int, seed: int) -> tuple[list[float], Array]:
    draw = np.random.default_rng(seed)
    return [6e-3, 5e-3, 3e-3, 1e-3], draw.random((rows, columns)).astype(np.float32).astype(float)


def reference_field(size: list[float], data: Array) -> TriangleMesh:
    """The closed solid of a height field: its top, its flat base and walls between them."""
    rows, columns = data.shape
    x, y = np.meshgrid(np.linspace(-size[0], size[0], columns), np.linspace(-size[1], size[1], rows))
    below = rows * columns
    heights = np.concatenate([size[2] * data.ravel(), np.full(below, -size[3])])
    number = np.arange(below).reshape(rows, columns)
    here, right, up, across = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    top = np.concatenate([np.column_stack([here, right, across]), np.column_stack([here, across, up])])
    rim = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    after = np.roll(rim, -1)
    walls = np.column_stack([rim, rim + below, after + below, rim, after + below, after]).reshape(-1, 3)
    places = np.column_stack([np.tile(x.ravel(), 2), np.tile(y.ravel(), 2), heights])
    return TriangleMesh(places, np.concatenate([top, top[:, ::-1] + below, walls]))


@pytest.mark.parametrize(("rows", "columns"), [(7, 5), (2, 2), (3, 40), (60, 50)])
def test_a_height_field_is_the_reference_s_solid(rows, columns):
    size, data = field(rows, columns, 2)
    mesh, reference = NativeMesh.of_field(size, data), reference_field(size, data)
    assert mesh.closed
    assert mesh.vertices == pytest.approx(reference.vertices, abs=1e-17)

    def turned(triangles):
        """Every triangle's smallest number first, in order."""
        first = triangles.argmin(axis=1)[:, None]
        return np.unique(np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1), axis=0)

    assert np.array_equal(turned(mesh.triangles), turned(reference.triangles))
    points = points_over(PART)
    for seed in range(10):
        pose = random_pose(seed)
        expected = reference.heights(pose, points[:, 0], points[:, 1], -1e-3)
        assert mesh.heights(pose, points, floor=-1e-3)[0] == pytest.approx(expected, abs=1e-12)


def test_a_height_field_is_not_met_where_it_has_no_height():
    size, data = field(9, 9, 4)
    down = Pose(np.zeros(3), np.diag([1.0, -1.0, -1.0]))
    points = points_over(Rectangle(-5e-3, -4e-3, 5e-3, 4e-3))
    whole = NativeMesh.of_field(size, data)
    centre = 4 * 9 + 4
    rest = TriangleMesh(whole.vertices, whole.triangles[(whole.triangles != centre).all(axis=1)].astype(np.int64))
    data[4, 4] = np.nan
    found, lowest = NativeMesh.of_field(size, data).heights(down, points, floor=-0.1)
    expected = rest.heights(down, points[:, 0], points[:, 1], -0.1)
    assert np.isinf(expected).any()
    assert found == pytest.approx(expected, abs=1e-12)
    assert np.isfinite(lowest)


def test_a_height_field_of_one_row_is_empty():
    assert len(NativeMesh.of_field([1e-3, 1e-3, 1e-3, 1e-3], np.zeros((1, 5))).triangles) == 0


@pytest.mark.parametrize("name", ["box", "torus", "star", "ball", "cone", "annulus", "grid", "fine_ball"])
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_lowest_of_all_is_among_the_bottoms(name, seed):
    mesh, _ = both(name)
    part, pose = Rectangle(-5e-3, -4e-3, 6e-3, 3e-3), random_pose(seed)
    _, lowest = mesh.heights(pose, points_over(part), part=part)
    bottoms = mesh.bottoms(pose, part=part, reach=1e-3)
    assert bottoms[:, 2].min(initial=np.inf) == pytest.approx(lowest, abs=2e-12)
    assert (bottoms[:, 2] <= lowest + 1e-3).all()
    over = mesh.heights(pose, bottoms[:, :2], part=part)[0]
    assert (over >= bottoms[:, 2] - 1e-7).all()


@pytest.mark.parametrize("subdivisions", [2, 5])
def test_every_foot_is_among_the_bottoms(subdivisions):
    """The finer feet have 100,000 triangles, most of which are not looked at."""
    places = 1e-3 * np.array([[-6, -6, 0], [6, -5, 0.02], [5, 6, 0.01], [-6, 5, 0.03], [0.4, 0.2, 0.3]])
    feet = [trimesh.creation.icosphere(subdivisions, radius=0.4e-3).apply_translation(place) for place in places]
    mesh = soup(joined(feet))
    bottoms = mesh.bottoms(Pose(np.zeros(3), np.eye(3)))
    for place in places:
        apart = np.abs(bottoms - (place - (0.0, 0.0, 0.4e-3))).max(axis=1)
        assert apart.min() <= ROUNDING
    assert len(bottoms) == len(places)


def test_a_slope_that_is_cut_at_the_rim_has_its_bottom_there():
    lean = Rotation.from_euler("y", 0.1).as_matrix()
    mesh = soup(trimesh.creation.box((0.1, 4e-3, 4e-3)))
    bottoms = mesh.bottoms(Pose(np.array([0.0, 0.0, 5e-3]), lean))
    assert bottoms[:, 0] == pytest.approx(np.full(len(bottoms), PART.east))
    assert np.ptp(bottoms[:, 2]) <= 1e-9
    assert mesh.heights(Pose(np.array([0.0, 0.0, 5e-3]), lean), bottoms[:1, :2])[0] == pytest.approx(
        bottoms[:1, 2], abs=1e-12
    )


def reach_of(vertices: Array, facet: Facet) -> float:
    return float((vertices @ facet.normal).max() - facet.offset)


def flat_area(facet: Facet) -> float:
    """Within its outer loops, its holes left out [m^2]; loops must not cross themselves."""
    across = np.linalg.svd(facet.normal[None])[2][1:]
    if np.linalg.det(np.vstack([across, facet.normal])) < 0.0:
        across = across[::-1]
    rings = [shapely.LinearRing(loop @ across.T) for loop in facet.loops]
    assert all(ring.is_simple for ring in rings)
    return sum(Polygon(ring).area if ring.is_ccw else -Polygon(ring).area for ring in rings)


#: Of each solid: facets on which it can lie, loops of the largest, and corners of that.
EXPECTED = {
    "box": (6, 1, 4),
    "star": (2, 1, 10),
    "cone": (41, 1, 40),
    "annulus": (52, 2, 100),
    "torus": (0, 0, 0),
}


@pytest.mark.parametrize("name", EXPECTED)
@pytest.mark.parametrize("turn", [None, 5])
def test_facets_are_those_of_trimesh_on_which_a_body_can_lie(name, turn):
    one = solid(name).copy()
    if turn is not None:
        one.vertices = (one.vertices @ random_pose(turn).rotation.T).astype(np.float32)
    mesh = soup(one)
    facets = mesh.facets()
    number, loops, corners = EXPECTED[name]
    if name == "torus":
        # Rings of triangles near its top and bottom are shallow cones: nothing of it is flat.
        assert [facet for facet in facets if facet.area > 0.01 * one.area] == []
        return
    assert len(facets) == number
    assert len(facets[0].loops) == loops
    assert sum(len(loop) for loop in facets[0].loops) == corners
    one.merge_vertices()
    for facet in facets:
        alike = one.facets_normal @ facet.normal > 1.0 - 1e-6
        alike &= np.abs((one.facets_origin * one.facets_normal).sum(axis=1) - facet.offset) < 1e-6
        areas = one.facets_area[alike]
        if not alike.any():  # trimesh calls no single triangle a facet
            alone = one.face_normals @ facet.normal > 1.0 - 1e-6
            areas = one.area_faces[alone]
        assert areas.sum() == pytest.approx(facet.area, rel=1e-5)
        assert flat_area(facet) == pytest.approx(facet.area, rel=1e-6)
        assert reach_of(one.vertices, facet) <= GAP
        assert np.linalg.norm(facet.normal) == pytest.approx(1.0, abs=1e-12)
        for loop in facet.loops:
            assert np.abs(loop @ facet.normal - facet.offset).max() <= 10 * ROUNDING


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(4, 25))
def test_every_face_of_a_convex_body_is_a_facet(seed, count):
    hull = trimesh.convex.convex_hull(8e-3 * np.random.default_rng(seed).normal(size=(count, 3)))
    # Faces that lie in one plane to a micrometre are one facet: slivers, and those that hardly bend.
    longest = hull.edges_unique_length.max()
    assume(2.0 * hull.area_faces.min() / longest > 2e-5 and hull.face_adjacency_angles.min() > 2e-2)
    mesh = soup(hull)
    facets = mesh.facets()
    # Whether one at the limit is looked at is a matter of rounding.
    areas, least = hull.area_faces, 2e-3 * hull.area
    assert (areas >= 1.001 * least).sum() <= len(facets) <= (areas >= 0.999 * least).sum()
    assert areas[areas >= 1.001 * least].sum() * (1 - 1e-6) <= sum(facet.area for facet in facets)
    assert sum(facet.area for facet in facets) <= areas[areas >= 0.999 * least].sum() * (1 + 1e-6)


def test_a_fine_face_is_one_facet_with_four_corners():
    one = trimesh.creation.box((14e-3, 10e-3, 3e-3))
    for _ in range(5):
        one = one.subdivide()
    one.vertices = one.vertices @ random_pose(1).rotation.T
    facets = soup(one).facets()
    assert [len(facet.loops) for facet in facets] == [1] * 6
    assert [len(facet.loops[0]) for facet in facets] == [4] * 6
    assert facets[0].area == pytest.approx(140e-6, rel=1e-6)


def test_feet_of_one_plane_are_one_facet_and_higher_ones_none():
    feet = []
    for x, y, height in [(-5, -5, 0.0), (5, -5, 0.0), (5, 5, 0.0), (-5, 5, 0.2)]:
        foot = trimesh.creation.cylinder(1e-3, 4e-3, sections=24)
        feet.append(foot.apply_translation((x * 1e-3, y * 1e-3, height * 1e-3)))
    mesh = soup(joined(feet))
    down = [facet for facet in mesh.facets() if facet.normal[2] < -0.99]
    assert [len(facet.loops) for facet in down] == [3]
    assert down[0].area == pytest.approx(3 * 12 * np.sin(2 * np.pi / 24) * 1e-6, rel=1e-5)
    # A gap as large as the fourth is high lets it lie on that one too.
    down = [facet for facet in mesh.facets(gap=0.25e-3) if facet.normal[2] < -0.99]
    assert [len(facet.loops) for facet in down] == [3, 1]


def test_feet_that_lean_by_rounding_are_one_facet():
    draw, feet = np.random.default_rng(0), []
    for x, y in [(-5, -5), (5, -5), (5, 5), (-5, 5)]:
        foot = trimesh.creation.box((2e-3, 2e-3, 4e-3))
        foot.apply_transform(trimesh.transformations.euler_matrix(*draw.uniform(-1e-5, 1e-5, 3)))
        feet.append(foot.apply_translation((x * 1e-3, y * 1e-3, draw.uniform(-1e-7, 1e-7))))
    facets = soup(joined(feet)).facets()
    assert len(facets) == 6
    assert sorted(len(facet.loops) for facet in facets) == [2, 2, 2, 2, 4, 4]


def test_feet_of_2_um_apart_are_two_facets():
    feet = [trimesh.creation.box((6e-3, 6e-3, 4e-3)) for _ in range(2)]
    feet[0].apply_translation((-25e-3, 0.0, 2e-6))
    feet[1].apply_translation((25e-3, 0.0, 0.0))
    assert [len(facet.loops) for facet in soup(joined(feet)).facets() if facet.normal[2] < -0.99] == [1, 1]


def test_squares_that_meet_at_a_corner_are_two_loops():
    boxes = [trimesh.creation.box((2e-3, 2e-3, 1e-3)).apply_translation((s * 1e-3, s * 1e-3, 0)) for s in (-1, 1)]
    mesh = soup(joined(boxes))
    assert not mesh.closed  # four triangles at one edge
    bottom = next(facet for facet in mesh.facets() if facet.normal[2] < -0.99)
    assert [len(loop) for loop in bottom.loops] == [4, 4]
    assert bottom.area == pytest.approx(8e-6, rel=1e-6)


def test_a_lens_is_not_flat():
    # Of 1 m radius: over 4 mm it rises by 8 um.
    disc = trimesh.creation.cylinder(4e-3, 1e-3, sections=90)
    for _ in range(3):
        disc = disc.subdivide()
    vertices = np.array(disc.vertices)
    vertices[:, 2] += (vertices[:, :2] ** 2).sum(axis=1) / 2 * np.where(vertices[:, 2] < 0.0, 1.0, 0.0)
    facets = soup(trimesh.Trimesh(vertices, disc.faces, process=False)).facets()
    below = [facet for facet in facets if facet.normal[2] < -0.9]
    above = [facet for facet in facets if facet.normal[2] > 0.9]
    assert sum(facet.area for facet in below) < 0.1 * above[0].area
    assert above[0].area == pytest.approx(np.pi * 16e-6, rel=2e-3)


def test_both_sides_of_an_open_sheet_are_facets():
    sheet = NativeMesh.of(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 1e-2, [[0, 1, 2], [0, 2, 3]])
    facets = sheet.facets()
    assert sorted(facet.normal[2] for facet in facets) == pytest.approx([-1.0, 1.0])
    for facet in facets:
        assert facet.area == pytest.approx(1e-4, rel=1e-6)
        corners = facet.loops[0]
        assert np.cross(corners[1] - corners[0], corners[2] - corners[1]) @ facet.normal > 0.0
