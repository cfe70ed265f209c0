// Rings of narrow contact cells along an outline.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/face.hpp"
#include "geometry/outline.hpp"

namespace mjtactile {

// How many rings there are. Widths are over the length of a ring's pieces.
struct RingLayers {
  std::size_t count;
  double width;      // of all rings
  double ends[2];    // inner end of each ring, over the width of all
};

// Two rings halve the readings' error.
constexpr RingLayers kNoRing = {0, 0.0, {}}, kOneRing = {1, 0.1, {1.0}}, kTwoRings = {2, 0.3, {0.15, 1.0}};

// Number of pieces, about `size` long, into which a length is divided: at least one.
std::size_t pieces_of(double length, double size);

// A point of the rings' innermost side.
struct InnerPoint {
  Point at;
  std::int32_t right;  // piece of a ring to the right of the edge that begins here, -1 for none
};

// Divides a strip along an outline's loops into pieces. Each loop is cut into pieces of equal length. The strip's inner
// side is parallel to the loop, but simpler. The strip is narrower where it would overlap itself, down to nothing.
// Pieces of the outermost ring are numbered from 0, loop by loop; then come those of the ring inside it.
class BorderRings {
 public:
  // Lay rings with pieces about `size` long [m]. Without a ring, the inner side is the outline.
  void lay(const OutlineLoops& outline, double size, const RingLayers& layers);

  double width() const { return width_; }   // of all rings, where they are not narrower [m]
  std::int32_t pieces() const { return pieces_ * static_cast<std::int32_t>(layers_.count); }
  // Move corners of the inner side; a function of a Point does.
  template <typename Move>
  void move_inner_side(const Move& move) {
    for (Border& border : borders_) {
      for (KeptPoint& point : border.kept) {
        move(point.inner);
        if (point.share == 0.0) border.walk[point.walk].at = point.at = point.inner;
      }
    }
  }
  // Add the pieces' edges, except those along the inner side, and set the inner side of each loop.
  void add_edges(std::vector<CellEdge>& edges, std::vector<std::vector<InnerPoint>>& inner) const;

 private:
  // A corner of the outline, or a point at which one of its edges is cut.
  struct WalkPoint {
    Point at;
    bool station;        // whether a piece of the ring ends here
    std::int32_t piece;  // piece of the ring from here to the next point
  };
  // A corner of the rings' inner side.
  struct KeptPoint {
    Point at;          // the point of the outline to which it belongs
    Point inward;      // vector from there to the inner side of a ring of unit width
    Point inner;       // the corner itself
    double share;      // width of the ring here, over the wanted width
    std::size_t walk;  // index of `at` in the walk
    bool swallowed;    // whether the corner was merged with a neighbour
    bool backward;     // whether the inner edge that begins here points opposite to the outline
    bool crossed;      // whether the inner side crosses itself at an edge that begins or ends here
  };
  // The strip along one loop.
  struct Border {
    std::vector<WalkPoint> walk;
    std::vector<KeptPoint> kept;
  };
  // A cut in an edge of a loop: the edge's number, and the distance from its start [m].
  struct Cut {
    std::size_t edge;
    double along;
  };

  void walk(const std::vector<Point>& loop, Border& border);
  bool is_long(std::size_t edge) const;
  void cut_edges(std::size_t begin);
  void cut_round_loop(const std::vector<Point>& loop, double length);
  void add_cut(std::size_t edge, double along);
  std::int32_t add_walk(const std::vector<Point>& loop, std::vector<WalkPoint>& walk) const;
  void keep(Border& border);
  void direct_inward(std::vector<KeptPoint>& kept) const;
  void set_inner(KeptPoint& point) const;
  void bound_shares();
  double bound_share(const KeptPoint& own) const;
  void mend_inner_side();
  bool turn_forward(std::vector<KeptPoint>& kept) const;
  bool uncross(bool last);
  void shrink(KeptPoint& point) const;
  void add_edges(const Border& border, std::vector<CellEdge>& edges, std::vector<InnerPoint>& inner) const;

  double size_ = 0.0, width_ = 0.0, extent_ = 0.0;   // of a piece, of all rings, and of the outline [m]
  RingLayers layers_ = kNoRing;
  std::int32_t pieces_ = 0;                          // number of pieces in one ring
  std::vector<Border> borders_;                      // one per loop
  std::vector<double> lengths_, anchors_;
  std::vector<Cut> cuts_;
  std::vector<Point> points_;
  std::vector<std::uint8_t> marks_;
};

}  // namespace mjtactile
