// A contact law: how a body's pressure is distributed over contact cells.
//
// Each law is a class in a file of its own. One object of it serves all contacts; see laws/by_name.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "contact/cells/face.hpp"
#include "contact/solvers/rigid_contact.hpp"

namespace mjtactile {

// The problem that a law solves: cells, the body's heights and motions, and the wanted resultants.
struct LawProblem {
  const Face& face;
  const SurfaceCompliance& compliance;
  RigidProblem body;          // its compliance is `between`
  Matrix& between;            // compliance between the placed cells [m/N], if the law couples them
  const std::uint8_t* start;  // cells that are likely pressed (cells); null for all
};

// The normal contact that a law found.
struct LawContact {
  std::vector<std::uint8_t> pressed;
  std::vector<double> normal;     // force on each cell [N]
  double slopes[2] = {};          // of the body's tilt, times the face's length as a law finds them [m]
  RigidContact contact;
  SpringBed bed;                  // of laws "uniform" and "foundation"
  std::vector<double> springs;    // stiffnesses of the cells' springs, of law "foundation" [N/m]
  double stiffness = 0.0;         // stiffness per area of these springs [Pa/m]

  // Copy pressed cells, forces and tilt from a solver with `motions` motions.
  template <typename Solved>
  void take(const Solved& solved, std::size_t motions) {
    pressed = solved.pressed();
    normal = solved.forces();
    if (motions > 1) slopes[0] = solved.motion()[1], slopes[1] = solved.motion()[2];
  }
};

// The interface of a contact law.
class ContactLaw {
 public:
  virtual const char* name() const = 0;
  // Whether pressure on one cell moves the surface under the other cells, including those of other bodies.
  virtual bool couples() const { return false; }
  // Whether the law uses the pad's compliance. Otherwise a body presses with its lowest part and tilts freely, and flat
  // faces need no cells, because UniformPress solves their contact.
  virtual bool shapes() const { return true; }

  // Find the normal forces, without a bound on the pressure, and the body's tilt. False if no contact is found.
  virtual bool solve(const LawProblem& problem, LawContact& found) const = 0;
  // Give the compliance between the cells to the contact that solve() found. False if the law has none.
  virtual bool set_compliance(const Face& face, LawContact& found, Matrix& between) const = 0;
  // Depth of the surface under a cell below the undeformed surface [m].
  virtual double depth(const Face& face, const LawContact& found, const Matrix& between, std::size_t cell) const = 0;

 protected:
  ~ContactLaw() = default;
};

}  // namespace mjtactile
