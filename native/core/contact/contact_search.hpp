// Search for contact: the parts of the surface that a rigid body is likely to touch.
//
// Heights of the body are measured from a plane that tilts with it. The parts below a certain level l are taken to be
// in contact. The level is the one at which these parts carry the force: on an elastic half space, a part of perimeter
// P carries about E* l P / 2. Exact values are 8/3 E* a l under a ball, where l = a^2 / (2 R), 2 E* a l under a flat
// punch, where l is its indentation, and pi / 2 E* L l under a long cylinder, where l = a^2 / (2 R) (Johnson, Contact
// Mechanics, 1985, chapters 3 and 4); a is the radius of the contact or half its width. The estimate is off by a factor
// of 1.6 at most. P is that of the samples' staircase outline times pi / 4, so that a long cylinder along the grid gets
// half of its force.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/lattice.hpp"
#include "contact/ridges.hpp"
#include "contact/solvers/rising_heights.hpp"
#include "contact/solvers/springs.hpp"
#include "geometry/disjoint_sets.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

// An inclined plane, subtracted from heights: slopes along x and y [-], height 0 at the point `middle`.
struct Plane {
  double slopes[2];
  Point middle;

  double operator()(double x, double y) const { return slopes[0] * (x - middle.x) + slopes[1] * (y - middle.y); }
};

// A part of the surface that may touch.
struct Spot {
  Region region;
  double area;     // area of the part under the level [m^2]
  double length;   // half the perimeter of that area [m]

  // A spot is open (bent or hollow) if it fills less than this of its rectangle. It is not a ratio of small whole
  // numbers, as numbers of samples have, because rounding would decide at one.
  static constexpr double kOpen = 0.499;
  bool is_open() const { return area < kOpen * region.area(); }
};

inline bool any_is_open(const std::vector<Spot>& spots) {
  return std::any_of(spots.begin(), spots.end(), [](const Spot& one) { return one.is_open(); });
}

// The load that a body must carry.
struct SearchLoad {
  double force;        // pressing [N]
  Point through;       // where its line of action meets the surface [m]
  double modulus;      // E* of a half space as compliant as the surface [Pa]
  double least_area;   // contact area that the force needs at least [m^2]
  double narrowest;    // least width of a cell [m]
  bool follows;        // whether narrow contacts are searched for along ridges
  double reach = 0.0;  // height up to which the body was found to touch [m]; 0 if not known
  double end = kNowhere;   // height at which the contact was found to end, where spots end, too [m]
};

class ContactSearch {
 public:
  // Sample the heights of a body; false if no part of it faces the pad.
  bool look(const HeightMap& map);
  // Parts below the level that carries the load, measured from a plane.
  const std::vector<Spot>& find(const HeightMap& map, const Plane& plane, const SearchLoad& load);
  // The whole area that was sampled, as a spot.
  Spot everything() const;
  // Height of the level above the body's lowest point [m].
  double level() const { return level_; }
  // Heights that differ by at most this are equal [m], so that rounding does not break the symmetry of a body's spots.
  double same() const { return kSame * spacing_; }
  // Height of the level if no least area were asked for [m].
  double loaded() const { return loaded_; }
  // Whether the level is higher because the area would be less than that.
  bool lacks_area() const { return level_ > loaded_; }
  // Height of the body's lowest point above the given plane [m].
  double lowest() const { return lowest_; }
  // Height up to which the spots reach [m]. It is above the level if a higher spot was found to touch or nearly
  // touches.
  double reached() const { return reached_; }
  // If the spots lie along ridges, the height above these up to which the body is in contact beside them [m], about a
  // level. 0 if they do not.
  double strip() const { return strip_; }
  // Whether there are more ridges below a height above the lowest point [m].
  bool has_more_ridges(double height) const;
  // Diagonal of the sampled area [m].
  double extent() const { return std::hypot(bounds_.east - bounds_.west, bounds_.north - bounds_.south); }
  // Height of the lowest sample, without a plane [m]; infinite if there is none.
  double least() const { return least_; }
  // Whether all of the body that faces the pad is below the level, so that another plane would find no more parts.
  bool sees_all() const { return sees_all_; }
  // Whether the load's line of action passes through the convex hull of the parts.
  bool supported(const SearchLoad& load) const;
  // Convex hull of the area that the body covers, counter-clockwise.
  std::vector<Point> covered() const;
  // Share of a tilt after which some point of the body outside the given regions has come down to a height above the
  // plane `seen` [-]; infinite if none ever does.
  double share_until(const Plane& seen, const Plane& tilt, double height, const std::vector<Region>& regions) const;
  // Whether some point of the body outside the given regions is lower than a height above the plane `seen` [m].
  bool lower_than(const Plane& seen, double height, const std::vector<Region>& regions) const;
  // Visit the samples of the body: visit(point, height above a plane and the lowest point of the last search).
  template <typename Visit>
  void each_sample(const Plane& plane, Visit&& visit) const {
    for (std::size_t i = 0; i < raw_.size(); ++i) visit(points_[i], over(plane, points_[i], raw_[i]));
  }
  // The tilt at which the body rests on springs under the load. An inclined body tilts onto the face that follows.
  Plane resting(const SearchLoad& load);

