#include "contact/facing_faces.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/outline.hpp"
#include "linalg/angles.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// A face that extends beyond the sheet is cut at the sheet's edge, for a placement rounded to this [m, rad]. The error
// of the edge is a hundredth of the depth of the first taxels. A right angle is a multiple of the angle's step, so that
// scenes turned by it are cut alike.
constexpr double kCutStep = 5e-6, kCutTurn = kRightAngle / 3142;
constexpr std::size_t kMostCutFaces = 64;
// Share of a cut outline that must lie on the sheet's rim for cells along the sheet's axes. It is not a ratio of simple
// shapes.
constexpr double kMostlyRim = 0.503;
// Least cosine of a face's slope with which it may face the pad alone.
constexpr double kFacing = 0.9;
// Largest distance of a pressing face from the surface, above it or, with soft contacts, below it, over the pad's
// depth.
constexpr double kNear = 0.8;

}  // namespace

std::shared_ptr<const Face> FacingFaces::towards(const Touch& touch, Placement& placement) {
  if (touch.face != nullptr) placement = touch.placement;
  if (touch.face != nullptr || touch.geometry == nullptr) return touch.face;
  BodyGeometry& body = *touch.geometry;
  const double* up = touch.pose.rotation + 6;
  // A pressing face is near the surface where the force passes. A face far below it is beside or under the pad.
  const double near = kNear * depth_;
  const Point at = centre_of_pressure(touch.wrench);
  for (std::size_t i = 0; i < body.sides(); ++i) {
    const FlatSide& seen = body.outlined(i);
    if (dot(up, seen.up()) < kFacing) continue;
    FacePlane plane = seen;
    plane.most_slope = 1.0;
    if (!place(plane, touch.pose, placement) || std::abs(plane_of(plane, touch.pose).over(at.x, at.y)) > near ||
        covered(seen, placement).is_empty()) {
      continue;
    }
    const FlatSide* side = body.side(i);
    if (side == nullptr || !place(*side, touch.pose, placement)) continue;
    if (leans_below_others(*side, touch, placement)) continue;
    // Another part of the body may press as well, unless it is beside the sheet or deeper than the pad.
    if (std::any_of(side->others.begin(), side->others.end(), [&](std::size_t k) {
          return !part_under(body.shapes()[k], touch.pose, sheet_, -depth_).is_empty();
        })) {
      continue;
    }
    if (side->whole != nullptr && over_sheet(*side->whole, placement)) return side->whole;
    const std::shared_ptr<const Face> made = cut(touch, i, placement);
    placement = kUnmoved;
    return made;
  }
  return nullptr;
}

// The part of the sheet under the bounding box of a side's outline.
Rectangle FacingFaces::covered(const FlatSide& side, const Placement& placement) const {
  if (side.endless) return sheet_;
  const auto& [west, south, east, north] = side.bounds;
  Rectangle placed = kNoRectangle;
  for (const Point& corner : {Point{west, south}, {east, south}, {east, north}, {west, north}}) {
    placed = around(placed, placement(corner));
  }
  return common(placed, sheet_);
}

// Whether a side leans so far that other shapes of the body may be lower.
bool FacingFaces::leans_below_others(const FlatSide& side, const Touch& touch, const Placement& placement) const {
  const InclinedPlane plane = plane_of(side, touch.pose);
  if (std::hypot(plane.slopes[0], plane.slopes[1]) <= side.any_part.slope) return false;
  const auto [west, south, east, north] = covered(side, placement);
  const double lowest = plane.over(plane.slopes[0] > 0.0 ? west : east, plane.slopes[1] > 0.0 ? south : north);
  const InclinedPlane below = {{-plane.slopes[0], -plane.slopes[1]}, lowest - plane.height};
  return any_below(side.rises, touch.geometry->shapes(), touch.pose, sheet_, -depth_, below);
}

// A side of a body, cut at the sheet's edge. Null if nothing of it is over the sheet.
std::shared_ptr<const Face> FacingFaces::cut(const Touch& touch, std::size_t side, const Placement& placement) {
  const FlatSide& whole = *touch.geometry->side(side);
  CutPlace place = {std::llround(placement.shift[0] / kCutStep), std::llround(placement.shift[1] / kCutStep),
                    std::llround(placement.angle() / kCutTurn)};
  if (whole.endless) place = {};
  for (auto known = known_.begin(); known != known_.end(); ++known) {
    if (known->body == touch.body && known->side == side && known->place == place &&
        known->geometry.lock() == touch.geometry) {
      known_.splice(known_.begin(), known_, known);
      return known->face;
    }
  }
  known_.push_front({touch.body, side, place, touch.geometry, make(whole, place)});
  if (known_.size() > kMostCutFaces) known_.pop_back();
  return known_.front().face;
}

// Cut a side at the sheet's edge, at a rounded place.
std::shared_ptr<const Face> FacingFaces::make(const FlatSide& whole, const CutPlace& place) {
  Outline outline;
  double angle = 0.0;
  if (whole.endless) {
    const auto& [west, south, east, north] = sheet_;
    outline.rings.push_back({{west, south}, {east, south}, {east, north}, {west, north}});
  } else {
    angle = static_cast<double>(place[2]) * kCutTurn;
    const Placement there = {std::cos(angle), std::sin(angle),
                             {static_cast<double>(place[0]) * kCutStep, static_cast<double>(place[1]) * kCutStep}};
    if (!clip_outline(whole.outline, there, sheet_, outline)) return nullptr;
    // By whole right angles, so that cells turn with a scene that is turned by them.
    if (share_on_rim(outline, sheet_) > kMostlyRim) angle = kRightAngle * std::floor(angle / kRightAngle + 0.5);
  }
  // The squares lie along the side's own axes, or along the sheet's if most of the outline is the sheet's rim.
  auto face = std::make_shared<Face>();
  if (!cutter_.make(outline, cells_, *face, angle)) return nullptr;
  static_cast<FacePlane&>(*face) = whole;
  face->rises = whole.rises;
  face->cut = true;
  return face;
}

bool FacingFaces::over_sheet(const Face& face, const Placement& placement) const {
  return std::all_of(face.corners.begin(), face.corners.end(), [&](const Point& corner) {
    const Point there = placement(corner);
    return sheet_.holds(there.x, there.y);
  });
}

}  // namespace mjtactile
