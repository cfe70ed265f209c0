// One pad's tables as the core uses them: influence matrices, compliance, outer surface. It owns copies of all data.
// Immutable once made, and shared by all threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "geometry/outer_surface.hpp"
#include "geometry/pose.hpp"
#include "influence/stress_map.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

// Weights of sample points in the taxels of one layer: a sparse matrix (taxels, images * points) by rows.
struct AveragingRows {
  std::size_t points, taxels;
  const std::int32_t* starts;   // (taxels + 1)
  const std::int32_t* places;   // image * points + point
  const double* weights;
};

// The stress matrix of one class and layer, stored whole or as a low-rank product left * right. Rows are
// (coordinate, point).
struct MatrixFactors {
  std::size_t rank;     // 0: whole
  const double* left;   // (columns, rank), or (columns, rows) if whole [Pa/N]
  const double* right;  // (rank, rows); null if whole
};

// Mean pressure [Pa] and indentation [m] up to which strains are small, and the sheet's thickness [m].
struct LinearRange {
  double pressure, indentation, depth;
};

// A tile of the heat map on the surface: pose of its middle in the pad frame, half lengths of its sides [m], and the
// number of the reading that colours it.
struct Tile {
  Pose pose;
  double half_size[2];
  std::size_t reading;
};

class Pad {
 public:
  // Matrices from nodal forces to deviatoric stress, whose norm readings are means of, and to mean stress.
  template <typename Value>
  struct Maps {
    StressMap<Value> deviatoric, mean;
  };

  // `precision`: the widest of the layers'. `corners`: how loads are replaced by forces on the elements' corners; null
  // if tables have columns of all nodes.
  Pad(SurfaceGrid surface, Precision precision, const CornerSpread* corners);

  // Data that contacts need: the range of small strains, and the reading [Pa] at which taxels of each sensing layer
  // saturate.
  void set_range(const LinearRange& range, std::vector<double> saturation) {
    range_ = range;
    saturation_ = std::move(saturation);
  }
  // The outer surface, for a curved pad.
  void set_outer(OuterSurface outer) { outer_ = std::move(outer); }
  void set_compliance(SurfaceCompliance compliance) { compliance_ = std::move(compliance); }

  void set_tiles(std::vector<Tile> tiles) { tiles_ = std::move(tiles); }

  // Set the matrices in this order: the mirrors, with the signs of each class in the images (images, classes);
  // every layer; every class.
  void set_mirrors(bool x, bool y, const double* signs);
  // `precision`: in which the layer's matrices are stored.
  void add_layer(const AveragingRows& rows, Precision precision);
  // `columns` (component, y, x): for each degree of freedom of the quarter, its column in the matrices, or -1. `signs`
  // (3 components, 2 axes): see StressMap::Class. `mean`: whether these are matrices to the mean stress, which are
  // needed for whole tensors only, instead of those to the deviatoric stress.
  void set_class(std::size_t c, std::size_t count, const std::int32_t* columns, const double* signs,
                 const MatrixFactors* layers, bool mean);

  const SurfaceGrid& surface() const { return surface_; }
  const OuterSurface& outer() const { return outer_; }
  const std::vector<Tile>& tiles() const { return tiles_; }
  const SurfaceCompliance& compliance() const { return compliance_; }
  SurfaceCompliance& compliance() { return compliance_; }
  const LinearRange& range() const { return range_; }
  const std::vector<double>& saturation() const { return saturation_; }
  double depth() const { return range_.depth; }
  std::size_t layers() const { return stored_.size(); }
  std::size_t taxels() const { return taxels_; }
  Precision precision() const { return precision_; }
  // Whether whole stress tensors can be computed.
  bool has_mean() const { return has_mean_; }

  // In double precision if that is the widest of the layers', else in single precision.
  const std::variant<Maps<float>, Maps<double>>& maps() const { return maps_; }

 private:
  template <typename Value>
  void set_class_of(StressMap<Value>& map, std::size_t c, std::size_t count, const std::int32_t* columns,
                    const double* signs, const MatrixFactors* layers);

  SurfaceGrid surface_;
  OuterSurface outer_;
  std::vector<Tile> tiles_;
  SurfaceCompliance compliance_;
  Precision precision_;
  std::vector<Precision> stored_;   // by layer
  LinearRange range_ = {};
  std::vector<double> saturation_;
  bool has_mean_ = false;
  std::size_t taxels_ = 0;
  std::variant<Maps<float>, Maps<double>> maps_;
};

}  // namespace mjtactile
