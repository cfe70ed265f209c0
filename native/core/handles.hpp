// What the C interface's handles hold, and the host behind its function pointers.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "api.h"
#include "pad_sensor.hpp"

struct mjt_pad {
  std::shared_ptr<mjtactile::Pad> pad;
};

struct mjt_face {
  std::shared_ptr<const mjtactile::Face> face;
};

struct mjt_body {
  std::shared_ptr<mjtactile::BodyGeometry> geometry;
};

namespace mjtactile {

inline Pose pose_of(const double* numbers) {
  Pose pose;
  std::copy(numbers, numbers + 3, pose.position);
  std::copy(numbers + 3, numbers + 12, pose.rotation);
  return pose;
}

// A host behind C function pointers.
class CallbackHost : public Host {
 public:
  CallbackHost(mjt_host functions, std::int64_t context) : functions_(functions), context_(context) {}

  std::shared_ptr<const BodyGeometry> body(int body) override {
    const mjt_body* found = functions_.body == nullptr ? nullptr : functions_.body(context_, body);
    return found == nullptr ? nullptr : found->geometry;
  }

  std::shared_ptr<const Face> face(int body, int number) override {
    const mjt_face* found = functions_.face == nullptr ? nullptr : functions_.face(context_, body, number);
    return found == nullptr ? nullptr : found->face;
  }

  std::shared_ptr<const Face> cut_face(int body, int number, const double* place) override {
    if (functions_.cut_face == nullptr) return nullptr;
    const mjt_face* found = functions_.cut_face(context_, body, number, place);
    return found == nullptr ? nullptr : found->face;
  }

  bool nodal_forces(const Touch& touch, double* forces) override {
    double pose[12];
    flat(touch.pose, pose);
    return functions_.nodal_forces != nullptr &&
           functions_.nodal_forces(context_, touch.body, pose, touch.wrench, forces) != 0;
  }

  void beyond_range(const Touch& touch, double pressure, double approach) override {
    if (functions_.beyond_range != nullptr) functions_.beyond_range(context_, touch.body, pressure, approach);
  }

  void not_carried(const Touch& touch) override {
    if (functions_.not_carried != nullptr) functions_.not_carried(context_, touch.body, touch.wrench);
  }

 private:
  static void flat(const Pose& pose, double* numbers) {
    std::copy(pose.position, pose.position + 3, numbers);
    std::copy(pose.rotation, pose.rotation + 9, numbers + 3);
  }

  mjt_host functions_;
  std::int64_t context_;
};

// A sensor of a pad in single or in double precision.
class AnySensor {
 public:
  AnySensor(const std::shared_ptr<const Pad>& pad, LawOptions options, bool native, double tolerance)
      : sensor_(make(pad, options, native, tolerance)) {}

  void press(const Touch* touches, std::size_t count, const Steadiness& before, Host& host) {
    std::visit([&](auto& sensor) { sensor.press(touches, count, before, host); }, sensor_);
  }
  void readings(double* to) {
    std::visit([&](auto& sensor) { sensor.readings(to); }, sensor_);
  }
  void stress(double* to) {
    std::visit([&](auto& sensor) { sensor.stress(to); }, sensor_);
  }
  Steadiness after(const Steadiness& before) const {
    return std::visit([&](const auto& sensor) { return sensor.after(before); }, sensor_);
  }

 private:
  using Either = std::variant<PadSensor<float>, PadSensor<double>>;
  static Either make(const std::shared_ptr<const Pad>& pad, LawOptions options, bool native, double tolerance) {
    if (pad->twofold()) return PadSensor<double>(pad, options, native, tolerance);
    return PadSensor<float>(pad, options, native, tolerance);
  }

  Either sensor_;
};

}  // namespace mjtactile
