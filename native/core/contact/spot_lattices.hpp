// Lattices of cells on the spots where a body may touch: where they lie, and how large their cells are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/sampled_lattices.hpp"
#include "contact/contact_search.hpp"
#include "contact/laws/cell_contact.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class SpotLattices {
 public:
  // What one look at a body has found, and asks for.
  struct Look {
    const std::vector<Spot>& spots;
    const HeightWindow& seen;      // the body up to the height at which cells end
    const ContactSearch& search;   // that found the spots
    const LawOptions& options;
    double finer;                  // number of cells over that of the options [-]
    double height_factor;          // height up to which cells are laid, over the level [-]
    double strip;                  // how much higher the body is at the sides of strips along ridges [m]; 0 if the
                                   // spots do not lie along ridges
    bool everywhere;               // whether the only spot is all of the body that is over the sheet

    bool along_ridges() const { return strip > 0.0; }
  };
  // That factor in a first look, and its least value if the bound on pressure sets the level.
  static constexpr double kHeightFactor = 2.5, kBoundedHeightFactor = 1.6;

  // Lay a lattice on each spot. Cells of bent and hollow spots along ridges follow the ridges. Cells of straight ones
  // lie along them anyway.
  void lay(const Look& look, SampledLattices& lattices);
  // Regions around the spots of the last call.
  const std::vector<Region>& regions() const { return regions_; }
  // Whether there is a single spot that fills its rectangle, is about as long as wide, and is larger than a cell.
  static bool is_compact(const std::vector<Spot>& spots, const LawOptions& options);

 private:
  struct Number {   // of cells
    double wanted, most;
  };
  void lay_all(const Look& look, SampledLattices& lattices);
  bool lay_along_ridges(const Look& look, SampledLattices& lattices);
  Number number_of_cells(const Look& look) const;
  void set_regions(const Look& look);
  Lattice lattice_over(const Look& look, std::size_t number, double cells, double coarser) const;

  std::vector<Region> regions_;
  std::vector<std::uint8_t> follows_;   // for each spot, whether its cells follow ridges
};

}  // namespace mjtactile
