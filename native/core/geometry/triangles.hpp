// The lower surface of a triangle mesh, exact at every point, including holes and notches.
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
#include "linalg/kernels.hpp"

namespace mjtactile {

// The triangles of a mesh that face a part of the pad, sorted into buckets over that part. Those of a fine mesh are
// sorted in clusters of neighbours, and are placed when a height over their cluster is first asked for. cast() is
// called for every pose; memory is kept. The mesh must live as long as the functions after cast() are used. A shadow
// must not be used by two threads at once.
class TriangleShadow {
 public:
  // Find the triangles of a mesh that face the rectangle `part`, from the height `floor` up to `reach` above the lowest
  // point there, or above the height `level` where that is higher [m].
  void cast(const TriangleMesh& mesh, const Pose& pose, const Rectangle& part, double floor, double reach,
            double level);
  // Height over (x, y), a point of the part [m]; infinite if there is no surface at the floor or above. The floor must
  // not be below that of the cast. Surfaces beyond the cast's reach may be left out; the height over their points is
  // infinite, or that of a higher surface.
  double height(double x, double y, double floor) const;
  // Lower each of the given heights (points) [m] to that of the mesh over the same point, if that is less. This is
  // faster if the points lie on a grid, row by row.
  void lower(const std::vector<Point>& points, double floor, double* heights) const;
  // The least height over the part at the cast's floor or above [m]. It is the floor itself if the mesh passes through
  // the floor there, and infinite if there is no surface.
  double lowest() const { return lowest_; }
  // Whether triangles over the part that were left out, because they are beyond the cast's reach, come below a plane.
  bool left_out_below(const InclinedPlane& plane);
  // Points over the part where the mesh may touch first [m]: vertices without a lower neighbour, and the lowest points
  // of triangles that are cut at the part's rim. Only the lowest in each bucket of a coarse grid is kept.
  void bottoms(std::vector<std::array<double, 3>>& points);

 private:
  static constexpr std::size_t kFinest = 96;  // finest buckets along each side
  static constexpr std::ptrdiff_t kEight = 8;   // points that a kernel processes at once
  struct Span {
    double low, high;
  };
  static constexpr std::uint32_t kNotPlaced = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::uint32_t kAsked = kNotPlaced - 1;   // of a bucket that is packed if it is asked for again
  struct Cluster {                 // the triangles of a box of the mesh, or one of them
    Span x, y;                     // bounds along x and y [m]
    double low;                    // least height that it may have [m]
    std::uint32_t first, count;    // its triangles in the mesh
    std::uint32_t placed;          // number of its first block; kNotPlaced before they are placed
    std::uint8_t lane;             // place in the block, if it is one triangle
    std::uint8_t from[2], to[2];   // finest buckets that its bounds meet: column and row
    bool inside;                   // whether it is wholly over the part
    bool turns_up;                 // whether it may have a vertex without a lower neighbour

    std::size_t blocks() const { return (count + kTriangles - 1) / kTriangles; }
  };
  struct BucketRange {               // columns and rows of buckets
    std::size_t first[2], last[2];
    std::size_t count() const { return (last[0] - first[0] + 1) * (last[1] - first[1] + 1); }
  };
  struct PaddedPoints {   // points and heights over them, followed by eight more
    std::vector<double> x, y, heights;

    void set(const std::vector<Point>& points, const double* given);
    std::size_t count() const { return x.size() - std::size_t{kEight}; }
    PointRows row(std::size_t from, std::size_t end) const;
  };
  Span span(const MeshBox& box, int axis) const;
  // Bounds that also hold points which are on them but for rounding. Vertices are placed here and by a kernel, whose
  // rounding differs.
  Span widened(const Span& bounds) const { return {bounds.low - slack_, bounds.high + slack_}; }
  bool is_beside(const Span& x, const Span& y) const;
  bool may_face_down(const MeshBox& box) const;
  Span corner_span(std::uint32_t triangle, int axis, double corner[3][3]) const;
  void corners_of(std::uint32_t triangle, double corner[3][3]) const;
  bool faces_down(const double corner[3][3]) const;
  void find_lowest();
  void gather();
  void add_triangles(const MeshBox& box);
  bool is_inside(const Span& x, const Span& y) const;
  const Cluster& placed(std::uint32_t cluster) const;
  std::uint32_t packed(std::size_t bucket) const;
  void place(std::uint32_t first, std::uint32_t count) const;
  template <typename Visit>
  void each_triangle(const Cluster& cluster, Visit&& visit) const;
  void place_buckets();
  void fill_buckets();
  bool may_be_lowest(const NormalBounds& ring) const;
  bool is_lowest_of_ring(std::size_t vertex) const;
  void offer_vertices(std::uint32_t triangle);
  void offer_cuts(std::uint32_t triangle);
  void offer(std::vector<std::array<double, 3>>& candidates, const std::array<double, 3>& spot);
  bool is_lowest_on_rim(std::size_t at) const;
  std::uint8_t finest_bucket(double at, std::size_t axis) const;
  // The buckets that hold all triangles over a rectangle. False if there are none.
  bool buckets_over(const Rectangle& box, BucketRange& range) const;
  void lower_by_eights(double floor, PaddedPoints& points) const;
  std::size_t entries_of(const BucketRange& range) const;   // clusters, in every bucket that they meet
  template <typename Visit>
  void over(const BucketRange& range, Visit&& visit) const;

  const TriangleMesh* mesh_ = nullptr;
  Pose pose_ = {};
  Rectangle part_ = {};
  double floor_ = 0.0, ceiling_ = 0.0, lowest_ = 0.0;
  bool fine_ = false;                 // whether clusters have several triangles; else each is one
  bool cut_ = false;                  // whether triangles over the part may be left out
  double slack_ = 0.0;                // rounding error of a box's position [m]
  Rectangle grid_ = {};               // area that the buckets cover
  double per_[2] = {};                // number of finest buckets per length along x and y [1/m]
  std::size_t side_ = 1;              // number of buckets along each side
  std::uint8_t coarser_[kFinest] = {};  // for each finest bucket: the bucket that holds it
  std::vector<std::pair<double, std::uint32_t>> queue_;  // boxes still to be searched, with their least possible height
  // Mutable, because triangles are placed when they are first needed.
  mutable std::vector<Cluster> clusters_;
  mutable std::vector<TriangleBlock> blocks_;
  mutable std::vector<TriangleBounds> bounds_;   // of each block
  std::vector<std::uint32_t> starts_, entries_, fill_;   // clusters by bucket
  // Where clusters are single triangles: those of each bucket that was looked up twice, together, and its first block.
  mutable std::vector<TriangleBlock> packed_;
  mutable std::vector<std::uint32_t> packed_firsts_;
  // For `bottoms`: for each vertex, the last call in which it was dealt with; and candidates by bucket.
  std::vector<std::uint32_t> done_;
  std::uint32_t calls_ = 0;
  std::vector<std::array<double, 3>> inner_, rim_;
};

}  // namespace mjtactile
