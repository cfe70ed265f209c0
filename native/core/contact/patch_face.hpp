// Contact cells under a body of any shape.
//
// Every spot where the body may touch has a lattice of equal rectangles. A cell is a rectangle of a lattice over which
// the body stands low enough. If only a part of it counts, a rectangle of that part's area, middle and inertia replaces
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/covered_part.hpp"
#include "contact/cells/face.hpp"
#include "contact/cells/rectangle_integrals.hpp"
#include "contact/cells/sampled_lattices.hpp"
#include "contact/cells/tangential.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class CellContact;

class PatchFace {
 public:
  // The lattices from which cells are made.
  SampledLattices& lattices() { return lattices_; }
  const SampledLattices& lattices() const { return lattices_; }
  // Make the cells of the lattices that count. They are left out if only a tiny part of them counts.
  void lay(const HeightWindow& view);
  // Replace cells by up to four each, half as long and half as wide, but by none narrower than `narrowest`. All cells
  // are laid and numbered anew. `chosen`: whether to replace each cell. Sets `from` to the former number of each cell,
  // or of the one that it is a part of.
  void split(const std::vector<std::uint8_t>& chosen, const HeightWindow& view, double narrowest,
             std::vector<std::size_t>& from);
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
  // How badly the cells tell the body's shape: root mean square of what the heights and gradients of neighbours, of
  // which one presses at least, disagree by [m]. They agree where the body is curved but smooth. `most`: the largest
  // disagreement that counts.
  double roughness(const std::vector<std::uint8_t>& pressed, double most) const;
  // Find the neighbours, of which one presses at least, whose heights and gradients disagree by more than `least` [m],
  // and the cells that press across which the body rises by a multiple of that. Disagreement counts for more where the
  // force is larger.
  void find_rough(const CellContact& contact, double least, std::vector<std::uint8_t>& rough) const;
  // Find the cells that press and have no cell beside them on some side.
  void find_rim(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& rim) const;
  // Share of the force on chosen cells that is on those across which the body rises by at most `most` [m].
  double flat_share(const CellContact& contact, const std::vector<std::uint8_t>& chosen, double most) const;
  // Add the cells between which the contact ends: those that press beside one that does not, and the other way round.
  void add_ends(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& to) const;
  // Find the cells that press or have a cell beside them that does.
  void find_around(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& around) const;
  // Number of chosen cells that can be split into cells at least `narrowest` long [m].
  std::size_t count_splittable(const std::vector<std::uint8_t>& chosen, double narrowest) const;

 private:
  class ShearByOffset;
  struct Cell {
    std::size_t lattice;
    std::uint32_t place;      // in its lattice
    bool whole;
    double cosine, sine;      // direction of the rectangle that replaces it
    double sides[2];          // sides of that rectangle [m]
  };
  struct Arms {               // from a cell's middle to the points at which it is sampled, along its sides
    double lengths[2];
    Point ends[2];
  };
  void clear();
  // The number of the cell some columns and rows away from a cell in its lattice, or of such a cell that is whole;
  // negative if there is none.
  std::int32_t number_beside(std::size_t own, int columns, int rows) const;
  std::int32_t whole_beside(std::size_t own, int columns, int rows) const;
  template <typename Visit>
  void each_pair(const std::vector<std::uint8_t>& pressed, Visit&& visit) const;
  bool cut_out(const HeightWindow& view, std::size_t number, std::size_t place);
  static void replace(const Lattice& lattice, const CoveredPart& covered, Cell& cell);
  void find_slivers(const HeightWindow& view);
  void set_heights(const HeightWindow& view);
  static Arms arms_of(const Cell& cell);
  double rise_across(std::size_t own, const double* tilt) const;
  double mean_height(const HeightWindow& view, std::size_t own, Point& gradient) const;
  static bool shortened(const double* room, Cell& cell);
  static void keep_on(const Rectangle& sheet, const Point& middle, Cell& cell);
  std::vector<Point> outermost() const;
  void place_quadrature(double resolution);
  void integrate();
  void integrate(const Lattice& lattice, std::size_t first, std::size_t last);
  void add_edges();

  Face face_;
  SampledLattices lattices_;
  std::vector<Cell> cells_;
  std::vector<std::uint8_t> slivers_;          // whether each cell is left out as a sliver
  std::vector<CellRectangle> rectangles_;
  // Of all cells, and of those that a lattice's whole cells have no offset to.
  FarIntegrals far_, far_beside_;
  std::vector<std::size_t> whole_, beside_;    // a lattice's whole cells, and the others from its first cell on
  std::vector<CellRectangle> rectangles_beside_;
  std::vector<double> values_;
  std::vector<std::size_t> columns_, rows_;   // of each cell in its lattice
  std::vector<double> heights_, offsets_;
  std::vector<Point> gradients_;
  std::vector<Point> points_;            // points that are sampled together
  std::vector<double> found_;            // and the heights over them
  std::vector<std::uint8_t> goes_on_;
};

}  // namespace mjtactile
