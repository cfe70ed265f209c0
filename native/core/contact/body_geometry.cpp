#include "contact/body_geometry.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "linalg/angles.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

using Vector = std::array<double, 3>;

// Points within this distance of a plane [m] lie in it. Directions that differ by less than this [-] are equal.
constexpr double kFlatness = 1e-6, kSameDirection = 1e-6;
// Number of corners of the polygon that replaces a circle.
constexpr int kCircle = 64;
// A side is flat only if the area of the body near its plane, such as rounded edges, is less than this fraction of the
// side's area.
constexpr double kBeside = 1e-3;
// Limits of the slope at which a side faces the pad:
// kLean: a side may always rise by this fraction of the facing gap over its width.
// kMostLean: a body that may tilt comes down on a side up to this slope, about 12 degrees.
// kLeanShare: but not beyond this fraction of the slope at which another part of the body touches.
// kLevel: a side of a body that keeps its orientation may rise by this over its width [m].
// kSteepest: parts that would touch only at steeper slopes are not searched for.
constexpr double kLean = 0.5, kMostLean = 0.21, kLeanShare = 0.8, kLevel = 1e-7, kSteepest = 0.6;
// Slope up to which a half space faces the pad if bodies do not tilt onto inclined sides.
constexpr double kEndlessLean = 1e-3;

Vector in_body(const Pose& local, const double* point) {
  Vector at;
  for (std::size_t i = 0; i < 3; ++i) at[i] = local.position[i] + dot(local.rotation + 3 * i, point);
  return at;
}

// A flat part of one shape in the body's frame.
struct Part {
  std::size_t shape;
  Vector up;        // the inward normal
  double height;    // of the part along `up` [m]
  bool endless;
  std::vector<std::vector<Vector>> loops;
};

void add_parts(const Shape& shape, std::size_t number, std::vector<Part>& parts) {
  const auto add = [&](const double* normal, const std::vector<std::vector<Vector>>& loops, bool endless) {
    Part part = {number, {}, 0.0, endless, {}};
    rotate(shape.local.rotation, normal, part.up.data());
    for (double& one : part.up) one = -one;
    for (const auto& loop : loops) {
      part.loops.emplace_back();
      for (const Vector& point : loop) part.loops.back().push_back(in_body(shape.local, point.data()));
    }
    const Vector origin = in_body(shape.local, Vector{0.0, 0.0, 0.0}.data());
    part.height = part.loops.empty() ? dot(origin.data(), part.up.data())
                                     : dot(part.loops[0][0].data(), part.up.data());
    parts.push_back(std::move(part));
  };
  if (shape.kind == ShapeKind::box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Vector normal = {0.0, 0.0, 0.0};
        normal[axis] = sign;
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::vector<Vector> loop;
        for (const auto& [a, b] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
          Vector corner;
          corner[axis] = sign * shape.size[axis], corner[u] = a * shape.size[u], corner[v] = b * shape.size[v];
          loop.push_back(corner);
        }
        add(normal.data(), {loop}, false);
      }
    }
  } else if (shape.kind == ShapeKind::cylinder) {
    for (const double sign : {-1.0, 1.0}) {
      const double normal[3] = {0.0, 0.0, sign};
      std::vector<Vector> loop;
      // A polygon with the circle's area.
      const double radius = shape.size[0] * std::sqrt(kTurn / kCircle / std::sin(kTurn / kCircle));
      for (int k = 0; k < kCircle; ++k) {
        const double angle = kTurn * k / kCircle;
        loop.push_back({radius * std::cos(angle), radius * std::sin(angle), sign * shape.size[1]});
      }
      add(normal, {loop}, false);
    }
  } else if (shape.kind == ShapeKind::half_space) {
    const double normal[3] = {0.0, 0.0, 1.0};
    add(normal, {}, true);
  } else if (shape.kind == ShapeKind::triangles) {
    for (const Facet& facet : shape.mesh->facets) add(facet.normal, facet.loops, false);
  }
}

