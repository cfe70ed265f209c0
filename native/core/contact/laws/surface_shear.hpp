// Shear of a contact whose pressure without friction is known. A tangential choice says how the shear is distributed.
//
// Each choice is a class in a file of its own. One object of it serves all contacts; see laws/by_name.hpp. If friction
// cannot carry a wrench, the nearest wrench that it can is carried.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "contact/solvers/bonded_contact.hpp"
#include "contact/solvers/limit_surface.hpp"
#include "contact/solvers/partial_slip.hpp"
#include "contact/solvers/rigid_contact.hpp"
#include "contact/solvers/secant_mixing.hpp"
#include "geometry/polygon.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Cells that press with less than this fraction of the largest force only touch. Rounding decides whether they press.
constexpr double kTouches = 1e-9;

// Contact cells and the normal forces on them without friction, in the pad frame.
struct PressedCells {
  std::size_t count;
  const Point* points;     // centroids (count) [m]
  const double* pressing;  // normal forces (count) [N], positive where pressed
  const double* heights;   // of the body above the cells at first touch (count) [m]; null: flat; infinite: out of reach
  Point middle;            // point about which tilts are measured [m]
  double length;           // divides moments to compare them with forces [m]
  bool tilting;            // whether the body may tilt
  const double* most = nullptr;  // largest normal forces (count) [N], no less than `pressing`; null: no bound
  // Gradients of the body's height above the cells (count) [-]; null if no cell leans.
  const std::vector<Point>* gradients = nullptr;

  // Position of a cell from that point, over the length [-].
  Point lever(std::size_t cell) const {
    return {(points[cell].x - middle.x) / length, (points[cell].y - middle.y) / length};
  }
};

// The cells, and the wrench that they must carry.
struct ShearProblem {
  const PressedCells& cells;
  FullCompliance* compliance;   // of the cells; null if the choice needs none
  const double* wrench;      // (6) about the pad's origin [N, N m]
  double friction;           // coefficient; negative: no bound
};

// Result of a solution; all false if the wrench is carried as the choice says.
struct ShearOutcome {
  bool refused = false;     // no contact, or numbers that are not finite: all forces are zero
  bool slides = false;      // friction carries only the nearest wrench
  bool simplified = false;  // no solution of the choice was found: a simpler distribution carries the same wrench
};

// The cells of one contact that carry shear, and the memory to solve for it, which is kept from contact to contact.
struct ShearWork {
  WorkLimit limit;
  double patience = 1.0;   // multiplies the limit of work, which is made for a step of a simulation
  ShearGrip grip;
  PartialSlip slip;
  BondedContact bonded;
  RigidContact contact;
  Matrix tangential, pressed;               // tangential compliance of held cells; normal compliance of reached ones
  std::vector<std::size_t> reached, held;   // cells on which the body may press; cells that carry shear
  std::vector<std::size_t> gathered, last_held;  // cells whose compliance was gathered; held cells of the last round
  std::vector<std::uint8_t> start;
  std::vector<Point> levers;
  std::vector<double> heights, gaps, modes;   // of the cells reached
  std::vector<double> lift, new_lift;         // by which shear lifts the surface under them: assumed, and resulting [m]
  SecantMixing mixing;
  std::vector<double> normal, found, spread, last;   // of all cells: normal forces, and shear (2, count)
  std::vector<double> coupled;                       // forces of a bonded contact without bounds on the cells
  std::vector<double> shear, free_slip;              // of the held cells: shear, and slip by the pressure alone
  std::vector<Point> leans;                          // of all cells [-]
  std::vector<double> leaning, along;   // forces along the surface (2, count) [N]: of the leans; of these and shear

  // Reset the limit of work for a new contact.
  void allow();
  // Take the cells under pressure as those that carry shear.
  void hold(const PressedCells& cells, const double* normal_forces);
  // Compute the forces along the surface of cells that lean, under these normal forces. None if no cell leans.
  void lean(const PressedCells& cells, const double* normal_forces);
  // Gather the held cells' tangential compliance, and their tangential displacement by the normal forces and the leans
  // alone.
  void displace(const PressedCells& cells, const Matrix& compliance, const double* normal_forces);
  // Write the forces on all cells (count, 3) [N]: the normal forces, and the shear of the held cells.
  void write(const PressedCells& cells, const double* normal_forces, double* forces) const;
};

// The interface of a tangential choice.
class TangentialChoice {
 public:
  virtual const char* name() const = 0;
  // Whether the choice needs the cells' compliance in all directions. Otherwise it is given none.
  virtual bool couples() const { return true; }
  // Whether cells slip where friction bears no more, so that a coefficient must be given.
  virtual bool slips() const { return false; }
  // Whether cells press along the body's normals; see lean.hpp. If no cell may slip, the direction of the traction
  // follows from that.
  virtual bool leans() const { return true; }
  // Forces on the cells (count, 3) [N]; see SurfaceShear::solve.
  virtual ShearOutcome solve(const ShearProblem& problem, ShearWork& work, double* forces) const = 0;

 protected:
  ~TangentialChoice() = default;
};

// Solves for shear, with memory that is kept from contact to contact.
class SurfaceShear {
 public:
  // Find forces on the cells (count, 3) [N], pad frame, that carry the wrench's shear and torsion as well as its
  // pressing.
  ShearOutcome solve(const TangentialChoice& choice, const ShearProblem& problem, double* forces);
  // Let the solution take `times` as long as a simulation step allows.
  void set_patience(double times) { work_.patience = times; }

 private:
  ShearWork work_;
};

// The normal force up to which a cell only touches [N]. Such a cell carries no shear.
double most_of_touching(const PressedCells& cells, const double* normal_forces);

// The largest fraction of a change of a cell's normal force that the cell bears, up to 1. The change is from the force
// without friction to `coupled`, the force that is coupled with shear [N].
double share_borne(const PressedCells& cells, std::size_t cell, double coupled);

}  // namespace mjtactile
