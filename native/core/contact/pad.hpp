// One pad's tables in the form the fast path reads them in. Immutable once made: shared by all threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "geometry/outer_surface.hpp"
#include "influence/stress_map.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

// How a layer's taxels average their sample points: sparse rows (taxels, quadrants * points).
struct AveragingRows {
  std::size_t points, taxels;
  const std::int32_t* starts;   // (taxels + 1)
  const std::int32_t* places;   // quadrant * points + point
  const double* weights;
};

// A stress matrix of one class and layer: whole, or left (columns, rank) times right (rank, rows); rows are
// (coordinate, point).
struct MatrixFactors {
  std::size_t rank;     // 0: whole
  const double* left;   // (columns, rank or rows) [Pa/N]
  const double* right;  // (rank, rows), null where whole
};

// Beyond these strains are no longer small: mean pressure [Pa] and indentation [m]. And the sheet's thickness [m].
struct LinearRange {
  double pressure, indentation, depth;
};

// Of a heat map on the surface, in the pad frame: where it lies, its axes as columns, and half its sides [m]; and the
// reading that colours it.
struct Tile {
  double position[3], rotation[9], half_size[2];
  std::size_t reading;
};

class Pad {
 public:
  // `corners`: where loads are spread onto the elements' corners; null where they act on all nodes.
  Pad(SurfaceGrid surface, Precision precision, const CornerSpread* corners);

  // What contacts need: when strains are small, at which reading [Pa] the taxels of each sensing layer saturate, and
  // how far the surface gives under cells.
  void set_range(const LinearRange& range, std::vector<double> saturation) {
    range_ = range;
    saturation_ = std::move(saturation);
  }
  // Of a curved pad.
  void set_outer(OuterSurface outer) { outer_ = std::move(outer); }
  void set_compliance(SurfaceCompliance compliance) { compliance_ = std::move(compliance); }

  void set_tiles(std::vector<Tile> tiles) { tiles_ = std::move(tiles); }

  // In this order: the mirrors, with the quadrants' signs (quadrants, classes), and every layer; then every class.
  void set_mirrors(bool x, bool y, const double* signs);
  void add_layer(const AveragingRows& rows);
  // `columns`: quarter's degree of freedom (component, y, x), of corners where loads act there, -> column or -1;
  // `signs`: (3 components, 2 axes). `mean`: matrices to the mean stress, wanted for whole tensors only, in place of
  // those to deviatoric stress.
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
  std::size_t layers() const { return points_.size(); }
  std::size_t taxels() const { return twofold() ? double_maps_.deviatoric.taxels : float_maps_.deviatoric.taxels; }
  std::size_t bytes() const;
  bool twofold() const { return precision_ == Precision::twofold; }
  Precision precision() const { return precision_; }
  // Whether whole stress tensors are at hand.
  bool has_mean() const { return has_mean_; }

  template <typename Value>
  const StressMap<Value>& deviatoric() const {
    return maps<Value>().deviatoric;
  }
  template <typename Value>
  const StressMap<Value>& mean() const {
    return maps<Value>().mean;
  }

 private:
  template <typename Value>
  struct Maps {
    StressMap<Value> deviatoric, mean;
  };
  template <typename Value>
  const Maps<Value>& maps() const {
    if constexpr (std::is_same<Value, double>::value) {
      return double_maps_;
    } else {
      return float_maps_;
    }
  }
  template <typename Value>
  void prepare(Maps<Value>& maps, const CornerSpread* corners) const;
  template <typename Value>
  void set_mirrors_of(StressMap<Value>& map, bool x, bool y, const double* signs);
  template <typename Value>
  void add_layer_to(StressMap<Value>& map, const AveragingRows& rows);
  template <typename Value>
  void set_class_of(StressMap<Value>& map, std::size_t c, std::size_t count, const std::int32_t* columns,
                    const double* signs, const MatrixFactors* layers);

  SurfaceGrid surface_;
  OuterSurface outer_;
  std::vector<Tile> tiles_;
  SurfaceCompliance compliance_;
  Precision precision_;
  LinearRange range_ = {};
  std::vector<double> saturation_;
  bool has_mean_ = false;
  std::vector<std::size_t> points_;  // of each layer
  Maps<float> float_maps_;
  Maps<double> double_maps_;
};

}  // namespace mjtactile
