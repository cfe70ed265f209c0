// Ridges of a body's lower surface, along which narrow contacts lie: the bottom of a ring, or the crests of a thread.
//
// The search samples a body on a grid that may miss most of a narrow contact. The grid's lines cross its ridge, though,
// and tell where it is and how high. A curve that crosses the lines of a square grid of step d at n points is about
// pi / 4 n d long, on average over all directions (Cauchy and Crofton; Santalo, Integral Geometry and Geometric
// Probability, 1976, chapter 3).
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/ridge_crossings.hpp"
#include "geometry/disjoint_sets.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class Ridges {
 public:
  // Heights of a body at the middles of equal cells of a rectangle, not measured from a plane [m].
  struct Grid {
    Rectangle bounds;
    std::size_t lines;                     // rows, and columns
    const std::vector<double>& heights;    // row by row
    // Heights at the ends of all rows on the west and the east, and of all columns on the south and the north; null
    // where the body does not go on beyond the rectangle.
    const std::vector<double>* ends[4];
  };
  // A connected part of the ridges.
  struct Stretch {
    std::vector<Point> points;
    double area, length;   // of the surface near it that is low enough [m^2], and its own length [m]
    double narrow;         // length of its part that is narrower than the grid's steps [m]

    double width() const { return area / length; }
  };

  // What ridges have to be to count: longer than `length` below a height [m], with at most `most` crossings. A rough
  // body has more.
  struct Needed {
    double height, length;
    std::size_t most;
  };

  // Find the ridges up to the view's limit. Heights are found up to `tolerance` [m]. False if they do not count.
  bool find(const HeightWindow& view, const Grid& grid, double tolerance, const Needed& needed);
  // Length of the ridges below a height [m].
  double length_below(double height) const;
  // Area of the strips up to `level` above the ridges below a height [m^2].
  double area_below(double height, double level) const;
  // Height of their lowest point above the view's lowest [m]; infinite if there are none.
  double lowest() const;
  // Count heights from a point at this height [m].
  void count_from(double height);
  // The least height l for which l times the length of the ridges below l is `product` [m^2].
  double level_for(double product);
  // Connect points up to a height that are closer than `near` along x and y [m]. A stretch's area is that up to `level`
  // above it.
  void connect(double height, double near, double level);
  // The stretches that were connected.
  std::size_t count() const { return count_; }
  const Stretch& stretch(std::size_t number) const { return stretches_[number]; }

 private:
  struct RidgePoint {         // where a line crosses a ridge
    Point at;
    double height, spacing;   // above the view's lowest point; of the parallel lines [m]
    double step;              // along the line [m]
    std::size_t number;       // in crossings_
  };
  // Find the candidates on all lines of the grid. False if so few may be low enough that ridges do not count.
  bool find_candidates(const HeightWindow& view, const Grid& grid, double tolerance, const Needed& needed);
  Stretch& next_stretch();
  // Area that a crossing stands for, up to a level above it [m^2]. Lines in both directions measure the area, each with
  // the width along them.
  double area_of(const RidgePoint& point, double level) const;

  std::vector<double> over_;   // the grid's heights above the limit
  std::vector<SampledLine> lines_;            // first the rows, then the columns
  std::vector<std::size_t> line_ends_;        // number of candidates up to the end of each line
  std::vector<CrossingCandidate> candidates_;
  std::vector<RidgeCrossing> crossings_;
  std::vector<RidgePoint> points_;
  std::vector<Stretch> stretches_;   // only the first `count_` count, so that the others keep their memory
  std::size_t count_ = 0;
  std::vector<std::size_t> numbers_;
  DisjointSets<std::size_t> sets_;
};

}  // namespace mjtactile
