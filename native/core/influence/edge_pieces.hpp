// The pieces into which the lines of a grid of elements divide an edge. Each piece lies in one element.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// The elements along one axis through which an edge runs, one after the other. next() is the position along the edge,
// from 0 at its start to 1 at its end, where it enters the next element.
class ElementWalk {
 public:
  // `ends`: boundaries of the elements, ascending [m]; `start`, `direction`: of the edge along this axis [m].
  ElementWalk(const std::vector<double>& ends, double start, double direction)
      : ends_(ends), start_(start), direction_(direction) {
    // An edge that starts on a grid line belongs to the element ahead of it.
    const auto after = direction < 0.0 ? std::lower_bound(ends.begin(), ends.end(), start)
                                       : std::upper_bound(ends.begin(), ends.end(), start);
    element_ = after - ends.begin() - 1;
    look_ahead();
  }

  double next() const { return next_; }
  bool within() const { return element_ >= 0 && element_ < last() + 1; }
  // The present element; beside the sheet, the outermost element on that side.
  std::size_t nearest() const {
    return static_cast<std::size_t>(std::min(std::max(element_, std::ptrdiff_t{0}), last()));
  }
  void step() {
    element_ += direction_ < 0.0 ? -1 : 1;
    look_ahead();
  }

 private:
  std::ptrdiff_t last() const { return static_cast<std::ptrdiff_t>(ends_.size()) - 2; }
  void look_ahead() {
    const std::ptrdiff_t line = direction_ < 0.0 ? element_ : element_ + 1;
    const bool any = direction_ != 0.0 && line >= 0 && line <= last() + 1;
    next_ = any ? (ends_[static_cast<std::size_t>(line)] - start_) / direction_
                : std::numeric_limits<double>::infinity();
  }

  const std::vector<double>& ends_;
  double start_, direction_, next_ = 0.0;
  std::ptrdiff_t element_;
};

// Call visit(start, end, column, row) for each piece of an edge from `start` to `end` [m]. `x`, `y`: boundaries of
// the elements [m]. Pieces beside the grid along x count for the nearest element, because an edge contributes to all
// elements on its left. Pieces beside it along y and horizontal pieces contribute nothing and are left out.
template <typename Visit>
void visit_pieces(const std::vector<double>& x, const std::vector<double>& y, const Point& start, const Point& end,
                  Visit&& visit) {
  const double direction[2] = {end.x - start.x, end.y - start.y};
  if (direction[1] == 0.0) return;
  ElementWalk columns(x, start.x, direction[0]), rows(y, start.y, direction[1]);
  double begin[2] = {start.x, start.y}, last = 0.0;
  for (double at = 0.0; at < 1.0;) {
    at = std::min({columns.next(), rows.next(), 1.0});
    if (at > last) {
      const double finish[2] = {at == 1.0 ? end.x : start.x + at * direction[0],
                                at == 1.0 ? end.y : start.y + at * direction[1]};
      if (rows.within() && begin[1] != finish[1]) visit(begin, finish, columns.nearest(), rows.nearest());
      begin[0] = finish[0];
      begin[1] = finish[1];
      last = at;
    }
    if (columns.next() == at) columns.step();
    if (rows.next() == at) rows.step();
  }
}

}  // namespace mjtactile