// Least coordinate of a shape along a direction of the body's frame [m].
double least_along(const Shape& shape, const double* up) {
  double own[3];
  rotate_back(shape.local.rotation, up, own);
  const double middle = dot(shape.local.position, up);
  if (shape.kind == ShapeKind::half_space) {
    return std::hypot(own[0], own[1]) < kSameDirection && own[2] < 0.0 ? middle : -kNowhere;
  }
  if (shape.kind != ShapeKind::triangles) return middle - reach_along(shape.kind, shape.size, own);
  double least = kNowhere;
  for (std::size_t v = 0; v < shape.mesh->vertices.size(); v += 3) {
    least = std::min(least, dot(shape.mesh->vertices.data() + v, own));
  }
  return middle + least;
}

// A triangle of a mesh above a plane: how high its corners are [m], and twice its vector area [m^2].
struct Rising {
  double rise[3], least, most, doubled[3];
};

Rising above(const TriangleMesh& mesh, std::uint32_t triangle, const double* up, double plane) {
  const double* corner[3];
  Rising found = {{}, kNowhere, -kNowhere, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    corner[k] = mesh.corner(triangle, k);
    found.rise[k] = dot(corner[k], up) - plane;
    found.least = std::min(found.least, found.rise[k]);
    found.most = std::max(found.most, found.rise[k]);
  }
  double a[3], b[3];
  for (int i = 0; i < 3; ++i) a[i] = corner[1][i] - corner[0][i], b[i] = corner[2][i] - corner[0][i];
  cross(a, b, found.doubled);
  return found;
}

// Area of a mesh's triangles, projected along a direction, that is below a gap above a plane but not in the plane
// [m^2].
double area_beside(const Shape& shape, const double* up, double height, double gap) {
  double own[3];
  rotate_back(shape.local.rotation, up, own);
  const double plane = height - dot(shape.local.position, up);
  const TriangleMesh& mesh = *shape.mesh;
  double sum = 0.0;
  mesh.any_box([&](const MeshBox& box) { return box.least_along(own) <= plane + gap; }, [&](const MeshBox& box) {
    for (std::uint32_t f = box.first; f < box.first + box.count; ++f) {
      auto [rise, least, most, doubled] = above(mesh, f, own, plane);
      if ((most <= kFlatness && least >= -kFlatness) || least >= gap) continue;
      const double seen = -0.5 * dot(doubled, own);
      if (mesh.closed ? seen <= 0.0 : seen == 0.0) continue;
      // Fraction of a triangle below a height, from the sorted heights of its corners.
      std::sort(rise, rise + 3);
      double share = 1.0;
      if (gap < rise[2]) {
        const double low = rise[0], middle = rise[1], high = rise[2];
        share = gap < middle || middle == high
                    ? (gap - low) * (gap - low) / std::max((middle - low) * (high - low), 1e-300)
                    : 1.0 - (high - gap) * (high - gap) / std::max((high - low) * (high - middle), 1e-300);
      }
      sum += std::abs(seen) * std::min(std::max(share, 0.0), 1.0);
    }
    return false;
  });
  return sum;
}

void face_axes(const Vector& up, double* rotation) {
  std::size_t least = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(up[i]) < std::abs(up[least])) least = i;
  }
  double x[3] = {0.0, 0.0, 0.0};
  x[least] = 1.0;
  const double along = up[least];
  double length = 0.0;
  for (std::size_t i = 0; i < 3; ++i) x[i] -= up[i] * along, length += x[i] * x[i];
  length = std::sqrt(length);
  for (std::size_t i = 0; i < 3; ++i) rotation[i] = x[i] / length;
  cross(up.data(), rotation, rotation + 3);
  std::copy(up.begin(), up.end(), rotation + 6);
}

double distance_to(const std::vector<Point>& hull, const Point& at) {
  if (holds(hull, at)) return 0.0;
  double least = kNowhere;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point near = nearest_on(hull[i], hull[(i + 1) % hull.size()], at);
    least = std::min(least, std::hypot(at.x - near.x, at.y - near.y));
  }
  return least;
}

