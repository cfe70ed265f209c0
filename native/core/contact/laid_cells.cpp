#include "contact/laid_cells.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Cells that are cut off at their largest height end inside the contact if more than kGoesOn of them press. This counts
// only if the other cells have more than kOthersAtLeast times their area, which is no ratio of a few equal areas.
constexpr double kGoesOn = 0.5, kOthersAtLeast = 0.503;
// Least approach along a cell's own normal over that along the plane's normal.
constexpr double kLeastLean = 0.5;
// Cells lie in one row across a tilt if it lifts their middles apart by less than this, over its rise along one cell.
constexpr double kOneRow = 0.5;

bool any(const std::vector<std::uint8_t>& flags) { return std::find(flags.begin(), flags.end(), 1) != flags.end(); }
bool all(const std::vector<std::uint8_t>& flags) { return std::find(flags.begin(), flags.end(), 0) == flags.end(); }

}  // namespace

SampledLattices& LaidCells::see(const HeightWindow& view) {
  view_ = view;
  return cells_.lattices();
}

bool LaidCells::lay(const ContactSurface& surface, CellContact::Workspace& workspace) {
  cells_.lay(view_);
  if (cells_.heights().empty()) return false;
  position(surface, workspace);
  return true;
}

bool LaidCells::split(const std::vector<std::uint8_t>& chosen, const ContactSurface& surface,
                      std::vector<std::uint8_t>& start, CellContact::Workspace& workspace) {
  cells_.split(chosen, view_, surface.options.narrowest, from_);
  if (cells_.heights().empty()) return false;
  position(surface, workspace);
  start.clear();
  for (const std::size_t from : from_) start.push_back(pressed()[from]);
  return true;
}

// Place the cells that are laid on the pad and under the body.
void LaidCells::position(const ContactSurface& surface, CellContact::Workspace& workspace) {
  cells_.finish(surface.sheet, surface.compliance.resolution());
  bends_ = surface.plane != nullptr;
  if (bends_) bent_.lay(face(), *surface.plane);
  place(surface, workspace);
  set_heights();
}

void LaidCells::place(const ContactSurface& surface, CellContact::Workspace& workspace) {
  contact_.place(face(), kUnmoved, surface, workspace, bends_ ? &bent_ : nullptr);
}

// On a curved pad the height is measured along the cell's own normal, to first order in the slopes.
void LaidCells::set_heights() {
  heights_ = cells_.heights();
  for (std::size_t i = 0; bends_ && i < count(); ++i) {
    const Point& gradient = cells_.gradients()[i];
    const double *slopes = bent_.slopes().data() + 2 * i, stretch = bent_.stretches()[i];
    const double leans = (slopes[0] * gradient.x + slopes[1] * gradient.y) / (stretch * stretch);
    heights_[i] /= std::max(1.0 + leans, kLeastLean);
  }
}

void LaidCells::press(const ContactSurface& surface, const double* wrench, const std::vector<std::uint8_t>& start,
                      bool overloads, CellContact::Workspace& workspace) {
  const bool known = std::count(start.begin(), start.end(), 1) >= 3;
  contact_.press(face(), surface, {wrench, heights_.data(), known ? start.data() : nullptr, overloads}, workspace);
}

void LaidCells::press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                            CellContact::Workspace& workspace) {
  set_heights();
  for (std::size_t i = 0; i < count(); ++i) heights_[i] += sunk[i];
  const std::vector<std::uint8_t> start = pressed();
  contact_.press(face(), surface, {wrench, heights_.data(), start.data()}, workspace);
}

double LaidCells::lifted(const double* slopes) const {
  double least = kNowhere, most = -kNowhere;
  for (std::size_t i = 0; i < count(); ++i) {
    if (!pressed()[i]) continue;
    const Point& at = face().centroids[i];
    const double lift = slopes[0] * at.x + slopes[1] * at.y;
    least = std::min(least, lift), most = std::max(most, lift);
  }
  return std::max(most - least, 0.0);
}

bool LaidCells::tilts_openly() const {
  const double* slopes = contact_.slopes();
  const auto count = static_cast<double>(std::count(pressed().begin(), pressed().end(), 1));
  const double rise = std::hypot(slopes[0], slopes[1]) * std::sqrt(contact_.pressed_area() / count);
  return count > 0.0 && rise > contact_.indentation() && lifted(slopes) < kOneRow * rise;
}

bool LaidCells::centre(Point& at) const {
  double force = 0.0;
  Point moment = {0.0, 0.0};
  for (std::size_t i = 0; i < count(); ++i) {
    const double own = contact_.normal()[i];
    force += own;
    moment.x += own * face().centroids[i].x, moment.y += own * face().centroids[i].y;
  }
  at = {moment.x / force, moment.y / force};
  return force > 0.0;
}

double LaidCells::energy(double force) const {
  double sum = contact_.energy() + force * view_.lowest;
  for (std::size_t i = 0; i < count(); ++i) sum += contact_.normal()[i] * heights_[i];
  return sum;
}

bool LaidCells::goes_beyond() const {
  std::size_t at_end = 0, ends = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    ends += cells_.goes_on()[i];
    at_end += cells_.goes_on()[i] && pressed()[i];
  }
  return static_cast<double>(at_end) > kGoesOn * static_cast<double>(ends);
}

// In a single row all cells are cut off at their sides, so that decides nothing.
bool LaidCells::ends_early() const {
  double within = 0.0, at_end = 0.0;
  for (std::size_t i = 0; i < count(); ++i) (cells_.goes_on()[i] ? at_end : within) += face().areas[i];
  return goes_beyond() && within > kOthersAtLeast * at_end;
}

bool LaidCells::all_press() const { return all(pressed()) && !any(cells_.goes_on()); }

// A body that tilts is seen from another plane next, where the lowest cell tells more than those at its raised end.
double LaidCells::touched_height(bool tilting) const {
  if (!tilting) return contact_.lowered();
  double lowest = kNowhere;
  for (std::size_t i = 0; i < count(); ++i) {
    if (pressed()[i]) lowest = std::min(lowest, heights_[i]);
  }
  return contact_.indentation() + std::max(lowest, 0.0);
}

double LaidCells::lowered_at_origin() const {
  const double* slopes = contact_.slopes();
  double deepest = -kNowhere;
  for (std::size_t i = 0; i < count(); ++i) {
    const Point& at = face().centroids[i];
    if (!pressed()[i]) continue;
    deepest = std::max(deepest, slopes[0] * at.x + slopes[1] * at.y - heights_[i]);
  }
  return contact_.indentation() - deepest;
}

InclinedPlane LaidCells::reached() const {
  const double* slopes = contact_.slopes();
  const bool tilts = slopes[0] != 0.0 || slopes[1] != 0.0;
  const double lowered = tilts ? lowered_at_origin() : contact_.lowered();
  return {{view_.slopes[0] + slopes[0], view_.slopes[1] + slopes[1]},
          view_.lowest - view_.slopes[0] * view_.middle.x - view_.slopes[1] * view_.middle.y + lowered};
}

double LaidCells::tilt() const {
  return std::hypot(view_.slopes[0] + contact_.slopes()[0], view_.slopes[1] + contact_.slopes()[1]);
}

}  // namespace mjtactile
