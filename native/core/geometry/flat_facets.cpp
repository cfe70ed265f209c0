#include "geometry/flat_facets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include "geometry/hash.hpp"
#include "geometry/outline.hpp"
#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

// Largest distance of a facet's corners from its plane: in m, and over the mesh's size.
constexpr double kFlat = 1e-6, kFlatShare = 1e-4;
// Largest angle between normals of a facet's triangles, except for rounding of their corners [rad].
constexpr double kSameNormal = 1e-4;
// Rounding of corners, relative to the mesh's size: four units of single precision.
constexpr double kRounding = 4.8e-7;
// Largest number of facets, and least share of the mesh's surface that one has.
constexpr std::size_t kMost = 64;
constexpr double kLeastShare = 2e-3;
// Size of a cell in the space of planes, in tolerances. Equal planes are in the same or neighbouring cells.
constexpr double kCell = 4.0;

struct Vector {
  double x = 0.0, y = 0.0, z = 0.0;
};
Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vector operator*(double factor, const Vector& a) { return {factor * a.x, factor * a.y, factor * a.z}; }
double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double length(const Vector& a) { return std::sqrt(dot(a, a)); }

// Sums over triangles, and the plane through their centroid with their mean normal.
struct Plane {
  Vector area_normal, moment;  // vector area [m^2]; sum of the middles times areas [m^3]
  double area = 0.0;
  Vector normal;
  double offset = 0.0;

  void add(const Vector& vector_area, double size, const Vector& middle) {
    area_normal = area_normal + vector_area;
    moment = moment + size * middle;
    area += size;
    const double whole = length(area_normal);
    if (!(whole > 0.0)) return;
    normal = (1.0 / whole) * area_normal;
    offset = dot(normal, moment) / area;
  }
};

// Connected triangles in one plane, as a range of the finder's members_.
struct Region {
  Plane plane;
  std::size_t first, last;
};

// A hash of regions by their planes. A plane is four numbers, rounded to a cell. Equal planes are in the same cell or
// in a neighbouring one.
class PlaneCells {
 public:
  static constexpr unsigned kAround = 16;  // number of cells that planes equal to a given one may be in

  PlaneCells(const std::vector<Region>& regions, double flat)
      : regions_(regions), steps_{kCell * kSameNormal, kCell * kSameNormal, kCell * kSameNormal, kCell * flat} {
    entries_.reserve(regions.size());
    for (std::uint32_t number = 0; number < regions.size(); ++number) {
      double cell[4];
      for (std::size_t i = 0; i < 4; ++i) cell[i] = std::floor(place(regions[number].plane, i));
      entries_.emplace_back(key_of(cell), number);
    }
    std::sort(entries_.begin(), entries_.end());
  }

  // Numbers of the regions in all cells whose total area is at least this [m^2].
  std::vector<std::uint32_t> heavy(double least) const {
    std::vector<std::uint32_t> found;
    for (std::size_t i = 0, next; i < entries_.size(); i = next) {
      double area = 0.0;
      for (next = i; next < entries_.size() && entries_[next].first == entries_[i].first; ++next) {
        area += regions_[entries_[next].second].plane.area;
      }
      if (!(area >= least)) continue;
      for (std::size_t k = i; k < next; ++k) found.push_back(entries_[k].second);
    }
    return found;
  }

  // Call visit(number) for each region in the cells around a plane.
  template <typename Visit>
  void visit_around(const Plane& plane, Visit visit) const {
    for (unsigned side = 0; side < kAround; ++side) {
      double cell[4];
      for (std::size_t i = 0; i < 4; ++i) {
        const double at = place(plane, i), here = std::floor(at);
        cell[i] = (side >> i & 1U) == 0 ? here : here + (at - here < 0.5 ? -1.0 : 1.0);
      }
      const std::uint64_t key = key_of(cell);
      auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair{key, std::uint32_t{0}});
      for (; at != entries_.end() && at->first == key; ++at) visit(at->second);
    }
  }

 private:
  double place(const Plane& plane, std::size_t i) const {
    const double numbers[4] = {plane.normal.x, plane.normal.y, plane.normal.z, plane.offset};
    return numbers[i] / steps_[i];
  }

  static std::uint64_t key_of(const double cell[4]) {
    std::uint64_t key = 0;
    for (int i = 0; i < 4; ++i) key = mixed(key, static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[i])));
    return key;
  }

  const std::vector<Region>& regions_;
  double steps_[4];
  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;  // keys of cells, and regions there
};

