#include "contact/cells/compliance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linalg/kernels.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Number of entries of a row that are computed at once, and the multiple to which their range is rounded.
constexpr std::size_t kPanel = 64, kWhole = 8;

}  // namespace

QuadraticSplines::QuadraticSplines(std::vector<double> ends) : ends_(std::move(ends)) {
  if (ends_.size() < 2) return;
  const std::size_t last = ends_.size() - 1;
  for (std::size_t piece = 0; piece < last; ++piece) {
    const double low = ends_[piece], high = ends_[piece + 1];
    const double before = ends_[piece > 0 ? piece - 1 : 0], beyond = ends_[std::min(piece + 2, last)];
    shortest_ = std::min(shortest_, high - low);
    // De Boor's recurrence, with the outermost ends counted three times.
    pieces_.push_back({low, high, 1.0 / ((high - low) * (high - before)), 1.0 / ((high - low) * (beyond - low))});
  }
  pieces_per_length_ = static_cast<double>(last) / (ends_.back() - ends_.front());
}

void Bend::scale_to_surface_distances(std::size_t cell, std::size_t first, std::size_t last, double* row) const {
  const double own = row[cell], here[3] = {u[cell], v[cell], w[cell]};
  kernels().scale_to_surface_distances(here, u + first, v + first, w + first, last - first, row + first);
  // A cell's own side along the slope is longer by its stretch.
  if (first <= cell && cell < last) row[cell] = own / std::sqrt(stretches[cell]);
}

std::size_t QuadraticSplines::at(double place, double* values) const {
  // Pieces have similar lengths. So the search begins at the piece that would be right if they were equal.
  const double about = (place - ends_.front()) * pieces_per_length_, most = static_cast<double>(pieces_.size() - 1);
  std::size_t number = about > 0.0 ? static_cast<std::size_t>(std::min(about, most)) : 0;
  while (number > 0 && place < ends_[number]) --number;
  while (number + 1 < pieces_.size() && place >= ends_[number + 1]) ++number;
  const Piece& piece = pieces_[number];
  values[0] = (piece.high - place) * (piece.high - place) * piece.falling;
  values[2] = (place - piece.low) * (place - piece.low) * piece.rising;
  values[1] = 1.0 - values[0] - values[2];
  return number;
}

SurfaceCompliance::SurfaceCompliance(double factor, QuadraticSplines x, QuadraticSplines y, Matrix remainder)
    : factor_(factor), x_(std::move(x)), y_(std::move(y)), remainder_(std::move(remainder)) {}

void SurfaceCompliance::set_foundation(std::vector<double> areas, std::vector<double> stiffnesses) {
  areas_ = std::move(areas);
  stiffnesses_ = std::move(stiffnesses);
}

double SurfaceCompliance::foundation_stiffness(double area) const {
  const double at = std::log(area);
  // Under small contacts the pad is like a half space, whose stiffness per area is proportional to 1 / radius.
  if (at <= areas_.front()) return std::exp(stiffnesses_.front() + 0.5 * (areas_.front() - at));
  if (at >= areas_.back()) return std::exp(stiffnesses_.back());
  const auto i = static_cast<std::size_t>(std::upper_bound(areas_.begin(), areas_.end(), at) - areas_.begin());
  const double part = (at - areas_[i - 1]) / (areas_[i] - areas_[i - 1]);
  return std::exp(stiffnesses_[i - 1] + part * (stiffnesses_[i] - stiffnesses_[i - 1]));
}

void SurfaceCompliance::set_tangential(double poisson, Matrix remainder) {
  poisson_ = poisson;
  full_remainder_ = std::move(remainder);
}

