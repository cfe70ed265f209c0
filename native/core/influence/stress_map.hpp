// From nodal forces on the surface to stress at sample points, and to von Mises readings.
//
// Tables use the sheet's mirror symmetry (mjtactile/fem/symmetry.py). With both mirrors there are four symmetry
// classes. A load is decomposed into one set of forces per class on a quarter of the surface, and each class has its
// own matrix to the stress at the sample points of that quarter. Along an axis without a mirror, the quarter is as long
// as the sheet.
// The stress of all classes is called the response. It is linear in the load, so responses of several loads are added
// up. Readings are means of norms and are computed from the sum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "influence/corner_spread.hpp"
#include "linalg/aligned.hpp"
#include "linalg/half.hpp"

namespace mjtactile {

constexpr std::size_t kClasses = 4;     // largest number of symmetry classes
constexpr std::size_t kDeviatoric = 5;  // coordinates of deviatoric stress; their norm is the von Mises stress
constexpr std::size_t kTensor = 6;      // components xx, yy, zz, xy, yz, zx of a stress tensor

// Storage of the matrices' numbers.
enum class Precision { half, single, double_precision, byte };

// A matrix stored column by column. Columns in half precision and in bytes have a scale each. It owns its memory.
// `Value`: type of the sums.
template <typename Value>
class Columns {
 public:
  Columns(std::size_t count, std::size_t rows, Precision precision);

  std::size_t rows() const { return rows_; }
  std::size_t stride() const { return stride_; }   // rows rounded up to whole vectors
  std::size_t bytes() const;                       // memory of the numbers

  // Store one column (rows).
  void set(std::size_t column, const double* values);
  // sums += sum over j < count of weights[j] * column places[j]; `sums` has stride() entries.
  void add(const std::uint32_t* places, const Value* weights, std::size_t count, Value* sums) const;

 private:
  void set_half(std::size_t column, const double* values, double largest);
  void set_byte(std::size_t column, const double* values, double largest);
  template <typename Stored>
  using AddColumns = void (*)(const Stored* const*, const Value*, std::size_t, std::size_t, Value*);
  template <typename Stored>
  void add_scaled(AddColumns<Stored> kernel, const AlignedVector<Stored>& stored, const std::uint32_t* places,
                  const Value* weights, std::size_t count, Value* sums) const;

  std::size_t rows_, stride_;
  AlignedVector<Byte> bytes_;
  AlignedVector<Half> halves_;
  AlignedVector<Value> values_;
  std::vector<Value> scales_;
};

// The entries of Layer::places and Layer::weights that belong to one taxel.
struct Share {
  std::uint32_t first, count;
};

// The matrices of one pad, by symmetry class and sensing layer. `Value` is float, or double for tables in double
// precision. It owns its memory and is immutable once filled by Pad; Workspace holds what a call changes.
template <typename Value>
class StressMap {
 public:
  struct Layer {
    std::size_t points = 0;               // sample points in the quarter
    std::size_t rows = 0;                 // coordinates * points, rounded up to whole vectors
    std::size_t offset = 0;               // start of class 0 in the response; the other classes follow
    std::vector<Share> taxels;            // in reading order
    bool single = false;                  // whether each taxel has exactly one sample point, in reading order
    std::vector<std::uint32_t> places;    // sample points of the taxels, as image * points + point
    std::vector<Value> weights;           // of these points in the taxel's mean
  };
  struct Class {
    // For each of the quarter's degrees of freedom (y, x, component), in rows of `row_stride`: its column in the
    // matrices; and 1 if it has a column, else 0.
    std::vector<std::uint32_t> columns;
    std::vector<double> allowed;
    // Per layer: the matrix from forces to stress, or the two factors of its low-rank form.
    std::vector<std::vector<Columns<Value>>> factors;
    double signs[3][2];                   // of each force component under x -> -x and y -> -y
  };
  struct Workspace {
    std::vector<std::uint32_t> places;
    std::vector<std::size_t> rows;     // rows of the quarter in which there are forces
    std::vector<double> folded;        // forces of each class on the quarter, ordered as Class::columns [N]
    double largest[kClasses] = {};     // largest force of each class [N]
    std::vector<double> spread_row, corners;
    std::vector<Value> weights;
    AlignedVector<Value> sums, norms;
    std::vector<std::uint32_t> every;  // 0, 1, 2, ...
  };

  std::size_t coordinates = kDeviatoric;  // or 1, for the mean stress
  // Nodes of the surface; corners of the elements if loads are spread onto these.
  std::size_t nodes_x = 0, nodes_y = 0;
  std::size_t response_size = 0, taxels = 0;   // of all layers
  std::vector<CornerSpread> spread;  // one if loads are spread onto corners, else none
  // Sign of a class's stress in a mirror image of the quarter (images, classes); 0 beyond class_count().
  Value signs[kClasses * kClasses] = {};
  bool mirrored[2] = {true, true};        // whether the sheet is its own image under x -> -x, and under y -> -y
  std::vector<Layer> layers;
  Class classes[kClasses];

  // Set the columns of a class. `columns` (component, y, x of the quarter): the table's column of a degree of freedom,
  // negative for none; `count` of them are not negative. `parities` (3, 2): sign of each force component under x -> -x
  // and y -> -y. Returns the table's columns in the order in which they must be stored: neighbouring nodes together.
  std::vector<std::size_t> set_columns(Class& of_class, std::size_t count, const std::int32_t* columns,
                                       const double* parities) const;
  // Add the response to nodal forces (surface nodes y, nodes x, 3) [N].
  void add_response(const double* forces, Workspace& workspace, Value* response) const;
  // Readings (taxels of all layers) [Pa] from the response of deviatoric stress.
  void readings(const Value* response, Workspace& workspace, double* readings) const;
  // Means of the stress over each taxel's sample points (coordinates, taxels) [Pa]. `odd`: for each coordinate, whether
  // it changes its sign under x -> -x and under y -> -y.
  void means(const Value* response, const bool odd[][2], double* means) const;
  std::size_t class_count() const { return (mirrored[0] ? 2u : 1u) * (mirrored[1] ? 2u : 1u); }
  // Number of nodes in the quarter along an axis (0: x, 1: y) with `nodes` nodes in all.
  std::size_t part(std::size_t nodes, int axis) const { return mirrored[axis] ? nodes / 2 + 1 : nodes; }

 private:
  std::size_t row_stride() const;
  double fold(const double* forces, Workspace& workspace) const;
  double fold_row(const double* upper, const double* lower, const double shares[2][4], const double* allowed,
                  double* to) const;
  std::size_t keep(std::size_t c, double scale, Workspace& workspace) const;
};

}  // namespace mjtactile
