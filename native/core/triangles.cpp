#include "triangles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mjtactile {
namespace {

// Points this far outside a triangle, relative to its size, still meet it: no light falls through shared edges.
constexpr double kSeam = 1e-9;
// Triangles steeper than this (the cosine of their normal with the pad's) show only their edge.
constexpr double kSteep = 1e-9;
constexpr std::size_t kLeastBuckets = 4, kMostBuckets = 48;

}  // namespace

void TriangleShadow::cast(const TriangleMesh& mesh, const Pose& pose, const Rectangle& part) {
  part_ = part;
  const std::size_t count = mesh.vertices.size() / 3;
  placed_.resize(3 * count);
  bottom_[2] = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < count; ++v) {
    const double* from = mesh.vertices.data() + 3 * v;
    double* to = placed_.data() + 3 * v;
    for (int i = 0; i < 3; ++i) {
      const double* row = pose.rotation + 3 * i;
      to[i] = pose.position[i] + row[0] * from[0] + row[1] * from[1] + row[2] * from[2];
    }
    if (to[2] < bottom_[2]) std::copy(to, to + 3, bottom_);
  }
  triangles_.clear();
  for (std::size_t f = 0; f < mesh.faces.size(); f += 3) {
    const double* corner[3];
    for (std::size_t k = 0; k < 3; ++k) corner[k] = placed_.data() + 3 * static_cast<std::size_t>(mesh.faces[f + k]);
    Triangle made;
    for (int i = 0; i < 2; ++i) {
      made.low[i] = std::min({corner[0][i], corner[1][i], corner[2][i]});
      made.high[i] = std::max({corner[0][i], corner[1][i], corner[2][i]});
    }
    if (made.low[0] > part.east || made.high[0] < part.west) continue;
    if (made.low[1] > part.north || made.high[1] < part.south) continue;
    double a[3], b[3];
    for (int i = 0; i < 3; ++i) a[i] = corner[1][i] - corner[0][i], b[i] = corner[2][i] - corner[0][i];
    const double normal[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double size = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const bool down = mesh.closed ? normal[2] < -kSteep * size : std::abs(normal[2]) > kSteep * size;
    if (!down) continue;
    const double per = 1.0 / normal[2];
    made.second[0] = b[1] * per, made.second[1] = -b[0] * per;
    made.third[0] = -a[1] * per, made.third[1] = a[0] * per;
    made.second[2] = -(made.second[0] * corner[0][0] + made.second[1] * corner[0][1]);
    made.third[2] = -(made.third[0] * corner[0][0] + made.third[1] * corner[0][1]);
    made.height = corner[0][2], made.second_rise = a[2], made.third_rise = b[2];
    triangles_.push_back(made);
  }
  fill_buckets();
}

std::array<std::size_t, 2> TriangleShadow::bucket(double x, double y) const {
  const auto along = [this](double at) {
    return at <= 0.0 ? std::size_t{0} : std::min(static_cast<std::size_t>(at), side_ - 1);
  };
  return {along((x - part_.west) * per_x_), along((y - part_.south) * per_y_)};
}

// Triangles by the buckets their boxes meet, one bucket after the other.
void TriangleShadow::fill_buckets() {
  const auto wanted = static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles_.size())));
  side_ = std::min(std::max(wanted, kLeastBuckets), kMostBuckets);
  per_x_ = static_cast<double>(side_) / (part_.east - part_.west);
  per_y_ = static_cast<double>(side_) / (part_.north - part_.south);
  starts_.assign(side_ * side_ + 1, 0);
  const auto over_each = [this](const Triangle& triangle, auto&& visit) {
    const auto first = bucket(triangle.low[0], triangle.low[1]), last = bucket(triangle.high[0], triangle.high[1]);
    for (std::size_t row = first[1]; row <= last[1]; ++row) {
      for (std::size_t column = first[0]; column <= last[0]; ++column) visit(row * side_ + column);
    }
  };
  for (const Triangle& triangle : triangles_) over_each(triangle, [this](std::size_t at) { ++starts_[at + 1]; });
  for (std::size_t i = 0; i < side_ * side_; ++i) starts_[i + 1] += starts_[i];
  entries_.resize(starts_.back());
  fill_.assign(starts_.begin(), starts_.end() - 1);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    over_each(triangles_[t], [this, t](std::size_t at) { entries_[fill_[at]++] = static_cast<std::uint32_t>(t); });
  }
}

double TriangleShadow::height(double x, double y, double floor) const {
  double lowest = std::numeric_limits<double>::infinity();
  if (!part_.holds(x, y)) return lowest;
  const auto place = bucket(x, y);
  const std::size_t at = place[1] * side_ + place[0];
  for (std::uint32_t e = starts_[at]; e < starts_[at + 1]; ++e) {
    const Triangle& triangle = triangles_[entries_[e]];
    const double second = triangle.second[0] * x + triangle.second[1] * y + triangle.second[2];
    const double third = triangle.third[0] * x + triangle.third[1] * y + triangle.third[2];
    if (second < -kSeam || third < -kSeam || second + third > 1.0 + kSeam) continue;
    const double here = triangle.height + second * triangle.second_rise + third * triangle.third_rise;
    if (here >= floor && here < lowest) lowest = here;
  }
  return lowest;
}

}  // namespace mjtactile
