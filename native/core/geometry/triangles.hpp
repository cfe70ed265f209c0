// Lower surface of a triangle mesh: exact at every point asked for, holes and notches included.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "geometry/polygon.hpp"
#include "geometry/pose.hpp"
#include "geometry/triangle_mesh.hpp"

namespace mjtactile {

// An upright rectangle of the pad's surface [m].
struct Rectangle {
  double west, south, east, north;

  bool holds(double x, double y) const { return x >= west && x <= east && y >= south && y <= north; }
};

// What of a mesh faces a part of the pad, in buckets over it. Cast anew for every pose; its memory is kept. The mesh
// must outlive what is asked after a cast.
class TriangleShadow {
 public:
  // Look at the part of the mesh that faces a part of the pad, from the floor up to `reach` above the lowest of it [m].
  void cast(const TriangleMesh& mesh, const Pose& pose, const Rectangle& part,
            double floor = -std::numeric_limits<double>::infinity(),
            double reach = std::numeric_limits<double>::infinity());
  // Height over (x, y), a point of the part [m]; infinite where there is none at the floor or above. The floor must not
  // be below that of the cast. What is more than the cast's reach above the lowest may be left out: over such points
  // the height is infinite, or of something higher still.
  double height(double x, double y, double floor) const;
  // Set each of the heights to that over its point where it is less. Points that lie on a grid, row by row, take less
  // time.
  void lower(const std::vector<Point>& points, double floor, double* heights) const;
  // The least height over the part at the cast's floor or above [m], the floor itself where the mesh passes through it
  // there; infinite where there is none.
  double lowest() const { return lowest_; }
  // The lowest vertex (3) [m], over the part or not; its height is infinite where the mesh is empty.
  const double* bottom() const { return bottom_; }
  // Points of the lower surface over the part where it may touch first [m]: vertices no neighbour of which is lower,
  // and lowest points of what is cut at the part's rim; of several in one bucket of a coarse grid the lowest.
  void bottoms(std::vector<std::array<double, 3>>& points);

 private:
  static constexpr std::size_t kFinest = 96;  // finest buckets along each side
  struct Triangle {
    double second[3], third[3];  // the second corner's share at (x, y) and the third's: rates along x, y, value at 0
    double height, second_rise, third_rise;  // of the first corner [m]; of the others above it
    std::uint32_t number;        // of the triangle in the mesh
    std::uint8_t first[2], last[2];  // finest buckets that its shadow's box meets, column and row
  };
  struct Span {
    double low, high;
  };
  struct BucketRange {               // columns and rows of buckets
    std::size_t first[2], last[2];
    std::size_t count() const { return (last[0] - first[0] + 1) * (last[1] - first[1] + 1); }
  };
  Span span(const MeshBox& box, int axis) const;
  bool may_face_down(const MeshBox& box) const;
  Span corner_span(std::uint32_t triangle, int axis, double corner[3][3]) const;
  void corners_of(std::uint32_t triangle, double corner[3][3]) const;
  bool faces_down(const double corner[3][3], double normal[3]) const;
  template <typename Reach, typename Visit>
  void walk_down(const double& lowest, Reach&& reach, Visit&& visit);
  void find_bottom();
  void find_lowest();
  void gather();
  void take(std::uint32_t triangle);
  void place_buckets();
  void fill_buckets();
  std::uint8_t finest_bucket(double at, std::size_t axis) const;
  // False where no triangle is met over a rectangle; else the buckets in which all of those are.
  bool buckets_over(const Rectangle& box, BucketRange& range) const;
  template <typename Visit>
  void over(const BucketRange& range, Visit&& visit) const;

  const TriangleMesh* mesh_ = nullptr;
  Pose pose_ = {};
  Rectangle part_ = {};
  double floor_ = 0.0, ceiling_ = 0.0, lowest_ = 0.0;
  double slack_ = 0.0;                // rounding of a box's place [m]
  Rectangle grid_ = {};               // that the buckets cover
  double per_[2] = {};                // finest buckets per length along x and y [1/m]
  std::size_t side_ = 1;              // buckets along each side
  std::uint8_t coarser_[kFinest] = {};  // by finest bucket: the one that holds it
  double bottom_[3] = {};
  std::vector<std::pair<double, std::uint32_t>> queue_;  // boxes still to be looked into, by how low they may be
  std::vector<std::uint32_t> stack_;
  std::vector<Triangle> triangles_;
  std::vector<std::array<Span, 2>> spans_;   // of each, along x and y
  std::vector<std::uint32_t> starts_, entries_, fill_;
  // Of `bottoms`: by vertex, the last call in which it was passed over or done with; candidates by bucket.
  std::vector<std::uint32_t> done_;
  std::uint32_t calls_ = 0;
  std::vector<std::array<double, 3>> inner_, rim_;
};

}  // namespace mjtactile
