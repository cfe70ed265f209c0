// Where a curved body presses: a coarse lattice finds the part of what it covers that touches, and closes in on it
// until cells of the wanted number lie there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cell_contact.hpp"
#include "gap_map.hpp"
#include "lattice.hpp"

namespace mjtactile {

class CurvedPress {
 public:
  // Press a body that `gap` holds; contact() has the answer, on face(). Looked for within `start`, gap.covered() as a
  // rule. False where the readable reference has to: where the body's own rim ends the contact, or none was found.
  bool solve(const GapMap& gap, const Region& start, const SurfaceCompliance& compliance, const LawOptions& options,
             const double* wrench, CellContact::Workspace& workspace);

  const CellContact& contact() const { return contact_; }
  const Face& face() const { return cells_.face(); }
  // How far the body moved into the pad where it stands lowest, under a sum of the contact's parts [m].
  double approach(const std::vector<double>& weights) const;

 private:
  bool cover(const GapMap& gap, const Lattice& lattice);
  bool cover_on_sheet(const GapMap& gap, const Lattice& lattice);
  bool has_neighbour(const Lattice& lattice, std::uint32_t cell) const;
  bool ends_at_rim(const Lattice& lattice) const;
  double spreading_force();
  void mean_heights(const GapMap& gap);

  LatticeFace cells_;
  CellContact contact_;
  std::vector<std::uint32_t> kept_;
  std::vector<double> heights_, lowest_, weights_;
  std::vector<std::uint8_t> start_, over_, covered_;
  std::vector<Point> pressed_;
};

}  // namespace mjtactile
