#include "flat_press.hpp"

#include <algorithm>

namespace mjtactile {
namespace {

// As the readable reference has them: mjtactile/pressing.py.
constexpr double kFewCells = 16.0, kFewShare = 0.5, kRim = 1e-3;

}  // namespace

bool is_small(const CellContact& contact) {
  const auto& pressed = contact.pressed();
  const auto count = static_cast<double>(std::count(pressed.begin(), pressed.end(), 1));
  return count < std::min(kFewCells, kFewShare * static_cast<double>(pressed.size()));
}

bool FlatPress::solve(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
                      const LawOptions& options, const double* wrench, CellContact::Workspace& workspace) {
  face_ = &face;
  small_ = false;
  std::copy(wrench, wrench + 6, carried_);
  if (!whole_.solve(face, placement, compliance, options, wrench, workspace)) return false;
  if (!is_small(whole_)) return true;
  if (!face.convex) return false;
  outline_.clear();
  for (const Point& corner : face.corners) outline_.push_back(placement(corner));
  // What passes beside the face, or along its very rim, would close in on nothing.
  Point through;
  if (!nearest_inside(outline_, {-wrench[4] / wrench[2], wrench[3] / wrench[2]}, kRim * face.length, through)) return true;
  carried_[3] = through.y * wrench[2];
  carried_[4] = -through.x * wrench[2];
  small_ = true;
  return part_.solve(outline_, compliance, options, carried_, workspace);
}

}  // namespace mjtactile