// Call visit(point) for the outermost points of a shape, in the body's frame. Points are skipped in groups: if
// pass(middle, distance, rise) is true, all points within that distance of the middle rise by at least `rise` above the
// height and are not visited.
template <typename Visit, typename Pass>
void outermost(const Shape& shape, const double* up, double height, double farthest, Visit&& visit, Pass&& pass) {
  const double* size = shape.size;
  const auto at = [&](double x, double y, double z) {
    const double point[3] = {x, y, z};
    visit(in_body(shape.local, point));
  };
  constexpr int kAround = 32, kPolar = 16;
  if (shape.kind == ShapeKind::box) {
    for (int k = 0; k < 8; ++k) {
      at((k & 1) != 0 ? size[0] : -size[0], (k & 2) != 0 ? size[1] : -size[1], (k & 4) != 0 ? size[2] : -size[2]);
    }
  } else if (shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule ||
             shape.kind == ShapeKind::ellipsoid) {
    const bool round = shape.kind != ShapeKind::cylinder;
    for (int j = 0; j < kAround; ++j) {
      const double c = std::cos(kTurn * j / kAround), s = std::sin(kTurn * j / kAround);
      if (shape.kind != ShapeKind::ellipsoid) {
        for (const double end : {-size[1], size[1]}) at(size[0] * c, size[0] * s, end);
      }
      for (int i = 0; round && i <= kPolar; ++i) {
        const double across = std::sin(kHalfTurn * i / kPolar), along = std::cos(kHalfTurn * i / kPolar);
        if (shape.kind == ShapeKind::ellipsoid) {
          at(size[0] * across * c, size[1] * across * s, size[2] * along);
        } else {
          for (const double end : {-size[1], size[1]}) {
            at(size[0] * across * c, size[0] * across * s, end + size[0] * along);
          }
        }
      }
    }
  } else if (shape.kind == ShapeKind::triangles) {
    // Parts that rise more steeply than bodies ever lean are not needed.
    double own[3];
    rotate_back(shape.local.rotation, up, own);
    const double plane = height - dot(shape.local.position, up);
    const auto enters = [&](const MeshBox& box) {
      const double least = box.least_along(own);
      if (least > plane + kSteepest * farthest) return false;
      double middle[3], square = 0.0;
      for (int k = 0; k < 3; ++k) {
        middle[k] = (box.low[k] + box.high[k]) / 2;
        square += (box.high[k] - middle[k]) * (box.high[k] - middle[k]);
      }
      return !pass(in_body(shape.local, middle), std::sqrt(square), least - plane);
    };
    shape.mesh->any_box(enters, [&](const MeshBox& box) {
      for (std::uint32_t t = box.first; t < box.first + box.count; ++t) {
        for (std::size_t k = 0; k < 3; ++k) visit(in_body(shape.local, shape.mesh->corner(t, k)));
      }
      return false;
    });
  }
}

// Least slope from a side's rim to any other point of the shapes that count [-].
double steepness(const std::vector<Shape>& shapes, const std::vector<std::uint8_t>& counts, const FlatSide& side) {
  std::vector<Point> corners;
  for (const auto& ring : side.outline.rings) corners.insert(corners.end(), ring.begin(), ring.end());
  const std::vector<Point> hull = convex_hull(std::move(corners));
  double farthest = 0.0;
  for (const Shape& shape : shapes) {
    if (shape.kind != ShapeKind::triangles) continue;
    double size = 0.0;
    for (int k = 0; k < 3; ++k) {
      size += std::pow(shape.mesh->boxes.empty() ? 0.0 : shape.mesh->boxes[0].high[k] - shape.mesh->boxes[0].low[k], 2);
    }
    farthest = std::max(farthest, std::sqrt(size) + std::sqrt(dot(shape.local.position, shape.local.position)));
  }
  double least = kNowhere;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    if (!counts[k]) continue;
    const Shape& shape = shapes[k];
    const auto away = [&](const Vector& point) {
      return distance_to(hull, {dot(side.rotation, point.data()), dot(side.rotation + 3, point.data())});
    };
    const auto visit = [&](const Vector& point) {
      const double rise = dot(side.up(), point.data()) - side.height;
      if (rise <= kFlatness) return;
      const double distance = away(point);
      if (distance > 0.0) least = std::min(least, rise / distance);
    };
    // No point of a box has a smaller slope than the box's least height over its largest distance.
    outermost(shape, side.up(), side.height, farthest, visit, [&](const Vector& middle, double around, double rise) {
      return rise > kFlatness && rise >= least * (away(middle) + around);
    });
  }
  return least;
}

