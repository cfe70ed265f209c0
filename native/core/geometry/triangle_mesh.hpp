// Rigid triangle meshes: how they are made from single-precision arrays, and the boxes by which they are searched.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mjtactile {

// A box around some of a mesh's triangles, in the mesh's frame. The two halves of one that is halved follow it in the
// list: the first at once, the second at `second`.
struct MeshBox {
  double low[3], high[3];                  // of the triangles' corners [m]
  float least_normal[3], most_normal[3];   // of the triangles' unit normals, a little wider
  std::uint32_t first, count;              // its triangles, one after the other
  std::uint32_t second;                    // 0 where it is not halved
};

// A rigid triangle mesh in its own frame. Immutable once made, shared. Of an open mesh both sides of each triangle
// count.
struct TriangleMesh {
  std::vector<double> vertices;      // (count, 3) [m]
  std::vector<std::int32_t> faces;   // (count, 3), counter-clockwise from outside, in the order of the boxes
  bool closed = false;
  std::vector<MeshBox> boxes;        // the first holds all; none of an empty mesh
  std::size_t dropped = 0;           // triangles left out because a corner is not finite or does not exist
};

// An edge of a triangle, named by its vertices in the order of their numbers.
struct MeshEdge {
  std::int32_t low, high;
  std::uint32_t start;   // the triangle's corner it starts at: 3 times the triangle's number, and 0, 1 or 2
  bool upward;           // whether the triangle passes it from low to high
};

// Every triangle's edges, those of the same two vertices one after the other.
std::vector<MeshEdge> mesh_edges(const std::vector<std::int32_t>& faces, std::size_t vertices);

// A mesh of vertices and triangles that are taken as they are, but for the triangles' order.
TriangleMesh indexed_mesh(std::vector<double> vertices, std::vector<std::int32_t> faces, bool closed);

// A mesh of vertices (count, 3) [m] and triangles (triangles, 3). Vertices that agree to 1e-8 m are welded, triangles
// that lose a corner by that are left out, as are those whose corners are not finite or do not exist (see `dropped`).
// It is closed where every edge belongs to two triangles that pass it in opposite directions; a closed mesh whose
// triangles are clockwise from outside is turned inside out.
TriangleMesh make_mesh(const float* vertices, std::size_t count, const std::int32_t* faces, std::size_t triangles);

// A height field as the closed solid MuJoCo collides. Size: half lengths along x and y, height of data 1, depth of the
// base below height 0 [m]. Data: (rows, columns), along y and x. Empty where there are less than two rows or columns;
// where data is not finite nothing is met.
TriangleMesh make_height_field(std::size_t rows, std::size_t columns, const double size[4], const float* data);
// Give a height field of as many rows and columns other heights or another size, without allocation.
void set_heights(TriangleMesh& field, std::size_t rows, std::size_t columns, const double size[4], const float* data);

}  // namespace mjtactile