void SurfaceCompliance::prepare(const SurfaceCells& cells, Workspace& workspace) const {
  workspace.inverse_areas.resize(cells.count);
  for (std::size_t i = 0; i < cells.count; ++i) workspace.inverse_areas[i] = 1.0 / cells.areas[i];
  const std::size_t per_cell = cells.per_cell;
  constexpr std::size_t kOver = QuadraticSplines::kOver;
  workspace.windows.clear();
  workspace.values.clear();
  workspace.places.resize(per_cell);
  const double share = 1.0 / static_cast<double>(per_cell);
  for (std::size_t i = 0; i < cells.count; ++i) {
    const double* own = cells.points + 2 * per_cell * i;
    std::size_t low[2] = {x_.count(), y_.count()}, high[2] = {0, 0};
    for (Place& place : workspace.places) {
      const std::size_t found[2] = {x_.at(*own++, place.along), y_.at(*own++, place.across)};
      for (int axis = 0; axis < 2; ++axis) {
        place.first[axis] = found[axis];
        low[axis] = std::min(low[axis], found[axis]);
        high[axis] = std::max(high[axis], found[axis]);
      }
    }
    const Window window = {low[0], low[1], high[0] - low[0] + kOver, high[1] - low[1] + kOver, workspace.values.size()};
    workspace.windows.push_back(window);
    workspace.values.resize(window.first + window.columns * window.rows, 0.0);
    for (const Place& place : workspace.places) {
      double* to = workspace.values.data() + window.first + (place.first[1] - low[1]) * window.columns +
                   (place.first[0] - low[0]);
      for (std::size_t r = 0; r < kOver; ++r, to += window.columns) {
        const double value = share * place.across[r];
        for (std::size_t c = 0; c < kOver; ++c) to[c] += value * place.along[c];
      }
    }
  }
}

void SurfaceCompliance::add_remainder(const double* remainder, std::size_t stride, bool upper, Workspace& workspace,
                                      double* block, std::size_t block_stride) const {
  const std::size_t cells = workspace.windows.size(), columns = x_.count();
  // Only rows of splines that are not zero at some cell are needed.
  std::size_t first = y_.count(), last = 0;
  for (const Window& window : workspace.windows) {
    first = std::min(first, window.row);
    last = std::max(last, window.row + window.rows);
  }
  // Begin at a whole vector, so that no vector lies in two cache lines.
  const std::size_t begin = first * columns / kWhole * kWhole, size = last * columns - begin;
  Matrix &through = workspace.through, &transposed = workspace.transposed;
  through.resize(cells, size);
  // The range of splines at which each row of the product is needed. For the upper triangle it is that of the splines
  // of this cell and of those before it.
  std::vector<std::size_t>& nonzero = workspace.nonzero;
  nonzero.clear();
  for (std::size_t i = 0, low = size, high = 0; i < cells; ++i) {
    const Window& window = workspace.windows[i];
    low = std::min(low, window.row * columns - begin);
    high = std::max(high, (window.row + window.rows) * columns - begin);
    nonzero.insert(nonzero.end(), {upper ? low : 0, upper ? high : size});
  }
  // Panel by panel, so that a panel of the remainder stays in the first-level cache for all cells.
  for (std::size_t from = 0; from < size; from += kPanel) {
    const std::size_t count = std::min(kPanel, size - from);
    for (std::size_t i = 0; i < cells; ++i) {
      if (nonzero[2 * i] >= from + count || nonzero[2 * i + 1] <= from) continue;
      const Window& window = workspace.windows[i];
      const double* lines = remainder + (window.row * columns + window.column) * stride + begin + from;
      kernels().add_window(lines, window.rows, columns * stride, window.columns, stride,
                           workspace.values.data() + window.first, count, true, through[i] + from);
    }
  }
  transposed.resize(size, cells);
  for (std::size_t from = 0; from < cells; from += kPanel) {
    // The range of the last cell in a panel contains those of the others.
    const std::size_t end = std::min(from + kPanel, cells);
    transpose_part(through, from, end, nonzero[2 * end - 2], nonzero[2 * end - 1], transposed);
  }
  const std::size_t row = transposed.stride();
  for (std::size_t from = 0; from < cells; from += kPanel) {
    const std::size_t end = std::min(from + kPanel, cells);
    for (std::size_t j = 0; j < (upper ? end : cells); ++j) {
      const Window& window = workspace.windows[j];
      const std::size_t start = upper ? std::max(from, j / kWhole * kWhole) : from;
      const double* lines = transposed.data() + (window.row * columns + window.column - begin) * row + start;
      kernels().add_window(lines, window.rows, columns * row, window.columns, row,
                           workspace.values.data() + window.first, end - start, false,
                           block + j * block_stride + start);
    }
  }
}

