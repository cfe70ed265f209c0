// Contact cells under a body of any shape.
//
// Every spot where the body may touch has a lattice of equal rectangles. A cell is a rectangle of a lattice over which
// the body stands low enough. If only a part of it counts, a rectangle of that part's area, middle and inertia replaces
// it.
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
  // Remove all lattices and cells.
  void clear();
  // The heights of a body that count: those up to `highest`, measured from an inclined plane.
  struct HeightWindow {
    const HeightMap* map;
    double slopes[2];         // of the plane along x and y [-]
    Point middle;             // where the plane is at height 0
    double lowest, highest;   // origin of the measured heights, and their limit above it [m]
  };
  // The regions of all spots, and the one of them that a lattice is for.
  struct Territory {
    const std::vector<Region>& regions;
    std::size_t own;
    // Whether a point belongs to another region. Of regions of unlike size, the smaller one has it. Of others, the one
    // whose middle is nearer has it.
    bool lost(const Point& at) const;
  };
  // Add a lattice, grown as far as the body goes on, and count its cells over which the body stands low enough.
  void sound(Lattice lattice, const HeightWindow& view, const Territory& territory);
  std::size_t sounded() const { return sounded_; }   // number of counted cells of all lattices
  // Where a lattice has grown out of its region over cells of another one, count the cells of one of them. `regions`:
  // those of the lattices.
  void settle(const std::vector<Region>& regions);
  // Make the counted cells. Cells are left out if only a tiny part of them counts.
  void lay(const HeightWindow& view);
  // Replace cells by up to four each, half as long and half as wide, but by none narrower than `narrowest`. All cells
  // are laid and numbered anew. `chosen`: whether to replace each cell. Sets `from` to the former number of each cell,
  // or of the one that it is a part of.
  void split(const std::vector<std::uint8_t>& chosen, const HeightWindow& view, double narrowest,
             std::vector<std::size_t>& from);
  // Shorten or lengthen a region to where the body ends or stands too high, as measured on some lines along the region.
  // Its size becomes between `least` and `most` times the old one; it stays as it is where no end is found.
  void trim(const HeightWindow& view, double least, double most, Region& region) const;
  // Compute the integrals over pairs of cells and their edges, after the last lattice. `resolution`: length over which
  // the surface's compliance may differ from a half space's [m].
  void finish(const Rectangle& sheet, double resolution);

  // Integrals of shear over pairs of cells, along the pad's axes. The integral of a cell over itself is in closed form;
  // that of two cells is a sum over points of both.
  void integrate_shear(ShearIntegrals& integrals) const;
  // The cells as a face in the pad frame, and the mean height of the body over each in the last view (cells) [m].
  const Face& face() const { return face_; }
  const std::vector<double>& heights() const { return heights_; }
  // Mean slopes of these heights over each cell along x and y (cells) [-].
  const std::vector<Point>& gradients() const { return gradients_; }
  // For each cell: whether it ends because the body rises beyond the limit, not because the body itself ends.
  const std::vector<std::uint8_t>& goes_on() const { return goes_on_; }
  // Find the cells beside which the body goes on: also whole ones at the end of their lattice.
  void find_ends(const HeightWindow& view, std::vector<std::uint8_t>& ends) const;
  // How badly the cells tell the body's shape: root mean square of what the heights and gradients of neighbours, of
  // which one presses at least, disagree by [m]. They agree where the body is curved but smooth. `most`: the largest
  // disagreement that counts.
  double roughness(const std::vector<std::uint8_t>& pressed, double most) const;
  // Find the neighbours, of which one presses at least, whose heights and gradients disagree by more than `least` [m].
  void find_rough(const std::vector<std::uint8_t>& pressed, double least, std::vector<std::uint8_t>& rough) const;
  // Find the cells that press or have a cell beside them that does.
  void find_around(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& around) const;

 private:
  class ShearByOffset;
  struct Cell {
    std::size_t lattice;
    std::uint32_t place;      // in its lattice
    bool whole;
    double cosine, sine;      // direction of the rectangle that replaces it
    double sides[2];          // sides of that rectangle [m]
  };
  struct Covered {            // the part of a cell that counts, in the lattice's axes from the cell's middle
    double area, x, y, xx, xy, yy;   // its area [m^2], middle [m] and second moments over the area [m^2]
  };
  struct CutCell {            // a cell of which a part counts
    const Lattice& lattice;
    const HeightWindow& view;
    double column, row;
    const double* over;       // heights minus the limit at its 3 x 3 nodes; null if the body is not over all of them
  };
  struct Nodes {              // heights minus the limit at a cell's corners, middles of its sides and middle
    double over[9];
    int under, finite;        // at how many of them the body is low enough; at how many there is a body at all
  };
  struct Arms {               // from a cell's middle to the points at which it is sampled, along its sides
    double lengths[2];
    Point ends[2];
  };
  void clear_cells();
  void sound_parts(std::size_t number, const std::vector<std::uint8_t>& chosen, const HeightWindow& view);
  template <typename Visit>
  void each_pair(const std::vector<std::uint8_t>& pressed, Visit&& visit) const;
  void grow(const HeightWindow& view, const Territory& territory, Lattice& lattice) const;
  Nodes nodes_of(std::size_t number, std::size_t place) const;
  bool cut_out(const HeightWindow& view, std::size_t number, std::size_t place);
  bool goes_on_beside(const HeightWindow& view, std::size_t number, std::size_t place) const;
  void set_heights(const HeightWindow& view, std::size_t first);
  double seen(const HeightWindow& view, const Point& at) const;
  bool cover(const CutCell& cut, Covered& covered) const;
  int sweep(const CutCell& cut, bool along, Covered& sum) const;
  bool search_ends(const CutCell& cut, bool along, double line, double& low, double& high) const;
  static Arms arms_of(const Cell& cell);
  double mean_height(const HeightWindow& view, std::size_t own, std::size_t looked_at, Point& gradient) const;
  static void keep_on(const Rectangle& sheet, const Point& middle, Cell& cell);
  std::int32_t cell_at(std::size_t lattice, std::size_t column, std::size_t row) const;
  std::vector<Point> outermost() const;
  void place_quadrature(double resolution);
  void integrate();
  void integrate(const Lattice& lattice, std::size_t first, std::size_t last);
  void add_edges();

  Face face_;
  std::vector<Lattice> lattices_;
  std::vector<std::size_t> firsts_;      // where each lattice's places begin
  std::vector<std::size_t> first_nodes_; // and its nodes
  static constexpr std::int32_t kNone = -1, kSounded = -2;
  std::vector<std::int32_t> places_;     // number of a lattice's cell among the face's cells, or one of these constants
  std::size_t sounded_ = 0;
  // The cells before some are replaced, their numbers by place, and for each new lattice the one that it splits.
  std::vector<Cell> former_cells_;
  std::vector<std::int32_t> former_numbers_;
  std::vector<std::size_t> split_;
  std::vector<std::size_t> wanted_;      // nodes of a lattice whose heights are needed
  std::vector<std::size_t> twice_;       // places of cells that another lattice has
  std::vector<Cell> cells_;
  std::vector<CellRectangle> rectangles_;
  // Of all cells, and of those that a lattice's whole cells have no offset to.
  FarIntegrals far_, far_beside_;
  std::vector<std::size_t> whole_, beside_;    // a lattice's whole cells, and the others from its first cell on
  std::vector<CellRectangle> rectangles_beside_;
  std::vector<double> values_;
  std::vector<std::size_t> columns_, rows_;   // of each cell in its lattice
  std::vector<double> heights_, offsets_, nodes_;
  std::vector<Point> gradients_;
  std::vector<Point> points_;            // points that are sampled together
  std::vector<double> found_;            // and the heights over them
  std::vector<std::uint8_t> goes_on_;
};

}  // namespace mjtactile
