// Division of a flat face into contact cells: narrow pieces along its outline, squares inside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/edge_integrals.hpp"
#include "contact/cells/face.hpp"
#include "geometry/disjoint_sets.hpp"
#include "geometry/outline.hpp"

namespace mjtactile {

// How many contact cells are wanted.
struct CellCount {
  std::size_t count;     // about so many
  double widest = 0.0;   // more, up to a bound, where they would be wider than this on the average [m]; 0: never
};

// Makes contact cells. It keeps its memory between calls.
//
// One or two rings of narrow pieces follow the outline, because pressure is singular there (docs/contact.md). A lattice
// of squares fills the rest. All of it is represented by directed edges with a cell on either side. A cell is the area
// that its edges enclose, so that the cells' areas and nodal forces add up to those of the outline.
class FaceCells {
 public:
  // Divide an outline [m] into about the wanted number of cells. Sets all members of the face that depend on its cells:
  // not its rotation, height, slopes and `cut`. Sides of the squares are along the axes turned by `angle` [rad]. False if
  // the outline encloses no area or crosses itself.
  bool make(const Outline& outline, const CellCount& wanted, Face& face, double angle = 0.0);

 private:
  // A closed ring of points: those from `first` to before `last` in a list.
  struct Loop {
    std::size_t first, last;
  };
  // A corner of the outline, or a point at which one of its edges is cut.
  struct WalkPoint {
    Point at;
    bool station;        // whether a piece of the ring ends here
    bool kept;           // whether the ring's inner side has a corner here
    std::int32_t piece;  // piece of the ring from here to the next point
  };
  // A corner of the ring's inner side.
  struct KeptPoint {
    Point at;          // the point of the outline to which it belongs
    Point inward;      // vector from there to the inner side of a ring of unit width
    Point inner;       // the corner itself
    double share;      // width of the ring here, over the wanted width
    std::size_t walk;  // index of `at` in walk_
    bool swallowed;    // whether the corner was merged with a neighbour
  };
  // A cut in an edge of the outline: its number, and the distance from its start [m].
  struct Cut {
    std::size_t edge;
    double along;
  };
  // A point of the rings' innermost side.
  struct InnerPoint {
    Point at;
    std::int32_t right;  // piece of the ring to the right of the edge that begins here, -1 for none
  };
  // A crossing of a loop and a line of the lattice.
  struct Crossing {
    std::uint32_t line, place;  // number of the line, and of the row or column along it
    double at;                  // coordinate along the line [m]
    int sign;                   // change of the loop's winding number at the crossing, along the line
    std::int32_t low, high;     // chains of the loop's edges on the line's two sides
  };
  // An edge between two items, -1 for none. Items are explained at sets_.
  struct RawEdge {
    Point start, end;
    std::int32_t left, right;
  };
  // One of a cell's items, and the square that contains the cell, -1 for pieces of rings.
  struct Kind {
    std::int32_t item, square;
  };
  // Length of an edge that a cell shares with a neighbour [m].
  struct Shared {
    std::size_t cell, neighbour;
    double length;
  };

  bool set_loops(const Outline& outline, double cosine, double sine);
  bool find_extent(const Outline& outline, double cosine, double sine);
  bool is_redundant(const Point& before, const Point& at, const Point& after) const;
  void add_corners(const std::vector<Point>& ring, double cosine, double sine);
  void close_loop(std::size_t first);
  void simplify(double tolerance);
  bool fit(double size, double wanted, double width);
  // Divide the outline by squares and rings of a size and a width [m]. Returns the number of cells, 0 if one of them
  // has no area.
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
  void follow_loop(const Loop& loop);
  void add_lines(std::vector<Crossing>& crossings, bool upright);
  void label_cells();
  std::size_t label_of(std::int32_t item);
  void join_parts_of_squares();
  void join_slivers();
  void finish();
  Point placed(const Point& at, double cosine, double sine) const;
  bool describe(Face& face, double cosine, double sine);
  void place_quadrature(Face& face);

  std::vector<Point> points_;  // corners of the outline, along the lattice's axes from the middle of its bounds [m]
  std::vector<Loop> loops_;    // rings of points_
  Point middle_ = {0.0, 0.0};
  double extent_[2] = {0.0, 0.0}, area_ = 0.0, length_ = 0.0, outer_rings_ = 0.0;

  double size_ = 0.0, width_ = 0.0;  // size of a square; width of all rings together [m]
  const double* layers_ = nullptr;   // inner end of each ring, over the width of all
  std::size_t layer_count_ = 0;      // number of rings
  std::int32_t pieces_ = 0, ring_cells_ = 0;  // number of pieces in one ring, and in all rings
  std::vector<WalkPoint> walk_;
  std::vector<KeptPoint> kept_;
  std::vector<Loop> walk_loops_, kept_loops_, inner_loops_;
  std::vector<double> lengths_, anchors_;
  std::vector<Cut> cuts_;
  std::vector<std::size_t> stack_;
  std::vector<std::uint8_t> backward_;   // for each edge of a loop: whether its inner side points the other way
  std::vector<std::uint8_t> crossed_;    // for each kept point: whether the inner side crosses itself at it
  std::vector<InnerPoint> inner_;
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<double> lines_x_, lines_y_;
  std::vector<Crossing> upright_, level_;
  std::vector<RawEdge> edges_;

  // A cell consists of items: pieces of rings, corners of squares, and chains of edges within a square. The items of
  // one cell are joined. By item: its square (-1 for none) and, for roots, its cell.
  DisjointSets<std::int32_t> sets_;
  std::vector<std::int32_t> square_of_, label_;
  std::vector<Kind> kinds_;
  std::vector<double> areas_;
  std::vector<Point> centroids_;
  std::vector<Shared> shared_;
  std::size_t cells_ = 0;
  std::vector<AreaIntegrals> about_centroid_;  // of each cell
  EdgeIntegrals integrals_;
};

}  // namespace mjtactile
