#include "geometry/triangle_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "geometry/hash.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// Vertices that agree to this are welded [m]; the same value as tol.merge of trimesh.
constexpr double kWeld = 1e-8;
// Boxes with at most this many triangles are not halved.
constexpr std::uint32_t kLeaf = 4;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

using Key = std::array<double, 3>;

// A hash table with open addressing that numbers points, equal ones alike. It is at most half full.
class Welder {
 public:
  explicit Welder(std::size_t most) {
    std::size_t slots = 16;
    while (slots < 2 * most) slots *= 2;
    slots_.assign(slots, -1);
  }

  // The number of a point. A new point gets the number `count`.
  std::int32_t number(const Key& key, std::int32_t count) {
    std::size_t at = mixed(0, key.data(), sizeof key) & (slots_.size() - 1);
    while (slots_[at] >= 0 && keys_[static_cast<std::size_t>(slots_[at])] != key) at = (at + 1) & (slots_.size() - 1);
    if (slots_[at] < 0) slots_[at] = count, keys_.push_back(key);
    return slots_[at];
  }

 private:
  std::vector<std::int32_t> slots_;
  std::vector<Key> keys_;
};

bool is_closed(const std::vector<std::int32_t>& faces, std::size_t vertices) {
  const std::vector<MeshEdge> edges = mesh_edges(faces, vertices);
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    if (i + 1 == edges.size()) return false;
    if (!edges[i].joins_as(edges[i + 1]) || edges[i].upward == edges[i + 1].upward) return false;
    if (i + 2 < edges.size() && edges[i].joins_as(edges[i + 2])) return false;
  }
  return !edges.empty();
}

// Six times the volume [m^3].
double volume(const std::vector<double>& vertices, const std::vector<std::int32_t>& faces) {
  double sum = 0.0;
  const double* origin = vertices.data() + 3 * static_cast<std::size_t>(faces[0]);
  for (std::size_t f = 0; f < faces.size(); f += 3) {
    double corner[3][3], product[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const double* vertex = vertices.data() + 3 * static_cast<std::size_t>(faces[f + k]);
      for (std::size_t i = 0; i < 3; ++i) corner[k][i] = vertex[i] - origin[i];
    }
    cross(corner[0], corner[1], product);
    sum += dot(product, corner[2]);
  }
  return sum;
}

struct Centre {
  float at[3];
  std::uint32_t triangle;
};

// Make the tree of boxes: halve the triangles at the median along their longest extent, recursively.
void halve(std::vector<Centre>& centres, std::uint32_t first, std::uint32_t count, std::vector<MeshBox>& boxes) {
  const std::size_t here = boxes.size();
  boxes.push_back({});
  boxes[here].first = first, boxes[here].count = count, boxes[here].second = 0;
  if (count <= kLeaf) return;
  float low[3], high[3];
  std::copy(centres[first].at, centres[first].at + 3, low);
  std::copy(centres[first].at, centres[first].at + 3, high);
  for (std::uint32_t t = first; t < first + count; ++t) {
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], centres[t].at[i]);
      high[i] = std::max(high[i], centres[t].at[i]);
    }
  }
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (high[i] - low[i] > high[axis] - low[axis]) axis = i;
  }
  const std::uint32_t half = count / 2;
  const auto begin = centres.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [axis](const Centre& a, const Centre& b) {
    return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.triangle < b.triangle;
  });
  halve(centres, first, half, boxes);
  boxes[here].second = static_cast<std::uint32_t>(boxes.size());
  halve(centres, first + half, count - half, boxes);
}

// Unit normals are rounded to single precision, so their bounds are widened by this.
constexpr float kNormalRounding = 1e-6F;
constexpr NormalBounds kNoNormal = {{2.0F, 2.0F, 2.0F}, {-2.0F, -2.0F, -2.0F}};
constexpr NormalBounds kAnyNormal = {{-2.0F, -2.0F, -2.0F}, {2.0F, 2.0F, 2.0F}};

