// A flat face of a rigid body as contact cells, and where it stands on a pad.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/pose.hpp"

namespace mjtactile {

// An edge between two cells, or at the outline: which cells' tractions step across it, with the edge's direction.
struct CellEdge {
  double start[2], end[2];
  std::int32_t left, right;  // cells to its left and right, -1 for none

  // The step of tractions (cells, 3) across it; false where there is none.
  bool step(const std::vector<double>& tractions, double* step) const;
};

// Cells of a face in its own frame, whose z axis is the pad's when the face lies flat on it. Immutable, shared.
struct Face {
  double rotation[9];   // body's frame to the face's, row-major
  double height;        // of the face in its own frame [m]
  double most_slope;    // beyond this the body no longer faces the pad with this face alone [-]
  double tips_at = std::numeric_limits<double>::infinity();  // slope from which on other faces may touch as well [-]
  std::vector<Point> centroids;
  std::vector<double> areas;
  std::vector<Point> quadrature;         // points per cell whose mean integrates quadratic functions, or none
  std::vector<double> inverse_distance;  // integrals of 1/r over pairs of cells (cells, cells) [m^3]
  std::vector<CellEdge> edges;
  std::vector<Point> corners;            // convex hull of its outline, counter-clockwise
  std::vector<Point> hull;               // convex hull of the centroids, counter-clockwise
  bool convex = false;                   // whether the hull of its outline is all of it
  double length;                         // root of its area, by which tilts compare with the indentation [m]
  bool cut = false;                      // at the sheet's edge, for one place: its frame is the pad's

  std::size_t cells() const { return areas.size(); }
};

// Pose of the face on the pad; false if the body is tilted too far for this face.
bool place(const Face& face, const Pose& pose, Placement& placement);

// Height of the face's plane over (x, y) [m].
double plane_height(const Face& face, const Pose& pose, double x, double y);

}  // namespace mjtactile