// Least height above a side's plane of what else of the side's own shapes faces the pad, of all that is higher than a
// gap [m].
double least_rise(const std::vector<Shape>& shapes, const FlatSide& side, double gap) {
  double least = kNowhere;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    const Shape& shape = shapes[k];
    if (!side.shapes[k] || shape.kind != ShapeKind::triangles) continue;
    double own[3];
    rotate_back(shape.local.rotation, side.up(), own);
    const double plane = side.height - dot(shape.local.position, side.up());
    const TriangleMesh& mesh = *shape.mesh;
    mesh.any_box([&](const MeshBox& box) { return box.least_along(own) < plane + least; }, [&](const MeshBox& box) {
      for (std::uint32_t f = box.first; f < box.first + box.count; ++f) {
        const Rising found = above(mesh, f, own, plane);
        if (found.most <= gap) continue;
        const double seen = -dot(found.doubled, own), length = std::sqrt(dot(found.doubled, found.doubled));
        // Parts that rise more steeply than bodies ever lean are sides.
        const bool faces = (mesh.closed ? seen : std::abs(seen)) * std::hypot(1.0, kSteepest) > length;
        if (faces) least = std::min(least, std::max(found.least, gap));
      }
      return false;
    });
  }
  return least;
}

// Outline of a part in a side's frame, counter-clockwise about the inward normal.
Outline outline_on(const FlatSide& side, const Part& part) {
  Outline outline;
  for (const auto& loop : part.loops) {
    outline.rings.emplace_back();
    for (const Vector& point : loop) {
      outline.rings.back().push_back({dot(side.rotation, point.data()), dot(side.rotation + 3, point.data())});
    }
  }
  if (signed_area(outline) < 0.0) {
    for (auto& ring : outline.rings) std::reverse(ring.begin(), ring.end());
  }
  return outline;
}

// Whether bounds meet none of the known ones. They are added to them.
bool is_apart(const Rectangle& bounds, std::vector<Rectangle>& known) {
  const bool apart = std::none_of(known.begin(), known.end(), [&](const Rectangle& one) { return bounds.meets(one); });
  known.push_back(bounds);
  return apart;
}

// Add all parts in the plane of parts[first], of any shapes, to a side. False if they have no common outline.
bool gather(const std::vector<Part>& parts, std::size_t first, std::vector<std::uint8_t>& done, FlatSide& side) {
  std::vector<Rectangle> known;
  bool apart = true;
  for (std::size_t j = first; j < parts.size(); ++j) {
    const Part& part = parts[j];
    if (dot(parts[first].up.data(), part.up.data()) < 1.0 - kSameDirection * kSameDirection / 2 ||
        std::abs(part.height - side.height) > kFlatness) {
      continue;
    }
    done[j] = 1;
    side.shapes[part.shape] = 1;
    apart = apart && (j == first || !(side.endless || part.endless));
    Outline own = outline_on(side, part);
    apart = is_apart(around(own), known) && apart;
    std::move(own.rings.begin(), own.rings.end(), std::back_inserter(side.outline.rings));
  }
  if (apart) return true;
  if (side.endless) return false;
  side.outline = united(side.outline, kFlatness);
  return !side.outline.rings.empty();
}

}  // namespace

