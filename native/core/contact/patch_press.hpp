// A body of any shape pressed on a pad: spots where it may touch, cells on them, and the contact they carry.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/contact_search.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/patch_face.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class PatchPress {
 public:
  // Press a body; contact() has the answer, on face(). Looks again with finer or wider cells a bounded number of times.
  // False where nothing of the body faces the pad, or the force does not press. On a curved pad, all is seen from a tangent
  // plane, over the surface.
  bool solve(const HeightMap& map, const Rectangle& sheet, const SurfaceCompliance& compliance,
             const LawOptions& options, const double* wrench, CellContact::Workspace& workspace,
             const TangentPlane* plane = nullptr);
  // The same contact on its cells where the surface has sunk by so much under each, as others bend it [m].
  void press_again(const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
                   const std::vector<double>& sunk, CellContact::Workspace& workspace);

  const CellContact& contact() const { return contact_; }
  // How the cells lie on a curved pad.
  const BentCells& bent() const { return bent_; }
  // Of the body above the cells, seen from where it tilts to [m].
  const std::vector<double>& heights() const { return heights_; }
  const Face& face() const { return cells_.face(); }
  // From where the heights are seen.
  const PatchFace::View& view() const { return seen_; }
  void integrate_shear(ShearIntegrals& integrals) const { cells_.integrate_shear(integrals); }
  // Slope by which the body tilts from where it stands [-].
  double tilt() const;

 private:
  // What is changed from look to look.
  struct View {
    Plane plane;
    double generosity;   // cells reach up to so many times the level of the spots
    double sinks;        // but no higher than the body was found to sink in; 0 where that is not known [m]
  };
  // Whether the contact is one spot that is neither long nor open, nor hardly larger than a cell.
  bool compact(const LawOptions& options) const;
  double likely_height() const;
  Plane first_plane(const SearchLoad& load);
  void set_heights();
  bool add_cells(const HeightMap& map, const Rectangle& sheet, const LawOptions& options, const View& view);
  void reach_out();
  Lattice lattice_over(std::size_t number, const LawOptions& options, const View& view, double wanted,
                       double coarser) const;
  const std::vector<Region>& taken_by_others(std::size_t number);
  bool next_view(View& view) const;
  // Whether the contact leaves a part of the load's moment though the body stands about the load's line.
  bool misses(const SearchLoad& load) const;

  ContactSearch search_;
  PatchFace cells_;
  BentCells bent_;
  bool bends_ = false;
  CellContact contact_;
  PatchFace::View seen_ = {};
  std::vector<Spot> spots_;
  std::vector<Region> regions_, taken_;
  std::vector<double> heights_;
  std::vector<std::uint8_t> start_;
};

}  // namespace mjtactile
