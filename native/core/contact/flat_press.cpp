#include "contact/flat_press.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// The pressed cells are few if they are less than this number, or less than this share of the face's cells. Measured on
// 700 flat faces that lift off in part, on three pads and two fidelities, against 2,500 cells: no reading of fidelity
// "fast" is off by more than 15 %, and two of "balanced" by more than 6 %. With limits of 16 cells and half of the face
// these were six and eight.
constexpr double kFewCells = 28.0, kFewShare = 0.7;
// A rigid flat punch begins to lift off on the far side if its load is a quarter of its width from the rim (Johnson,
// Contact Mechanics, 1985, section 2.8). Loads closer to the rim press a strip kStrip times as wide as their distance
// from it. If that strip has less than the fraction kSurelyFew of what counts as few cells, the face's own cells are
// not tried.
constexpr double kStrip = 4.0, kSurelyFew = 0.7;

double few(std::size_t cells) { return std::min(kFewCells, kFewShare * static_cast<double>(cells)); }

// Whether a load through a point of the face's frame certainly presses too few of its cells.
bool surely_few(const Face& face, const Point& at) {
  double pressed = 1.0;
  for (std::size_t i = 0; i < face.corners.size(); ++i) {
    const Point &start = face.corners[i], &end = face.corners[(i + 1) % face.corners.size()];
    double depth = 0.0;
    for (const Point& corner : face.corners) depth = std::max(depth, left_of(start, end, corner));
    pressed = std::min(pressed, kStrip * left_of(start, end, at) / depth);
  }
  return pressed * static_cast<double>(face.cells()) < kSurelyFew * few(face.cells());
}

}  // namespace

bool is_small(const CellContact& contact) {
  const auto& pressed = contact.pressed();
  const auto count = static_cast<double>(std::count(pressed.begin(), pressed.end(), 1));
  return count < few(pressed.size());
}

bool FlatPress::solve(const Face& face, const Placement& placement, const ContactSurface& surface, const double* wrench,
                      CellContact::Workspace& workspace) {
  face_ = &face;
  placement_ = placement;
  small_ = false;
  if (!(wrench[2] < 0.0)) return false;
  const auto press_whole = [&]() {
    whole_.place(face, placement, surface, workspace);
    whole_.press(face, surface, {wrench}, workspace);
  };
  const Point at = centre_of_pressure(wrench);
  const bool tried = !surface.options.tilting || !surface.options.law->shapes() ||
                     !surely_few(face, placement.back(at.x, at.y));
  if (tried) {
    press_whole();
    if (whole_.exact() && whole_.linear() && !is_small(whole_)) return true;
  }
  find_outline(face, placement, outline_);
  map_.place(outline_, surface.sheet);
  small_ = part_.solve(map_, surface, wrench, workspace);
  if (small_) return true;
  if (tried) {
    whole_.place(face, placement, surface, workspace);  // the workspace has the cells of part_
  } else {
    press_whole();
  }
  return true;
}

bool FlatPress::tips_over() const {
  const double tilt = small_ ? part_.tilt() : std::hypot(whole_.slopes()[0], whole_.slopes()[1]);
  return tilt > face_->tips_at;
}

void FlatPress::press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                            CellContact::Workspace& workspace) {
  if (small_) {
    part_.press_again(surface, wrench, sunk, workspace);
  } else {
    whole_.press(*face_, surface, {wrench, sunk.data()}, workspace);
  }
}

}  // namespace mjtactile