NormalBounds around(const NormalBounds& a, const NormalBounds& b) {
  NormalBounds both;
  for (int i = 0; i < 3; ++i) {
    both.least[i] = std::min(a.least[i], b.least[i]);
    both.most[i] = std::max(a.most[i], b.most[i]);
  }
  return both;
}

// Bounds of a triangle's normal. A triangle without area has none, and that of one with a corner that is not finite is
// not known.
NormalBounds normal_of(const TriangleMesh& mesh, std::size_t triangle) {
  const double* corner[3];
  for (std::size_t k = 0; k < 3; ++k) corner[k] = mesh.corner(triangle, k);
  double a[3], b[3], normal[3];
  for (int i = 0; i < 3; ++i) a[i] = corner[1][i] - corner[0][i], b[i] = corner[2][i] - corner[0][i];
  cross(a, b, normal);
  const double size = std::sqrt(dot(normal, normal));
  if (!std::isfinite(size)) return kAnyNormal;
  NormalBounds bounds = kNoNormal;
  for (int i = 0; size > 0.0 && i < 3; ++i) {
    const auto unit = static_cast<float>(normal[i] / size);
    bounds.least[i] = unit - kNormalRounding, bounds.most[i] = unit + kNormalRounding;
  }
  return bounds;
}

// List the triangles around each vertex.
void list_rings(TriangleMesh& mesh) {
  mesh.ring_starts.assign(mesh.vertices.size() / 3 + 1, 0);
  for (const std::int32_t vertex : mesh.faces) ++mesh.ring_starts[static_cast<std::size_t>(vertex) + 1];
  std::partial_sum(mesh.ring_starts.begin(), mesh.ring_starts.end(), mesh.ring_starts.begin());
  mesh.rings.resize(mesh.faces.size());
  std::vector<std::uint32_t> fill(mesh.ring_starts.begin(), mesh.ring_starts.end() - 1);
  for (std::size_t corner = 0; corner < mesh.faces.size(); ++corner) {
    mesh.rings[fill[static_cast<std::size_t>(mesh.faces[corner])]++] = static_cast<std::uint32_t>(corner / 3);
  }
  mesh.ring_normals.resize(mesh.vertices.size() / 3);
}

// Set all bounds from the present vertices. Corners that are not finite are ignored.
void fit_boxes(TriangleMesh& mesh) {
  std::fill(mesh.ring_normals.begin(), mesh.ring_normals.end(), kNoNormal);
  for (std::size_t t = 0; t < mesh.faces.size() / 3; ++t) {
    const NormalBounds normal = normal_of(mesh, t);
    for (std::size_t k = 0; k < 3; ++k) {
      NormalBounds& ring = mesh.ring_normals[mesh.vertex(t, k)];
      ring = around(ring, normal);
    }
  }
  for (std::size_t b = mesh.boxes.size(); b-- > 0;) {
    MeshBox& box = mesh.boxes[b];
    std::fill(box.low, box.low + 3, kInfinite);
    std::fill(box.high, box.high + 3, -kInfinite);
    box.normals = box.ring_normals = kNoNormal;
    if (box.second != 0) {
      for (const MeshBox* half : {&mesh.boxes[b + 1], &mesh.boxes[box.second]}) {
        for (int i = 0; i < 3; ++i) {
          box.low[i] = std::min(box.low[i], half->low[i]);
          box.high[i] = std::max(box.high[i], half->high[i]);
        }
        box.normals = around(box.normals, half->normals);
        box.ring_normals = around(box.ring_normals, half->ring_normals);
      }
      continue;
    }
    for (std::size_t t = box.first; t < box.first + box.count; ++t) {
      box.normals = around(box.normals, normal_of(mesh, t));
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t vertex = mesh.vertex(t, k);
        box.ring_normals = around(box.ring_normals, mesh.ring_normals[vertex]);
        for (std::size_t i = 0; i < 3; ++i) {
          const double at = mesh.vertices[3 * vertex + i];
          if (at < box.low[i]) box.low[i] = at;
          if (at > box.high[i]) box.high[i] = at;
        }
      }
    }
  }
}

