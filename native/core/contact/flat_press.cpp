#include "contact/flat_press.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// The face's own cells are too coarse if those at which the contact ends take more than this share of the pressed area.
// Measured on 1,000 flat faces that lift off in part, on six pads, against 1,600 cells: 12.7 % at most at "fast" and
// 4.7 % at "balanced". When pressed cells were counted instead, 3 were off by more than 15 % and 17 by more than 6 %.
constexpr double kCoarseEnd = 0.27;
// A rigid flat punch begins to lift off on the far side if its load is a quarter of its width from the rim (Johnson,
// Contact Mechanics, 1985, section 2.8). Loads closer to the rim press a strip kStrip times as wide as their distance
// from it. If that strip is less than kNarrow cells wide, the face's own cells are not tried.
constexpr double kStrip = 4.0, kNarrow = 2.5;

// Whether a load through a point of the face's frame certainly presses a strip of few cells.
bool surely_narrow(const Face& face, const Point& at) {
  double pressed = 1.0;
  for (std::size_t i = 0; i < face.corners.size(); ++i) {
    const Point &start = face.corners[i], &end = face.corners[(i + 1) % face.corners.size()];
    double depth = 0.0;
    for (const Point& corner : face.corners) depth = std::max(depth, left_of(start, end, corner));
    pressed = std::min(pressed, kStrip * left_of(start, end, at) / depth);
  }
  return pressed * std::sqrt(static_cast<double>(face.cells())) < kNarrow;
}

}  // namespace

bool ends_coarsely(const Face& face, const CellContact& contact, std::vector<std::uint8_t>& at_end) {
  const std::vector<std::uint8_t>& pressed = contact.pressed();
  at_end.assign(face.cells(), 0);
  for (const CellEdge& edge : face.edges) {
    if (edge.left < 0 || edge.right < 0) continue;
    const auto left = static_cast<std::size_t>(edge.left), right = static_cast<std::size_t>(edge.right);
    if (pressed[left] != pressed[right]) at_end[pressed[left] ? left : right] = 1;
  }
  double all = 0.0, ends = 0.0;
  for (std::size_t i = 0; i < face.cells(); ++i) {
    if (pressed[i]) all += face.areas[i];
    if (at_end[i]) ends += face.areas[i];
  }
  return ends > kCoarseEnd * all;
}

bool FlatPress::solve(const Face& face, const Placement& placement, const ContactSurface& surface, const double* wrench,
                      CellContact::Workspace& workspace) {
  face_ = &face;
  on_part_ = false;
  if (!(wrench[2] < 0.0)) return false;
  const auto press_whole = [&]() {
    whole_.place(face, placement, surface, workspace);
    whole_.press(face, surface, {wrench}, workspace);
  };
  const Point at = centre_of_pressure(wrench);
  const bool tried = !surface.options.tilting || !surface.options.law->shapes() ||
                     !surely_narrow(face, placement.back(at.x, at.y));
  if (tried) {
    press_whole();
    if (whole_.exact() && whole_.linear() && !ends_coarsely(face, whole_, at_end_)) return true;
  }
  find_outline(face, placement, outline_);
  map_.place(outline_, surface.sheet);
  on_part_ = part_.solve(map_, surface, wrench, workspace);
  if (on_part_) {
    // A narrow strip is all rim, and its cells are small.
    if (tried) part_.refine_rim(map_, surface, wrench, workspace);
    return true;
  }
  if (tried) {
    whole_.place(face, placement, surface, workspace);  // the workspace has the cells of part_
  } else {
    press_whole();
  }
  return true;
}

bool FlatPress::reaches(const Onset& onset) const {
  const double tilt = on_part_ ? part_.tilt() : std::hypot(whole_.slopes()[0], whole_.slopes()[1]);
  return onset.reached(tilt, contact().indentation());
}

InclinedPlane FlatPress::lowered(const Point& at) const {
  const InclinedPlane on_part = on_part_ ? part_.reached() : InclinedPlane{};
  const double* slopes = on_part_ ? on_part.slopes : whole_.slopes();
  return {{slopes[0], slopes[1]}, contact().indentation() - slopes[0] * at.x - slopes[1] * at.y};
}

void FlatPress::press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                            CellContact::Workspace& workspace) {
  if (on_part_) {
    part_.press_again(surface, wrench, sunk, workspace);
  } else {
    whole_.press(*face_, surface, {wrench, sunk.data()}, workspace);
  }
}

}  // namespace mjtactile
