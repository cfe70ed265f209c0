// Contact cells of a flat face's outline: narrow pieces along it, squares inside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/edge_integrals.hpp"
#include "contact/cells/face.hpp"
#include "geometry/outline.hpp"

namespace mjtactile {

// Makes contact cells; keeps its memory between calls.
//
// Everything is made of edges with a cell on either side: edges of the outline, of the rings along it, and of the
// lattice inside. Cells are what their edges enclose, so that areas and nodal forces add up whatever the outline.
class FaceCells {
 public:
  // About `count` cells that fill an outline: all of the face but its rotation, height, slope and `cut`. The squares lie
  // along the axes turned by `angle` [rad]. False where the outline encloses nothing or crosses itself.
  bool make(const Outline& outline, std::size_t count, Face& face, double angle = 0.0);
  // Four points per cell of the last face whose mean integrates quadratic functions over it.
  const std::vector<Point>& quadrature() const { return quadrature_; }

 private:
  struct Loop {
    std::size_t first, last;  // of its points
  };
  // A corner of the outline, or a cut in one of its edges.
  struct WalkPoint {
    Point at;
    bool station, kept;  // whether a piece of the ring ends here; whether the ring's inner side has a corner here
    std::int32_t piece;  // of the ring, from here to the next
  };
  // A corner of the ring's inner side.
  struct KeptPoint {
    Point at, inward, inner;  // on the outline; from there to the inner side of a ring of unit width; on the inner side
    double share;             // of the ring's width
    std::size_t walk;
    bool swallowed;           // whether its inner side fell together with a neighbour's
  };
  struct Cut {
    std::size_t edge;
    double along;  // [m]
  };
  struct InnerPoint {
    Point at;
    std::int32_t right;  // piece of the ring to the right of the edge that begins here, -1 for none
  };
  // Where a loop crosses a line of the lattice.
  struct Crossing {
    std::uint32_t line, place;  // number of the line, and of the row or column along it
    double at;
    int sign;                   // by which the loop's turns grow beyond it, along the line
    std::int32_t low, high;     // chains of the loop's edges on the line's two sides
  };
  struct RawEdge {
    Point start, end;
    std::int32_t left, right;  // -1 for none
  };
  struct Kind {
    std::int32_t item, square;  // one of the cell's; the square it lies in, -1 for pieces of rings
  };
  struct Shared {
    std::size_t cell, neighbour;
    double length;
  };

  bool tidy(const Outline& outline, double cosine, double sine);
  bool find_extent(const Outline& outline, double cosine, double sine);
  bool says_nothing(const Point& before, const Point& at, const Point& after) const;
  void add_corners(const std::vector<Point>& ring, double cosine, double sine);
  void close_loop(std::size_t first);
  void simplify(double tolerance);
  bool fit(double size, double wanted, double width);
  // Number of cells of a layout with squares of a size and rings of a width [m]; 0 where some enclose nothing.
  std::size_t lay_out(double size, double width);
  void walk(const Loop& loop);
  void cut_edges(std::size_t begin);
  bool is_long(std::size_t edge) const;
  std::int32_t add_walk(const Loop& loop);
  void add_cut(std::size_t edge, double along);
  void cut_round_loop(const Loop& loop, double length);
  void keep(const Loop& loop);
  void keep_corners(const Loop& loop, std::size_t from, std::size_t to, double tolerance);
  void direct_inward(const Loop& loop);
  void set_inner(KeptPoint& point);
  void bound_shares();
  void mend_inner_side();
  bool mend_inner_side(const Loop& loop);
  void shrink(KeptPoint& point);
  bool uncross(bool last);
  void add_ring_edges(const Loop& kept, const Loop& walk);
  void add_edge(const Point& start, const Point& end, std::int32_t left, std::int32_t right);
  void place_lattice();
  void snap(Point& point);
  void cut_at_lattice();
  static std::size_t interval(const std::vector<double>& lines, double at);
  std::int32_t new_chain(std::size_t column, std::size_t row);
  void walk_lattice(const Loop& loop);
  void add_lines(std::vector<Crossing>& crossings, bool upright);
  std::int32_t root(std::int32_t item);
  void unite(std::int32_t a, std::int32_t b);
  void label_cells();
  std::size_t label_of(std::int32_t item);
  void join_parts_of_squares();
  void join_slivers();
  void finish();
  Point placed(const Point& at, double cosine, double sine) const;
  bool describe(Face& face, double cosine, double sine);
  void place_quadrature(const Face& face);

  std::vector<Point> points_;  // of the outline, in the lattice's axes about its middle
  std::vector<Loop> loops_;
  Point middle_ = {0.0, 0.0};
  double extent_[2] = {0.0, 0.0}, area_ = 0.0, length_ = 0.0;

  double size_ = 0.0, width_ = 0.0;  // of a square; of all rings together [m]
  const double* layers_ = nullptr;   // shares of the width at which rings end
  std::size_t layer_count_ = 0;
  std::int32_t pieces_ = 0, ring_cells_ = 0;  // of one ring, and of all
  std::vector<WalkPoint> walk_;
  std::vector<KeptPoint> kept_;
  std::vector<Loop> walk_loops_, kept_loops_, inner_loops_;
  std::vector<double> lengths_, anchors_;
  std::vector<Cut> cuts_;
  std::vector<std::size_t> stack_;
  std::vector<std::uint8_t> backward_;
  std::vector<InnerPoint> inner_;
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<double> lines_x_, lines_y_;
  std::vector<Crossing> upright_, level_;
  std::vector<RawEdge> edges_;

  // Items are pieces of rings, corners of squares and chains of edges in a square; those of one cell are united.
  std::vector<std::int32_t> parent_, square_of_, label_;
  std::vector<Kind> kinds_;
  std::vector<double> areas_;
  std::vector<Point> moments_;  // middles of the cells
  std::vector<Shared> shared_;
  std::size_t cells_ = 0;
  std::vector<double> inertia_;  // second moments of each cell, xx, xy, yy
  std::vector<Point> quadrature_;
  EdgeIntegrals integrals_;
};

}  // namespace mjtactile
