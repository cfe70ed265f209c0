// A rigid body over a pad's sheet, seen from the shapes it consists of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/height_map.hpp"
#include "geometry/shape.hpp"

namespace mjtactile {

// One body at one pose; its memory is kept from pose to pose.
class GapMap : public HeightMap {
 public:
  // Heights of what lies between `floor` and `ceiling` [m]: what is lower stands beside the pad, what is higher is out of
  // reach. False where nothing of the body can be there.
  bool place(const std::vector<Shape>& shapes, const Pose& pose, const Rectangle& sheet, double floor, double ceiling);

  double height(double x, double y) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }
  const std::vector<Point>& candidates() const override { return candidates_; }
  // Height of the lowest point of the parts that reach over the sheet, below the floor or not [m].
  double bottom() const { return bottom_; }

 private:
  Rectangle sheet_ = {}, bounds_ = {};
  double floor_ = 0.0, ceiling_ = 0.0, bottom_ = 0.0;
  std::size_t count_ = 0;
  std::vector<PlacedShape> placed_;  // the first `count_` may be over the sheet
  std::vector<Point> candidates_;
};

// A flat face over a pad's sheet: of height 0 within its outline.
class FlatMap : public HeightMap {
 public:
  // `edges`: of the outline in the pad frame, (count), each with the face on its left.
  void place(const std::vector<Point>& starts, const std::vector<Point>& ends, const Rectangle& sheet);

  double height(double x, double y) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }
  const std::vector<Point>& candidates() const override { return candidates_; }

 private:
  Rectangle sheet_ = {}, bounds_ = {};
  bool convex_ = false;   // then inside is what lies left of all edges
  // Else edges by strips along y that they meet, strip after strip: only those beside a point tell whether it is inside.
  void fill_strips();
  std::size_t strip(double y) const;
  double south_ = 0.0, per_ = 0.0;             // where the first strip begins [m], strips per length [1/m]
  std::vector<std::uint32_t> firsts_, edges_, fill_;
  std::vector<Point> starts_, ends_, candidates_;
};

}  // namespace mjtactile
