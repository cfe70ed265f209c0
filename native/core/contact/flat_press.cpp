#include "contact/flat_press.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// What is pressed is few cells below this number of them, or below this share of the face's. Of 700 flat faces that
// lift off in part, on three pads and two levels, these leave none of the fast readings over 15 % from 2,500 cells (six
// at 16 cells and half of the face), and two of the balanced ones over 6 % (eight).
constexpr double kFewCells = 28.0, kFewShare = 0.7;
// A rigid flat punch under a load a quarter of its width from its rim begins to lift off on the other side (Johnson,
// Contact Mechanics, 1985, section 2.8): loads closer to the rim press a strip four times as wide as they are away from
// it. A strip that holds less than this share of what are few cells is not tried.
constexpr double kStrip = 4.0, kSurelyFew = 0.7;

double few(std::size_t cells) { return std::min(kFewCells, kFewShare * static_cast<double>(cells)); }

// Whether a load that passes through a point of a face's frame leaves few of its cells pressed, by far.
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
  const bool tried = !surface.options.tilting || !surface.options.law->shapes() ||
                     !surely_few(face, placement.back(-wrench[4] / wrench[2], wrench[3] / wrench[2]));
  if (tried) {
    press_whole();
    if (whole_.exact() && whole_.linear() && !is_small(whole_)) return true;
  }
  starts_.clear();
  ends_.clear();
  for (const CellEdge& edge : face.edges) {
    if ((edge.left >= 0) == (edge.right >= 0)) continue;
    const Point start = placement({edge.start[0], edge.start[1]}), end = placement({edge.end[0], edge.end[1]});
    starts_.push_back(edge.left >= 0 ? start : end);
    ends_.push_back(edge.left >= 0 ? end : start);
  }
  map_.place(starts_, ends_, surface.sheet);
  small_ = part_.solve(map_, surface, wrench, workspace);
  if (small_) return true;
  if (tried) {
    whole_.place(face, placement, surface, workspace);  // the workspace was the other's
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
