// Outlines of flat faces: rings of corners, convex or not.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/pose.hpp"

namespace mjtactile {

// Rings of corners [m]. Outer rings run counter-clockwise, holes clockwise. A face may have several pieces.
struct Outline {
  std::vector<std::vector<Point>> rings;
};

// Place an outline on the pad and clip it at the sheet's rectangle; `result` is in the pad frame [m]. False if nothing
// is left.
bool clip_outline(const Outline& outline, const Placement& placement, const Rectangle& sheet, Outline& result);

// The outline of what several pieces cover together. Pieces may overlap, lie side by side, and touch. Points within
// `same` of each other are one [m]. Empty if that leaves no area, or no closed rings.
Outline united(const Outline& pieces, double same);

// The share of an outline's length, after it was clipped, that lies on the sheet's rim [-].
double share_on_rim(const Outline& clipped, const Rectangle& sheet);

// The area that a ring encloses [m^2], negative if the ring runs clockwise; and that of an outline.
double signed_area(const std::vector<Point>& ring);
double signed_area(const Outline& outline);
// The length of a ring [m].
double perimeter(const std::vector<Point>& ring);

// The least rectangle that contains an outline.
Rectangle around(const Outline& outline);

// Mark the corners of a closed loop that lie off the line through their neighbours by more than a tolerance [m], by the
// algorithm of Douglas and Peucker. Those from `from` to `to` are looked at, whose numbers may go on beyond the loop's
// end. If two corners are equally far from the line, both are kept, so that symmetric outlines stay symmetric.
void keep_corners(const std::vector<Point>& loop, std::size_t from, std::size_t to, double tolerance,
                  std::vector<std::uint8_t>& kept);

// An outline as it is divided: its rings, here called loops, about the middle of their bounds and along axes of their
// own. Corners and loops that make no difference are left out. It keeps its memory between calls.
class OutlineLoops {
 public:
  // `angle`: of the axes [rad]. False if the outline encloses no area.
  bool set(const Outline& outline, double angle);
  // Remove corners that change the outline by less than a tolerance [m].
  void simplify(double tolerance);

  const std::vector<std::vector<Point>>& loops() const { return own_.rings; }
  std::size_t corners() const;
  std::size_t outer_loops() const { return outer_loops_; }
  double area() const { return area_; }        // [m^2]
  double length() const { return length_; }    // [m]
  double width() const { return width_; }      // of the bounds, along the axes [m]
  double height() const { return height_; }
  double extent() const { return std::max(width_, height_); }
  // Where a point is in the frame in which the outline was given [m].
  Point placed(const Point& at) const;

 private:
  bool find_extent(const Outline& outline);
  bool is_redundant(const Point& before, const Point& at, const Point& after) const;
  void add_corners(const std::vector<Point>& ring, std::vector<Point>& loop) const;
  void close(std::vector<Point>& loop) const;

  Outline own_;
  double cosine_ = 1.0, sine_ = 0.0;
  Point middle_ = {0.0, 0.0};
  double width_ = 0.0, height_ = 0.0, area_ = 0.0, length_ = 0.0;
  std::size_t outer_loops_ = 0;
  std::vector<std::uint8_t> kept_;
};

}  // namespace mjtactile