class FacetFinder {
 public:
  explicit FacetFinder(const TriangleMesh& mesh) : mesh_(mesh), count_(mesh.faces.size() / 3) {
    for (const double one : mesh.vertices) {
      if (std::isfinite(one)) size_ = std::max(size_, std::abs(one));
    }
    flat_ = std::min(kFlat, kFlatShare * size_);
    measure();
    find_neighbours();
    grow();
  }

  std::vector<Facet> facets(double gap) {
    std::vector<Facet> found;
    std::vector<std::uint32_t> owner(count_, 0);
    std::uint32_t number = 0;
    for (auto& [plane, members] : coplanar(kLeastShare * surface_)) {
      if (!is_flat(plane, members)) continue;
      fill_up(plane, members, owner, ++number);
      for (const double side : {1.0, -1.0}) {
        if (side < 0.0 && mesh_.closed) break;
        const Vector normal = side * plane.normal;
        if (reaches_beyond(normal, side * plane.offset + gap)) continue;
        Facet facet = {{normal.x, normal.y, normal.z}, side * plane.offset, {}, 0.0};
        outline(members, normal, side, facet);
        if (!facet.loops.empty()) found.push_back(std::move(facet));
      }
    }
    std::stable_sort(found.begin(), found.end(), [](const Facet& a, const Facet& b) { return a.area > b.area; });
    if (found.size() > kMost) found.resize(kMost);
    return found;
  }

 private:
  using Triangles = std::vector<std::uint32_t>;

  Vector vertex(std::size_t number) const {
    const double* at = mesh_.at(number);
    return {at[0], at[1], at[2]};
  }
  Vector corner(std::size_t triangle, std::size_t k) const { return vertex(mesh_.vertex(triangle, k)); }

  // Compute each triangle's vector area, area, middle, and the angle by which rounding may turn it.
  void measure() {
    area_normals_.resize(count_), areas_.assign(count_, 0.0), middles_.resize(count_), turns_.resize(count_);
    for (std::size_t t = 0; t < count_; ++t) {
      const Vector a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
      const Vector twice = cross(b - a, c - a);
      const double area = length(twice) / 2;
      turns_[t] = std::numeric_limits<double>::infinity();
      if (!std::isfinite(area)) continue;
      area_normals_[t] = 0.5 * twice, areas_[t] = area, middles_[t] = (1.0 / 3.0) * (a + b + c);
      const double longest = std::max({length(b - a), length(c - b), length(a - c)});
      if (area > 0.0) turns_[t] = std::max(kSameNormal, kRounding * size_ * longest / (2 * area));
      surface_ += area;
    }
  }

  // Find each triangle's neighbours over edges that belong to exactly two triangles.
  void find_neighbours() {
    edges_ = mesh_edges(mesh_.faces, mesh_.vertices.size() / 3);
    neighbours_.assign(3 * count_, -1);
    for (std::size_t i = 0, next; i < edges_.size(); i = next) {
      next = i + 1;
      while (next < edges_.size() && edges_[next].joins_as(edges_[i])) ++next;
      if (next != i + 2 || edges_[i].upward == edges_[i + 1].upward) continue;
      neighbours_[edges_[i].start] = static_cast<std::int32_t>(edges_[i + 1].start / 3);
      neighbours_[edges_[i + 1].start] = static_cast<std::int32_t>(edges_[i].start / 3);
    }
  }

