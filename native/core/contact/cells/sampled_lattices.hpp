// Lattices of cells over the spots where a body may touch, with the body's heights at the cells' nodes.
//
// They say which cells count, because the body stands low enough over some node, and number the cells that are laid.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/covered_part.hpp"
#include "contact/cells/lattice.hpp"
#include "contact/cells/ridge_crossings.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class SampledLattices {
 public:
  // The regions of all spots, and the one of them that a lattice is for.
  struct Territory {
    const std::vector<Region>& regions;
    std::size_t own;
    // Whether a point belongs to another region. Of regions of unlike size, the smaller one has it. Of others, the one
    // whose middle is nearer has it.
    bool lost(const Point& at) const;
  };
  // Heights minus the limit at a cell's corners, middles of its sides and middle [m].
  struct Nodes {
    double over[9];
    int under, finite;   // at how many of them the body is low enough; at how many there is a body at all

    // Whether the body goes on at some node, higher than its limit by at most `most` [m].
    bool goes_on(double most) const {
      return std::any_of(over, over + 9, [most](double one) { return one > 0.0 && one <= most; });
    }
  };
  // Of a place whose cell does not count; and of one whose cell counts but has no number yet.
  static constexpr std::int32_t kNone = -1, kCounted = -2;

  // Remove all lattices. `along_ridges`: whether those to be added lie along ridges of the body.
  void clear(bool along_ridges);
  bool along_ridges() const { return along_ridges_; }
  // Add a lattice, grown as far as the body goes on, and count its cells over which the body stands low enough.
  void add(Lattice lattice, const HeightWindow& view, const Territory& territory);
  // Add a lattice whose cells follow the ridges of the body. Those count that a strip along a ridge meets, in which the
  // body is less than `strip` higher than on the ridge [m].
  void add_along_ridges(Lattice lattice, const HeightWindow& view, const Territory& territory, double strip);
  // Whether the cells of a lattice follow ridges; then no cell counts as a whole.
  bool follows_ridges(std::size_t lattice) const { return lattices_[lattice].first_line != kNoLines; }
  // The parts of lines across a cell of such a lattice that lie on strips.
  CellSpans spans(std::size_t lattice, std::size_t place) const;
  // Where a lattice has grown out of its region over cells of another one, count the cells of one of them. `regions`:
  // those of the lattices.
  void settle(const std::vector<Region>& regions);
  // Whether cells as wide as those of some lattice can be split into cells that are not narrower than `narrowest`.
  bool can_split(double narrowest) const;
  // Whether the cells of one lattice can be, which those along ridges cannot.
  bool splits(std::size_t lattice, double narrowest) const;
  // Replace numbered cells by up to four each, half as long and half as wide, but by none narrower than `narrowest`.
  // They are cells of further lattices. `chosen`: whether to replace the cell of each number. All numbers are lost.
  void split(const std::vector<std::uint8_t>& chosen, const HeightWindow& view, double narrowest);

  std::size_t size() const { return lattices_.size(); }
  const Lattice& operator[](std::size_t lattice) const { return lattices_[lattice]; }
  std::size_t counted() const { return counted_; }   // number of cells that count, before any were split
  // The number of a lattice's cell, or one of the constants. `place`: row by row in the lattice.
  std::int32_t number(std::size_t lattice, std::size_t place) const {
    return numbers_[lattices_[lattice].first + place];
  }
  void set_number(std::size_t lattice, std::size_t place, std::int32_t number) {
    numbers_[lattices_[lattice].first + place] = number;
  }
  // Visit the numbers of the cells that have a point: several if it is on a line, or cells of several lattices have it.
  template <typename Visit>
  void each_number_at(const Point& point, Visit visit) const {
    for (std::size_t k = 0; k < size(); ++k) {
      lattices_[k].each_at(point, [&](std::size_t place) {
        if (number(k, place) >= 0) visit(static_cast<std::size_t>(number(k, place)));
      });
    }
  }
  // The number of the cell that stands some columns and rows away from another one; negative if there is none.
  std::int32_t beside(std::size_t lattice, std::size_t place, int columns, int rows) const {
    const Lattice& own = lattices_[lattice];
    // A number before the first column or row is a very large one, which no lattice has.
    const std::size_t column = place % own.columns + static_cast<std::size_t>(columns);
    const std::size_t row = place / own.columns + static_cast<std::size_t>(rows);
    return column < own.columns && row < own.rows ? number(lattice, row * own.columns + column) : kNone;
  }
  // The number before the last split of a cell, or of the one that it is a part of.
  std::size_t former(std::size_t lattice, std::size_t place) const;
  Nodes nodes(std::size_t lattice, std::size_t place) const;

 private:
  // Number of nodes in a row of a lattice, and the first node of a cell.
  std::size_t nodes_across(std::size_t lattice) const { return 2 * lattices_[lattice].columns + 1; }
  const double* corner(std::size_t lattice, std::size_t place) const;
  // Whether some cell of a lattice that has a point counts.
  bool is_counted_at(std::size_t lattice, const Point& at) const;
  // Whether the body is low enough at some node of a cell.
  bool is_under(std::size_t lattice, std::size_t place) const;
  void append(const Lattice& lattice);
  void sample_all(const HeightWindow& view);
  void append_along_ridges(const Lattice& lattice, const HeightWindow& view, double strip);
  void remove_last();
  // Number of a node line's first strip.
  std::size_t first_strip(std::size_t line) const { return line > 0 ? line_ends_[line - 1] : 0; }
  bool ridge_leaves(std::size_t side, const HeightWindow& view, double strip);
  void find_strips(const HeightWindow& view, double strip);
  template <typename Visit>
  void each_strip(std::size_t lattice, std::size_t place, Visit&& visit) const;
  void count(std::size_t place, const Territory& territory);
  void sample(const HeightWindow& view);
  void split_lattice(std::size_t lattice, const std::vector<std::uint8_t>& chosen, const HeightWindow& view);

  static constexpr std::size_t kNoLines = static_cast<std::size_t>(-1);
  struct Sampled : Lattice {
    std::size_t first, first_node, first_line;   // its first place, node and line; kNoLines if it follows no ridges
  };
  std::vector<Sampled> lattices_;
  std::vector<std::int32_t> numbers_, former_;      // by place: the cells' numbers, and those before the last split
  std::vector<double> nodes_;                       // heights minus the limit [m]; infinite where they are not needed
  std::vector<std::size_t> splits_;                 // for each lattice of the last split, the one that it splits
  std::size_t counted_ = 0;
  bool along_ridges_ = false;
  // Where a node line of a lattice that follows ridges crosses one, and the part of it on the strip, in half cells from
  // the lattice's first node.
  struct Strip {
    double height, low, high;   // height above the limit [m]
  };
  std::vector<std::size_t> line_ends_;      // for each line, the number of strips up to its end
  std::vector<Strip> strips_;
  double strip_ = 0.0;                      // how much higher the body is at the sides of strips [m]
  std::vector<CrossingCandidate> candidates_;
  std::vector<RidgeCrossing> crossings_;    // of one line
  // Members, so that no step allocates them anew.
  std::vector<std::size_t> wanted_;                 // nodes of the last lattice that are sampled,
  std::vector<Point> points_;                       // where they are,
  std::vector<double> found_;                       // and the body's heights there [m]
  std::vector<std::size_t> twice_;                  // places of cells that another lattice has
};

}  // namespace mjtactile
