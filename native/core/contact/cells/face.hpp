// A flat face of a rigid body, divided into contact cells, and its placement on a pad.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "contact/cells/lean.hpp"
#include "geometry/pose.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

// An edge between two cells or between a cell and the outside, directed from start to end [m].
struct CellEdge {
  Point start, end;
  std::int32_t left, right;  // cells to its left and right, -1 for none

  // Traction on the left minus traction on the right (3) [Pa], from the cells' tractions (cells, 3). False if it is
  // zero.
  bool step(const std::vector<double>& tractions, double* step) const;
};

// Visit the cells beside an edge: visit(cell, sign) with the sign 1 on its left and -1 on its right.
template <typename Visit>
void each_side(const CellEdge& edge, Visit&& visit) {
  if (edge.left >= 0) visit(static_cast<std::size_t>(edge.left), 1.0);
  if (edge.right >= 0) visit(static_cast<std::size_t>(edge.right), -1.0);
}

// Add an edge, unless its ends are equal.
void add_edge(const CellEdge& edge, std::vector<CellEdge>& edges);

// Slope [-] and depth [m] from which on parts of a body beside a face may touch as well.
struct Onset {
  double slope = std::numeric_limits<double>::infinity();
  double depth = std::numeric_limits<double>::infinity();

  // A part at the distance d and height h above the face touches if depth + slope d > h. No part is lower than `depth`,
  // and none has a smaller h / d than `slope`.
  bool reached(double tilt, double sunk) const { return tilt / slope + sunk / depth > 1.0; }
};

// The plane of a flat face of a body. The face's frame is parallel to the pad's when the face lies flat on the pad,
// except for a rotation about z.
struct FacePlane {
  double rotation[9] = {};   // from the body's frame to the face's, row-major
  double height = 0.0;       // z of the face in its own frame [m]
  double most_slope = 0.0;   // largest slope at which the body faces the pad with this face alone [-]
  Onset any_part, own_shapes;   // of all of the body, and of the shapes of which the face is a part
};

// Contact cells of a flat face. Points, edges and hulls are in the face's frame [m]. Immutable once made, and shared.
struct Face : FacePlane {
  // For each of the body's shapes, its least height above the face [m]; infinite for those of which the face is a part.
  std::vector<double> rises;
  std::vector<Point> centroids;
  std::vector<double> areas;             // [m^2]
  std::vector<Point> quadrature;         // four points per cell whose mean integrates quadratic functions, or empty
  std::vector<double> inverse_distance;  // integrals of 1/r over pairs of cells (cells, cells) [m^3]
  std::vector<CellEdge> edges;
  std::vector<Point> corners;            // convex hull of the outline, counter-clockwise
  std::vector<Point> hull;               // convex hull of the centroids, counter-clockwise
  bool convex = false;                   // whether the outline is convex
  double length;                         // square root of the area; makes tilts comparable with indentation [m]
  bool cut = false;                      // whether it was cut at the sheet's edge for one pose; its frame is the pad's

  std::size_t cells() const { return areas.size(); }
};

// Add the four quadrature points of a cell: on its axes, the first of which is along the unit vector `axis`, at these
// distances from its middle.
void add_quadrature(const Point& middle, const Point& axis, double along, double across, std::vector<Point>& points);

// Placement of the face's frame on the pad, from the body's pose. False if the body leans by more than most_slope.
bool place(const FacePlane& face, const Pose& pose, Placement& placement);

// Set `outline` to the edges of a placed face's outline, in the pad frame [m]. The face is on the left of each edge.
void find_outline(const Face& face, const Placement& placement, std::vector<Segment>& outline);

// Bound the forces (cells, 3) [N] so that sqrt(p^2 + 3 t^2) of pressure p and shear t does not exceed the strength [Pa]
// on any cell. Shear beyond that is left out. 0: no bound.
void bound_stress(const Face& cells, double strength, double* forces);

// Memory for nodal forces that the caller keeps between calls.
struct TractionWork {
  SurfaceGrid::Workspace grid;
  std::vector<TractionEdge> edges;
  std::vector<double> tractions;
};

// Compute the nodal forces (nodes y, nodes x, 3) [N] that are equivalent to forces on the cells of a placed face.
void nodal_forces(const Face& face, const Placement& placement, const SurfaceGrid& grid, const CellForces& forces,
                  TractionWork& work, double* nodal);

// The face's plane over the pad.
InclinedPlane plane_of(const FacePlane& face, const Pose& pose);

}  // namespace mjtactile
