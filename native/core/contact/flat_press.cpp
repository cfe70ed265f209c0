#include "contact/flat_press.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

constexpr double kFewCells = 16.0, kFewShare = 0.5;

}  // namespace

bool is_small(const CellContact& contact) {
  const auto& pressed = contact.pressed();
  const auto count = static_cast<double>(std::count(pressed.begin(), pressed.end(), 1));
  return count < std::min(kFewCells, kFewShare * static_cast<double>(pressed.size()));
}

bool FlatPress::solve(const Face& face, const Placement& placement, const Rectangle& sheet,
                      const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
                      CellContact::Workspace& workspace) {
  face_ = &face;
  placement_ = placement;
  small_ = false;
  if (!(wrench[2] < 0.0)) return false;
  whole_.place(face, placement, compliance, options, workspace);
  whole_.press(face, compliance, options, wrench, workspace);
  if (whole_.exact() && whole_.linear() && !is_small(whole_)) return true;
  starts_.clear();
  ends_.clear();
  for (const CellEdge& edge : face.edges) {
    if ((edge.left >= 0) == (edge.right >= 0)) continue;
    const Point start = placement({edge.start[0], edge.start[1]}), end = placement({edge.end[0], edge.end[1]});
    starts_.push_back(edge.left >= 0 ? start : end);
    ends_.push_back(edge.left >= 0 ? end : start);
  }
  map_.place(starts_, ends_, sheet);
  small_ = part_.solve(map_, sheet, compliance, options, wrench, workspace);
  if (!small_) whole_.place(face, placement, compliance, options, workspace);  // the workspace was the other's
  return true;
}

bool FlatPress::tips_over() const {
  const double tilt = small_ ? part_.tilt() : std::hypot(whole_.slopes()[0], whole_.slopes()[1]);
  return tilt > face_->most_slope;
}

void FlatPress::press_again(const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
                            const std::vector<double>& sunk, CellContact::Workspace& workspace) {
  if (small_) {
    part_.press_again(compliance, options, wrench, sunk, workspace);
  } else {
    whole_.press(*face_, compliance, options, wrench, workspace, sunk.data(), nullptr);
  }
}

}  // namespace mjtactile
