#include "contact/laws/surface_shear.hpp"

#include <algorithm>
#include <cmath>

#include "contact/cells/lean.hpp"
#include "contact/laws/by_name.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Limit on the multiplications in factorisations for one contact, which take some milliseconds.
constexpr double kWork = 3e7;

bool finite(const double* numbers, std::size_t count) {
  return std::all_of(numbers, numbers + count, [](double one) { return std::isfinite(one); });
}

}  // namespace

ShearOutcome SurfaceShear::solve(const TangentialChoice& choice, const ShearProblem& problem, double* forces) {
  const PressedCells& cells = problem.cells;
  work_.allow();
  double pressing = 0.0;
  for (std::size_t i = 0; i < cells.count; ++i) pressing += std::max(cells.pressing[i], 0.0);
  if (!(pressing > 0.0) || !finite(problem.wrench, 6) || !finite(cells.pressing, cells.count)) {
    std::fill(forces, forces + 3 * cells.count, 0.0);
    ShearOutcome refused;
    refused.refused = true;
    return refused;
  }
  work_.reached.clear();
  for (std::size_t i = 0; i < cells.count; ++i) {
    if (cells.heights == nullptr || std::isfinite(cells.heights[i])) work_.reached.push_back(i);
  }
  work_.gathered.clear();
  work_.leaning.clear();
  ShearOutcome outcome = choice.solve(problem, work_, forces);
  if (!finite(forces, 3 * cells.count)) {
    outcome = proportional_shear().solve(problem, work_, forces);
    outcome.simplified = true;
  }
  return outcome;
}

void ShearWork::allow() { limit.allow(patience * kWork); }

void ShearWork::hold(const PressedCells& cells, const double* normal_forces) {
  held.clear();
  const double touching = most_of_touching(cells, normal_forces);
  for (std::size_t i = 0; i < cells.count; ++i) {
    if (normal_forces[i] > touching) held.push_back(i);
  }
  grip.hold(cells.points, normal_forces, held.data(), held.size(), cells.length);
  shear.resize(2 * held.size());
}

void ShearWork::lean(const PressedCells& cells, const double* normal_forces) {
  leaning.clear();
  if (cells.gradients == nullptr) return;
  balance_lean(*cells.gradients, cells.points, normal_forces, leans);
  leaning.resize(2 * cells.count);
  for (std::size_t i = 0; i < cells.count; ++i) {
    leaning[i] = normal_forces[i] * leans[i].x;
    leaning[cells.count + i] = normal_forces[i] * leans[i].y;
  }
}

void ShearWork::write(const PressedCells& cells, const double* normal_forces, double* forces) const {
  for (std::size_t i = 0; i < cells.count; ++i) {
    forces[3 * i] = forces[3 * i + 1] = 0.0;
    forces[3 * i + 2] = -normal_forces[i];
  }
  for (std::size_t i = 0; i < held.size(); ++i) {
    forces[3 * held[i]] = shear[i];
    forces[3 * held[i] + 1] = shear[held.size() + i];
  }
}

void ShearWork::displace(const PressedCells& cells, const Matrix& compliance, const double* normal_forces) {
  const std::size_t size = held.size(), count = cells.count;
  free_slip.resize(2 * size);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t i = 0; i < size; ++i) {
      const double* from = compliance[a * count + held[i]];
      free_slip[a * size + i] = dot(from, leaning.data(), leaning.size()) - dot(from + 2 * count, normal_forces, count);
    }
  }
  if (gathered == held) return;
  gathered = held;
  tangential.resize(2 * size, 2 * size);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t i = 0; i < size; ++i) {
      const double* from = compliance[a * count + held[i]];
      double* to = tangential[a * size + i];
      for (std::size_t j = 0; j < size; ++j) to[j] = from[held[j]], to[size + j] = from[count + held[j]];
    }
  }
}

double most_of_touching(const PressedCells& cells, const double* normal_forces) {
  return kTouches * std::max(*std::max_element(normal_forces, normal_forces + cells.count), 0.0);
}

double share_borne(const PressedCells& cells, std::size_t cell, double coupled) {
  if (cells.most == nullptr || coupled <= cells.most[cell]) return 1.0;
  return std::max(cells.most[cell] - cells.pressing[cell], 0.0) / (coupled - cells.pressing[cell]);
}

}  // namespace mjtactile
