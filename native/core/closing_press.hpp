// Where a body presses that touches with a small part of what it covers: a coarse lattice finds that part and closes in
// on it until cells of the wanted number lie there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cell_contact.hpp"
#include "gap_map.hpp"
#include "lattice.hpp"

namespace mjtactile {

class ClosingPress {
 public:
  // Press a curved body; contact() has the answer, on face(). Looked for within `start`, gap.covered() as a rule. False
  // where the readable reference has to: where the body's own rim ends the contact, or none was found.
  bool solve(const GapMap& gap, const Region& start, const SurfaceCompliance& compliance, const LawOptions& options,
             const double* wrench, CellContact::Workspace& workspace);
  // Press a flat face with a convex outline, counter-clockwise in the pad frame, by a force near its rim.
  bool solve(const std::vector<Point>& outline, const SurfaceCompliance& compliance, const LawOptions& options,
             const double* wrench, CellContact::Workspace& workspace);

  const CellContact& contact() const { return contact_; }
  const Face& face() const { return cells_.face(); }
  // How far the body moved into the pad where it stands lowest, under a sum of the contact's parts [m].
  double approach(const std::vector<double>& weights) const;

 private:
  bool search(const GapMap* gap, const std::vector<Point>& outline, Region& region,
              const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
              CellContact::Workspace& workspace);
  bool cover(const GapMap* gap, const std::vector<Point>& outline, const Lattice& lattice);
  bool cover_on_sheet(const GapMap& gap, const Lattice& lattice);
  bool has_neighbour(const Lattice& lattice, std::uint32_t cell) const;
  bool ends_at_rim(const Lattice& lattice) const;
  double spreading_force();
  void mean_heights(const GapMap& gap);

  LatticeFace cells_;
  CellContact contact_;
  double barely_ = 0.0;      // inside a flat face's outline [m]
  RigidMotion motion_ = {};  // found by the search
  std::vector<std::uint32_t> kept_;
  std::vector<Point> sheet_;
  std::vector<double> heights_, lowest_, weights_;
  std::vector<std::uint8_t> start_, over_, covered_;
  std::vector<Point> pressed_;
};

}  // namespace mjtactile
