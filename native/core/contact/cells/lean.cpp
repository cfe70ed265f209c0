#include "contact/cells/lean.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

constexpr double kMostLean = 0.5;
// The rotation is open if the cells' polar moment is below this fraction of their force times their largest distance
// squared.
constexpr double kOpen = 1e-12;

}  // namespace

void limit_lean(std::vector<Point>& leans) {
  for (Point& lean : leans) {
    const double share = kMostLean / std::max(std::hypot(lean.x, lean.y), kMostLean);
    lean.x *= share, lean.y *= share;
  }
}

void balance_lean(const std::vector<Point>& leans, const Point* points, const double* pressing,
                  std::vector<Point>& balanced) {
  const std::size_t cells = leans.size();
  balanced.assign(cells, {0.0, 0.0});
  double force = 0.0;
  Point centre = {0.0, 0.0}, mean = {0.0, 0.0};
  for (std::size_t i = 0; i < cells; ++i) {
    force += pressing[i];
    centre.x += pressing[i] * points[i].x, centre.y += pressing[i] * points[i].y;
    mean.x += pressing[i] * leans[i].x, mean.y += pressing[i] * leans[i].y;
  }
  if (!(force > 0.0)) return;
  centre.x /= force, centre.y /= force, mean.x /= force, mean.y /= force;
  double polar = 0.0, torsion = 0.0, widest = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    const double x = points[i].x - centre.x, y = points[i].y - centre.y, square = x * x + y * y;
    polar += pressing[i] * square;
    torsion += pressing[i] * (x * (leans[i].y - mean.y) - y * (leans[i].x - mean.x));
    if (pressing[i] > 0.0) widest = std::max(widest, square);
  }
  const double turn = polar > kOpen * force * widest ? torsion / polar : 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    balanced[i] = {leans[i].x - mean.x + turn * (points[i].y - centre.y),
                   leans[i].y - mean.y - turn * (points[i].x - centre.x)};
  }
}

}  // namespace mjtactile