 private:
  // Lines of the grid on which a body is sampled, and of that on a part of it.
  static constexpr std::size_t kLines = 33, kCloser = 15;
  struct Part {          // a connected part of the surface under the level, sampled on a grid of its own
    Region region;       // that the grid covers
    bool thin;   // whether the body is thinner there than points are from one another
    double cosine, sine; // of the region's angle
    std::vector<double> heights;

    // Sides of the cell for which each sample counts [m], and its area [m^2].
    double width() const { return region.width / kCloser; }
    double height() const { return region.height / kCloser; }
    double cell() const { return region.area() / (kCloser * kCloser); }
  };
  // A side of the sampled area beyond which the body goes on, because the sheet ends there: its inward normal, and
  // samples on it.
  struct RimSide {
    Point inward;
    std::vector<Point> points;
    std::vector<double> heights;
  };
  // What lies below a level: perimeter [m], area [m^2] and number of the samples.
  struct Below {
    double level, perimeter = 0.0, area = 0.0;
    std::size_t points = 0;
  };
  // Units of the motion on springs.
  struct SpringFrame {
    Point middle = {0.0, 0.0};
    double length = 0.0;   // of tilts' levers [m]
  };
  Point grid_point(std::size_t sample) const;
  static std::size_t line_at(double steps);
  std::size_t sample_about(const Point& at) const;
  void offer(const Point& at, double height);
  void look_at_rim(const HeightMap& map);
  bool find_ridges(const HeightMap& map, const Plane& plane, const SearchLoad& load, double length);
  void follow_ridges(const HeightMap& map, const Plane& plane, const SearchLoad& load);
  void add_rim_strips(const HeightMap& map, const Plane& plane);
  double add_rim_strip(const HeightMap& map, const Plane& plane, const RimSide& side, std::size_t first,
                       std::size_t last);
  void set_heights(const Plane& plane);
  void flood(const SearchLoad& load);
  void connect();
  void gather_parts();
  void look_closer(const HeightMap& map, const Plane& plane, Part& part);
  void set_level(const SearchLoad& load);
  void resist_tilt(const SpringFrame& frame);
  void lay_springs(const SpringFrame& frame, double highest, double modulus);
  bool presses_above(const SpringFrame& frame, double highest) const;
  static void add_below(const Part& part, Below& below);
  Below all_below(double level) const;
  Below all_up_to(double level) const;
  double level_for(const SearchLoad& load, double least_area, double highest);
  Region region_under(const Part& part, double level, double& area, std::size_t& count);
  Point point_of(const Part& part, std::size_t place) const;
  static Point end_of(const Part& part, const Region& region);
  static bool is_one_row(const Part& part, const Region& below, std::size_t count);

  // Height of a point of the body over a plane and its lowest point [m].
  double over(const Plane& plane, const Point& at, double height) const { return height - plane(at.x, at.y) - lowest_; }
  // A height above the lowest point [m]; 0 if it is `same` [m], which is rounding, or less from it.
  static double levelled(double height, double same) { return std::abs(height) <= same ? 0.0 : height; }

  static constexpr double kSame = 1e-9;   // over the spacing
  Rectangle bounds_ = {};
  const HeightMap* map_ = nullptr;
  std::vector<Point> points_, closer_;
  std::vector<Point> corners_;       // of a flat face
  std::vector<std::size_t> moved_;   // samples whose points do not belong to the grid
  std::vector<double> raw_, heights_;
  std::vector<double> grid_;         // raw_ before points were moved
  Ridges ridges_;
  RimSide rim_[4];
  std::size_t rim_count_ = 0;
  RisingHeights rising_;
  DisjointSets<std::size_t> sets_;     // samples under the level that are near each other
  std::vector<std::uint8_t> under_;
  std::vector<std::size_t> flooded_;   // samples under the level, in their order
  std::vector<std::vector<Point>> members_;
  std::vector<std::size_t> labels_;
  std::vector<Part> parts_;
  std::vector<const Part*> owners_;   // the part of each sample under the level; null for others
  std::size_t part_count_ = 0;
  std::vector<Spot> spots_, along_ridges_;
  std::vector<Point> chosen_;
  double least_ = kNowhere, level_ = 0.0, loaded_ = 0.0, lowest_ = 0.0, reached_ = 0.0;
  double step_[2] = {}, spacing_ = 0.0;   // of the grid along x and y, and the larger of the two [m]
  bool sees_all_ = false;
  double strip_ = 0.0;
  SpringBed springs_;
  std::vector<double> between_;
  std::vector<double> stiffness_, modes_, bed_heights_;
};

// A rectangle around points. It is turned along them if they form a long shape. `sides`: of the box around each point
// that belongs to it [m].
Region region_about(const std::vector<Point>& points, const double sides[2], double angle, const HeightMap& map);

}  // namespace mjtactile