// Order vertices by their first use in the triangles, so that those of one box are near each other in memory.
void sort_vertices(TriangleMesh& mesh) {
  std::vector<std::int32_t> number(mesh.vertices.size() / 3, -1);
  std::vector<double> sorted;
  sorted.reserve(mesh.vertices.size());
  for (std::int32_t& corner : mesh.faces) {
    std::int32_t& known = number[static_cast<std::size_t>(corner)];
    if (known < 0) {
      known = static_cast<std::int32_t>(sorted.size() / 3);
      const double* at = mesh.vertices.data() + 3 * static_cast<std::size_t>(corner);
      sorted.insert(sorted.end(), at, at + 3);
    }
    corner = known;
  }
  mesh.vertices = std::move(sorted);
}

// The triangles in the order of the boxes, and the tree of boxes without bounds.
TriangleMesh in_boxes(std::vector<double> vertices, const std::vector<std::int32_t>& faces, bool closed) {
  TriangleMesh mesh;
  mesh.vertices = std::move(vertices);
  mesh.closed = closed;
  if (faces.empty()) return mesh;
  const auto count = static_cast<std::uint32_t>(faces.size() / 3);
  std::vector<Centre> centres(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    centres[t].triangle = t;
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        sum += mesh.vertices[3 * static_cast<std::size_t>(faces[3 * std::size_t{t} + k]) + i];
      }
      const auto middle = static_cast<float>(sum / 3.0);
      centres[t].at[i] = std::isfinite(middle) ? middle : 0.0F;  // numbers that are not finite cannot be sorted
    }
  }
  mesh.boxes.reserve(count);
  halve(centres, 0, count, mesh.boxes);
  mesh.faces.resize(faces.size());
  for (std::size_t t = 0; t < count; ++t) {
    const auto from = faces.begin() + 3 * static_cast<std::ptrdiff_t>(centres[t].triangle);
    std::copy(from, from + 3, mesh.faces.begin() + 3 * static_cast<std::ptrdiff_t>(t));
  }
  return mesh;
}

// Set the heights of a height field's vertices, and all bounds.
void set_heights(TriangleMesh& field, std::size_t rows, std::size_t columns, const double size[4], const float* data) {
  const std::size_t below = rows * columns;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t at = row * columns + column;
      double* top = field.vertices.data() + 3 * at;
      double* base = field.vertices.data() + 3 * (at + below);
      const auto along = [](double half, std::size_t place, std::size_t count) {
        if (place + 1 == count) return half;
        return -half + 2.0 * half * (static_cast<double>(place) / static_cast<double>(count - 1));
      };
      top[0] = base[0] = along(size[0], column, columns);
      top[1] = base[1] = along(size[1], row, rows);
      top[2] = size[2] * static_cast<double>(data[at]);
      base[2] = -size[3];
    }
  }
  fit_boxes(field);
}

}  // namespace

double NormalBounds::least_along(const double* direction) const {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += std::min(direction[i] * double{least[i]}, direction[i] * double{most[i]});
  return sum;
}

double NormalBounds::most_along(const double* direction) const {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += std::max(direction[i] * double{least[i]}, direction[i] * double{most[i]});
  return sum;
}

std::vector<MeshEdge> mesh_edges(const std::vector<std::int32_t>& faces, std::size_t vertices) {
  const auto each = [&faces](auto&& visit) {
    for (std::size_t f = 0; f < faces.size(); f += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t from = faces[f + k], to = faces[f + (k + 1) % 3];
        visit(MeshEdge{std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(f + k), from < to});
      }
    }
  };
  std::vector<std::uint32_t> starts(vertices + 1, 0);
  each([&](const MeshEdge& edge) { ++starts[static_cast<std::size_t>(edge.low) + 1]; });
  for (std::size_t v = 0; v < vertices; ++v) starts[v + 1] += starts[v];
  std::vector<MeshEdge> edges(faces.size());
  std::vector<std::uint32_t> fill(starts.begin(), starts.end() - 1);
  each([&](const MeshEdge& edge) { edges[fill[static_cast<std::size_t>(edge.low)]++] = edge; });
  for (std::size_t v = 0; v < vertices; ++v) {
    std::sort(edges.begin() + starts[v], edges.begin() + starts[v + 1], [](const MeshEdge& a, const MeshEdge& b) {
      return a.high != b.high ? a.high < b.high : a.start < b.start;
    });
  }
  return edges;
}

