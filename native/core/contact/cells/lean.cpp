#include "contact/cells/lean.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Largest gradient that counts. Cells at a body's rim can have any gradient.
constexpr double kMostLean = 0.5;
// The rotation is open if the cells' polar moment is below this fraction of their force times their largest distance
// squared.
constexpr double kOpen = 1e-12;

}  // namespace

void balance_lean(const std::vector<Point>& gradients, const Point* points, const double* pressing,
                  std::vector<Point>& leans) {
  const std::size_t cells = gradients.size();
  leans.assign(cells, {0.0, 0.0});
  double force = 0.0;
  for (std::size_t i = 0; i < cells; ++i) force += pressing[i];
  if (!(force > 0.0)) return;
  Point centre = {0.0, 0.0}, mean = {0.0, 0.0};
  for (std::size_t i = 0; i < cells; ++i) {
    const Point& gradient = gradients[i];
    const double share = kMostLean / std::max(std::hypot(gradient.x, gradient.y), kMostLean);
    leans[i] = {share * gradient.x, share * gradient.y};
    centre.x += pressing[i] * points[i].x, centre.y += pressing[i] * points[i].y;
    mean.x += pressing[i] * leans[i].x, mean.y += pressing[i] * leans[i].y;
  }
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
    leans[i].x += turn * (points[i].y - centre.y) - mean.x;
    leans[i].y -= turn * (points[i].x - centre.x) + mean.y;
  }
}

}  // namespace mjtactile
