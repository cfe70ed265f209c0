#include "pad.hpp"

#include <algorithm>
#include <utility>

namespace mjtactile {
namespace {

constexpr std::size_t kAligned = 16;

std::size_t padded(std::size_t points) { return (points + kAligned - 1) / kAligned * kAligned; }

// Rows (coordinate, point) with room for padding after each coordinate's points.
void spread(const double* from, std::size_t coordinates, std::size_t points, std::size_t room, double* to) {
  for (std::size_t k = 0; k < coordinates; ++k) {
    std::copy(from + k * points, from + (k + 1) * points, to + k * room);
  }
}

}  // namespace

Pad::Pad(SurfaceGrid surface, SurfaceCompliance compliance, Precision precision, LinearRange range)
    : surface_(std::move(surface)), compliance_(std::move(compliance)), precision_(precision), range_(range) {
  prepare(float_maps_);
  prepare(double_maps_);
}

template <typename Value>
void Pad::prepare(Maps<Value>& maps) const {
  maps.mean.coordinates = 1;
  for (StressMap<Value>* map : {&maps.deviatoric, &maps.mean}) {
    map->nodes_x = surface_.nodes_x();
    map->nodes_y = surface_.nodes_y();
  }
}

void Pad::set_signs(const double* signs) {
  for (std::size_t i = 0; i < kClasses * kClasses; ++i) {
    float_maps_.deviatoric.signs[i] = float_maps_.mean.signs[i] = static_cast<float>(signs[i]);
    double_maps_.deviatoric.signs[i] = double_maps_.mean.signs[i] = signs[i];
  }
}

void Pad::add_layer(const AveragingRows& rows) {
  points_.push_back(rows.points);
  if (twofold()) {
    add_layer_to(double_maps_.deviatoric, rows);
    add_layer_to(double_maps_.mean, rows);
  } else {
    add_layer_to(float_maps_.deviatoric, rows);
    add_layer_to(float_maps_.mean, rows);
  }
}

void Pad::set_class(std::size_t c, std::size_t count, const std::int32_t* columns, const double* signs,
                    const MatrixFactors* layers, bool mean) {
  has_mean_ = has_mean_ || mean;
  if (twofold()) {
    set_class_of(mean ? double_maps_.mean : double_maps_.deviatoric, c, count, columns, signs, layers);
  } else {
    set_class_of(mean ? float_maps_.mean : float_maps_.deviatoric, c, count, columns, signs, layers);
  }
}

std::size_t Pad::bytes() const {
  return float_maps_.deviatoric.bytes() + float_maps_.mean.bytes() + double_maps_.deviatoric.bytes() +
         double_maps_.mean.bytes();
}

template <typename Value>
void Pad::add_layer_to(StressMap<Value>& map, const AveragingRows& rows) {
  typename StressMap<Value>::Layer layer;
  layer.points = padded(rows.points);
  layer.offset = map.response_size;
  for (std::size_t t = 0; t < rows.taxels; ++t) {
    const std::int32_t start = rows.starts[t], end = rows.starts[t + 1];
    layer.taxels.push_back({static_cast<std::uint32_t>(start), static_cast<std::uint32_t>(end - start)});
    for (std::int32_t i = start; i < end; ++i) {
      const std::size_t place = static_cast<std::size_t>(rows.places[i]);
      const std::size_t quadrant = place / rows.points, point = place % rows.points;
      layer.places.push_back(static_cast<std::uint32_t>(quadrant * layer.points + point));
      layer.weights.push_back(static_cast<Value>(rows.weights[i]));
    }
  }
  map.response_size += kClasses * map.coordinates * layer.points;
  map.taxels += rows.taxels;
  map.layers.push_back(std::move(layer));
}

template <typename Value>
void Pad::set_class_of(StressMap<Value>& map, std::size_t c, std::size_t count, const std::int32_t* columns,
                       const double* signs, const MatrixFactors* layers) {
  typename StressMap<Value>::Class& of_class = map.classes[c];
  const std::size_t quarter = 3 * (map.nodes_x / 2 + 1) * (map.nodes_y / 2 + 1);
  of_class.columns.assign(quarter, StressMap<Value>::kNone);
  for (std::size_t i = 0; i < quarter; ++i) {
    if (columns[i] >= 0) of_class.columns[i] = static_cast<std::uint32_t>(columns[i]);
  }
  std::copy(signs, signs + 6, &of_class.signs[0][0]);

  std::size_t rows = 0;
  std::vector<std::size_t> widths;
  of_class.offsets.clear();
  of_class.second.assign(map.layers.size(), {});
  for (std::size_t k = 0; k < map.layers.size(); ++k) {
    of_class.offsets.push_back(rows);
    widths.push_back(layers[k].rank > 0 ? layers[k].rank : map.coordinates * map.layers[k].points);
    rows += widths.back();
  }
  Columns<Value> first(count, rows, precision_);
  std::vector<double> column(rows, 0.0);
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t k = 0; k < map.layers.size(); ++k) {
      const std::size_t rank = layers[k].rank;
      double* to = column.data() + of_class.offsets[k];
      if (rank > 0) {
        std::copy(layers[k].left + j * rank, layers[k].left + (j + 1) * rank, to);
      } else {
        spread(layers[k].left + j * map.coordinates * points_[k], map.coordinates, points_[k], map.layers[k].points, to);
      }
    }
    first.set(j, column.data());
  }
  of_class.first.assign(1, std::move(first));
  for (std::size_t k = 0; k < map.layers.size(); ++k) {
    if (layers[k].rank == 0) continue;
    Columns<Value> second(layers[k].rank, map.coordinates * map.layers[k].points, precision_);
    std::vector<double> row(map.coordinates * map.layers[k].points, 0.0);
    for (std::size_t j = 0; j < layers[k].rank; ++j) {
      spread(layers[k].right + j * map.coordinates * points_[k], map.coordinates, points_[k], map.layers[k].points, row.data());
      second.set(j, row.data());
    }
    of_class.second[k].push_back(std::move(second));
  }
}

}  // namespace mjtactile
