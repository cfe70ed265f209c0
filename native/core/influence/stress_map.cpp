#include "influence/stress_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "linalg/dense.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

constexpr std::size_t kChunk = 128;    // columns passed to a kernel at once
constexpr double kTopByte = 127.0;     // largest entry of a scaled column in bytes
constexpr int kTopExponent = 15;       // exponent of a scaled column's largest entry; half precision ends below 2^16
// Forces below this fraction of the machine epsilon, relative to the largest force, are neglected.
constexpr double kNegligible = 1.0 / 16.0;

// The kernel for numbers of a type.
template <typename Value, typename Single, typename Double>
auto of_type(Single single, Double double_precision) {
  if constexpr (std::is_same_v<Value, float>) {
    return single;
  } else {
    return double_precision;
  }
}

// Norms of the stress on a sheet with one mirror or none, which has as many images of the quarter as classes; see
// Kernels::norms_float.
template <typename Value>
void norms_of_few(const Value* const* classes, std::size_t count, const Value* signs, std::size_t points,
                  Value* norms) {
  for (std::size_t image = 0; image < count; ++image, norms += points) {
    std::fill(norms, norms + points, Value(0));
    for (std::size_t k = 0; k < kDeviatoric; ++k) {
      const Value *first = classes[0] + k * points, *second = classes[count - 1] + k * points;
      const Value other = count > 1 ? signs[kClasses * image + 1] : Value(0);
      for (std::size_t i = 0; i < points; ++i) {
        const Value sum = first[i] + other * second[i];
        norms[i] += sum * sum;
      }
    }
    for (std::size_t i = 0; i < points; ++i) norms[i] = std::sqrt(norms[i]);
  }
}

}  // namespace

template <typename Value>
Columns<Value>::Columns(std::size_t count, std::size_t rows, Precision precision)
    : rows_(rows), stride_(padded(rows)) {
  const bool narrow = std::is_same_v<Value, float>;
  if (narrow && precision == Precision::byte) {
    bytes_.assign(count * stride_, 0);
    scales_.assign(count, Value(1));
  } else if (narrow && precision == Precision::half) {
    halves_.assign(count * stride_, 0);
    scales_.assign(count, Value(1));
  } else {
    values_.assign(count * stride_, Value(0));
  }
}

template <typename Value>
void Columns<Value>::set(std::size_t column, const double* values) {
  if (scales_.empty()) {
    std::transform(values, values + rows_, values_.begin() + static_cast<std::ptrdiff_t>(column * stride_),
                   [](double value) { return static_cast<Value>(value); });
    return;
  }
  double largest = 0.0;
  for (std::size_t r = 0; r < rows_; ++r) largest = std::max(largest, std::abs(values[r]));
  if (halves_.empty()) {
    set_byte(column, values, largest);
  } else {
    set_half(column, values, largest);
  }
}

template <typename Value>
void Columns<Value>::set_byte(std::size_t column, const double* values, double largest) {
  const float scale = static_cast<float>(largest / kTopByte);
  if (scale == 0.0f) return;
  scales_[column] = scale;
  Byte* to = bytes_.data() + column * stride_;
  for (std::size_t r = 0; r < rows_; ++r) {
    const double whole = std::nearbyint(values[r] / static_cast<double>(scale));
    to[r] = static_cast<Byte>(std::clamp(whole, -kTopByte, kTopByte));
  }
}

template <typename Value>
void Columns<Value>::set_half(std::size_t column, const double* values, double largest) {
  int exponent = 0;
  if (largest > 0.0) {
    std::frexp(largest, &exponent);
    exponent -= kTopExponent;
  }
  scales_[column] = static_cast<Value>(std::ldexp(1.0, exponent));
  Half* to = halves_.data() + column * stride_;
  for (std::size_t r = 0; r < rows_; ++r) to[r] = to_half(static_cast<float>(std::ldexp(values[r], -exponent)));
}

template <typename Value>
std::size_t Columns<Value>::bytes() const {
  return bytes_.size() * sizeof(Byte) + halves_.size() * sizeof(Half) +
         (values_.size() + scales_.size()) * sizeof(Value);
}

template <typename Value>
template <typename Stored>
void Columns<Value>::add_scaled(AddColumns<Stored> kernel, const AlignedVector<Stored>& stored,
                                const std::uint32_t* places, const Value* weights, std::size_t count,
                                Value* sums) const {
  const Stored* columns[kChunk];
  Value scaled[kChunk];
  for (std::size_t first = 0; first < count; first += kChunk) {
    const std::size_t taken = std::min(kChunk, count - first);
    for (std::size_t j = 0; j < taken; ++j) {
      columns[j] = stored.data() + places[first + j] * stride_;
      scaled[j] = scales_.empty() ? weights[first + j] : weights[first + j] * scales_[places[first + j]];
    }
    kernel(columns, scaled, taken, stride_, sums);
  }
}

