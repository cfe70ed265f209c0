// From nodal forces on the surface to stress at sample points, and to von Mises readings.
//
// Everything is kept by the sheet's four symmetry classes (mjtactile/folding.py): a load is folded into forces on a
// quarter of the surface, one set per class, and each class has its own matrix to the stress at points of a quarter.
// The response is linear in the load and adds up over loads; the readings, means of norms, come from it at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "half.hpp"

namespace mjtactile {

constexpr std::size_t kClasses = 4;
constexpr std::size_t kDeviatoric = 5;  // coordinates of deviatoric stress; their norm is the von Mises stress
constexpr std::size_t kTensor = 6;      // components xx, yy, zz, xy, yz, zx of a stress tensor

enum class Precision { half, single, twofold };

// A matrix stored column by column, each one run of memory.
template <typename Value>
class Columns {
 public:
  Columns(std::size_t count, std::size_t rows, Precision precision);

  std::size_t rows() const { return rows_; }
  std::size_t stride() const { return stride_; }
  std::size_t bytes() const { return count_ * stride_ * (halves_.empty() ? sizeof(Value) : sizeof(Half)); }

  // Store one column, (rows).
  void set(std::size_t column, const double* values);
  // sums += sum_j weights[j] * column places[j]; sums has `stride` entries.
  void add(const std::uint32_t* places, const Value* weights, std::size_t count, Value* sums) const;

 private:
  std::size_t count_, rows_, stride_;
  std::vector<Half> halves_;
  std::vector<Value> values_, scales_;
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
    std::size_t points = 0;               // folded sample points, a multiple of 16: the last ones are zero
    std::size_t offset = 0;               // of its class 0 in the response; classes follow each other
    std::vector<Share> taxels;            // per taxel, in reading order
    std::vector<std::uint32_t> places;    // norm number quadrant * points + point
    std::vector<Value> weights;
  };
  struct Class {
    std::vector<std::uint32_t> columns;   // quarter's degree of freedom (component, y, x) -> column, or kNone
    std::vector<Columns<Value>> first;    // one: forces to (layers' stress or coefficients), side by side
    std::vector<std::size_t> offsets;     // of each layer in its rows
    std::vector<std::vector<Columns<Value>>> second;  // per layer none, or one: coefficients to stress
    double signs[3][2];                   // of each force component under x -> -x and y -> -y
  };
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Workspace {
    std::vector<std::uint32_t> places;
    std::vector<double> folded;
    std::vector<Value> weights, sums, norms;
    std::vector<std::uint32_t> every;  // 0, 1, 2, ...
  };

  std::size_t coordinates = kDeviatoric;  // or 1, for the mean stress
  std::size_t nodes_x = 0, nodes_y = 0, response_size = 0, taxels = 0;
  Value signs[kClasses * kClasses] = {};  // (quadrants, classes)
  std::vector<Layer> layers;
  Class classes[kClasses];

  // response += that to nodal forces (nodes y, nodes x, 3) [N].
  void add_response(const double* forces, Workspace& workspace, Value* response) const;
  // Readings (taxels of all layers) [Pa] of a response of deviatoric stress.
  void readings(const Value* response, Workspace& workspace, double* readings) const;
  // Means over each taxel's sample points, (coordinates, taxels) [Pa]. `odd`: per coordinate, whether it changes its
  // sign under x -> -x and under y -> -y.
  void means(const Value* response, const bool odd[][2], double* means) const;
  std::size_t bytes() const;

 private:
  double fold(const double* forces, std::size_t c, Workspace& workspace) const;
};

}  // namespace mjtactile
