// Shear of a contact whose pressure without friction is known, distributed by a tangential choice.
//
// Each choice is a class in a file of its own, and one object of it serves all contacts; see laws/by_name.hpp. If friction
// cannot carry a wrench, the nearest possible wrench is carried.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/solvers/bonded_contact.hpp"
#include "contact/solvers/limit_surface.hpp"
#include "contact/solvers/partial_slip.hpp"
#include "contact/solvers/rigid_contact.hpp"
#include "contact/solvers/secant_mixing.hpp"
#include "geometry/polygon.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Contact cells and the pressing on them without friction, pad frame.
struct PressedCells {
  std::size_t count;
  const Point* points;     // centroids [m]
  const double* pressing;  // force on each [N], positive where pressed
  const double* heights;   // of the body above each at first touch [m], null where flat, infinite out of reach
  Point middle;            // tilts are about it [m]
  double length;           // by which tilts and torsion compare with forces [m]
  bool tilting;            // whether the body may tilt
  const double* most = nullptr;  // force that each cell bears [N], no less than the pressing; null: no bound
};

// What presses, and what is to be carried.
struct ShearProblem {
  const PressedCells& cells;
  const Matrix* compliance;  // see SurfaceCompliance::full; null where the choice asks for none
  const double* wrench;      // about the pad's origin [N, N m]
  double friction;           // coefficient; negative: no bound
};

// What was found, all false where everything was as asked for.
struct ShearOutcome {
  bool refused = false;     // no contact, or numbers that are not finite: forces are zero
  bool slides = false;      // friction carries only the nearest wrench
  bool simplified = false;  // the choice has no solution that was found: a simpler one carries the same wrench
};

// The cells of one contact that carry shear, and room to solve for it, kept from contact to contact.
struct ShearWork {
  WorkLimit limit;
  double patience = 1.0;   // times as long that shear may take as in a step of a simulation
  ShearGrip grip;
  PartialSlip slip;
  BondedContact bonded;
  RigidContact contact;
  Matrix tangential, pressed;               // compliance of the cells held, along the surface; of those reached, across
  std::vector<std::size_t> reached, held;   // cells the body may press on; those that carry shear
  std::vector<std::size_t> gathered, last_held;  // those whose compliance was gathered; those of the round before
  std::vector<std::uint8_t> start;
  std::vector<Point> levers;
  std::vector<double> heights, gaps, modes, lifted, lifts;  // of the cells reached
  SecantMixing mixing;
  std::vector<double> normal, found, spread, last;   // of all cells: pressing, and shear in two blocks
  std::vector<double> coupled;                       // forces of a bonded contact that no cell is bounded in
  std::vector<double> shear, slipped;                // of the cells held

  // Begin to count the work of a contact anew.
  void allow();
  // Hold on to the cells under pressure.
  void hold(const PressedCells& cells, const double* normal_forces);
  // Displacement along the surface of the cells held that the pressing alone brings, and their compliance there.
  void displace(const PressedCells& cells, const Matrix& compliance, const double* normal_forces);
  // Forces on all cells: the pressing, and the shear of those held.
  void write(const PressedCells& cells, const double* normal_forces, double* forces) const;
};

class TangentialChoice {
 public:
  virtual const char* name() const = 0;
  // Whether it asks for the compliance of the cells in all directions; otherwise none is handed over.
  virtual bool couples() const { return true; }
  // Whether cells slip where friction bears no more, so that a coefficient must be known.
  virtual bool slips() const { return false; }
  // Forces on the cells (count, 3) [N], see SurfaceShear.
  virtual ShearOutcome solve(const ShearProblem& problem, ShearWork& work, double* forces) const = 0;

 protected:
  ~TangentialChoice() = default;
};

class SurfaceShear {
 public:
  // Forces on the cells (count, 3) [N], pad frame, that carry a wrench's shear and torsion besides the pressing.
  ShearOutcome solve(const TangentialChoice& choice, const ShearProblem& problem, double* forces);
  // Take so many times as long as a step of a simulation may.
  void set_patience(double times) { work_.patience = times; }

 private:
  ShearWork work_;
};

// Largest fraction of the change of a cell's force from that without friction to that coupled with shear; 1 for all.
double share_borne(const PressedCells& cells, std::size_t cell, double coupled);

}  // namespace mjtactile
