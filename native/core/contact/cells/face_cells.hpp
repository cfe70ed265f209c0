// Division of a flat face into contact cells: narrow pieces along its outline, squares inside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/border_rings.hpp"
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
  // not its rotation, height, slopes and `cut`. Sides of the squares are along the axes turned by `angle` [rad]. False
  // if the outline encloses no area or crosses itself.
  bool make(const Outline& outline, const CellCount& wanted, Face& face, double angle = 0.0);

 private:
  // A crossing of a loop and a line of the lattice.
  struct Crossing {
    std::uint32_t line, place;  // number of the line, and of the row or column along it
    double at;                  // coordinate along the line [m]
    int sign;                   // change of the loop's winding number at the crossing, along the line
    std::int32_t low, high;     // chains of the loop's edges on the line's two sides
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

  bool fit(double size, double wanted, const RingLayers& layers);
  // Divide the outline by squares and rings of a size [m]. Returns the number of cells, 0 if one of them has no area.
  std::size_t lay_out(double size, const RingLayers& layers);
  // Squares.
  void snap(Point& point) const;
  void cut_at_lattice();
  std::int32_t new_chain(const std::size_t square[2]);
  void follow_loop(const std::vector<InnerPoint>& loop);
  void add_lines(std::size_t axis);
  // Cells.
  void label_cells();
  std::size_t label_of(std::int32_t item);
  void join_parts_of_squares();
  void join_slivers();
  void merge_edges();
  // The face.
  bool integrate(Face& face);
  void describe(Face& face);
  void place_quadrature(Face& face);

  OutlineLoops outline_;
  double size_ = 0.0;                            // of a square [m]
  BorderRings rings_;
  std::vector<std::vector<InnerPoint>> inner_;   // the rings' inner side, by loop
  std::size_t squares_[2] = {};                  // along x and y
  std::vector<double> lines_[2];                 // of the lattice: their x, and their y [m]
  std::vector<Crossing> crossings_[2];           // with these lines

  // A cell consists of items: pieces of rings, corners of squares, and chains of edges within a square. The items of
  // one cell are joined. By item: its square (-1 for none) and, for roots, its cell.
  DisjointSets<std::int32_t> sets_;
  std::vector<std::int32_t> square_of_, label_;
  std::vector<CellEdge> edges_;                  // between items; after merge_edges(), between cells
  std::size_t cells_ = 0;
  std::vector<Kind> kinds_;
  std::vector<double> areas_;
  std::vector<Point> centroids_;
  std::vector<Shared> shared_;
  std::vector<AreaIntegrals> about_centroid_;    // of each cell
  EdgeIntegrals integrals_;
};

}  // namespace mjtactile