  // Whether all corners of a triangle are near a plane.
  bool is_near(const Plane& plane, std::size_t triangle, double distance) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(std::abs(dot(plane.normal, corner(triangle, k)) - plane.offset) <= distance)) return false;
    }
    return true;
  }

  bool in_plane(const Plane& plane, std::size_t triangle) const {
    if (!is_near(plane, triangle, flat_)) return false;
    if (areas_[triangle] == 0.0) return true;
    const Vector apart = area_normals_[triangle] - areas_[triangle] * plane.normal;
    return length(apart) <= turns_[triangle] * areas_[triangle];
  }

  // Grow regions of connected triangles in one plane, beginning with the largest triangle.
  void grow() {
    std::vector<std::uint32_t> order(count_);
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) {
      return areas_[a] != areas_[b] ? areas_[a] > areas_[b] : a < b;
    });
    std::vector<std::uint8_t> taken(count_, 0);
    members_.reserve(count_);
    for (const std::uint32_t seed : order) {
      if (taken[seed] || !(areas_[seed] > 0.0)) continue;
      const std::size_t first = members_.size();
      Plane plane;
      const auto take = [&](std::uint32_t triangle) {
        taken[triangle] = 1;
        members_.push_back(triangle);
        plane.add(area_normals_[triangle], areas_[triangle], middles_[triangle]);
      };
      take(seed);
      for (std::size_t i = first; i < members_.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          const std::int32_t next = neighbours_[3 * std::size_t{members_[i]} + k];
          if (next < 0 || taken[static_cast<std::size_t>(next)]) continue;
          if (in_plane(plane, static_cast<std::size_t>(next))) take(static_cast<std::uint32_t>(next));
        }
      }
      regions_.push_back({plane, first, members_.size()});
    }
  }

  // Join the regions that are in one plane. Planes with less than `least` area [m^2] are left out.
  std::vector<std::pair<Plane, Triangles>> coplanar(double least) const {
    const PlaneCells cells(regions_, flat_);
    std::vector<std::uint32_t> order = cells.heavy(least / PlaneCells::kAround);
    std::sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) {
      const double first = regions_[a].plane.area, second = regions_[b].plane.area;
      return first != second ? first > second : a < b;
    });
    std::vector<std::uint8_t> taken(regions_.size(), 0);
    std::vector<std::pair<Plane, Triangles>> found;
    for (const std::uint32_t seed : order) {
      if (taken[seed]) continue;
      auto joined = join(seed, cells, taken);
      if (joined.first.area >= least) found.push_back(std::move(joined));
    }
    return found;
  }

  // Join a region and all others in its plane that are not taken yet, and mark them as taken.
  std::pair<Plane, Triangles> join(std::uint32_t seed, const PlaneCells& cells,
                                   std::vector<std::uint8_t>& taken) const {
    const Plane& begun = regions_[seed].plane;
    std::pair<Plane, Triangles> joined;
    cells.visit_around(begun, [&](std::uint32_t number) {
      if (taken[number] || (number != seed && !agrees(regions_[number], begun))) return;
      taken[number] = 1;
      for (std::size_t i = regions_[number].first; i < regions_[number].last; ++i) {
        const std::uint32_t triangle = members_[i];
        joined.first.add(area_normals_[triangle], areas_[triangle], middles_[triangle]);
        joined.second.push_back(triangle);
      }
    });
    return joined;
  }

  bool agrees(const Region& region, const Plane& plane) const {
    if (length(region.plane.normal - plane.normal) > kSameNormal) return false;
    const auto first = members_.begin() + static_cast<std::ptrdiff_t>(region.first);
    const auto last = members_.begin() + static_cast<std::ptrdiff_t>(region.last);
    return std::all_of(first, last, [&](std::uint32_t triangle) { return in_plane(plane, triangle); });
  }

  // Add neighbours that lie in the final plane. It is more accurate than the plane of the first triangles.
  void fill_up(const Plane& plane, Triangles& members, std::vector<std::uint32_t>& owner, std::uint32_t number) const {
    for (const std::uint32_t t : members) owner[t] = number;
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t next = neighbours_[3 * std::size_t{members[i]} + k];
        if (next < 0 || owner[static_cast<std::size_t>(next)] == number) continue;
        if (!in_plane(plane, static_cast<std::size_t>(next))) continue;
        owner[static_cast<std::size_t>(next)] = number;
        members.push_back(static_cast<std::uint32_t>(next));
      }
    }
  }

  // Whether all corners are near the final plane.
  bool is_flat(const Plane& plane, const Triangles& members) const {
    return std::all_of(members.begin(), members.end(),
                       [&](std::uint32_t t) { return is_near(plane, t, 2 * flat_); });
  }

  // Whether a corner of the mesh has a coordinate along a direction above a limit [m].
  bool reaches_beyond(const Vector& direction, double limit) const {
    const double back[3] = {-direction.x, -direction.y, -direction.z};
    return mesh_.any_box([&](const MeshBox& box) { return -box.least_along(back) > limit; }, [&](const MeshBox& box) {
      for (std::size_t t = box.first; t < box.first + box.count; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          if (dot(direction, corner(t, k)) > limit) return true;
        }
      }
      return false;
    });
  }

  // An edge of a facet's outline, from one vertex to another.
  struct Step {
    std::int32_t from, to;
    bool used;
  };

  // Chain the edges that only one triangle of a facet has into loops.
  void outline(const Triangles& members, const Vector& normal, double side, Facet& facet) const {
    // Axes in the facet's plane, right-handed with the normal.
    Vector u = std::abs(normal.x) < 0.6 ? Vector{1.0, 0.0, 0.0} : Vector{0.0, 1.0, 0.0};
    u = u - dot(u, normal) * normal;
    u = (1.0 / length(u)) * u;
    const Vector v = cross(normal, u);
    std::vector<Step> steps = boundary(members, side);
    const auto from_vertex = [&steps](std::int32_t from) {
      return std::lower_bound(steps.begin(), steps.end(), from,
                              [](const Step& step, std::int32_t wanted) { return step.from < wanted; });
    };
    const auto flat = [&](std::int32_t number) {
      const Vector at = vertex(static_cast<std::size_t>(number));
      return Point{dot(u, at), dot(v, at)};
    };
    for (Step& start : steps) {
      std::vector<std::int32_t> loop;
      for (Step* step = &start; step != nullptr && !step->used;) {
        step->used = true;
        loop.push_back(step->from);
        // At a corner where several loops meet, the area on the left is bounded by the next edge clockwise.
        const auto here = flat(step->to), back = flat(step->from);
        const double behind = std::atan2(back.y - here.y, back.x - here.x);
        Step* best = nullptr;
        double least = std::numeric_limits<double>::infinity();
        for (auto next = from_vertex(step->to); next != steps.end() && next->from == step->to; ++next) {
          const auto there = flat(next->to);
          double turn = behind - std::atan2(there.y - here.y, there.x - here.x);
          if (turn <= 0.0) turn += kTurn;
          if (turn < least) least = turn, best = &*next;
        }
        step = best;
      }
      if (loop.empty()) continue;
      std::vector<Point> points(loop.size());
      std::transform(loop.begin(), loop.end(), points.begin(), flat);
      double area = 0.0;
      const std::vector<std::size_t> kept = corners_of(points, area);
      if (kept.size() < 3) continue;
      facet.area += area;
      facet.loops.emplace_back();
      for (const std::size_t k : kept) {
        const Vector at = vertex(static_cast<std::size_t>(loop[k]));
        facet.loops.back().push_back({at.x, at.y, at.z});
      }
    }
  }

  // Edges that triangles of a facet pass more often in one direction than in the other, sorted by their first vertex.
  std::vector<Step> boundary(const Triangles& members, double side) const {
    std::vector<MeshEdge> passed;
    passed.reserve(3 * members.size());
    for (const std::uint32_t t : members) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::int32_t from = mesh_.faces[3 * std::size_t{t} + k], to = mesh_.faces[3 * std::size_t{t} + (k + 1) % 3];
        if (side < 0.0) std::swap(from, to);
        passed.push_back({std::min(from, to), std::max(from, to), 0, from < to});
      }
    }
    std::sort(passed.begin(), passed.end(), [](const MeshEdge& a, const MeshEdge& b) {
      return a.low != b.low ? a.low < b.low : a.high < b.high;
    });
    std::vector<Step> steps;
    for (std::size_t i = 0, next; i < passed.size(); i = next) {
      int times = 0;
      for (next = i; next < passed.size() && passed[next].joins_as(passed[i]); ++next) {
        times += passed[next].upward ? 1 : -1;
      }
      if (times > 0) steps.push_back({passed[i].low, passed[i].high, false});
      if (times < 0) steps.push_back({passed[i].high, passed[i].low, false});
    }
    std::sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) {
      return a.from != b.from ? a.from < b.from : a.to < b.to;
    });
    return steps;
  }

  // Corners of a loop, without points that are on the line between their neighbours up to rounding. Empty if the loop
  // has no area.
  std::vector<std::size_t> corners_of(const std::vector<Point>& points, double& area) const {
    const double near = kRounding * size_ / 4;
    const std::size_t count = points.size();
    // Start at the point furthest from another one, which is certainly a corner.
    std::size_t start = 0;
    double away = 0.0;
    for (std::size_t k = 1; k < count; ++k) {
      const double off = std::hypot(points[k].x - points[0].x, points[k].y - points[0].y);
      if (off > away) away = off, start = k;
    }
    const auto at = [&](std::size_t i) { return points[(start + i) % count]; };
    std::vector<std::size_t> kept = {start};
    // Range of directions of lines from the last corner that pass all points since, and the largest distance of these.
    Point from = at(0);
    double middle = 0.0, least = -4.0, most = 4.0, furthest = 0.0;
    bool open = false;
    const auto wrapped = [](double angle) { return std::remainder(angle, kTurn); };
    for (std::size_t i = 1; i <= count; ++i) {
      for (;;) {
        const auto here = at(i);
        const double dx = here.x - from.x, dy = here.y - from.y, distance = std::hypot(dx, dy);
        const double direction = distance > near ? std::atan2(dy, dx) : middle;
        const double off = wrapped(direction - middle);
        if (open && (distance < furthest - near || off < least || off > most)) {
          // The previous point was a corner.
          const std::size_t corner_at = (start + i - 1) % count;
          kept.push_back(corner_at);
          from = points[corner_at];
          open = false, least = -4.0, most = 4.0, furthest = 0.0;
          continue;
        }
        if (distance > near) {
          const double width = std::asin(std::min(near / distance, 1.0));
          if (!open) {
            middle = direction, least = -width, most = width, open = true;
          } else {
            least = std::max(least, off - width), most = std::min(most, off + width);
          }
          furthest = std::max(furthest, distance);
        }
        break;
      }
    }
    std::vector<Point> ring;
    for (const std::size_t k : kept) ring.push_back(points[k]);
    area = signed_area(ring);
    if (std::abs(area) <= near * perimeter(ring)) kept.clear(), area = 0.0;
    return kept;
  }

  const TriangleMesh& mesh_;
  std::size_t count_;
  double size_ = 0.0, flat_ = 0.0, surface_ = 0.0;
  std::vector<Vector> area_normals_, middles_;
  std::vector<double> areas_, turns_;
  std::vector<MeshEdge> edges_;
  std::vector<std::int32_t> neighbours_;
  Triangles members_;
  std::vector<Region> regions_;
};

}  // namespace

std::vector<Facet> flat_facets(const TriangleMesh& mesh, double gap) {
  if (mesh.boxes.empty()) return {};
  return FacetFinder(mesh).facets(gap);
}

}  // namespace mjtactile