template <typename Value>
void Columns<Value>::add(const std::uint32_t* places, const Value* weights, std::size_t count, Value* sums) const {
  if constexpr (std::is_same_v<Value, float>) {
    if (!bytes_.empty()) return add_scaled(kernels().add_byte, bytes_, places, weights, count, sums);
    if (!halves_.empty()) return add_scaled(kernels().add_half, halves_, places, weights, count, sums);
    add_scaled(kernels().add_float, values_, places, weights, count, sums);
  } else {
    add_scaled(kernels().add_double, values_, places, weights, count, sums);
  }
}

template <typename Value>
void StressMap<Value>::add_response(const double* forces, Workspace& workspace, Value* response) const {
  if (!spread.empty()) {
    spread.front().spread(forces, workspace.spread_row, workspace.corners);
    forces = workspace.corners.data();
  }
  const double scale = fold(forces, workspace);
  if (scale == 0.0) return;
  const Value back = static_cast<Value>(scale);
  for (std::size_t c = 0; c < class_count(); ++c) {
    const std::size_t kept = keep(c, scale, workspace);
    if (kept == 0) continue;
    for (std::size_t k = 0; k < layers.size(); ++k) {
      const std::vector<Columns<Value>>& factors = classes[c].factors[k];
      const Columns<Value>& first = factors.front();
      Value* to = response + layers[k].offset + c * layers[k].rows;
      workspace.sums.assign(first.stride(), Value(0));
      first.add(workspace.places.data(), workspace.weights.data(), kept, workspace.sums.data());
      for (Value& sum : workspace.sums) sum *= back;
      if (factors.size() == 1) {
        for (std::size_t r = 0; r < first.stride(); ++r) to[r] += workspace.sums[r];
        continue;
      }
      for (std::size_t i = workspace.every.size(); i < first.rows(); ++i) {
        workspace.every.push_back(static_cast<std::uint32_t>(i));
      }
      factors.back().add(workspace.every.data(), workspace.sums.data(), first.rows(), to);
    }
  }
}

template <typename Value>
std::size_t StressMap<Value>::row_stride() const {
  return padded(3 * part(nodes_x, 0) + 1);  // the kernel writes one number beyond the row
}

template <typename Value>
std::vector<std::size_t> StressMap<Value>::set_columns(Class& of_class, std::size_t count, const std::int32_t* columns,
                                                       const double* parities) const {
  const std::size_t quarter_x = part(nodes_x, 0), quarter_y = part(nodes_y, 1), stride = row_stride();
  of_class.columns.assign(quarter_y * stride, 0);
  of_class.allowed.assign(quarter_y * stride, 0.0);
  std::vector<std::size_t> order;
  order.reserve(count);
  for (std::size_t y = 0; y < quarter_y; ++y) {
    for (std::size_t i = 0; i < 3 * quarter_x; ++i) {
      const std::int32_t column = columns[(i % 3 * quarter_y + y) * quarter_x + i / 3];
      if (column < 0) continue;
      of_class.columns[y * stride + i] = static_cast<std::uint32_t>(order.size());
      of_class.allowed[y * stride + i] = 1.0;
      order.push_back(static_cast<std::size_t>(column));
    }
  }
  std::copy(parities, parities + 6, &of_class.signs[0][0]);
  return order;
}

// Decompose nodal forces into those of the classes on the quarter, only in rows with forces. Returns the largest.
template <typename Value>
double StressMap<Value>::fold(const double* forces, Workspace& workspace) const {
  const std::size_t quarter_x = part(nodes_x, 0), quarter_y = part(nodes_y, 1), stride = row_stride();
  const std::size_t width = 3 * nodes_x, quarter = quarter_y * stride, first = nodes_y - quarter_y;
  workspace.rows.clear();
  workspace.folded.resize(kClasses * quarter);
  std::fill(workspace.largest, workspace.largest + kClasses, 0.0);
  double about[kClasses][2][4] = {}, on_mirror[kClasses][2][4] = {};  // a node on the mirror y = 0 is its own image
  for (std::size_t c = 0; c < class_count(); ++c) {
    for (std::size_t component = 0; component < 3; ++component) {
      about[c][0][component] = on_mirror[c][0][component] = classes[c].signs[component][0];
      about[c][1][component] = classes[c].signs[component][1];
    }
  }
  for (std::size_t y = 0; y < quarter_y; ++y) {
    const bool below = mirrored[1] && y > 0;
    const double* upper = forces + (first + y) * width;
    const double* lower = below ? forces + (first - y) * width : upper;
    if (is_zero(upper, width) && is_zero(lower, width)) continue;
    workspace.rows.push_back(y);
    const double* allowed[kClasses];
    double* to[kClasses];
    for (std::size_t c = 0; c < class_count(); ++c) {
      allowed[c] = classes[c].allowed.data() + y * stride;
      to[c] = workspace.folded.data() + c * quarter + y * stride;
    }
    const auto& shares = below ? about : on_mirror;
    if (class_count() == kClasses) {
      kernels().fold_row(upper, lower, nodes_x / 2, shares, allowed, to, workspace.largest);
    } else {
      for (std::size_t c = 0; c < class_count(); ++c) {
        workspace.largest[c] = std::max(workspace.largest[c], fold_row(upper, lower, shares[c], allowed[c], to[c]));
      }
    }
    for (std::size_t c = 0; c < class_count(); ++c) std::fill(to[c] + 3 * quarter_x, to[c] + stride, 0.0);
  }
  return *std::max_element(workspace.largest, workspace.largest + kClasses);
}

