// Shear of a contact whose pressure without friction is known, as each tangential choice spreads it.
//
// "proportional": everywhere in proportion to the pressure, with a turn. "stick": no cell slips; pressure and shear are
// solved for together. "coulomb": cells stick where they can and slip where |t| reaches mu F; pressure and slip are
// solved for in turn until they agree. What friction cannot carry of a wrench is left out: the nearest is carried.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/laws/bonded_contact.hpp"
#include "contact/laws/limit_surface.hpp"
#include "contact/laws/partial_slip.hpp"
#include "contact/laws/rigid_contact.hpp"
#include "geometry/polygon.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

enum class Tangential { proportional, stick, coulomb };

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

// What was found, all false where everything was as asked for.
struct ShearOutcome {
  bool refused = false;     // no contact, or numbers that are not finite: forces are zero
  bool slides = false;      // friction carries only the nearest wrench
  bool simplified = false;  // the choice has no solution that was found: a simpler one carries the same wrench
};

class SurfaceShear {
 public:
  // Forces on the cells (count, 3) [N], pad frame, that carry a wrench's shear and torsion besides the pressing.
  // `compliance`: see SurfaceCompliance::full, null for "proportional". `friction`: coefficient, negative: no bound.
  ShearOutcome solve(const PressedCells& cells, const Matrix* compliance, const double* wrench, Tangential tangential,
                     double friction, double* forces);
  // Take so many times as long as a step of a simulation may.
  void set_patience(double times) { patience_ = times; }

 private:
  ShearOutcome proportional(const PressedCells& cells, const double* wrench, double friction, double* forces);
  ShearOutcome stick(const PressedCells& cells, const Matrix& compliance, const double* wrench, double friction,
                     double* forces);
  ShearOutcome coulomb(const PressedCells& cells, const Matrix& compliance, const double* wrench, double friction,
                       double* forces);
  bool bonded(const PressedCells& cells, const Matrix& compliance, const double* wrench, double* forces);
  bool bonded_as_pressed(const PressedCells& cells, const Matrix& compliance, const double* wrench, double* forces);
  double share_borne(const PressedCells& cells, std::size_t cell, double coupled) const;
  bool holds(const PressedCells& cells, const double* wrench, double friction, const double* forces);
  bool slipping(const PressedCells& cells, const Matrix& compliance, const double* wrench, double friction, bool known,
                double tolerance, bool& slides);
  void hold(const PressedCells& cells, const double* normal);
  void displace(const PressedCells& cells, const Matrix& compliance, const double* normal);
  void write(const PressedCells& cells, const double* normal, const double* shear, double* forces) const;

  WorkLimit limit_;
  double patience_ = 1.0;
  ShearGrip grip_;
  PartialSlip slip_;
  BondedContact bonded_;
  RigidContact contact_;
  Matrix tangential_, pressed_;              // compliance of the cells held, along the surface; of those reached, across
  std::vector<std::size_t> reached_, held_;  // cells the body may press on; those that carry shear
  std::vector<std::size_t> gathered_, last_held_;  // those whose compliance was gathered; those of the round before
  std::vector<std::uint8_t> start_;
  std::vector<Point> levers_;
  std::vector<double> heights_, gaps_, modes_, lifted_;  // of the cells reached
  std::vector<double> normal_, found_, spread_, last_;  // of all cells: pressing, and shear in two blocks
  std::vector<double> coupled_;                         // forces of a bonded contact that no cell is bounded in
  std::vector<double> shear_, slipped_;                // of the cells held
};

}  // namespace mjtactile
