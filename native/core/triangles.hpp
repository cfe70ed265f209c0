// Lower surface of a triangle mesh: exact at every point asked for, holes and notches included.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "face.hpp"

namespace mjtactile {

// An upright rectangle of the pad's surface [m].
struct Rectangle {
  double west, south, east, north;

  bool holds(double x, double y) const { return x >= west && x <= east && y >= south && y <= north; }
};

// A rigid triangle mesh in its own frame. Immutable, shared. Of an open mesh both sides of each triangle count.
struct TriangleMesh {
  std::vector<double> vertices;      // (count, 3) [m]
  std::vector<std::int32_t> faces;   // (count, 3), counter-clockwise from outside
  bool closed;
};

// What of a mesh faces a part of the pad, in buckets over it. Cast anew for every pose; its memory is kept.
class TriangleShadow {
 public:
  void cast(const TriangleMesh& mesh, const Pose& pose, const Rectangle& part);
  // Height over (x, y), a point of the part [m]; infinite where there is none at the floor or above.
  double height(double x, double y, double floor) const;
  // The lowest vertex (3) [m].
  const double* bottom() const { return bottom_; }

 private:
  struct Triangle {
    double second[3], third[3];  // the second corner's share at (x, y) and the third's: rates along x, y, value at 0
    double height, second_rise, third_rise;  // of the first corner [m]; of the others above it
    double low[2], high[2];      // of its shadow's box [m]
  };
  void fill_buckets();
  std::array<std::size_t, 2> bucket(double x, double y) const;

  Rectangle part_ = {};
  double per_x_ = 0.0, per_y_ = 0.0;  // buckets per length [1/m]
  std::size_t side_ = 0;              // buckets along each side
  double bottom_[3] = {};
  std::vector<double> placed_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> starts_, entries_, fill_;
};

}  // namespace mjtactile
