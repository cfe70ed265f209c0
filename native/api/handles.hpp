// The objects behind the handles of the C interface. Each owns its data or shares it by shared_ptr.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "api/api.h"
#include "contact/laws/by_name.hpp"
#include "contact/pad_sensor.hpp"

struct mjt_pad {
  std::shared_ptr<mjtactile::Pad> pad;
};

struct mjt_outer {
  mjtactile::OuterSurface surface;
};

struct mjt_body {
  std::vector<mjtactile::Shape> shapes;
};

struct mjt_cells {
  std::shared_ptr<const mjtactile::Face> face;
};

namespace mjtactile {

// Options of a contact. `law` and `tangential` must be names for which mjt_knows() is true.
inline LawOptions law_options(const char* law, const char* tangential, int tilting, double friction, std::size_t cells,
                              double strength) {
  LawOptions options;
  options.law = law_named(law);
  options.tangential = tangential_named(tangential);
  options.tilting = tilting != 0;
  options.friction = friction;
  options.cells = cells;
  options.strength = strength;
  return options;
}

inline SideLimits side_limits(const LawOptions& options, double facing_gap) {
  const bool shapes = options.law->shapes();
  return {facing_gap, !options.tilting && shapes, shapes, {options.cells, options.widest}};
}

inline Pose pose_of(const double* numbers) {
  Pose pose;
  std::copy(numbers, numbers + 3, pose.position);
  std::copy(numbers + 3, numbers + 12, pose.rotation);
  return pose;
}

// Write both ends of edges (edges, 2, 2) [m]. Returns where they end.
inline double* copy_edges(const std::vector<Segment>& edges, double* to) {
  for (const Segment& edge : edges) {
    for (const Point& point : {edge.start, edge.end}) *to++ = point.x, *to++ = point.y;
  }
  return to;
}

}  // namespace mjtactile
