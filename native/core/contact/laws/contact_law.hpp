// A contact law: how a body's pressure is distributed over contact cells.
//
// Each law is a class in a file of its own, and one object of it serves all contacts; see laws/by_name.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "contact/cells/face.hpp"
#include "contact/solvers/rigid_contact.hpp"

namespace mjtactile {

// Cells, the body's gaps and motions, and the resultants that are asked for.
struct LawProblem {
  const Face& face;
  const SurfaceCompliance& compliance;
  RigidProblem body;          // its compliance is that between the cells
  Matrix& between;            // the same: as the cells were placed, where the law couples them
  const std::uint8_t* start;  // cells likely pressed, null for all
};

// What presses on the cells, as a law found it.
struct LawContact {
  std::vector<std::uint8_t> pressed;
  std::vector<double> normal;     // force on each cell [N]
  double slopes[2] = {};          // of the body's tilt, over the face's length [m]
  RigidContact contact;
  SpringBed bed;                  // of laws "uniform" and "foundation"
  std::vector<double> springs;    // of law "foundation" [N/m]
  double stiffness = 0.0;         // the same per area [Pa/m]

  // Take over what presses, and how the body has moved.
  template <typename Solved>
  void take(const Solved& solved, std::size_t motions) {
    pressed = solved.pressed();
    normal = solved.forces();
    if (motions > 1) slopes[0] = solved.motion()[1], slopes[1] = solved.motion()[2];
  }
};

class ContactLaw {
 public:
  virtual const char* name() const = 0;
  // Whether pressure on one cell moves the surface under the others, those of other bodies included.
  virtual bool couples() const { return false; }
  // Whether it uses the pad's compliance; otherwise a body presses with its lowest part and tilts freely.
  virtual bool shapes() const { return true; }
  // Whether flat faces need no cells: UniformPress presses them.
  virtual bool presses_faces() const { return false; }

  // Normal forces where no pressure is too high, and the body's tilt; false where none were found.
  virtual bool solve(const LawProblem& problem, LawContact& found) const = 0;
  // Have the compliance between the cells at hand, as solve() found the contact; false where the law has none.
  virtual bool set_compliance(const Face& face, LawContact& found, Matrix& between) const = 0;
  // Of the surface under a cell [m].
  virtual double depth(const Face& face, const LawContact& found, const Matrix& between, std::size_t cell) const = 0;

 protected:
  ~ContactLaw() = default;
};

}  // namespace mjtactile