void SurfaceCompliance::normal(const SurfaceCells& cells, Workspace& workspace, Matrix& compliance) const {
  const std::size_t count = cells.count;
  const std::optional<Bend>& bend = cells.bend;
  prepare(cells, workspace);
  compliance.resize(count, count);
  const std::vector<double>& inverse_areas = workspace.inverse_areas;
  for (std::size_t i = 0; i < count; ++i) {
    const double own = factor_ * inverse_areas[i];
    const double* near = cells.inverse_distance + i * count;
    double* row = compliance[i];
    for (std::size_t j = i; j < count; ++j) row[j] = own * near[j] * inverse_areas[j];
    if (bend) bend->scale_to_surface_distances(i, i, count, row);
  }
  add_remainder(remainder_.data(), remainder_.stride(), true, workspace, compliance.data(), compliance.stride());
  for (std::size_t i = 0; bend && i < count; ++i) {
    for (std::size_t j = i; j < count; ++j) compliance[i][j] *= bend->stretches[i] * bend->stretches[j];
  }
  mirror_upper(compliance);
}

// The half space's factor over the areas of a cell and of every cell [1/(Pa m^4)]; multiplied by the integrals, it is a
// row of the compliance.
const double* SurfaceCompliance::per_areas(const SurfaceCells& cells, std::size_t cell, Workspace& workspace) const {
  std::vector<double>& row = workspace.coefficients;
  row.resize(cells.count);
  const double own = factor_ * workspace.inverse_areas[cell];
  for (std::size_t j = 0; j < cells.count; ++j) row[j] = own * workspace.inverse_areas[j];
  if (cells.bend) cells.bend->scale_to_surface_distances(cell, 0, cells.count, row.data());
  return row.data();
}

// The surface's response to a point force is that of Johnson 1985, eqs. 3.18 and 3.75 to 3.77, with z out of the pad.
void SurfaceCompliance::set_normal_rows(const ShearedCells& sheared, const Matrix& normal, Workspace& workspace,
                                        Matrix& compliance) const {
  const SurfaceCells& cells = sheared.cells;
  const std::size_t count = cells.count;
  prepare(cells, workspace);
  compliance.resize(3 * count, 3 * count);
  const double slope = (1.0 - 2.0 * poisson_) / (2.0 * (1.0 - poisson_));
  const double cosine = slope * sheared.placement.cosine, sine = slope * sheared.placement.sine;
  for (std::size_t i = 0; i < count; ++i) {
    const double* per_area = per_areas(cells, i, workspace);
    const double* along = sheared.integrals->along.data() + i * count;
    const double* across = sheared.integrals->across.data() + i * count;
    double* row = compliance[2 * count + i];
    // Component zx of a pair is xz of the reversed pair. The integrals change their sign with the order of the cells.
    for (std::size_t j = 0; j < count; ++j) row[j] = -per_area[j] * (cosine * along[j] - sine * across[j]);
    for (std::size_t j = 0; j < count; ++j) row[count + j] = -per_area[j] * (sine * along[j] + cosine * across[j]);
    std::copy(normal[i], normal[i] + count, row + 2 * count);
  }
  // Rows of the coefficients belong to columns of the result in add_remainder(). So block (a, b) is given the
  // coefficients (b, a).
  for (std::size_t b = 0; b < 2; ++b) {
    add_remainder(full_remainder_[b * splines()] + 2 * splines(), full_remainder_.stride(), false, workspace,
                  compliance[2 * count] + b * count, compliance.stride());
  }
  for (std::size_t i = 0; cells.bend && i < count; ++i) {
    double* row = compliance[2 * count + i];
    for (std::size_t j = 0; j < 2 * count; ++j) row[j] *= cells.bend->stretches[i];
  }
}

