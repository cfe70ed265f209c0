// From nodal forces on the surface to stress at sample points, and to von Mises readings.
//
// Everything is kept by the sheet's symmetry classes (mjtactile/fem/symmetry.py), four with both mirrors: a load is folded
// into forces on a quarter of the surface, one set per class, and each class has its own matrix to the stress at points of
// a quarter. Along an axis without a mirror the quarter is as long as the whole.
// The response is linear in the load and adds up over loads; the readings, means of norms, come from it at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "influence/corner_spread.hpp"
#include "linalg/aligned.hpp"
#include "linalg/half.hpp"

namespace mjtactile {

constexpr std::size_t kClasses = 4;     // at most
constexpr std::size_t kDeviatoric = 5;  // coordinates of deviatoric stress; their norm is the von Mises stress
constexpr std::size_t kTensor = 6;      // components xx, yy, zz, xy, yz, zx of a stress tensor

enum class Precision { half, single, twofold, byte };

// A matrix stored column by column, each one run of memory; in half precision and in bytes every column has a scale.
template <typename Value>
class Columns {
 public:
  Columns(std::size_t count, std::size_t rows, Precision precision);

  std::size_t rows() const { return rows_; }
  std::size_t stride() const { return stride_; }
  std::size_t bytes() const;

  // Store one column, (rows).
  void set(std::size_t column, const double* values);
  // sums += sum_j weights[j] * column places[j]; sums has `stride` entries.
  void add(const std::uint32_t* places, const Value* weights, std::size_t count, Value* sums) const;

 private:
  void set_half(std::size_t column, const double* values, double largest);
  void set_byte(std::size_t column, const double* values, double largest);
  template <typename Stored>
  void add_scaled(const AlignedVector<Stored>& stored, const std::uint32_t* places, const Value* weights,
                  std::size_t count, Value* sums) const;

  std::size_t count_, rows_, stride_;
  AlignedVector<Byte> bytes_;
  AlignedVector<Half> halves_;
  AlignedVector<Value> values_;
  std::vector<Value> scales_;
};

// One taxel's share in the norms of its sample points.
struct Share {
  std::uint32_t first, count;  // entries from `first` on
};

// What every class and layer of one pad needs. `Value` is float, or double for tables in double precision.
template <typename Value>
class StressMap {
 public:
  struct Layer {
    std::size_t points = 0;               // folded sample points
    std::size_t rows = 0;                 // room for a class's coordinates * points, whole vectors
    std::size_t offset = 0;               // of its class 0 in the response; classes follow each other
    std::vector<Share> taxels;            // per taxel, in reading order
    bool single = false;                  // whether each of them has one entry, in their order
    std::vector<std::uint32_t> places;    // norm number quadrant * points + point
    std::vector<Value> weights;
  };
  struct Class {
    // Of the quarter's degrees of freedom (y, x, component), rows of `row_stride`: the column, and 1, or 0 where it has none.
    std::vector<std::uint32_t> columns;
    std::vector<double> allowed;
    std::vector<std::vector<Columns<Value>>> factors;  // per layer: forces to stress, or to coefficients and those on
    double signs[3][2];                   // of each force component under x -> -x and y -> -y
  };
  struct Workspace {
    std::vector<std::uint32_t> places;
    std::vector<std::size_t> rows;     // of the quarter, in which there are forces
    std::vector<double> folded;        // forces of each class, as its columns
    double largest[kClasses] = {};     // of each class [N]
    std::vector<double> spread_row, corners;
    std::vector<Value> weights;
    AlignedVector<Value> sums, norms;
    std::vector<std::uint32_t> every;  // 0, 1, 2, ...
  };

  std::size_t coordinates = kDeviatoric;  // or 1, for the mean stress
  // Of the surface, or its corners where loads are spread onto those.
  std::size_t nodes_x = 0, nodes_y = 0, response_size = 0, taxels = 0;
  std::vector<CornerSpread> spread;  // none or one
  Value signs[kClasses * kClasses] = {};  // (quadrants, classes); 0 of those that are none
  bool mirrored[2] = {true, true};        // whether the sheet is its own image under x -> -x, and under y -> -y
  std::vector<Layer> layers;
  Class classes[kClasses];

  // Take over so many columns (component, y, x of the quarter), negative for none, and signs of each component under x -> -x and
  // y -> -y; returns in which order the columns are wanted: those of nodes side by side after each other.
  std::vector<std::size_t> set_columns(Class& of_class, std::size_t count, const std::int32_t* columns,
                                       const double* parities) const;
  // response += that to nodal forces (surface nodes y, nodes x, 3) [N].
  void add_response(const double* forces, Workspace& workspace, Value* response) const;
  // Readings (taxels of all layers) [Pa] of a response of deviatoric stress.
  void readings(const Value* response, Workspace& workspace, double* readings) const;
  // Means over each taxel's sample points, (coordinates, taxels) [Pa]. `odd`: per coordinate, whether it changes its
  // sign under x -> -x and under y -> -y.
  void means(const Value* response, const bool odd[][2], double* means) const;
  std::size_t bytes() const;
  std::size_t class_count() const { return (mirrored[0] ? 2u : 1u) * (mirrored[1] ? 2u : 1u); }
  // Nodes of the part that stands for the whole, along an axis that has so many.
  std::size_t part(std::size_t nodes, int axis) const { return mirrored[axis] ? nodes / 2 + 1 : nodes; }

 private:
  std::size_t row_stride() const;
  double fold(const double* forces, Workspace& workspace) const;
  double fold_row(const double* upper, const double* lower, const double shares[2][4], const double* allowed,
                  double* to) const;
  std::size_t keep(std::size_t c, double scale, Workspace& workspace) const;
};

}  // namespace mjtactile
