// The objects behind the handles of the C interface. Each owns its data or shares it by shared_ptr.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>
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
  std::vector<std::vector<mjtactile::Facet>> facets;
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
  return {facing_gap, !options.tilting && shapes, shapes, options.cells};
}

inline Pose pose_of(const double* numbers) {
  Pose pose;
  std::copy(numbers, numbers + 3, pose.position);
  std::copy(numbers + 3, numbers + 12, pose.rotation);
  return pose;
}

// A sensor of a pad in single or in double precision.
class AnySensor {
 public:
  AnySensor(const std::shared_ptr<const Pad>& pad, LawOptions options, double facing_gap, double tolerance)
      : sensor_(make(pad, options, facing_gap, tolerance)) {}

  void press(const Touch* touches, std::size_t count, const Steadiness& before) {
    std::visit([&](auto& sensor) { sensor->press(touches, count, before); }, sensor_);
  }
  const Pressed& pressed() const {
    return std::visit([](const auto& sensor) -> const Pressed& { return sensor->pressed(); }, sensor_);
  }
  void readings(double* to) {
    std::visit([&](auto& sensor) { sensor->readings(to); }, sensor_);
  }
  void stress(double* to) {
    std::visit([&](auto& sensor) { sensor->stress(to); }, sensor_);
  }
  void keep_nodal_forces(bool keep, bool only = false) {
    std::visit([&](auto& sensor) { sensor->keep_nodal_forces(keep, only); }, sensor_);
  }
  const std::vector<double>& nodal_forces() const {
    return std::visit([](const auto& sensor) -> const std::vector<double>& { return sensor->nodal_forces(); }, sensor_);
  }
  Steadiness after(const Steadiness& before) const {
    return std::visit([&](const auto& sensor) { return sensor->after(before); }, sensor_);
  }
  void set_patience(double times) {
    std::visit([&](auto& sensor) { sensor->set_patience(times); }, sensor_);
  }
  void carry_any_torsion() {
    std::visit([](auto& sensor) { sensor->carry_any_torsion(); }, sensor_);
  }
  const std::vector<Segment>& rim() const {
    return std::visit([](const auto& sensor) -> const std::vector<Segment>& { return sensor->rim(); }, sensor_);
  }
  SolvedCells solved_cells(std::size_t touch) const {
    return std::visit([&](const auto& sensor) { return sensor->solved_cells(touch); }, sensor_);
  }

 private:
  using Either = std::variant<std::unique_ptr<PadSensor<float>>, std::unique_ptr<PadSensor<double>>>;
  static Either make(const std::shared_ptr<const Pad>& pad, LawOptions options, double facing_gap, double tolerance) {
    if (pad->twofold()) return std::make_unique<PadSensor<double>>(pad, options, facing_gap, tolerance);
    return std::make_unique<PadSensor<float>>(pad, options, facing_gap, tolerance);
  }

  Either sensor_;
};

}  // namespace mjtactile
