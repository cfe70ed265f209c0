// Flat faces with which bodies face a pad.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>

#include "contact/cells/face.hpp"
#include "contact/cells/face_cells.hpp"
#include "contact/touch.hpp"
#include "geometry/polygon.hpp"

namespace mjtactile {

// The faces that face one pad. Those that extend beyond the sheet are cut at its edge, and kept for the next step.
class FacingFaces {
 public:
  // `depth`: the pad's thickness [m]; `cells`: how many a cut face gets.
  FacingFaces(const Rectangle& sheet, double depth, const CellCount& cells)
      : sheet_(sheet), depth_(depth), cells_(cells) {}

  // The flat face with which a body faces the pad, cut at the sheet's edge, and its placement. Null if there is none.
  std::shared_ptr<const Face> towards(const Touch& touch, Placement& placement);

 private:
  using CutPlace = std::array<std::int64_t, 3>;   // shift along x and y and angle, in steps
  struct CutFace {
    int body;
    std::size_t side;
    CutPlace place;
    std::weak_ptr<const BodyGeometry> geometry;  // unlike an address, never that of a later geometry
    std::shared_ptr<const Face> face;
  };
  std::shared_ptr<const Face> cut(const Touch& touch, std::size_t side, const Placement& placement);
  std::shared_ptr<const Face> make(const FlatSide& whole, const CutPlace& place);
  bool over_sheet(const Face& face, const Placement& placement) const;
  Rectangle covered(const FlatSide& side, const Placement& placement) const;
  bool leans_below_others(const FlatSide& side, const Touch& touch, const Placement& placement) const;

  Rectangle sheet_;
  double depth_;
  CellCount cells_;
  std::list<CutFace> known_;   // latest used first
  FaceCells cutter_;
};

}  // namespace mjtactile
