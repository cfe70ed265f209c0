// Bodies whose geometry is not known, such as flexes. Each of MuJoCo's contact points presses with its own force on a
// square.
//
// No contact is solved, because a flex is not rigid and each force is known. A square is centred where its force passes
// through the surface, so that force and moment are those of the contact.
#pragma once

#include <vector>

#include "contact/cells/bent_cells.hpp"
#include "contact/cells/face.hpp"

namespace mjtactile {

// A point at which a body presses, in the pad frame.
struct ContactPoint {
  double x, y;        // [m]
  double force;       // pressing [N]
  double wrench[6];   // on the pad, about the pad's origin [N, N m]
};

class PointPress {
 public:
  struct Options {
    double least_side;   // of a square [m]
    double strength;     // largest pressure [Pa]; 0: no bound
    Rectangle sheet;     // that squares may cover [m]
  };
  // Make a square for each point. Points closer to each other than half the least side share one. False if no point
  // presses.
  bool lay(const std::vector<ContactPoint>& points, const Options& options);

  // The squares as cells, and the forces on them (cells, 3) [N].
  const Face& face() const { return face_; }
  double area() const { return area_; }   // of all squares [m^2]
  double peak() const;                    // largest pressure [Pa]
  // Compute the nodal forces (nodes y, nodes x, 3) [N]. `plane`: in whose frame points and squares are; null on a flat
  // pad. `carried`: on entry the wanted wrench (6) about the pad's origin [N, N m], on return the one carried.
  void nodal_forces(const SurfaceGrid& grid, const TangentPlane* plane, double* carried, double* nodal);

 private:
  void merge_close_points(const std::vector<ContactPoint>& points, double apart);
  void add_square(const ContactPoint& point, const Options& options);
  void turn_to_squares();

  std::vector<ContactPoint> merged_;
  Face face_ = {};
  std::vector<double> forces_;
  double area_ = 0.0;
  BentCells bent_;
  BentCells::Workspace work_;
};

}  // namespace mjtactile