bool any_below(const std::vector<double>& rises, const std::vector<Shape>& shapes, const Pose& body,
               const Rectangle& over, double floor, const InclinedPlane& plane) {
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    if (!(rises[k] < kNowhere)) continue;
    const Rectangle part = part_under(shapes[k], body, over, floor);
    if (part.is_empty()) continue;
    // The plane is highest at the corner to which it rises.
    const double x = plane.slopes[0] > 0.0 ? part.east : part.west;
    const double y = plane.slopes[1] > 0.0 ? part.north : part.south;
    if (rises[k] < plane.over(x, y)) return true;
  }
  return false;
}

BodyGeometry::BodyGeometry(std::vector<Shape> shapes, const SideLimits& limits)
    : shapes_(std::move(shapes)), limits_(limits) {
  std::vector<Part> parts;
  for (std::size_t i = 0; i < shapes_.size(); ++i) add_parts(shapes_[i], i, parts);
  std::vector<std::uint8_t> done(parts.size(), 0);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (done[i]) continue;
    FlatSide side = {};
    face_axes(parts[i].up, side.rotation);
    side.height = parts[i].height;
    side.endless = parts[i].endless;
    side.shapes.assign(shapes_.size(), 0);
    if (!gather(parts, i, done, side)) continue;
    side.bounds = around(side.outline);
    sides_.push_back(std::move(side));
  }
}

const FlatSide* BodyGeometry::side(std::size_t number) {
  FlatSide& side = sides_[number];
  if (!side.looked_at) {
    side.looked_at = true;
    side.usable = look_at(side);
  }
  return side.usable ? &side : nullptr;
}

bool BodyGeometry::look_at(FlatSide& side) const {
  side.others.clear();
  side.rises.assign(shapes_.size(), kNowhere);
  const double area = side.endless ? kNowhere : signed_area(side.outline);
  if (!(area > 0.0)) return false;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const Shape& shape = shapes_[k];
    if (side.shapes[k]) {
      if (shape.kind == ShapeKind::triangles &&
          area_beside(shape, side.up(), side.height, limits_.facing_gap) > kBeside * area) {
        return false;
      }
    } else {
      side.rises[k] = least_along(shape, side.up()) - side.height;
      if (side.rises[k] <= limits_.facing_gap) side.others.push_back(k);
    }
  }
  if (side.endless) {
    side.most_slope = limits_.level ? kLevel : limits_.leaning ? kMostLean : kEndlessLean;
    return true;
  }
  const double width = std::max(side.bounds.east - side.bounds.west, side.bounds.north - side.bounds.south);
  side.most_slope = limits_.level ? kLevel / width : kLean * limits_.facing_gap / width;
  if (limits_.leaning) find_onsets(side);
  auto face = std::make_shared<Face>();
  FaceCells cells;
  if (!cells.make(side.outline, limits_.cells, *face)) return false;
  static_cast<FacePlane&>(*face) = side;
  face->rises = side.rises;
  side.whole = std::move(face);
  return true;
}

// Find from which tilt and depth on other parts of the body may touch, and how far the body may lean on the side.
void BodyGeometry::find_onsets(FlatSide& side) const {
  const std::vector<std::uint8_t>& own = side.shapes;
  std::vector<std::uint8_t> others(own.size());
  std::transform(own.begin(), own.end(), others.begin(), [](std::uint8_t one) { return one ? 0 : 1; });
  side.own_shapes.depth = side.any_part.depth = least_rise(shapes_, side, limits_.facing_gap);
  for (const double rise : side.rises) {
    if (rise > limits_.facing_gap) side.any_part.depth = std::min(side.any_part.depth, rise);
  }
  if (limits_.level) return;
  const double own_slope = kLeanShare * steepness(shapes_, own, side);
  const double slope = std::min(own_slope, kLeanShare * steepness(shapes_, others, side));
  side.any_part.slope = std::max(side.most_slope, slope);
  side.most_slope = std::max(side.most_slope, std::min(kMostLean, own_slope));
  side.own_shapes.slope = std::max(side.most_slope, own_slope);
}

}  // namespace mjtactile
