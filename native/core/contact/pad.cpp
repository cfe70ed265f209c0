#include "contact/pad.hpp"

#include <numeric>
#include <utility>

#include "linalg/aligned.hpp"

namespace mjtactile {
namespace {

template <typename Value>
Columns<Value> filled(const double* matrix, const std::vector<std::size_t>& order, std::size_t rows,
                      Precision precision) {
  Columns<Value> columns(order.size(), rows, precision);
  for (std::size_t j = 0; j < order.size(); ++j) columns.set(j, matrix + order[j] * rows);
  return columns;
}

template <typename Value>
void set_mirrors_of(StressMap<Value>& map, bool x, bool y, const double* signs) {
  map.mirrored[0] = x, map.mirrored[1] = y;
  const std::size_t count = map.class_count();
  for (std::size_t image = 0; image < count; ++image) {
    for (std::size_t c = 0; c < count; ++c) {
      map.signs[kClasses * image + c] = static_cast<Value>(signs[count * image + c]);
    }
  }
}

template <typename Value>
void add_layer_to(StressMap<Value>& map, const AveragingRows& rows) {
  typename StressMap<Value>::Layer layer;
  layer.points = rows.points;
  layer.rows = padded(map.coordinates * rows.points);
  layer.offset = map.response_size;
  layer.single = true;
  for (std::size_t t = 0; t < rows.taxels; ++t) {
    const std::int32_t start = rows.starts[t], end = rows.starts[t + 1];
    layer.single = layer.single && static_cast<std::size_t>(start) == t && end == start + 1;
    layer.taxels.push_back({static_cast<std::uint32_t>(start), static_cast<std::uint32_t>(end - start)});
    for (std::int32_t i = start; i < end; ++i) {
      layer.places.push_back(static_cast<std::uint32_t>(rows.places[i]));
      layer.weights.push_back(static_cast<Value>(rows.weights[i]));
    }
  }
  map.response_size += map.class_count() * layer.rows;
  map.taxels += rows.taxels;
  map.layers.push_back(std::move(layer));
}

}  // namespace

Pad::Pad(SurfaceGrid surface, Precision precision, const CornerSpread* corners)
    : surface_(std::move(surface)), precision_(precision) {
  if (precision == Precision::double_precision) maps_.emplace<Maps<double>>();
  std::visit([&](auto& maps) {
    maps.mean.coordinates = 1;
    for (auto* map : {&maps.deviatoric, &maps.mean}) {
      map->nodes_x = corners == nullptr ? surface_.nodes_x() : corners->corners_x();
      map->nodes_y = corners == nullptr ? surface_.nodes_y() : corners->corners_y();
      if (corners != nullptr) map->spread.push_back(*corners);
    }
  }, maps_);
}

void Pad::set_mirrors(bool x, bool y, const double* signs) {
  std::visit([&](auto& maps) {
    set_mirrors_of(maps.deviatoric, x, y, signs);
    set_mirrors_of(maps.mean, x, y, signs);
  }, maps_);
}

void Pad::add_layer(const AveragingRows& rows, Precision precision) {
  stored_.push_back(precision);
  taxels_ += rows.taxels;
  std::visit([&](auto& maps) {
    add_layer_to(maps.deviatoric, rows);
    add_layer_to(maps.mean, rows);
  }, maps_);
}

void Pad::set_class(std::size_t c, std::size_t count, const std::int32_t* columns, const double* signs,
                    const MatrixFactors* layers, bool mean) {
  has_mean_ = has_mean_ || mean;
  std::visit([&](auto& maps) { set_class_of(mean ? maps.mean : maps.deviatoric, c, count, columns, signs, layers); },
             maps_);
}

template <typename Value>
void Pad::set_class_of(StressMap<Value>& map, std::size_t c, std::size_t count, const std::int32_t* columns,
                       const double* signs, const MatrixFactors* layers) {
  typename StressMap<Value>::Class& of_class = map.classes[c];
  const std::vector<std::size_t> order = map.set_columns(of_class, count, columns, signs);
  of_class.factors.clear();
  for (std::size_t k = 0; k < map.layers.size(); ++k) {
    // Columns of a left factor combine entries of very different size, so bytes are too coarse for it. It is small.
    const Precision left = stored_[k] == Precision::byte ? Precision::half : stored_[k];
    const std::size_t rank = layers[k].rank, rows = map.coordinates * map.layers[k].points;
    std::vector<Columns<Value>> factors;
    if (rank > 0) {
      std::vector<std::size_t> every(rank);
      std::iota(every.begin(), every.end(), std::size_t{0});
      factors.push_back(filled<Value>(layers[k].left, order, rank, left));
      factors.push_back(filled<Value>(layers[k].right, every, rows, stored_[k]));
    } else {
      factors.push_back(filled<Value>(layers[k].left, order, rows, stored_[k]));
    }
    of_class.factors.push_back(std::move(factors));
  }
}

}  // namespace mjtactile
