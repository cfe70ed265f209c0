// Height maps of a rigid body that consists of shapes, and of a flat face.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/height_map.hpp"
#include "geometry/shape.hpp"

namespace mjtactile {

// One body at one pose. Its memory is kept from pose to pose.
class GapMap : public HeightMap {
 public:
  // Place a body in the pad frame. Only parts within the range of heights count. False if no part of the body can be
  // there.
  bool place(const std::vector<Shape>& shapes, const Pose& pose, const Rectangle& sheet, const HeightRange& range);

  double height(double x, double y) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }
  Rectangle whole() const override { return whole_; }
  const std::vector<Point>& candidates() const override { return candidates_; }
  // Known for a single box.
  bool part_below(const Segment& line, const double (&plane)[2], SegmentPart& part) const override;
  // Whether parts of meshes over the sheet that were left out, because they are beyond the range's reach, come below a
  // plane.
  bool left_out_below(const InclinedPlane& plane);

 private:
  Rectangle sheet_ = {};   // with what rounding may add to points on its rim
  Rectangle bounds_ = {}, whole_ = {};
  double floor_ = 0.0, ceiling_ = 0.0;
  std::size_t count_ = 0;
  std::vector<PlacedShape> placed_;  // only the first `count_` may be over the sheet
  std::vector<Point> candidates_;
};

// A flat face over a pad's sheet: height 0 within its outline.
class FlatMap : public HeightMap {
 public:
  // `outline`: its edges in the pad frame [m]. The face is on the left of each edge.
  void place(const std::vector<Segment>& outline, const Rectangle& sheet);

  double height(double x, double y) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  bool part_below(const Segment& line, const double (&plane)[2], SegmentPart& part) const override;
  double straightened(double angle) const override;
  Rectangle bounds() const override { return bounds_; }
  const std::vector<Point>& candidates() const override { return corners_; }
  const std::vector<Point>& corners() const override { return corners_; }

 private:
  Rectangle sheet_ = {};   // with what rounding may add to points on its rim
  Rectangle bounds_ = {};
  // A point is inside a convex face if it lies left of all sides.
  struct Side {
    double x, y, offset;   // unit normal to the left, and coordinate of the line along it [m]

    double inside(double at_x, double at_y) const { return x * at_x + y * at_y - offset; }
  };
  bool is_inside(double x, double y) const;
  SegmentPart part_between_edges(const Segment& line) const;
  bool set_sides();
  bool convex_ = false;
  double rounding_ = 0.0;   // largest distance to a side of points that lie on it [m]
  std::vector<Side> sides_;
  // For other faces, the edges are listed by the strips along y that they meet. The edges in a point's strip suffice to
  // tell whether the point is inside.
  void fill_strips();
  std::size_t strip(double y) const;
  double south_ = 0.0, per_ = 0.0;             // beginning of the first strip [m], number of strips per length [1/m]
  std::vector<std::uint32_t> firsts_, edges_, fill_;
  std::vector<Point> starts_, ends_, corners_;
};

}  // namespace mjtactile
