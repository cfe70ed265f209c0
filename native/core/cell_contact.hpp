// A rigid body on contact cells: which forces on them carry a wrench, and the parts whose sum they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "compliance.hpp"
#include "face.hpp"
#include "rigid_contact.hpp"
#include "surface_grid.hpp"

namespace mjtactile {

enum class Law { elastic, foundation, uniform };

struct LawOptions {
  Law law = Law::elastic;
  bool tilting = true;      // whether the body may tilt under its load
  double friction = -1.0;   // coefficient that bounds shear and torsion; negative: none
  std::size_t cells = 0;    // on curved bodies; faces come with theirs

  bool operator==(const LawOptions& other) const {
    return law == other.law && tilting == other.tilting && friction == other.friction && cells == other.cells;
  }
};

// Motion of a body into the pad: x, y in the pad frame [m].
struct RigidMotion {
  double approach;    // at the middle [m]
  double slopes[2];
  Point middle;

  double depth(const Point& at) const {
    return approach + slopes[0] * (at.x - middle.x) + slopes[1] * (at.y - middle.y);
  }
};

// A body pressed at one place. Shear is in proportion to the pressure, with a turn for the torsion.
class CellContact {
 public:
  struct Workspace {
    SurfaceCompliance::Workspace compliance;
    SurfaceGrid::Workspace grid;
    Matrix matrix, gram, motion;
    std::vector<double> placed, modes, forces, tractions;
    std::vector<TractionEdge> edges;
  };

  // Find the pressed cells under a wrench (force [N], moment about the pad's origin [N m]). `heights`: of the body
  // above each cell at first touch, null for a flat face; `start`: cells likely pressed, null for all. False where the
  // readable reference has to: a force that does not press or passes too near the rim of a flat face, no contact found.
  bool solve(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
             const LawOptions& options, const double* wrench, Workspace& workspace, const double* heights = nullptr,
             const std::uint8_t* start = nullptr);

  // Weights of the parts under another wrench, (parts()); false where other cells press, or some slip.
  bool weights(const Face& face, const LawOptions& options, const double* wrench, std::vector<double>& weights,
               Workspace& workspace) const;

  // Parts of a load: pressures, one per resultant and on a curved body one of its shape, and three of shear for each:
  // a unit motion times that pressure.
  std::size_t parts() const { return 4 * pressures(); }
  // Nodal forces of a sum of parts, (nodes y, nodes x, 3) [N].
  void nodal_forces(const Face& face, const SurfaceGrid& grid, const std::vector<double>& weights,
                    Workspace& workspace, double* forces) const;

  const std::vector<std::uint8_t>& pressed() const { return contact_.pressed(); }
  // Whether a wrench's force passes through what it presses.
  bool carries(const Face& face, const double* wrench) const;
  double pressed_area() const { return pressed_area_; }  // [m^2]
  // Motion of the body under a sum of parts.
  RigidMotion motion(const Face& face, const std::vector<double>& weights) const;

 private:
  // What the forces must add up to, and 1 on a curved body, (pressures()).
  bool resultants(const Face& face, const double* wrench, double* resultants) const;
  Point through(const double* wrench) const;
  std::size_t pressures() const { return contact_.motions() + (curved_ ? 1 : 0); }
  bool solve_contact(const Face& face, const SurfaceCompliance& compliance, const LawOptions& options,
                     const double* resultants, const double* heights, const std::uint8_t* start, Workspace& workspace);

  Placement placement_;
  std::vector<Point> points_;     // of the cells, from their middle, over the face's length; pad axes
  Point centre_ = {0.0, 0.0};     // middle of the cells in the pad frame [m]
  bool tilting_ = true, curved_ = false;
  double pressed_area_ = 0.0;
  RigidContact contact_;
  std::vector<double> gram_;      // motions times motions of the shear under each of the pressures
};

}  // namespace mjtactile
