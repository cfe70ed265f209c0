// Contact cells under a body of any shape: rectangles of lattices, one lattice for every spot where it may touch.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/face.hpp"
#include "contact/cells/lattice.hpp"
#include "contact/cells/rectangle_integrals.hpp"
#include "contact/cells/tangential.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class PatchFace {
 public:
  // Begin anew.
  void clear();
  // How a body is looked at: heights over a plane (slopes about a point), counted from `lowest` [m]; those up to
  // `highest` count.
  struct View {
    const HeightMap* map;
    double slopes[2];
    Point middle;
    double lowest, highest;
  };
  // Look at one more lattice, grown as far as the body goes on: how many of its cells that stands over low enough, but
  // for those in regions that are taken by others.
  void sound(Lattice lattice, const View& view, const std::vector<Region>& taken);
  std::size_t sounded() const { return sounded_; }   // such cells of all lattices
  // Lay these cells. For one of which only a part counts, the rectangle of the same area, middle and inertia as that part
  // stands in; what is hardly covered is left out.
  void lay(const View& view);
  // Let a region end where the body, on some lines along it, is no longer over it or stands too high: between `least` and
  // `most` times its size, or where it is.
  void trim(const View& view, double least, double most, Region& region) const;
  // Integrals over pairs of cells and edges, after the last lattice.
  void finish(const Rectangle& sheet);

  // Integrals of shear over pairs of cells, along the pad's axes: in closed form over each cell itself, point by point of
  // parts of both over others.
  void integrate_shear(ShearIntegrals& integrals) const;
  // The cells as a face in the pad frame, and mean heights of the body over each, seen from the view's plane [m].
  const Face& face() const { return face_; }
  const std::vector<double>& heights() const { return heights_; }
  // How these grow over each cell, along x and y [-].
  const std::vector<Point>& gradients() const { return gradients_; }
  // Whether each cell ends where the body stands higher than counts, rather than where it ends.
  const std::vector<std::uint8_t>& goes_on() const { return goes_on_; }

 private:
  class ShearByOffset;
  struct Cell {
    std::size_t lattice;
    std::uint32_t place;      // in its lattice
    bool whole;
    double cosine, sine;      // of the direction of the rectangle that stands for it
    double sides[2];          // and its sides [m]
  };
  struct Covered {            // the part of a cell that counts, in the lattice's axes from the cell's middle
    double area, x, y, xx, xy, yy;   // [m^2], [m], [m^2]
  };
  struct Nodes {              // heights over the highest that counts, at a cell's corners, middles of sides and middle
    double over[9];
    int under, finite;        // how many count, and over how many the body is at all
  };
  struct Arms {               // from a cell's middle to where it is looked at, along its sides
    double lengths[2];
    Point ends[2];
  };
  void grow(const View& view, const std::vector<Region>& taken, Lattice& lattice) const;
  Nodes nodes_of(std::size_t number, std::size_t place) const;
  bool cut_out(const View& view, std::size_t number, std::size_t place);
  void set_heights(const View& view, std::size_t first);
  double seen(const View& view, const Point& at) const;
  bool cover(const Lattice& lattice, const View& view, double column, double row, const double* over,
             Covered& covered) const;
  // Lines through the cell in one direction; how many of them meet the part.
  int sweep(const Lattice& lattice, const View& view, double column, double row, bool along, const double* over,
            Covered& sum) const;
  bool search_ends(const Lattice& lattice, const View& view, double column, double row, bool along, double line,
                   double& low, double& high) const;
  static Arms arms_of(const Cell& cell);
  double mean_height(const View& view, std::size_t own, std::size_t looked_at, Point& gradient) const;
  static void keep_on(const Rectangle& sheet, const Point& middle, Cell& cell);
  std::int32_t cell_at(std::size_t lattice, std::size_t column, std::size_t row) const;
  std::vector<Point> outermost() const;
  void integrate();
  void add_edges();

  Face face_;
  std::vector<Lattice> lattices_;
  std::vector<std::size_t> firsts_;      // where each lattice's places begin
  std::vector<std::size_t> first_nodes_; // and its nodes
  static constexpr std::int32_t kNone = -1, kSounded = -2;
  std::vector<std::int32_t> places_;     // of the lattices' cells among the face's, or one of these
  std::size_t sounded_ = 0;
  std::vector<Cell> cells_;
  std::vector<CellRectangle> rectangles_;
  std::vector<std::size_t> columns_, rows_;   // of each cell in its lattice
  std::vector<double> heights_, offsets_, nodes_;
  std::vector<Point> gradients_;
  std::vector<Point> points_;            // that are looked at together, and what stands over them
  std::vector<double> found_;
  std::vector<std::uint8_t> goes_on_;
};

}  // namespace mjtactile
