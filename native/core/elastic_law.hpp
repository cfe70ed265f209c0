// Law "elastic" on a flat face: which forces on its cells carry a wrench, and the parts whose sum they are.
#pragma once

#include <cstddef>
#include <vector>

#include "compliance.hpp"
#include "face.hpp"
#include "rigid_contact.hpp"
#include "surface_grid.hpp"

namespace mjtactile {

struct LawOptions {
  bool tilting = true;      // whether the body may tilt under its load
  double friction = -1.0;   // coefficient that bounds shear and torsion; negative: none
};

// A face pressed at one place. Shear is in proportion to the pressure, with a turn for the torsion.
class ElasticContact {
 public:
  struct Workspace {
    SurfaceCompliance::Workspace compliance;
    SurfaceGrid::Workspace grid;
    Matrix matrix, gram, motion;
    std::vector<double> placed, modes, forces, tractions;
    std::vector<TractionEdge> edges;
  };

  // Find the pressed cells under a wrench (force [N], moment about the pad's origin [N m]). False where the readable
  // reference has to: a force that does not press or passes too near the rim, shear beyond friction, no contact found.
  bool solve(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
             const LawOptions& options, const double* wrench, Workspace& workspace);

  // Weights of the parts under another wrench, (parts()); false where other cells press, or some slip.
  bool weights(const Face& face, const LawOptions& options, const double* wrench, std::vector<double>& weights,
               Workspace& workspace) const;

  // Parts of a load: one per resultant, and three of shear for each: a unit motion times the resultant's pressure.
  std::size_t parts() const { return 4 * contact_.motions(); }
  // Nodal forces of a sum of parts, (nodes y, nodes x, 3) [N].
  void nodal_forces(const Face& face, const SurfaceGrid& grid, const std::vector<double>& weights,
                    Workspace& workspace, double* forces) const;

  double pressed_area() const { return pressed_area_; }  // [m^2]
  // How far the body moved into the pad at the middle of its cells [m].
  double approach(const std::vector<double>& weights) const;

 private:
  bool resultants(const Face& face, const double* wrench, double* resultants) const;

  Placement placement_;
  std::vector<Point> points_;     // of the cells, from their middle, over the face's length; pad axes
  Point centre_ = {0.0, 0.0};     // middle of the cells in the pad frame [m]
  bool tilting_ = true;
  double pressed_area_ = 0.0;
  RigidContact contact_;
  std::vector<double> gram_;      // motions times motions of the shear under each resultant's pressure
};

}  // namespace mjtactile