// One row of one class on a sheet with one mirror or none. Returns the largest force.
template <typename Value>
double StressMap<Value>::fold_row(const double* upper, const double* lower, const double shares[2][4],
                                  const double* allowed, double* to) const {
  const std::size_t quarter_x = part(nodes_x, 0), first = nodes_x - quarter_x;
  double largest = 0.0;
  for (std::size_t i = 0; i < 3 * quarter_x; ++i) {
    const std::size_t x = i / 3, component = i % 3, right = 3 * (first + x) + component;
    double force = upper[right] + shares[1][component] * lower[right];
    if (mirrored[0] && x > 0) {
      const std::size_t left = 3 * (first - x) + component;
      force += shares[0][component] * (upper[left] + shares[1][component] * lower[left]);
    }
    to[i] = allowed[i] * force;
    largest = std::max(largest, std::abs(to[i]));
  }
  return largest;
}

// Columns and weights of the forces of class `c` that are not negligible; returns their number. Forces are divided by
// `scale`, so that none is larger than 1 and single precision neither overflows nor underflows.
template <typename Value>
std::size_t StressMap<Value>::keep(std::size_t c, double scale, Workspace& workspace) const {
  const double least = scale * kNegligible * static_cast<double>(std::numeric_limits<Value>::epsilon());
  if (workspace.largest[c] < least) return 0;
  const std::size_t stride = row_stride(), quarter = part(nodes_y, 1) * stride;
  workspace.places.resize(quarter + kAligned);
  workspace.weights.resize(quarter + kAligned);
  const double* forces = workspace.folded.data() + c * quarter;
  const auto select = of_type<Value>(kernels().select_float, kernels().select_double);
  std::size_t kept = 0;
  for (const std::size_t y : workspace.rows) {
    kept += select(forces + y * stride, classes[c].columns.data() + y * stride, stride, least, 1.0 / scale,
                   workspace.places.data() + kept, workspace.weights.data() + kept);
  }
  return kept;
}

template <typename Value>
void StressMap<Value>::readings(const Value* response, Workspace& workspace, double* readings) const {
  for (const Layer& layer : layers) {
    workspace.norms.resize(kClasses * layer.points);
    const Value* of_classes[kClasses];
    for (std::size_t c = 0; c < class_count(); ++c) {
      of_classes[c] = response + layer.offset + c * layer.rows;
    }
    if (class_count() == kClasses) {
      of_type<Value>(kernels().norms_float, kernels().norms_double)(of_classes, signs, layer.points,
                                                                    workspace.norms.data());
    } else {
      norms_of_few(of_classes, class_count(), signs, layer.points, workspace.norms.data());
    }
    const Value* norms = workspace.norms.data();
    const std::uint32_t* places = layer.places.data();
    const Value* weights = layer.weights.data();
    const std::size_t count = layer.taxels.size();
    if (layer.single) {
      for (std::size_t t = 0; t < count; ++t) readings[t] = static_cast<double>(weights[t] * norms[places[t]]);
    } else {
      for (std::size_t t = 0; t < count; ++t) {
        const Share& share = layer.taxels[t];
        Value sum = 0;
        for (std::uint32_t i = share.first; i < share.first + share.count; ++i) sum += weights[i] * norms[places[i]];
        readings[t] = static_cast<double>(sum);
      }
    }
    readings += count;
  }
}

template <typename Value>
void StressMap<Value>::means(const Value* response, const bool odd[][2], double* means) const {
  std::size_t taxel = 0;
  for (const Layer& layer : layers) {
    for (const Share& share : layer.taxels) {
      for (std::size_t k = 0; k < coordinates; ++k) {
        double sum = 0.0;
        for (std::uint32_t i = share.first; i < share.first + share.count; ++i) {
          const std::size_t image = layer.places[i] / layer.points, point = layer.places[i] % layer.points;
          // With both mirrors, images 1 and 3 are at negative x, and 2 and 3 at negative y.
          const bool west = mirrored[0] && image % 2 == 1;
          const bool south = mirrored[1] && image / (mirrored[0] ? 2 : 1) == 1;
          const bool flipped = (odd[k][0] && west) != (odd[k][1] && south);
          double value = 0.0;
          for (std::size_t c = 0; c < class_count(); ++c) {
            value += static_cast<double>(signs[kClasses * image + c]) *
                     static_cast<double>(response[layer.offset + c * layer.rows + k * layer.points + point]);
          }
          sum += static_cast<double>(layer.weights[i]) * (flipped ? -value : value);
        }
        means[k * taxels + taxel] = sum;
      }
      ++taxel;
    }
  }
}

template class Columns<float>;
template class Columns<double>;
template class StressMap<float>;
template class StressMap<double>;

}  // namespace mjtactile
