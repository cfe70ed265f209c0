// Search for contact: the parts of the surface that a rigid body's lower side comes close enough to.
//
// Heights of the body are measured from a plane that moves with it; parts below a level are in contact. The level is the
// one at which these parts carry the force: a part of an elastic half space pressed to a depth d carries about
// E* d P / 2, where P is its perimeter:
// 2.7 E* a d under a ball, 2 E* a d under a punch, pi / 2 E* L d under a long cylinder (Johnson, Contact Mechanics, 1985,
// chapters 3 and 4), which it meets within a third.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/lattice.hpp"
#include "contact/solvers/rising_heights.hpp"
#include "contact/solvers/springs.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

// A tilt of the body: slopes along x and y about a point, which are subtracted from heights.
struct Plane {
  double slopes[2];
  Point middle;

  double operator()(double x, double y) const { return slopes[0] * (x - middle.x) + slopes[1] * (y - middle.y); }
};

// A part of the surface that may touch.
struct Spot {
  Region region;
  double area;     // of it that lies under the level [m^2]
  double length;   // half the perimeter of that [m]
};

// The load to carry.
struct SearchLoad {
  double force;        // pressing [N]
  Point through;       // where its line meets the surface
  double modulus;      // E* of a half space that gives like the surface [Pa]
  double least_area;   // that the force needs [m^2]
  double reach = 0.0;  // height up to which it was found to touch; 0 where that is not known [m]
};

class ContactSearch {
 public:
  // Sample the heights of a body; false if no part of it faces the pad.
  bool look(const HeightMap& map);
  // Parts below the level that carries the load, measured from a plane.
  const std::vector<Spot>& find(const HeightMap& map, const Plane& plane, const SearchLoad& load);
  // Height of the level above the plane through the lowest point [m], and of that point above the given plane.
  double level() const { return level_; }
  // The same without a least area.
  double loaded() const { return loaded_; }
  double lowest() const { return lowest_; }
  // Height up to which the spots reach [m]: above the level where one was found to touch, or nearly touches.
  double reached() const { return reached_; }
  // Whether the whole body that faces the pad is below the level, so that another plane would find no more parts.
  bool sees_all() const { return sees_all_; }
  // Whether the load's line of action passes through the convex hull of the parts.
  bool supported(const SearchLoad& load) const;
  // Convex hull of what the body covers, counter-clockwise.
  std::vector<Point> covered() const;
  // Share of a tilt after which the body, seen from a plane, has come down to a height at some point outside the given
  // regions; infinite where it never does.
  double share_until(const Plane& seen, const Plane& tilt, double height, const std::vector<Region>& regions) const;
  // Slopes at which the body rests on springs under the load; for an inclined body, the face that it tilts onto follows.
  Plane resting(const SearchLoad& load);

 private:
  struct Part {          // a connected part of what is under the level
    Region region;       // looked at
    double cosine, sine; // of its angle
    std::size_t columns, rows;
    double cell;         // area that each of its points stands for [m^2]
    std::vector<double> heights;
  };
  Point grid_point(std::size_t sample) const;
  void set_heights(const Plane& plane);
  void flood(const SearchLoad& load);
  void connect();
  std::size_t root(std::size_t sample);
  void gather_parts();
  void look_closer(const HeightMap& map, const Plane& plane, Part& part);
  void set_level(const SearchLoad& load);
  double perimeter(const Part& part, double level, double& area);
  Region region_under(const Part& part, double level, double& area, std::size_t& count);
  Point point_of(const Part& part, std::size_t place) const;

  static constexpr std::size_t kLines = 33;
  Rectangle bounds_ = {};
  std::vector<Point> points_, closer_;
  std::vector<std::size_t> moved_;   // samples whose points are none of the grid's
  std::vector<double> raw_, heights_;
  RisingHeights rising_;
  std::vector<std::size_t> parents_;
  std::vector<std::uint8_t> under_, under_closer_;
  std::vector<std::vector<Point>> members_;
  std::vector<std::size_t> labels_;
  std::vector<Part> parts_;
  std::size_t part_count_ = 0;
  std::vector<Spot> spots_;
  std::vector<Point> chosen_;
  double level_ = 0.0, loaded_ = 0.0, lowest_ = 0.0, reached_ = 0.0, spacing_ = 0.0;
  bool sees_all_ = false;
  SpringBed springs_;
  std::vector<double> stiffness_, modes_, bed_heights_;
};

// A rectangle about points, turned along their length where they are long: `sides` is the box that each stands for.
Region region_about(const std::vector<Point>& points, const double sides[2], double angle);

}  // namespace mjtactile
