// Bodies over a curved pad, as height maps of a tangent plane: how far each is from the surface.
#pragma once

#include <vector>

#include "geometry/height_map.hpp"
#include "geometry/tangent_plane.hpp"

namespace mjtactile {

// Distance of a body from the surface along the plane's normal. The body's heights are over the plane.
class SurfaceMap : public HeightMap {
 public:
  // What is nearer than `floor` or farther than `ceiling` [m] is left out.
  void place(const HeightMap& body, const TangentPlane& plane, double floor, double ceiling);

  double height(double u, double v) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }
  const std::vector<Point>& candidates() const override { return candidates_; }

 private:
  double over_surface(double height, double surface) const;

  const HeightMap* body_ = nullptr;
  const TangentPlane* plane_ = nullptr;
  double floor_ = 0.0, ceiling_ = 0.0;
  Rectangle bounds_ = {};
  std::vector<Point> candidates_;
  mutable std::vector<double> surface_;   // kept: nothing is allocated in a step
};

// A body that is known by its heights z(x, y) in the pad frame, seen from a tangent plane.
class TurnedMap : public HeightMap {
 public:
  void place(const HeightMap& upright, const TangentPlane& plane);

  double height(double u, double v) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }

 private:
  struct Line {           // over a point of the plane
    std::size_t place;    // among those that were asked for
    double w, last, missed, rises;   // where it is looked at, and before; how far off; how fast it rises over the surface
  };
  void look(const std::vector<Point>& points) const;

  const HeightMap* upright_ = nullptr;
  const TangentPlane* plane_ = nullptr;
  Rectangle bounds_ = {};
  mutable std::vector<Line> lines_;
  mutable std::vector<Point> asked_, one_;   // points of the pad's plane below those that are looked at
  mutable std::vector<double> found_;
};

}  // namespace mjtactile
