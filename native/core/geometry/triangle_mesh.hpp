// Rigid triangle meshes, made from single-precision arrays, with a tree of bounding boxes.
#pragma once

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
};

// An edge of a triangle. `low` and `high` are its vertices, the lower number first.
struct MeshEdge {
  std::int32_t low, high;
  std::uint32_t start;   // corner at which the triangle's edge starts: 3 times the triangle's number, plus 0, 1 or 2
  bool upward;           // whether the triangle passes the edge from low to high
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
