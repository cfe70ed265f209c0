#include "contact/cells/placed_cells.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <list>
#include <mutex>
#include <utility>
#include <vector>

#include "contact/cells/face_cells.hpp"
#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

// Outlines share cells if they agree to this fraction of their size after a rigid motion.
constexpr double kSameShape = 2e-12;
// Number of shapes whose cells are kept. Their half-space integrals take longer than everything else.
constexpr std::size_t kKeptShapes = 64;
// Outlines with more corners count as round.
constexpr std::size_t kRound = 60;
// Sides within this angle of a direction count as parallel to it [rad]. Two directions are equal if the lengths of
// their sides agree to the fraction kAlike.
constexpr double kParallel = 1e-3, kAlike = 1e-6;
// Directions within this angle of the x axis are set to 0 [rad].
constexpr double kLevel = 1e-9;
// Difference over sum of the principal moments of inertia above which an area is long.
constexpr double kLong = 1e-2;

struct Side {
  double angle, length;
};

double within_quarter(double angle) {
  const double turned = std::fmod(angle + kRightAngle / 2, kRightAngle);
  return (turned < 0.0 ? turned + kRightAngle : turned) - kRightAngle / 2;
}

double levelled(double angle) { return std::abs(angle) < kLevel ? 0.0 : angle; }

template <typename Visit>
void visit_sides(const std::vector<Point>& ring, Visit&& visit) {
  for (std::size_t i = 0; i < ring.size(); ++i) visit(ring[i], ring[i + 1 == ring.size() ? 0 : i + 1]);
}

// Angle of the principal axis of inertia [rad]; 0 if the area has none. `middle`: a point near the area.
double direction_of_length(const Outline& outline, const Point& middle) {
  AreaIntegrals all;
  for (const std::vector<Point>& ring : outline.rings) {
    visit_sides(ring, [&](const Point& start, const Point& end) {
      all.add(triangle_integrals({start.x - middle.x, start.y - middle.y}, {end.x - middle.x, end.y - middle.y}));
    });
  }
  // Second moments about the centroid.
  const double xx = all.xx - all.x * all.x / all.area, yy = all.yy - all.y * all.y / all.area;
  const double xy = all.xy - all.x * all.y / all.area;
  if (std::hypot(xx - yy, 2 * xy) < kLong * (xx + yy)) return 0.0;
  return levelled(within_quarter(0.5 * std::atan2(2 * xy, xx - yy)));
}

// Corners of a shape by ring, in its own frame, as multiples of a resolution [m]; and the wanted number of cells.
struct OutlineKey {
  std::vector<std::vector<std::pair<std::int64_t, std::int64_t>>> rings;
  double resolution;
  CellCount wanted;

  bool operator==(const OutlineKey& other) const {
    return wanted.count == other.wanted.count && wanted.widest == other.wanted.widest &&
           resolution == other.resolution && rings == other.rings;
  }
};

std::shared_ptr<const Face> make_face(const OutlineKey& key) {
  static thread_local FaceCells maker;
  Outline local;
  for (const auto& ring : key.rings) {
    local.rings.emplace_back();
    for (const auto& [x, y] : ring) {
      local.rings.back().push_back({static_cast<double>(x) * key.resolution, static_cast<double>(y) * key.resolution});
    }
  }
  auto face = std::make_shared<Face>();
  if (!maker.make(local, key.wanted, *face, 0.0)) return nullptr;
  return face;
}

std::shared_ptr<const Face> shape_cells(OutlineKey key) {
  static std::mutex mutex;
  static std::list<std::pair<OutlineKey, std::shared_ptr<const Face>>> kept;   // latest used first
  const std::lock_guard<std::mutex> lock(mutex);
  const auto known = std::find_if(kept.begin(), kept.end(), [&](const auto& one) { return one.first == key; });
  if (known != kept.end()) {
    kept.splice(kept.begin(), kept, known);
  } else {
    auto face = make_face(key);
    kept.emplace_front(std::move(key), std::move(face));
    if (kept.size() > kKeptShapes) kept.pop_back();
  }
  return kept.front().second;
}

// Angle of an outline's own axes, from -pi/4 to pi/4 [rad]. They are the axes along which sides of the outline and of
// its convex hull have the largest total length. A round outline has its principal axes of inertia. If several
// directions are equal, the one nearest to the x axis is used.
double own_direction(const Outline& outline) {
  std::vector<Point> corners;
  for (const std::vector<Point>& ring : outline.rings) corners.insert(corners.end(), ring.begin(), ring.end());
  if (corners.size() > kRound) {
    Point middle = {0.0, 0.0};
    for (const Point& corner : corners) middle.x += corner.x, middle.y += corner.y;
    const auto number = static_cast<double>(corners.size());
    return direction_of_length(outline, {middle.x / number, middle.y / number});
  }
  std::vector<Side> sides;
  const auto add = [&](const Point& start, const Point& end) {
    const double x = end.x - start.x, y = end.y - start.y;
    sides.push_back({within_quarter(std::atan2(y, x)), std::hypot(x, y)});
  };
  for (const std::vector<Point>& ring : outline.rings) visit_sides(ring, add);
  visit_sides(convex_hull(std::move(corners)), add);
  std::vector<double> shared(sides.size(), 0.0);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    for (const Side& other : sides) {
      if (std::abs(within_quarter(sides[i].angle - other.angle)) < kParallel) shared[i] += other.length;
    }
  }
  const double most = *std::max_element(shared.begin(), shared.end());
  double best = kTurn;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (shared[i] >= (1.0 - kAlike) * most && std::abs(sides[i].angle) < std::abs(best)) best = sides[i].angle;
  }
  return levelled(best);
}

}  // namespace

PlacedCells placed_cells(const Outline& outline, const CellCount& wanted) {
  const Point origin = outline.rings.front().front();
  const double angle = own_direction(outline), cosine = std::cos(angle), sine = std::sin(angle);
  const Rectangle bounds = around(outline);
  // Corners are rounded to a grid, because rounding errors of a moving punch must not make it another shape.
  const double size = std::max(bounds.east - bounds.west, bounds.north - bounds.south);
  OutlineKey key = {{}, std::exp2(std::floor(std::log2(kSameShape * size))), wanted};
  for (const std::vector<Point>& ring : outline.rings) {
    key.rings.emplace_back();
    for (const Point& corner : ring) {
      const double x = corner.x - origin.x, y = corner.y - origin.y;
      key.rings.back().emplace_back(std::llround((cosine * x + sine * y) / key.resolution),
                                      std::llround((cosine * y - sine * x) / key.resolution));
    }
  }
  return {shape_cells(std::move(key)), origin, angle};
}

}  // namespace mjtactile
