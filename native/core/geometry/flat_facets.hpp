// Flat facets of a triangle mesh on which it can lie, each with its outline.
#pragma once

#include <array>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace mjtactile {

// Triangles of one plane, connected or not, in the mesh's frame.
struct Facet {
  double normal[3];  // unit, outward
  double offset;     // of the plane along it [m]
  // Corners of its outlines [m], none on the line between its neighbours: counter-clockwise around area, clockwise
  // around holes, as seen from outside. Loops may touch each other, and themselves, at corners.
  std::vector<std::vector<std::array<double, 3>>> loops;
  double area;       // within the loops, holes left out [m^2]
};

// The largest flat facets that nothing of the mesh reaches beyond by more than a gap [m], by falling area: at most
// `most`, each with at least a share of the mesh's surface. Flat is what lies in one plane to 1 um or 1e-4 of the
// mesh's size, whichever is less, and 1e-4 rad. Of an open mesh both sides count.
std::vector<Facet> flat_facets(const TriangleMesh& mesh, double gap, std::size_t most = 64, double least_share = 2e-3);

}  // namespace mjtactile
