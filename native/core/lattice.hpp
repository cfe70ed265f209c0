// Lattices of rectangular contact cells: where a body presses with a small part of itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "face.hpp"

namespace mjtactile {

// Equal rectangles in rows and columns about a centre, turned by an angle.
struct Lattice {
  Point centre;
  double angle, size, stretch;  // of the rows [rad]; cells are `size` [m] long, along the rows, and size / stretch wide
  std::size_t columns, rows;
  double cosine, sine;          // of the angle

  std::size_t cells() const { return columns * rows; }
  double width() const { return size / stretch; }
  // Where lattice coordinates, counted in cells from its first corner, lie in the plane.
  Point at(double column, double row) const;
  // The cell a point lies in, by number; false where it lies in none.
  bool cell_at(const Point& point, std::uint32_t& cell) const;
};

// A rectangle in the plane, turned by an angle: where a body presses, as far as that is known.
struct Region {
  Point centre;
  double angle, width, height;

  double area() const { return width * height; }
  // Length of cells over their width, a power of two: long contacts take long cells.
  double stretch() const;
  // About `count` equal cells that cover it.
  Lattice lattice(std::size_t count) const;
  // Pressed cells of its lattice and one row of others about them, turned along their length.
  Region around(const Lattice& lattice, const std::vector<Point>& pressed) const;
};

// Cells of a lattice as a face in the pad frame: those named, cut at an outline. Of a cell that is cut, the rectangle of
// the same area, middle and proportions stands in for the integrals.
class LatticeFace {
 public:
  // `kept`: cells of the lattice, ascending; those of which the outline leaves next to nothing are dropped. `outline`:
  // convex, counter-clockwise; empty where nothing is cut. False where no cell is left.
  bool make(const Lattice& lattice, const std::vector<std::uint32_t>& kept, const std::vector<Point>& outline);
  // Edges between the cells, of which loads are made.
  void add_edges();
  const Face& face() const { return face_; }
  // Number of a cell of the lattice among the face's, -1 where it is none of them.
  std::int32_t place(std::uint32_t cell) const { return place_[cell]; }
  // Four points per cell whose mean integrates quadratic functions over it.
  const Point* quadrature(std::size_t cell) const { return quadrature_.data() + 4 * cell; }

 private:
  bool add_cut_cell(const std::vector<Point>& outline);
  void integrate();

  Face face_;
  Lattice lattice_ = {};
  std::vector<std::uint32_t> kept_;
  std::vector<Point> quadrature_;
  std::vector<std::uint8_t> cut_;
  std::vector<std::size_t> rims_;    // where each cell's corners begin, none where it is whole
  std::vector<Point> rim_corners_;
  std::vector<double> sides_;    // length and width of the rectangle that stands for each cell [m]
  std::vector<double> offsets_;  // integrals by columns and rows between two whole cells, (rows, columns)
  std::vector<std::int32_t> place_;   // of each of the lattice's cells among those kept
  std::vector<Point> corners_, clipped_;
};

}  // namespace mjtactile
