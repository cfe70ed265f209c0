// Flat facets of a triangle mesh, on which it can lie, and their outlines.
#pragma once

#include <array>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace mjtactile {

// The triangles that lie in one plane, connected or not, in the mesh's frame.
struct Facet {
  double normal[3];  // outward unit normal
  double offset;     // of the plane along its normal [m]
  // Corners of the outlines [m]. Seen from outside, loops run counter-clockwise around area and clockwise around holes.
  // No corner lies on the line between its neighbours. Loops may touch each other, and themselves, at corners.
  std::vector<std::vector<std::array<double, 3>>> loops;
  double area;       // within the loops, without holes [m^2]
};

// The largest flat facets on which a mesh can lie, by falling area. No part of the mesh reaches beyond the plane of a
// facet by more than `gap` [m]. At most `most` facets are returned, each with at least the fraction `least_share` of
// the mesh's surface. Triangles lie in one plane if they agree to 1 um or 1e-4 of the mesh's size, whichever is less,
// and to 1e-4 rad. Both sides of an open mesh count.
std::vector<Facet> flat_facets(const TriangleMesh& mesh, double gap, std::size_t most = 64, double least_share = 2e-3);

}  // namespace mjtactile
