// Flat facets of a triangle mesh, on which it can lie, and their outlines.
#pragma once

#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace mjtactile {

// The largest flat facets on which a mesh can lie, by falling area. No part of the mesh reaches beyond the plane of a
// facet by more than `gap` [m]. Triangles lie in one plane if they agree to 1 um or 1e-4 of the mesh's size, whichever
// is less, and to 1e-4 rad. Both sides of an open mesh count.
std::vector<Facet> flat_facets(const TriangleMesh& mesh, double gap);

}  // namespace mjtactile
