// Rigid triangle meshes, made from single-precision arrays, with a tree of bounding boxes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mjtactile {

// Bounds of unit normals, slightly widened because of rounding. They are in the mesh's frame.
struct NormalBounds {
  float least[3], most[3];

  // Bounds of a normal's component along a direction.
  double least_along(const double* direction) const;
  double most_along(const double* direction) const;
};

// A bounding box of some of a mesh's triangles, in the mesh's frame. A box may have two halves. The first half is the
// next box of the list, and the second is at `second`.
struct MeshBox {
  double low[3], high[3];       // bounds of the triangles' corners [m]
  NormalBounds normals;         // of its triangles
  NormalBounds ring_normals;    // of all triangles of the mesh that share a corner with one of its triangles
  std::uint32_t first, count;   // its triangles: `count` ones from number `first`
  std::uint32_t second;         // 0 if the box has no halves

  // Least coordinate that it may have along a direction [m].
  double least_along(const double* direction) const {
    double least = 0.0;
    for (int i = 0; i < 3; ++i) least += std::min(direction[i] * low[i], direction[i] * high[i]);
    return least;
  }
};

// The triangles that lie in one plane, connected or not, in the mesh's frame.
struct Facet {
  double normal[3];  // outward unit normal
  double offset;     // of the plane along its normal [m]
  // Corners of the outlines [m]. Seen from outside, loops run counter-clockwise around area and clockwise around holes.
  // No corner lies on the line between its neighbours. Loops may touch each other, and themselves, at corners.
  std::vector<std::vector<std::array<double, 3>>> loops;
  double area;       // within the loops, without holes [m^2]
};

// A rigid triangle mesh in its own frame. It is immutable once made, and shared. Both sides of the triangles of an open
// mesh count.
struct TriangleMesh {
  std::vector<double> vertices;      // (count, 3) [m]
  std::vector<std::int32_t> faces;   // (count, 3), counter-clockwise from outside, in the order of the boxes
  bool closed = false;
  std::vector<MeshBox> boxes;        // the first holds all triangles; an empty mesh has none
  // The triangles around vertex v are rings[ring_starts[v]] to before rings[ring_starts[v + 1]].
  std::vector<std::uint32_t> ring_starts, rings;
  std::vector<NormalBounds> ring_normals;   // of the triangles around each vertex
  std::vector<Facet> facets;                // on which a body can lie; none before flat_facets() finds them

  // The vertex at a triangle's corner, and the position of a vertex or of a corner (3) [m].
  std::size_t vertex(std::size_t triangle, std::size_t corner) const {
    return static_cast<std::size_t>(faces[3 * triangle + corner]);
  }
  const double* at(std::size_t vertex) const { return vertices.data() + 3 * vertex; }
  const double* corner(std::size_t triangle, std::size_t corner) const { return at(vertex(triangle, corner)); }

  // Look for a box of at most `most` triangles, or without halves, for which found(box) is true. Only boxes for which
  // enters(box) is true are searched, and it is asked before found(). Returns whether there is one.
  template <typename Enters, typename Found>
  bool any_box(Enters&& enters, Found&& found, std::size_t most = 0) const {
    std::uint32_t open[64] = {0};   // more than there can be: the tree halves its triangles, and is 33 deep at most
    std::size_t count = boxes.empty() ? 0 : 1;
    while (count > 0) {
      const std::uint32_t number = open[--count];
      const MeshBox& box = boxes[number];
      if (!enters(box)) continue;
      if (box.second != 0 && box.count > most) {
        open[count++] = box.second, open[count++] = number + 1;
      } else if (found(box)) {
        return true;
      }
    }
    return false;
  }
};

// An edge of a triangle. `low` and `high` are its vertices, the lower number first.
struct MeshEdge {
  std::int32_t low, high;
  std::uint32_t start;   // corner at which the triangle's edge starts: 3 times the triangle's number, plus 0, 1 or 2
  bool upward;           // whether the triangle passes the edge from low to high

  bool joins_as(const MeshEdge& other) const { return low == other.low && high == other.high; }
};

// The edges of all triangles. Edges between the same two vertices follow each other.
std::vector<MeshEdge> mesh_edges(const std::vector<std::int32_t>& faces, std::size_t vertices);

// A mesh of vertices (count, 3) [m] and triangles (triangles, 3). Vertices that agree to 1e-8 m are welded. Triangles
// that lose a corner by that are left out, as are those with a corner that is not finite or does not exist. The mesh is
// closed if every edge belongs to two triangles that pass it in opposite directions. If the triangles of a closed mesh
// are clockwise from outside, they are reversed.
TriangleMesh make_mesh(const float* vertices, std::size_t count, const std::int32_t* faces, std::size_t triangles);

// A height field as a closed solid, as MuJoCo collides it. `size`: half lengths along x and y, height of data 1, and
// depth of the base below height 0 [m]. `data`: (rows, columns), along y and x [-]. The mesh is empty with fewer than
// two rows or columns. Where data is not finite, the solid has no surface.
TriangleMesh make_height_field(std::size_t rows, std::size_t columns, const double size[4], const float* data);

}  // namespace mjtactile