TriangleMesh make_mesh(const float* vertices, std::size_t count, const std::int32_t* faces, std::size_t triangles) {
  std::vector<double> welded;
  std::vector<std::int32_t> number(count, -1), kept;
  Welder welder(count);
  kept.reserve(3 * triangles);
  const auto usable = [&](std::int32_t vertex) {
    if (vertex < 0 || static_cast<std::size_t>(vertex) >= count) return false;
    const float* at = vertices + 3 * static_cast<std::size_t>(vertex);
    return std::isfinite(at[0]) && std::isfinite(at[1]) && std::isfinite(at[2]);
  };
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::int32_t* given = faces + 3 * t;
    if (!usable(given[0]) || !usable(given[1]) || !usable(given[2])) continue;
    std::int32_t corners[3];
    for (int k = 0; k < 3; ++k) {
      std::int32_t& known = number[static_cast<std::size_t>(given[k])];
      if (known < 0) {
        const float* at = vertices + 3 * static_cast<std::size_t>(given[k]);
        Key key;
        for (std::size_t i = 0; i < 3; ++i) key[i] = std::round(static_cast<double>(at[i]) / kWeld) + 0.0;  // no -0
        const auto next = static_cast<std::int32_t>(welded.size() / 3);
        known = welder.number(key, next);
        if (known == next) welded.insert(welded.end(), at, at + 3);
      }
      corners[k] = known;
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    kept.insert(kept.end(), corners, corners + 3);
  }
  const bool closed = is_closed(kept, welded.size() / 3);
  if (closed && volume(welded, kept) < 0.0) {
    for (std::size_t f = 0; f < kept.size(); f += 3) std::swap(kept[f + 1], kept[f + 2]);
  }
  TriangleMesh mesh = in_boxes(std::move(welded), kept, closed);
  sort_vertices(mesh);
  list_rings(mesh);
  fit_boxes(mesh);
  return mesh;
}

TriangleMesh make_height_field(std::size_t rows, std::size_t columns, const double size[4], const float* data) {
  if (rows < 2 || columns < 2) return {};
  const std::size_t below = rows * columns;
  std::vector<std::int32_t> faces;
  faces.reserve(12 * (rows - 1) * (columns - 1) + 12 * (rows + columns));
  const auto add = [&faces](std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t one : {a, b, c}) faces.push_back(static_cast<std::int32_t>(one));
  };
  for (std::size_t row = 0; row + 1 < rows; ++row) {
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      const std::size_t here = row * columns + column, right = here + 1, up = here + columns, across = up + 1;
      add(here, right, across), add(here, across, up);
      add(across + below, right + below, here + below), add(up + below, across + below, here + below);
    }
  }
  std::vector<std::size_t> rim;
  for (std::size_t column = 0; column + 1 < columns; ++column) rim.push_back(column);
  for (std::size_t row = 0; row + 1 < rows; ++row) rim.push_back(row * columns + columns - 1);
  for (std::size_t column = columns - 1; column > 0; --column) rim.push_back((rows - 1) * columns + column);
  for (std::size_t row = rows - 1; row > 0; --row) rim.push_back(row * columns);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const std::size_t here = rim[i], after = rim[(i + 1) % rim.size()];
    add(here, here + below, after + below), add(here, after + below, after);
  }
  // The tree is made for a flat field, because heights need not be finite.
  TriangleMesh flat;
  flat.vertices.resize(6 * below);
  const std::vector<float> level(below, 0.0F);
  set_heights(flat, rows, columns, size, level.data());
  TriangleMesh mesh = in_boxes(std::move(flat.vertices), faces, true);
  list_rings(mesh);
  set_heights(mesh, rows, columns, size, data);
  return mesh;
}

}  // namespace mjtactile