void SurfaceCompliance::set_tangential_rows(const ShearedCells& sheared, Workspace& workspace,
                                            Matrix& compliance) const {
  const SurfaceCells& cells = sheared.cells;
  const ShearIntegrals& integrals = *sheared.integrals;
  const std::size_t count = cells.count;
  const double share = poisson_ / (1.0 - poisson_), turn[2] = {sheared.placement.cosine, sheared.placement.sine};
  for (std::size_t i = 0; i < count; ++i) {
    const double* per_area = per_areas(cells, i, workspace);
    const std::size_t at = i * count;
    const double* from[4] = {cells.inverse_distance + at, integrals.xx.data() + at, integrals.xy.data() + at,
                             integrals.yy.data() + at};
    double *x = compliance[i], *y = compliance[count + i];
    double* const rows[3] = {x, x + count, y + count};
    kernels().tangential_row(from, per_area, turn, share, count, rows);
  }
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t b = a; b < 2; ++b) {
      add_remainder(full_remainder_[b * splines()] + a * splines(), full_remainder_.stride(), a == b, workspace,
                    compliance[a * count] + b * count, compliance.stride());
    }
  }
  transpose_part(compliance, 2 * count, 3 * count, 0, 2 * count, compliance);
  mirror_upper(compliance);
}

void FullCompliance::begin(const SurfaceCompliance& surface, const SurfaceCompliance::ShearedCells& sheared,
                           const Matrix* normal, SurfaceCompliance::Workspace& workspace) {
  surface_ = &surface, sheared_ = sheared, workspace_ = &workspace;
  if (normal == nullptr) surface.normal(sheared.cells, workspace, normal_);
  surface.set_normal_rows(sheared, normal == nullptr ? normal_ : *normal, workspace, matrix_);
}

Matrix& FullCompliance::given(std::size_t cells) {
  surface_ = nullptr;
  matrix_.resize(3 * cells, 3 * cells);
  return matrix_;
}

const Matrix& FullCompliance::whole() {
  if (surface_ != nullptr) surface_->set_tangential_rows(sheared_, *workspace_, matrix_);
  surface_ = nullptr;
  return matrix_;
}

void SurfaceCompliance::add_sinking(const SurfaceCells& cells, const SurfaceCells& pressed, const double* forces,
                                    Workspace& workspace, double* sunk) const {
  // The mean of 1/r between the middle of a square of side s and its points is 4 ln(1 + sqrt 2) / s.
  const double own = 4.0 * std::log(1.0 + std::sqrt(2.0));
  constexpr std::size_t kOver = QuadraticSplines::kOver;
  const std::size_t columns = x_.count();
  workspace.coefficients.assign(splines(), 0.0);
  workspace.smooth.assign(splines(), 0.0);
  const auto over_splines = [&](const double* at, auto&& visit) {
    double along[kOver], across[kOver];
    const std::size_t column = x_.at(at[0], along), row = y_.at(at[1], across);
    for (std::size_t r = 0; r < kOver; ++r) {
      for (std::size_t c = 0; c < kOver; ++c) visit((row + r) * columns + column + c, across[r] * along[c]);
    }
  };
  const auto along_plane = [&](std::size_t j) {
    return pressed.bend ? forces[j] * pressed.bend->stretches[j] : forces[j];
  };
  for (std::size_t j = 0; j < pressed.count; ++j) {
    const double force = along_plane(j);
    over_splines(pressed.points + 2 * j,
                 [&](std::size_t p, double value) { workspace.coefficients[p] += value * force; });
  }
  for (std::size_t p = 0; p < splines(); ++p) {
    workspace.smooth[p] = dot(remainder_[p], workspace.coefficients.data(), splines());
  }
  const std::optional<Bend>& bent = cells.bend;
  for (std::size_t i = 0; i < cells.count; ++i) {
    const double* at = cells.points + 2 * i;
    double sum = 0.0;
    for (std::size_t j = 0; j < pressed.count; ++j) {
      const double x = at[0] - pressed.points[2 * j], y = at[1] - pressed.points[2 * j + 1];
      const double z = bent ? bent->positions[3 * i + 2] - pressed.bend->positions[3 * j + 2] : 0.0;
      sum += along_plane(j) / std::sqrt(x * x + y * y + z * z + pressed.areas[j] / (own * own));
    }
    double sinks = factor_ * sum;
    over_splines(at, [&](std::size_t p, double value) { sinks += value * workspace.smooth[p]; });
    sunk[i] += bent ? sinks * bent->stretches[i] : sinks;
  }
}

}  // namespace mjtactile
